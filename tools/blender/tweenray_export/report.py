"""What tweenray cannot express, gathered while a scene is exported.

Takes notes of an object, its property and what was done instead; gives each once, in the order in which they came.
"""


class Report:
    """Notes about what was left out or replaced."""

    def __init__(self):
        self._notes = {}

    def add(self, name, what, instead):
        """Notes that `what` of the object `name` is not exported, and what was done `instead`."""
        self._notes.setdefault((name, what, instead))

    def lines(self):
        """One line for each note."""
        return [f"{name}: {what}: {instead}" for name, what, instead in self._notes]

    def text(self):
        """The report file."""
        lines = self.lines()
        head = "What tweenray cannot express as Blender does, and what was exported instead:\n\n"
        return head + "\n".join(lines) + "\n" if lines else "Everything was exported as it is.\n"


def is_animated(block):
    """Whether values of a data-block change with time."""
    data = block and block.animation_data
    return bool(data and (data.action or data.drivers or data.nla_tracks))
