"""Surface shaders as keys of a material."""

import math

from .values import Reader, Value

SIMPLE = ("BSDF_DIFFUSE", "BSDF_GLOSSY", "BSDF_ANISOTROPIC", "EMISSION", "BSDF_TRANSPARENT")


class Made:
    """A material of tweenray: its `table`, the UV maps (in the order of their numbers; None is the active one) and the colour attribute that
    it reads, and whether it is seen at all."""

    def __init__(self, table, is_seen=True):
        self.table, self.is_seen = table, is_seen
        self.uv_maps, self.colours = [], None


class Writer:
    """Writes the shaders of one material."""

    def __init__(self, name, images, report):
        self.name, self.images, self.report = name, images, report
        self.reader = Reader(name, report)
        self._maps = []

    def surface(self, place):
        """The material of a surface shader."""
        made = self.shader(place.fed())
        made.uv_maps = self._maps
        return made

    def note(self, what, instead):
        self.report.add(self.name, what, instead)

    def shader(self, fed):
        if fed is None:
            return Made({"diffuse": 0.0})
        write = getattr(self, "_" + fed.kind.lower(), None)
        if write is None:
            self.note(f"the shader {fed.node.name} ({fed.kind})", "diffuse grey 0.8")
            return Made({"diffuse": 0.8})
        return write(fed)

    def volume(self, place, made):
        """An absorbing volume, of glass."""
        fed = place.fed()
        if fed is None:
            return
        glass = made.table.get("glass")
        if fed.kind == "VOLUME_ABSORPTION" and glass is not None:
            colour, density = self.constant(fed, "Color"), self.constant(fed, "Density")
            glass["absorption"] = [max(density.grey(), 0.0) * max(1.0 - c, 0.0) for c in colour.rgb()]
        else:
            self.note(f"the volume {fed.node.name} ({fed.kind})", "no volume")

    # ---- shaders ---------------------------------------------------------------------------------

    def _bsdf_diffuse(self, fed):
        if self.constant(fed, "Roughness").grey() > 0.0:
            self.note("rough diffuse (Oren-Nayar)", "Lambert")
        made = Made({})
        self.coloured(made, "diffuse", "texture", fed, "Color")
        self.normal(made.table, "normal_map", fed)
        return made

    def _bsdf_glossy(self, fed):
        if self.constant(fed, "Anisotropy").grey() != 0.0:
            self.note("anisotropy", "an isotropic reflection")
        colour, made = self.read(fed, "Color"), Made({})
        if colour.is_constant():
            made.table["mirror"] = share(colour.rgb())
            self.number(made.table, "roughness", fed, "Roughness")
        else:
            self.note("a coloured image of a glossy shader", "principled metal, which is white at grazing angles")
            made.table["principled"] = principled = {"metallic": 1.0}
            self.coloured(made, "base_colour", "base_texture", fed, "Color", principled)
            self.number(principled, "roughness", fed, "Roughness")
        self.normal(made.table, "normal_map", fed)
        return made

    _bsdf_anisotropic = _bsdf_glossy

    def _bsdf_glass(self, fed):
        roughness = self.constant(fed, "Roughness").grey()
        if fed.input("Normal").fed() is not None:
            self.note("a normal map on glass", "none")
        tint = self.constant(fed, "Color").rgb()
        glass = {"ior": ior(self.constant(fed, "IOR").grey()), "tint": share(tint)}
        if roughness > 0.0:
            glass["roughness"] = min(roughness, 1.0)
        return Made({"glass": glass})

    def _bsdf_refraction(self, fed):
        self.note("refraction without reflection", "glass")
        return self._bsdf_glass(fed)

    def _bsdf_transparent(self, fed):
        colour = self.constant(fed, "Color").rgb()
        if min(colour) >= 1.0:
            return Made({}, is_seen=False)
        self.note("a coloured transparent shader", "thin glass, which also reflects")
        return Made({"glass": {"thin": True, "ior": 1.0, "tint": [c ** 0.5 for c in share(colour)]}})

    def _emission(self, fed):
        made = Made({})
        self.emit(made, fed, "Color", "Strength")
        return made

    def _add_shader(self, fed):
        one, two = (self.shader(fed.input(i).fed()) for i in (0, 1))
        return self.sum(one, two, 1.0, 1.0) or self.larger(one, two, 0.5, "an Add Shader")

    def _mix_shader(self, fed):
        factor = self.reader.of_place(fed.input(0))
        parts = [fed.input(i).fed() for i in (1, 2)]
        if factor is not None and factor.is_constant():
            f = min(max(factor.grey(), 0.0), 1.0)
            if f in (0.0, 1.0):
                return self.shader(parts[int(f)])
            one, two = (self.shader(part) for part in parts)
            return self.sum(one, two, 1.0 - f, f) or self.larger(one, two, f, f"a Mix Shader of {f:.3g}")
        kinds = [part.kind if part else None for part in parts]
        if kinds[0] == "BSDF_TRANSPARENT" and factor is not None and factor.image:
            made = self.shader(parts[1])
            self.cut(made, factor)
            return made
        if kinds == ["BSDF_DIFFUSE", "BSDF_GLOSSY"] or kinds == ["BSDF_DIFFUSE", "BSDF_ANISOTROPIC"]:
            return self.varnish(fed.input(0).fed(), parts)
        one, two = (self.shader(part) for part in parts)
        return self.larger(one, two, 0.5, "a Mix Shader whose factor is no constant")

    def varnish(self, factor, parts):
        """Diffuse under a glossy layer by Fresnel's share."""
        made, principled = Made({}), {}
        made.table["principled"] = principled
        self.coloured(made, "base_colour", "base_texture", parts[0], "Color", principled)
        self.number(principled, "roughness", parts[1], "Roughness")
        if factor.kind == "FRESNEL":
            principled["ior"] = ior(self.constant(factor, "IOR").grey())
        self.note("diffuse and glossy mixed by angle", "a principled material")
        self.normal(made.table, "normal_map", parts[0])
        return made

    def sum(self, one, two, a, b):
        """The exact sum of diffuse surface, mirror and emission, or None where there is none."""
        keys = {"diffuse", "texture", "mirror", "roughness", "emission", "emission_texture", "emits_back", "normal_map", "vertex_colours"}
        if not (one.is_seen and two.is_seen) or set(one.table) - keys or set(two.table) - keys:
            return None
        textured = [{"texture", "vertex_colours"} & set(m.table) for m in (one, two)]
        both_diffuse = all("diffuse" in m.table for m in (one, two)) and any(textured)
        both_mirror = all("mirror" in m.table for m in (one, two))
        maps = [m.table.get("normal_map") for m in (one, two) if {"diffuse", "mirror"} & set(m.table)]
        both_emit = all("emission" in m.table for m in (one, two)) and any("emission_texture" in m.table for m in (one, two))
        if both_diffuse or both_emit or len({repr(m) for m in maps}) > 1:
            return None
        if both_mirror and one.table.get("roughness") != two.table.get("roughness"):
            return None
        table = dict(one.table) | dict(two.table)
        for key in ("diffuse", "mirror", "emission"):
            if key in table:
                parts = [(three(m.table.get(key, 0.0)), f) for m, f in ((one, a), (two, b))]
                table[key] = [sum(c[i] * f for c, f in parts) for i in range(3)]
        sums = [d + m for d, m in zip(three(table.get("diffuse", 0.0)), three(table.get("mirror", 0.0)))]
        if max(sums) > 1.0 + 1e-9:
            return None
        made = Made(table)
        made.colours = one.colours if one.colours is not None else two.colours
        return made

    def larger(self, one, two, f, what):
        """The larger part of a mixture that tweenray has not."""
        self.note(what, f"its {'second' if f > 0.5 else 'first'} shader alone")
        return two if f > 0.5 else one

    def _bsdf_principled(self, fed):
        from .principled import write

        return write(self, fed)

    # ---- parts -----------------------------------------------------------------------------------

    def read(self, fed, name):
        """The value of an input."""
        place = fed.input(name)
        return Value(0.0) if place is None else self.reader.value(place, name)

    def constant(self, fed, name):
        """The value of an input that must be constant; an image's mean where it is not."""
        value = self.read(fed, name)
        if value.image is not None:
            self.note(f"an image of {name}", "its mean")
            mean = self.images.mean(value.image.image, value.image.channel, value.image.times_alpha)
            return Value(mean).times(value)
        if value.colours is not None:
            self.note(f"vertex colours of {name}", "white")
        return Value(value.constant)

    def coloured(self, made, key, image_key, fed, name, table=None):
        """A colour that an image or vertex colours may multiply."""
        table = made.table if table is None else table
        value = self.read(fed, name)
        if value.image is not None and value.image.channel is None:
            image, times_alpha = value.image.image, value.image.times_alpha
            if max(value.rgb()) > 1.0 + 1e-6:
                file, value = self.images.product(image, value.rgb(), times_alpha), Value(1.0, value.image)
            else:
                file = self.images.colour(image, times_alpha)
            if file is not None:
                table[image_key] = self.laid(value.image, file)
        elif value.image is not None:
            self.note(f"one channel of an image as {name}", "its mean")
            value = self.constant(fed, name)
        if value.colours is not None:
            made.table["vertex_colours"], made.colours = True, value.colours
            if max(value.rgb()) > 1.0 + 1e-6:
                self.note(f"a factor above 1 of vertex colours of {name}", "1")
        table[key] = share(value.rgb())

    def number(self, table, key, fed, name):
        """A share that may be an image."""
        value = self.read(fed, name)
        if value.image is None:
            table[key] = min(max(value.grey(), 0.0), 1.0)
            return
        image, channel, factor = value.image.image, value.image.channel, value.grey()
        is_coloured = channel is None and not self.images.is_grey(image)
        times_alpha = value.image.times_alpha and self.images.is_transparent(image)
        if is_coloured or times_alpha or factor > 1.0 + 1e-6:
            file, channel, factor = self.images.grey(image, channel, value.rgb(), times_alpha), "g", 1.0
        else:
            file = self.images.data(image)
        if file is None:
            table[key] = 0.0
            return
        table[key] = self.laid(value.image, file, True) | {"channel": channel or "g"}
        if not math.isclose(factor, 1.0, rel_tol=1e-6):
            table[key]["factor"] = min(max(factor, 0.0), 1.0)

    def laid(self, laid, file, as_table=False):
        """The file, or its table where it lies in another way than plainly."""
        if laid.uv_map not in self._maps:
            self._maps.append(laid.uv_map)
        number = self._maps.index(laid.uv_map)
        table = laid.table | ({"uv_set": number} if number else {})
        return {"file": file} | table if table or as_table else file

    def normal(self, table, key, fed, name="Normal"):
        """A normal map, as `key` of the table."""
        place = fed.input(name)
        node = place.fed() if place is not None else None
        if node is None:
            return
        colour = self.reader.of_place(node.input("Color")) if node.kind == "NORMAL_MAP" else None
        if colour is None or colour.image is None or node.node.space != "TANGENT":
            self.note(f"normals from {node.node.name} ({node.kind})", "the surface's own")
            return
        turn = turned_back(colour.image.table)
        file = self.images.data(colour.image.image) if turn is None else self.images.normals(colour.image.image, turn)
        if file is None:
            return
        if turn is not None and 1e-6 < abs(turn[0][0]) < 1.0 - 1e-6:
            self.note("a normal map that is turned by other than right angles", "right where its UV map keeps angles")
        if colour.image.table.get("wrap") == "mirror":
            self.note("a normal map that is mirrored at its edges", "its normals are mirrored, too")
        laid = self.laid(colour.image, file, True)
        strength = self.constant(node, "Strength").grey()
        if strength != 1.0:
            laid["strength"] = max(strength, 0.0)
        table[key] = laid

    def emit(self, made, fed, colour, strength):
        """Emission, of both sides as in Blender."""
        factor = self.constant(fed, strength).grey()
        if factor == 0.0:
            return
        value = self.read(fed, colour)
        file = None
        if value.image is not None and value.image.channel is None and value.colours is None:
            file = self.images.colour(value.image.image, value.image.times_alpha)
        if file is None:
            value = self.constant(fed, colour)
        rgb = [max(c * factor, 0.0) for c in value.rgb()]
        if max(rgb) > 0.0:
            made.table |= {"emission": rgb, "emits_back": True}
            if file is not None:
                made.table["emission_texture"] = self.laid(value.image, file)

    def cut(self, made, value):
        """Cut-outs by an image's alpha, one of its channels, or its grey."""
        if "glass" in made.table:
            self.note("alpha on glass", "none")
            return
        if value.grey() < 0.5:
            self.note("alpha that is less than a half everywhere", "nothing")
            made.is_seen = False
            return
        image, channel = value.image.image, value.image.channel
        if channel == "a" and math.isclose(value.grey(), 1.0, rel_tol=1e-6):
            # Scene files cut by the colours of an image that is opaque all over.
            if self.images.is_opaque(image):
                return
            file = self.images.alpha(image)
        else:
            file = self.images.grey(image, channel, value.rgb(), value.image.times_alpha)
        if file is not None:
            self.note("partial transparency", "cut-outs: a surface is there where alpha is a half or more")
            made.table["alpha"] = self.laid(value.image, file)


def share(rgb):
    """Reflectances between 0 and 1."""
    return [min(max(float(c), 0.0), 1.0) for c in rgb]


def turned_back(laid):
    """The matrix that turns the parts of normals along u and v into the axes of an image that lies as `laid` says; None where it is the
    identity. Normals follow an image in tweenray, in Blender its UV map."""
    turn, (wide, high) = math.radians(laid.get("rotate", 0.0)), laid.get("scale", (1.0, 1.0))
    along = math.atan2(-math.sin(turn) / high, math.cos(turn) / wide)
    c, s, side = math.cos(along), math.sin(along), math.copysign(1.0, wide * high)
    matrix = [[round(x, 9) + 0.0 for x in row] for row in ((c, s), (-side * s, side * c))]
    return None if matrix == [[1.0, 0.0], [0.0, 1.0]] else matrix


def three(x):
    """Three numbers of one or three."""
    return list(x) if hasattr(x, "__len__") else [x] * 3


def ior(x):
    """An index of refraction that tweenray takes."""
    return min(max(float(x), 0.1), 10.0)
