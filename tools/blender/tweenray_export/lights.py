"""Lights. Blender's watts become radiance or intensity as in Cycles, whose renderings the tests compare.

With P the power (W) times colour and exposure:
area light of area A: radiance P / (pi A); point light of radius r: radiance P / (4 pi^2 r^2), which is the
intensity P / (4 pi); spot: the same intensity along its axis; sun: P is the irradiance (W/m2). Without `normalize` the
radiance of area, point and spot is P / pi, and the sun's irradiance P pi sin(angle / 2)^2.
"""

import math

from mathutils import Vector

from . import axes

# Quads of the strip that stands for an ellipse.
STRIP = 16


def export(ob, matrix, materials, report):
    """(the `[[light]]` entries, triangles that emit or None) of a light object at `matrix`.

    The triangles are (corners in Blender's axes, radiance): an ellipse, which tweenray has no light for.
    """
    light, name = ob.data, ob.name
    power = [c * f for c, f in zip(colour(light), strength(light, materials, report, name))]
    if max(power) <= 0.0:
        return [], None
    if min(power) < 0.0:
        report.add(name, "negative light", "channels below 0 are 0")
        power = [max(p, 0.0) for p in power]
    note(ob, light, report, name)
    if light.type == "AREA":
        return area(light, matrix, power, report, name)
    where = matrix.translation
    axis = -matrix.col[2].xyz
    if axis.length == 0.0:
        report.add(name, "its scale is 0", "not exported")
        return [], None
    if light.type == "SUN":
        return [sun(light, axis, power)], None
    # Cycles scales the radius by the object's largest scale.
    radius = light.shadow_soft_size * max(matrix.to_scale(), key=abs)
    intensity = [p / (4.0 * math.pi) if light.normalize else p * radius * radius for p in power]
    if light.type == "SPOT":
        return [spot(light, matrix, abs(radius), intensity, report, name)], None
    return [point(where, abs(radius), intensity, ob.visible_camera)], None


def colour(light):
    """Its colour, with its temperature."""
    tint = light.temperature_color if getattr(light, "use_temperature", False) else (1.0, 1.0, 1.0)
    return [c * t for c, t in zip(light.color, tint)]


def strength(light, materials, report, name):
    """Its power by channel, with exposure and a constant emission node."""
    factors = [1.0] * 3
    if light.use_nodes and light.node_tree is not None:
        of_nodes = materials.light_factors(light.node_tree, name)
        if of_nodes is None:
            report.add(name, "nodes of the light", "its power and colour alone")
        else:
            factors = of_nodes
    return [light.energy * 2.0 ** getattr(light, "exposure", 0.0) * factor for factor in factors]


def note(ob, light, report, name):
    """Notes what no light of tweenray has."""
    for use in ("diffuse_factor", "specular_factor", "transmission_factor"):
        if getattr(light, use, 1.0) != 1.0 and not math.isclose(getattr(light, use), 1.0):
            report.add(name, use, "1 (Cycles ignores it too)")
    if not light.use_shadow:
        report.add(name, "no shadows", "it casts shadows")
    if getattr(light, "use_soft_falloff", False) and light.type in ("POINT", "SPOT") and light.shadow_soft_size > 0.0:
        report.add(name, "soft falloff", "the falloff of a sphere, brighter nearby by 1 + (radius / distance)^2")
    if light.type == "AREA":
        unseen = "" if ob.visible_camera else ", and the camera does not see it"
        report.add(name, f"light passes through it{unseen}", "it is a surface: bright from its front, black from its back, and it hides and shades what is behind it")
    if light.type == "SUN" and light.angle > 0.0 and not ob.visible_camera:
        report.add(name, "a sun that is invisible to the camera", "its disk is seen in the sky")
    if light.type == "POINT" and light.shadow_soft_size > 0.0 and not ob.visible_camera and ob.visible_glossy:
        report.add(name, "invisible to the camera alone", "perfect mirrors and glass do not show it either")


