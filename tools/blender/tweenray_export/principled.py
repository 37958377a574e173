"""The Principled BSDF."""

import math

from .shaders import Made, ior, share

# Inputs that tweenray has not, with the value at which they do nothing.
ABSENT = {
    "Subsurface Weight": ("subsurface scattering", "a diffuse surface"),
    "Anisotropic": ("anisotropy", "an isotropic reflection"),
    "Sheen Weight": ("sheen", "none"),
    "Diffuse Roughness": ("rough diffuse (Oren-Nayar)", "Lambert"),
    "Thin Film Thickness": ("a thin film", "none"),
}


def write(writer, fed):
    """The material of a Principled BSDF."""
    for name, (what, instead) in ABSENT.items():
        value = writer.read(fed, name)
        if not value.is_constant() or value.grey() != 0.0:
            writer.note(what, instead)
    if is_there(writer.read(fed, "Coat Weight")) and not is_white(writer.read(fed, "Coat Tint")):
        writer.note("coat tint", "white")
    alpha = writer.read(fed, "Alpha")
    if alpha.is_constant() and alpha.grey() <= 0.0:
        return Made({}, is_seen=False)
    made = body(writer, fed)
    writer.emit(made, fed, "Emission Color", "Emission Strength") if "glass" not in made.table else glows(writer, fed)
    if alpha.image is not None:
        writer.cut(made, alpha)
    elif alpha.grey() < 1.0:
        writer.note(f"alpha {alpha.grey():.3g}", "opaque")
    return made


def glows(writer, fed):
    """Notes emission of what is glass."""
    if writer.constant(fed, "Emission Strength").grey() > 0.0 and max(writer.constant(fed, "Emission Color").rgb()) > 0.0:
        writer.note("emission of glass", "none")


def body(writer, fed):
    """Glass, or all that reflects."""
    transmission = writer.read(fed, "Transmission Weight")
    index = writer.constant(fed, "IOR").grey()
    is_metal = is_there(writer.read(fed, "Metallic"))
    is_coated = is_there(writer.read(fed, "Coat Weight"))
    is_clear = transmission.image is None and transmission.grey() >= 1.0
    if is_clear and not is_metal and not is_coated:
        return glass(writer, fed, index)
    made, table = Made({}), {}
    made.table["principled"] = table
    writer.coloured(made, "base_colour", "base_texture", fed, "Base Color", table)
    writer.number(table, "metallic", fed, "Metallic")
    writer.number(table, "roughness", fed, "Roughness")
    table |= reflection(index, writer.constant(fed, "Specular IOR Level").grey())
    tinted(writer, made, fed, table)
    if is_coated:
        writer.number(table, "clearcoat", fed, "Coat Weight")
        writer.number(table, "clearcoat_roughness", fed, "Coat Roughness")
        coat_ior = writer.constant(fed, "Coat IOR").grey()
        if abs(coat_ior - 1.5) > 1e-3:
            writer.note(f"coat of index {coat_ior:.3g}", "1.5")
    if is_there(transmission) and part_glass(writer, fed, table):
        if is_coated and fed.input("Coat Normal").fed() is not None:
            writer.note("a normal of the coat on glass", "the surface's")
        return made
    writer.normal(made.table, "normal_map", fed)
    if is_coated and counts(table["clearcoat"]):
        writer.normal(table, "clearcoat_normal_map", fed, "Coat Normal")
    return made


def tinted(writer, made, fed, table):
    """The colour of the reflection of what is no metal. Cycles tints the edges of metal and the reflection of glass by it, too."""
    tint = writer.read(fed, "Specular Tint")
    if is_white(tint):
        return
    for name, what in (("Metallic", "metal"), ("Transmission Weight", "glass")):
        if is_there(writer.read(fed, name)):
            writer.note(f"specular tint of {what}", "white")
    if tint.colours is not None:
        table["specular_colour"] = share(writer.constant(fed, "Specular Tint").rgb())
    else:
        writer.coloured(made, "specular_colour", "specular_texture", fed, "Specular Tint", table)


def is_there(share):
    """Whether a share is above 0 anywhere."""
    return share.image is not None or share.grey() > 0.0


def counts(written):
    """Whether a share as it is written, a number or an image's table, is above 0: a file that is missing is written as 0."""
    return (written.get("factor", 1.0) if isinstance(written, dict) else written) > 0.0


def is_white(value):
    """Whether a colour is white everywhere."""
    return value.is_constant() and all(abs(c - 1.0) <= 1e-6 for c in value.rgb())


def part_glass(writer, fed, table):
    """The keys of what is glass in part; whether anything is. Of the base colour's image no root is taken."""
    writer.number(table, "transmission", fed, "Transmission Weight")
    if not counts(table["transmission"]):
        del table["transmission"]
        return False
    if "base_texture" not in table:
        table["tint"] = [math.sqrt(c) for c in share(writer.constant(fed, "Base Color").rgb())]
    if fed.input("Normal").fed() is not None:
        writer.note("a normal map on glass", "none")
    return True


def reflection(index, level):
    """`ior` and `specular` of an index of refraction and Blender's Specular IOR Level, which is a factor of twice
    itself on the reflectance at normal incidence."""
    root = (index - 1.0) / (index + 1.0)
    normal = root * root * 2.0 * max(level, 0.0)
    if normal <= 0.0:
        return {"specular": 0.0}
    root = math.sqrt(min(normal, 0.66))
    return {"ior": ior((1.0 + root) / (1.0 - root))}


def glass(writer, fed, index):
    """Clear glass. A surface lets the root of the base colour through, as in Cycles."""
    if not is_white(writer.read(fed, "Specular Tint")):
        writer.note("specular tint of glass", "white")
    roughness = writer.constant(fed, "Roughness").grey()
    if fed.input("Normal").fed() is not None:
        writer.note("a normal map on glass", "none")
    tint = [math.sqrt(c) for c in share(writer.constant(fed, "Base Color").rgb())]
    made = {"ior": ior(index), "tint": tint}
    if roughness > 0.0:
        made["roughness"] = min(roughness, 1.0)
    return Made({"glass": made})
