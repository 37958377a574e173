"""Balls of many materials, each alone in its picture, so that no light goes from one to another."""

import os

import mitsuba as mi
import numpy as np

import formulas  # registers the BSDF "layers"

EDGE = 96
EYE, TARGET, FOV = [0.0, 0.6, 5.0], [0.0, 0.0, 0.0], 28
LAMP = ([-1.6, 2.4, 2.2], [0.55, -0.7, -0.62], 1.0, 14.0)  # centre, normal, edge, radiance


def rgb(value):
    return {"type": "rgb", "value": list(value) if isinstance(value, (list, tuple)) else [value] * 3}


def principled(colour, **keys):
    return {"type": "principled", "base_color": rgb(colour), **keys}


def layers(base, **keys):
    """tweenray's own formula."""
    return {"type": "layers", **{f"base_{c}": x for c, x in zip("rgb", base)}, **keys}


def metal(roughness):
    gold = [1.0, 0.77, 0.34]
    text = f"principled = {{ base_colour = {gold}, metallic = 1, roughness = {roughness} }}"
    formula = layers(gold, metallic=1.0, roughness=roughness)
    if roughness == 0.0:
        return text, {"type": "conductor", "material": "none", "specular_reflectance": rgb(gold)}, formula
    return text, principled(gold, metallic=1.0, roughness=roughness), formula


def plastic(roughness, **more):
    red = [0.6, 0.06, 0.05]
    keys = "".join(f", {key} = {value}" for key, value in more.items())
    text = f"principled = {{ base_colour = {red}, roughness = {roughness}{keys} }}"
    own = principled(red, metallic=0.0, roughness=max(roughness, 0.001), eta=1.5, **more)
    return text, own, layers(red, roughness=roughness, **more)


def glass(kind, tint=1.0, words="", **keys):
    text = f"glass = {{ ior = 1.5, tint = {tint}{words} }}"
    return text, {"type": kind, "int_ior": 1.5, "ext_ior": 1.0, "specular_transmittance": rgb(tint), **keys}


def image(name, raw=False):
    return {"type": "bitmap", "filename": name, "raw": raw}


def twosided(bsdf):
    return {"type": "twosided", "bsdf": bsdf}


def decoded(codes):
    """Linear light of sRGB codes."""
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


# Name, lines of the material, Mitsuba's BSDF, tweenray's formula where that is another one, and whether the ball is a mesh with coordinates.
def materials(folder):
    def file(name):
        return os.path.join(folder, name)

    matte = {"type": "diffuse", "reflectance": rgb(0.7)}
    textured = {"type": "diffuse", "reflectance": image(file("paint.png"))}
    tilted = {"type": "normalmap", "normalmap": image(file("normals.png"), True), "bsdf": matte}
    holes = {"type": "mask", "opacity": image(file("holes.png"), True), "bsdf": twosided(matte)}
    coloured = {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}
    return [
        *((f"metal {r}", *metal(r), False) for r in (0.0, 0.2, 0.5, 0.9)),
        *((f"plastic {r}", *plastic(r), False) for r in (0.0, 0.2, 0.5, 0.9)),
        ("glass, clear", *glass("dielectric"), None, False),
        ("glass, rough", *glass("roughdielectric", words=", roughness = 0.4", alpha=0.16, distribution="ggx"), {"type": "given_back", "alpha": 0.16}, False),
        ("glass, thin", *glass("thindielectric", words=", thin = true"), None, False),
        ("glass, tinted", *glass("dielectric", [0.5, 0.85, 0.6]), None, False),
        ("clear coat", *plastic(0.5, clearcoat=1.0), False),
        ("textured", 'diffuse = 1\ntexture = "paint.png"', textured, None, True),
        ("normal map", 'diffuse = 0.7\nnormal_map = "normals.png"', tilted, None, True),
        ("cut-outs", 'diffuse = 0.7\nalpha = "holes.png"', holes, None, True),
        ("vertex colours", "diffuse = 1\nvertex_colours = true", coloured, None, True),
    ]