def area(light, matrix, power, report, name):
    """Rectangle, square, disk or ellipse; it shines along its -z."""
    if light.spread < math.pi - 1e-3:
        report.add(name, f"spread {math.degrees(light.spread):.0f} degrees", "it shines into the half space")
    is_round = light.shape in ("DISK", "ELLIPSE")
    sizes = (light.size, light.size if light.shape in ("SQUARE", "DISK") else light.size_y)
    u, v = (matrix.col[i].xyz * sizes[i] for i in (0, 1))
    extent = u.cross(v).length * (0.25 * math.pi if is_round else 1.0)
    if extent == 0.0:
        report.add(name, "an area light without area", "not exported")
        return [], None
    radiance = [p / math.pi / (extent if light.normalize else 1.0) for p in power]
    middle, normal = matrix.translation, -matrix.col[2].xyz.normalized()
    turned = v.cross(u).dot(normal) < 0.0
    if not is_round:
        edges = [u, v] if turned else [v, u]
        quad = {"corner": axes.vector(middle - 0.5 * (u + v)), "edges": [axes.vector(e) for e in edges]}
        return [{"quad": quad | {"radiance": radiance}}], None
    if abs(u.length - v.length) < 1e-5 * u.length and abs(u.dot(v)) < 1e-5 * u.length * v.length:
        disk = {"centre": axes.vector(middle), "normal": axes.vector(normal), "radius": 0.5 * u.length}
        return [{"disk": disk | {"radiance": radiance}}], None
    report.add(name, "an ellipse", f"{STRIP} quads of its area")
    return [], (ellipse(middle, u, v, turned), radiance)


def ellipse(middle, u, v, is_turned):
    """Corners of a strip of quads with the ellipse's area, that faces against the cross product of `u` and `v`, or along it
    where `is_turned`."""
    steps = 2 * STRIP + 2
    # The polygon's area is steps / 2 sin(2 pi / steps) for the radius 1.
    grow = math.sqrt(math.pi / (0.5 * steps * math.sin(2.0 * math.pi / steps)))

    def rim(k):
        angle = 2.0 * math.pi * (k + 0.5) / steps
        return middle + 0.5 * grow * (u * math.cos(angle) + v * math.sin(angle))

    quads = []
    for k in range(STRIP):
        quad = [rim(k), rim(k + 1), rim(steps - 2 - k), rim(steps - 1 - k)]
        quads.append(quad if is_turned else quad[::-1])
    return quads


def point(where, radius, intensity, is_seen):
    """A point, or a sphere where it has a radius; a sphere that is not seen is a spot that shines all around."""
    if radius == 0.0:
        return {"point": {"position": axes.vector(where), "intensity": intensity}}
    if not is_seen:
        around = {"direction": [0.0, -1.0, 0.0], "outer_angle": 180.0, "inner_angle": 180.0}
        return {"spot": {"position": axes.vector(where), "intensity": intensity, "radius": radius} | around}
    radiance = [i / (math.pi * radius * radius) for i in intensity]
    return {"sphere": {"centre": axes.vector(where), "radius": radius, "radiance": radiance}}


def spot(light, matrix, radius, intensity, report, name):
    """A cone. Cycles lets the light fall off over the share `spot_blend` of 1 - cos of the outer angle."""
    if light.use_square:
        report.add(name, "a square spot", "a round one")
    scale = matrix.to_scale()
    if max(abs(s - scale[0]) for s in scale) > 1e-4 * abs(scale[0]):
        report.add(name, "a spot with uneven scale", "a round cone")
    outer = 0.5 * light.spot_size
    inner = math.cos(outer) + (1.0 - math.cos(outer)) * light.spot_blend
    entries = {
        "position": axes.vector(matrix.translation),
        "direction": axes.vector(-matrix.col[2].xyz),
        "intensity": intensity,
        "outer_angle": math.degrees(outer),
        "inner_angle": min(math.degrees(math.acos(min(inner, 1.0))), math.degrees(outer)),
    }
    if radius > 0.0:
        entries["radius"] = radius
    return {"spot": entries}


def sun(light, axis, power):
    """A sun, or parallel light where its angle is too small for one."""
    half = 0.5 * light.angle
    irradiance = power if light.normalize else [p * math.pi * math.sin(half) ** 2 for p in power]
    entries = {"to_light": axes.vector(-Vector(axis)), "irradiance": irradiance}
    degrees = math.degrees(light.angle)
    if degrees < 0.02:
        return {"directional": entries}
    return {"sun": entries | {"angle": min(degrees, 90.0)}}
