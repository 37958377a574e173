"""Materials: Blender's shader nodes as `[material.NAME]` of a scene file."""

from . import shaders
from .nodes import Place, surface
from .values import Reader

# What a surface without a material is in Blender.
DEFAULT = "tweenray default"


class Materials:
    """The materials of an export, each made when it is first asked for."""

    def __init__(self, images, report):
        self.images, self.report = images, report
        self._made = {}

    def made(self, material):
        """What a material is in tweenray: a `shaders.Made`."""
        name = material.name_full if material else DEFAULT
        if name not in self._made:
            self._made[name] = self._make(material, name)
        return self._made[name]

    def uv_maps(self, material):
        """The names of the UV maps that its images use, in the order of their numbers; None is the active one."""
        return (self.made(material).uv_maps if material else None) or [None]

    def colour_attribute(self, material):
        """The name of its colour attribute, "" for the active one, None for none."""
        return self.made(material).colours if material else None

    def tables(self, used):
        """{name: table} of the materials that are used."""
        return {name: made.table for name, made in self._made.items() if name in used}

    def light_factors(self, tree, name):
        """The factors that a light's nodes put on the channels of its power; None where they are more than a constant emission."""
        out = tree.get_output_node("CYCLES")
        fed = out and Place(out.inputs["Surface"]).fed()
        if not fed or fed.kind != "EMISSION":
            return None
        reader = Reader(name, self.report)
        colour, power = (reader.of_place(fed.input(key)) for key in ("Color", "Strength"))
        if colour is None or power is None or not (colour.is_constant() and power.is_constant()):
            return None
        return [max(c * power.grey(), 0.0) for c in colour.rgb()]

    def _make(self, material, name):
        if material is None or material.node_tree is None:
            if material is None:
                return shaders.Made({"principled": {"base_colour": [0.8] * 3, "roughness": 0.5, "ior": 1.5}})
            return shaders.Made({"diffuse": list(material.diffuse_color)[:3]})
        places = surface(material.node_tree)
        if places is None:
            self.report.add(name, "no material output", "black")
            return shaders.Made({"diffuse": 0.0})
        shade, volume, displacement = places
        writer = shaders.Writer(name, self.images, self.report)
        made = writer.surface(shade)
        writer.volume(volume, made)
        if displacement.fed() is not None:
            self.report.add(name, "displacement", "the surface as it is modelled")
        return made