def ball_mesh(meridians=128, bands=64):
    """Positions (also unit normals), texture coordinates, colours and triangles."""
    u, v = np.meshgrid(np.linspace(0, 1, meridians + 1), np.linspace(0, 1, bands + 1))
    phi, theta = 2 * np.pi * u, np.pi * v
    p = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1).reshape(-1, 3)
    uv = np.stack([u, 1 - v], -1).reshape(-1, 2)
    colours = np.round(255 * (0.5 + 0.5 * p)) / 255
    at = lambda i, j: j * (meridians + 1) + i
    quads = [(at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)) for j in range(bands) for i in range(meridians)]
    triangles = []
    for j in range(bands):
        for a, b, c, d in quads[j * meridians : (j + 1) * meridians]:
            triangles += [(a, b, c)] if j < bands - 1 else []
            triangles += [(a, c, d)] if j > 0 else []
            triangles += [(a, b, d)] if j == bands - 1 else []
    return p, uv, colours, np.array(triangles)


def write_ply(path, with_colours):
    p, uv, colours, triangles = ball_mesh()
    names = ["x", "y", "z", "nx", "ny", "nz", "u", "v"]
    with open(path, "wb") as out:
        header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(p)}"]
        header += [f"property float {name}" for name in names]
        header += [f"property uchar {c}" for c in ("red", "green", "blue") if with_colours]
        header += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header"]
        out.write(("\n".join(header) + "\n").encode())
        rows = np.zeros(len(p), [("f", "<f4", 8), ("c", "u1", 3 if with_colours else 0)])
        rows["f"] = np.hstack([p, p, uv])
        if with_colours:
            rows["c"] = np.round(255 * colours)
        out.write(rows.tobytes())
        faces = np.zeros(len(triangles), [("n", "u1"), ("v", "<i4", 3)])
        faces["n"], faces["v"] = 3, triangles
        out.write(faces.tobytes())


def write_images(folder):
    size = 512
    y, x = np.mgrid[0:size, 0:size] / size
    paint = np.stack([0.2 + 0.6 * (np.floor(8 * x) % 2), 0.3 + 0.5 * y, 0.5 + 0.4 * np.sin(12 * np.pi * x)], -1)
    slope = [0.4 * np.sin(24 * np.pi * x), 0.4 * np.sin(12 * np.pi * y)]
    normals = np.stack([*slope, np.sqrt(1 - slope[0] ** 2 - slope[1] ** 2)], -1) * 0.5 + 0.5
    holes = np.repeat(((np.floor(16 * x) + np.floor(8 * y)) % 2)[..., None], 3, 2)
    for name, values in (("paint", paint), ("normals", normals), ("holes", holes)):
        mi.Bitmap(np.round(255 * values.clip(0, 1)).astype(np.uint8)).write(os.path.join(folder, f"{name}.png"))
    # tweenray has the first row half a texel below the pole, Mitsuba at the pole.
    write_sky(os.path.join(folder, "sky.exr"), lambda row, rows: (row + 0.5) / rows)
    write_sky(os.path.join(folder, "sky-of-mitsuba.exr"), lambda row, rows: row / (rows - 1))


def write_sky(path, place):
    # Fine enough that what is linear between texels is the same in both.
    width, height = 1024, 512
    v, u = np.mgrid[0:height, 0:width]
    theta, phi = np.pi * place(v, height), 2 * np.pi * ((u + 0.5) / width - 0.5)
    d = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], -1)
    sky = np.stack([0.15 + 0.1 * d[..., 1], 0.2 + 0.1 * d[..., 1], 0.3 + 0.15 * d[..., 1]], -1)
    for at, colour in (([-0.6, 0.6, 0.5], [5.0, 4.4, 3.6]), ([0.8, 0.2, -0.5], [0.6, 1.2, 2.4])):
        at = np.array(at) / np.linalg.norm(at)
        sky = sky + np.exp(12.0 * (d @ at - 1.0))[..., None] * np.array(colour)
    mi.Bitmap(sky.astype(np.float32)).write(path)


