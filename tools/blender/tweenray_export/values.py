"""What feeds a socket, as far as a tweenray material can say it: a constant, an image that a constant multiplies, or
vertex colours."""

import math

from .images import DATA, GREY
from .nodes import Place


class Value:
    """A colour or number: `constant` (three or one numbers), times `image`'s, or times vertex colours."""

    def __init__(self, constant, image=None, colours=None):
        self.constant, self.image, self.colours = constant, image, colours

    def is_constant(self):
        return self.image is None and self.colours is None

    def rgb(self):
        """The constant as three numbers."""
        c = self.constant
        return [float(x) for x in c[:3]] if hasattr(c, "__len__") else [float(c)] * 3

    def grey(self):
        """The constant as one number, by Rec. 709 as Blender has it."""
        c = self.constant
        return float(sum(a * b for a, b in zip(c, GREY))) if hasattr(c, "__len__") else float(c)

    def times(self, other):
        """The product with a constant value."""
        product = [a * b for a, b in zip(self.rgb(), other.rgb())]
        return Value(product, self.image, self.colours)


class Laid:
    """An image node: `image`, the channel that counts (r, g, b, a, or None for the colour), the table of how it lies, its UV
    map, and whether its colour counts times its alpha."""

    def __init__(self, image, channel, table, uv_map, times_alpha):
        self.image, self.channel, self.table, self.uv_map, self.times_alpha = image, channel, table, uv_map, times_alpha


