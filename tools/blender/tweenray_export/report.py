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
    """Whether values of a data-block, or of the node groups in it, change with time."""
    blocks = [block] if block else []
    for found in blocks:
        data = found.animation_data
        if data and (has_curves(data.action) or data.drivers or data.nla_tracks):
            return True
        groups = [getattr(node, "node_tree", None) for node in getattr(found, "nodes", ())]
        blocks.extend(group for group in groups if group and group not in blocks)
    return False


def has_curves(action):
    """Whether an action, or None, has any curve. Layers came with Blender 4.4; the list of all curves went with 5.0."""
    if action is None:
        return False
    strips = [strip for layer in getattr(action, "layers", ()) for strip in layer.strips]
    holders = [action, *(bag for strip in strips for bag in getattr(strip, "channelbags", ()))]
    return any(len(getattr(holder, "fcurves", ())) > 0 for holder in holders)
