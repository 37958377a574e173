"""From Blender's axes (z up) to tweenray's (y up): (x, y, z) becomes (x, z, -y)."""


def vector(v):
    """A point or direction."""
    return [float(v[0]), float(v[2]), -float(v[1])]


def matrix(m):
    """The three rows of a placement of what stays in Blender's axes."""
    rows = [m[0], m[2], [-x for x in m[1]]]
    return [[float(x) for x in row] for row in rows]