class Ball:
    """One ball under a lamp, or in an environment."""

    SIZE = (EDGE, EDGE)

    def __init__(self, name, text, bsdf, formula, is_mesh, folder, in_environment):
        self.name, self.text, self.bsdf, self.formula, self.is_mesh = name, text, bsdf, formula, is_mesh
        self.folder, self.in_environment = folder, in_environment
        self.samples = 1024 if name in ("metal 0.5", "metal 0.9", "glass, rough") else 256

    def mitsuba(self, bsdf=None):
        look = mi.ScalarTransform4f().look_at(origin=EYE, target=TARGET, up=[0, 1, 0])
        film = {"type": "hdrfilm", "width": EDGE, "height": EDGE, "pixel_format": "rgb", "rfilter": {"type": "box"}}
        sensor = {"type": "perspective", "fov": FOV, "fov_axis": "y", "to_world": look, "film": film}
        # Diffuse surfaces light no others in tweenray, which counts inside of a ball with holes alone: holes are no bounces here.
        # As many reflections and refractions as 16 bounces of tweenray's: rough glass still shows what a 17th adds.
        integrator = {"type": "path", "max_depth": 17, "rr_depth": 100}
        if self.name == "cut-outs":
            integrator = {"type": "volpath", "max_depth": 2, "rr_depth": 100}
        scene = {"type": "scene", "integrator": integrator, "sensor": sensor}
        if self.is_mesh:
            # Mitsuba has the first row of an image at v = 0.
            file = {"filename": os.path.join(self.folder, "plain.ply"), "flip_tex_coords": True}
            ball = mi.load_dict({"type": "ply", "bsdf": bsdf or self.bsdf, **file})
            if "vertex_colours" in self.text:
                ball.add_attribute("vertex_color", 3, decoded(ball_mesh()[2]).astype(np.float32).ravel())
            scene["ball"] = ball
        else:
            scene["ball"] = {"type": "sphere", "bsdf": bsdf or self.bsdf}
        if self.in_environment:
            turned = mi.ScalarTransform4f().rotate([0, 1, 0], 180)
            scene["sky"] = {"type": "envmap", "filename": os.path.join(self.folder, "sky-of-mitsuba.exr"), "to_world": turned}
        else:
            centre, normal, edge, radiance = LAMP
            target = [c + n for c, n in zip(centre, normal)]
            place = mi.ScalarTransform4f().look_at(origin=centre, target=target, up=[0, 1, 0]).scale(0.5 * edge)
            scene["lamp"] = {"type": "rectangle", "to_world": place, "emitter": {"type": "area", "radiance": rgb(radiance)}}
        return scene

    def tweenray(self):
        text = f"[camera]\nfov = {FOV}\nstill = {{ eye = {EYE}, target = {TARGET} }}\n"
        text += f"[settings]\nsize = [{EDGE}, {EDGE}]\nbounces = 16\n"
        if self.in_environment:
            text += '[sky]\nimage = "sky.exr"\n'
        else:
            centre, normal, edge, radiance = LAMP
            text += f"[[light]]\nquad = {{ centre = {centre}, normal = {normal}, size = [{edge}, {edge}], radiance = {radiance} }}\n"
        text += f"[material.ball]\n{self.text}\n"
        text += '[[mesh]]\nfile = "ball.ply"\n' if self.is_mesh else "[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\n"
        return text + 'material = "ball"\n'


def write(folder):
    write_ply(os.path.join(folder, "ball.ply"), True)
    write_ply(os.path.join(folder, "plain.ply"), False)
    write_images(folder)


def all_of(folder, in_environment):
    return [Ball(*row, folder, in_environment) for row in materials(folder)]