class Reader:
    """Reads sockets of one material or world; notes what it cannot read under `name`."""

    def __init__(self, name, report):
        self.name, self.report = name, report

    def value(self, place, what):
        """The value of the socket at `place`; with a note of `what` and the socket's own value where nodes are unknown."""
        fed = place.fed()
        if fed is None:
            return Value(place.default())
        found = self.of_node(fed)
        # Scene files have vertex colours of colours alone.
        is_number = place.socket.type == "VALUE"
        if found is not None and not (is_number and found.colours is not None):
            return found
        self.report.add(self.name, f"{what} from the node {fed.node.name} ({fed.kind})", "the socket's own value")
        return Value(place.socket.default_value if not hasattr(place.socket.default_value, "__len__")
                     else list(place.socket.default_value))

    def of_node(self, fed):
        """The value of a node's output, or None where it is none of those below."""
        node, kind = fed.node, fed.kind
        if kind in ("RGB", "VALUE"):
            value = fed.output.default_value
            return Value(list(value) if hasattr(value, "__len__") else value)
        if kind == "TEX_IMAGE" and node.image is not None and fed.output.name == "Alpha" and node.image.alpha_mode == "NONE":
            return Value(1.0)
        if kind == "TEX_IMAGE" and node.image is not None:
            return Value([1.0] * 3, image=self.laid(fed, "a" if fed.output.name == "Alpha" else None))
        if kind == "VERTEX_COLOR" and fed.output.name == "Color":
            return Value([1.0] * 3, colours=node.layer_name)
        if kind == "ATTRIBUTE" and node.attribute_type == "GEOMETRY" and fed.output.name == "Color":
            return Value([1.0] * 3, colours=node.attribute_name)
        if kind in ("SEPARATE_COLOR", "SEPRGB"):
            return self.channel(fed)
        if kind == "MATH" and node.operation == "MULTIPLY" and not node.use_clamp:
            return self.product(fed.input(0), fed.input(1))
        if kind in ("MIX", "MIX_RGB"):
            return self.mix(fed)
        return None

    def channel(self, fed):
        """A channel of an image."""
        if getattr(fed.node, "mode", "RGB") != "RGB":
            return None
        source = fed.input(0).fed()
        letter = {"Red": "r", "Green": "g", "Blue": "b", "R": "r", "G": "g", "B": "b"}.get(fed.output.name)
        if source is None or source.kind != "TEX_IMAGE" or source.node.image is None or source.output.name == "Alpha":
            return None
        return Value(1.0, image=self.laid(source, letter))

    def product(self, one, two):
        """The product of two sockets, of which one at most is no constant."""
        a, b = (self.of_place(place) for place in (one, two))
        if a is None or b is None or not (a.is_constant() or b.is_constant()):
            return None
        return b.times(a) if a.is_constant() else a.times(b)

    def of_place(self, place):
        fed = place.fed()
        return Value(place.default()) if fed is None else self.of_node(fed)

    def mix(self, fed):
        """A mix node that multiplies wholly, or of constants."""
        node = fed.node
        is_old = fed.kind == "MIX_RGB"
        if not is_old and node.data_type != "RGBA":
            return None
        sockets = [s for s in node.inputs if s.enabled]
        places = [Place(s, fed.groups) for s in sockets[:3]]
        factor, a, b = (self.of_place(place) for place in places)
        if factor is None or not factor.is_constant():
            return None
        share = min(max(factor.grey(), 0.0), 1.0)
        if share == 0.0:
            return a
        if node.blend_type == "MULTIPLY" and share == 1.0:
            return self.product(places[1], places[2])
        if node.blend_type != "MIX":
            return None
        if share == 1.0:
            return b
        if a is None or b is None or not (a.is_constant() and b.is_constant()):
            return None
        return Value([(1.0 - share) * x + share * y for x, y in zip(a.rgb(), b.rgb())])

    def laid(self, fed, channel):
        """An image node with its mapping."""
        node = fed.node
        table = {}
        wrap = {"REPEAT": None, "EXTEND": "clamp", "MIRROR": "mirror"}.get(node.extension, "clip")
        if wrap == "clip":
            self.report.add(self.name, "an image that is clipped at its edges", "its edges go on")
            wrap = "clamp"
        if wrap:
            table["wrap"] = wrap
        if node.image.source == "TILED":
            self.report.add(self.name, f"the tiles of the image {node.image.name}", "its first tile everywhere")
        if node.projection != "FLAT":
            self.report.add(self.name, f"the projection {node.projection} of an image", "texture coordinates")
        if node.interpolation != "Linear":
            self.report.add(self.name, f"the interpolation {node.interpolation} of an image", "linear")
        if is_moved(node.texture_mapping):
            self.report.add(self.name, f"the texture mapping of {node.name} itself", "none")
        uv_map, steps = self.mapping(fed.input("Vector"))
        table |= steps
        # Cycles multiplies colours by alpha unless a node takes the alpha too.
        times_alpha = channel != "a" and not node.outputs["Alpha"].is_linked and has_alpha(node.image)
        return Laid(node.image, channel, table, uv_map, times_alpha)

    def mapping(self, place):
        """(name of the UV map or None, keys of the texture's table) of a texture's vector."""
        fed = place.fed()
        if fed is None:
            return None, {}
        node = fed.node
        if fed.kind == "UVMAP":
            return node.uv_map or None, {}
        if fed.kind == "TEX_COORD" and fed.output.name == "UV":
            return None, {}
        if fed.kind == "ATTRIBUTE" and node.attribute_type == "GEOMETRY":
            return node.attribute_name or None, {}
        if fed.kind == "MAPPING" and node.vector_type in ("POINT", "VECTOR") and fed.input("Vector").fed() is not None:
            uv_map, inner = self.mapping(fed.input("Vector"))
            values = {name: self.of_place(fed.input(name)) for name in ("Rotation", "Scale")}
            values["Location"] = Value([0.0] * 3)
            if node.vector_type == "POINT":
                values["Location"] = self.of_place(fed.input("Location"))
            if not inner and all(v is not None and v.is_constant() for v in values.values()):
                turn, scale, move = (list(values[name].constant) for name in ("Rotation", "Scale", "Location"))
                if turn[0] == turn[1] == 0.0 and scale[0] != 0.0 and scale[1] != 0.0:
                    return uv_map, self.steps(turn[2], scale, move)
        self.report.add(self.name, f"texture coordinates from {node.name} ({fed.kind})", "the UV map as it stands")
        return None, {}

    @staticmethod
    def steps(turn, scale, move):
        """The keys of a mapping that is not the identity."""
        keys = {}
        if scale[0] != 1.0 or scale[1] != 1.0:
            keys["scale"] = [scale[0], scale[1]]
        if turn != 0.0:
            keys["rotate"] = math.degrees(turn)
        if move[0] != 0.0 or move[1] != 0.0:
            keys["offset"] = [move[0], move[1]]
        return keys


def has_alpha(image):
    """Whether Cycles multiplies an image's colours by its alpha where no node takes that."""
    return image.alpha_mode in ("STRAIGHT", "PREMUL") and image.colorspace_settings.name not in DATA


def is_moved(mapping):
    """Whether an image node's own mapping, which older files have, moves the image."""
    axes = (mapping.mapping_x, mapping.mapping_y, mapping.mapping_z)
    numbers = (*mapping.translation, *mapping.rotation, *(s - 1.0 for s in mapping.scale))
    return any(numbers) or axes != ("X", "Y", "Z") or mapping.use_min or mapping.use_max
