"""Scenes in both languages."""

import mitsuba as mi

WIDTH, HEIGHT = 320, 180


def grey(value):
    return list(value) if isinstance(value, (list, tuple)) else [value] * 3


def rgb(value):
    return {"type": "rgb", "value": grey(value)}


def camera_of(eye, target, fov):
    transform = mi.ScalarTransform4f().look_at(origin=list(eye), target=list(target), up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "pixel_format": "rgb", "rfilter": {"type": "box"}}
    sampler = {"type": "independent"}
    return {"type": "perspective", "fov": fov, "fov_axis": "y", "to_world": transform, "film": film, "sampler": sampler}


def toml_of(eye, target, fov):
    return (
        f"[camera]\nfov = {fov}\nstill = {{ eye = {list(eye)}, target = {list(target)} }}\n"
        f"[settings]\nsize = [{WIDTH}, {HEIGHT}]\n"
    )


def matte(value):
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(value)}}


def ball(centre, radius, bsdf):
    return {"type": "sphere", "center": list(centre), "radius": radius, "bsdf": bsdf}


def floor(bsdf, half=20.0):
    to_world = mi.ScalarTransform4f().rotate([1, 0, 0], -90).scale(half)
    return {"type": "rectangle", "to_world": to_world, "bsdf": bsdf}


def lamp(centre, half, radiance):
    """A square light that shines straight down."""
    to_world = mi.ScalarTransform4f().translate(list(centre)).rotate([1, 0, 0], 90).scale(half)
    return {"type": "rectangle", "to_world": to_world, "emitter": {"type": "area", "radiance": rgb(radiance)}}


def box(low, high, bsdf):
    middle = [0.5 * (a + b) for a, b in zip(low, high)]
    half = [0.5 * (b - a) for a, b in zip(low, high)]
    return {"type": "cube", "to_world": mi.ScalarTransform4f().translate(middle).scale(half), "bsdf": bsdf}


class Fog:
    """A lamp, a bulb and a point light in a box of fog; slats cast shafts of shadow."""

    EYE, TARGET, FOV = [0.3, 1.8, 7.5], [0.0, 1.2, 0.0], 45
    LOW, HIGH = [-4.0, -0.5, -4.0], [4.0, 4.0, 4.5]
    EXTINCTION, ALBEDO, ANISOTROPY = 0.15, [0.9, 0.85, 0.7], 0.4
    SLATS = [([x, 2.6, -1.6], [x + 0.25, 2.65, 0.6]) for x in (-1.9, -1.4, -0.9, -0.4, 0.1)]
    BALLS = [([0.9, 0.7, 0.3], 0.7, [0.6, 0.15, 0.1]), ([-1.5, 0.5, 1.0], 0.5, [0.1, 0.3, 0.6])]

    def mitsuba(self):
        medium = {
            "type": "homogeneous",
            "sigma_t": self.EXTINCTION,
            "albedo": rgb(self.ALBEDO),
            "phase": {"type": "hg", "g": self.ANISOTROPY},
        }
        fog = box(self.LOW, self.HIGH, {"type": "null"})
        fog["interior"] = medium
        scene = {
            "type": "scene",
            "integrator": {"type": "volpathmis", "max_depth": 2, "rr_depth": 100},
            "sensor": camera_of(self.EYE, self.TARGET, self.FOV),
            "fog": fog,
            "floor": floor(matte(0.5)),
            "lamp": lamp([-0.8, 3.6, -0.5], 0.4, 18.0),
            "bulb": {
                "type": "sphere",
                "center": [2.4, 2.2, -1.0],
                "radius": 0.25,
                "emitter": {"type": "area", "radiance": rgb([16.0, 11.0, 6.0])},
            },
            "point": {"type": "point", "position": [-2.9, 0.8, -1.5], "intensity": rgb([0.5, 0.8, 2.0])},
        }
        scene.update({f"slat{i}": box(low, high, matte(0.4)) for i, (low, high) in enumerate(self.SLATS)})
        scene.update({f"ball{i}": ball(c, r, matte(a)) for i, (c, r, a) in enumerate(self.BALLS)})
        return scene

    def tweenray(self):
        text = (
            f"fog = {{ extinction = {self.EXTINCTION}, albedo = {self.ALBEDO}, anisotropy = {self.ANISOTROPY}, "
            f"box = {{ min = {self.LOW}, max = {self.HIGH} }} }}\n"
        )
        text += toml_of(self.EYE, self.TARGET, self.FOV)
        text += "[[light]]\nquad = { centre = [-0.8, 3.6, -0.5], normal = [0, -1, 0], size = [0.8, 0.8], radiance = 18 }\n"
        text += "[[light]]\nsphere = { centre = [2.4, 2.2, -1.0], radius = 0.25, radiance = [16, 11, 6] }\n"
        text += "[[light]]\npoint = { position = [-2.9, 0.8, -1.5], intensity = [0.5, 0.8, 2.0] }\n"
        text += "[material.floor]\ndiffuse = 0.5\n[material.slat]\ndiffuse = 0.4\n"
        text += '[[mesh]]\nquad = { centre = [0, 0, 0], normal = "y", size = [40, 40] }\nmaterial = "floor"\n'
        for low, high in self.SLATS:
            text += f'[[mesh]]\nbox = {{ min = {low}, max = {high} }}\nmaterial = "slat"\n'
        for i, (centre, radius, albedo) in enumerate(self.BALLS):
            text += f"[material.ball{i}]\ndiffuse = {albedo}\n"
            text += f'[[sphere]]\ncentre = {centre}\nradius = {radius}\nmaterial = "ball{i}"\n'
        return text


ALL = {"fog": Fog()}
