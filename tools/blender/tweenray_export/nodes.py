"""Walking shader nodes: what feeds a socket, through reroutes, groups and muted nodes."""

# Deeper nests of groups and chains of nodes are given up.
MOST_STEPS = 1000


class Fed:
    """A node's output that feeds a socket, with the groups around it, outermost first."""

    def __init__(self, node, output, groups):
        self.node, self.output, self.groups = node, output, groups

    def input(self, name):
        """The node's input of that name or number, as a place to go on from."""
        inputs = self.node.inputs
        socket = inputs[name] if isinstance(name, int) else inputs.get(name)
        return None if socket is None else Place(socket, self.groups)

    @property
    def kind(self):
        """The node's type."""
        return self.node.type


class Place:
    """An input socket, with the groups around it."""

    def __init__(self, socket, groups=()):
        self.socket, self.groups = socket, tuple(groups)

    def default(self):
        """Its value where nothing feeds it: a number, a list, or None."""
        socket = self.inner() or self.socket
        value = getattr(socket, "default_value", None)
        return list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value

    def inner(self):
        """The outer socket whose value reaches this one through groups' inputs; None where a node feeds it."""
        socket, groups = self._walk()
        return None if socket.is_output else socket

    def fed(self):
        """What feeds it; None where nothing does."""
        socket, groups = self._walk()
        return Fed(socket.node, socket, groups) if socket.is_output else None

    def _walk(self):
        socket, groups = self.socket, self.groups
        for _ in range(MOST_STEPS):
            if not socket.is_output:
                link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
                if link is None:
                    return socket, groups
                socket = link.from_socket
            node = socket.node
            if node.type == "REROUTE":
                socket = node.inputs[0]
            elif node.mute:
                internal = next((link for link in node.internal_links if link.to_socket == socket), None)
                if internal is None:
                    return socket, groups
                socket = internal.from_socket
            elif node.type == "GROUP" and node.node_tree is not None:
                inside = output_of_group(node.node_tree)
                found = inside and same(inside.inputs, socket)
                if not found:
                    return socket, groups
                socket, groups = found, groups + (node,)
            elif node.type == "GROUP_INPUT" and groups:
                found = same(groups[-1].inputs, socket)
                if not found:
                    return socket, groups
                socket, groups = found, groups[:-1]
            else:
                return socket, groups
        return socket, groups


def same(sockets, socket):
    """The socket of a group's other side; names may stand twice."""
    return next((other for other in sockets if other.identifier == socket.identifier), None)


def output_of_group(tree):
    """The active output node of a group."""
    found = [node for node in tree.nodes if node.type == "GROUP_OUTPUT"]
    return next((node for node in found if node.is_active_output), found[0] if found else None)


def surface(tree):
    """The place of the surface shader, and of the volume; None where the tree has no output."""
    out = tree.get_output_node("CYCLES")
    return None if out is None else (Place(out.inputs["Surface"]), Place(out.inputs["Volume"]), Place(out.inputs["Displacement"]))
