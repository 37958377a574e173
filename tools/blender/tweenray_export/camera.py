"""The camera, baked frame by frame.

A frame's record has eye, target and up (tweenray's axes, world units), the vertical field of view (degrees), the shift as
shares of the picture, the shape of pixels, and the lens. All but pose and depth of field follow from Blender's own
projection matrix, so that sensor fit, shift and the shape of pixels are what Blender renders.
"""

import math

from mathutils import Vector

from . import axes

# A camera's own clip start, nearer than which nothing is that a picture should show.
USUAL_START = 0.11
# Cosine between two axes of a camera beyond which it is sheared; rounding alone gives some 1e-7.
MOST_SHEAR = 1e-4


def record(camera, depsgraph, size, report):
    """The camera object's record at the depsgraph's frame. `size` is (width, height), pixels.

    Raises ValueError for a camera without perspective.
    """
    data, name = camera.data, camera.name
    if data.type != "PERSP":
        raise ValueError(f"{name}: the camera's type is {data.type}; tweenray has perspective cameras: set Lens, Type")
    width, height = size
    render = depsgraph.scene.render
    scales = {"scale_x": render.pixel_aspect_x, "scale_y": render.pixel_aspect_y}
    projection = camera.calc_matrix_camera(depsgraph, x=width, y=height, **scales)
    place = camera.matrix_world.normalized()
    eye, right = place.translation, place.col[0].xyz
    up, forward = place.col[1].xyz, -place.col[2].xyz
    if right.cross(up).dot(-forward) < 0.0:
        report.add(name, "the camera is mirrored by its scale", "it is not mirrored")
    if max(abs(right.dot(up)), abs(up.dot(forward)), abs(forward.dot(right))) > MOST_SHEAR:
        report.add(name, "the camera is sheared by the scale of its parent", "its axes are at right angles")
    lens = thin_lens(data, eye, forward, depsgraph, report, name)
    # Nine digits of the target keep the direction to 1e-8 where it is about as far away as the origin.
    reach = max(lens["focus"] if lens else 10.0, eye.length)
    half_width, half_height = 1.0 / projection[0][0], 1.0 / projection[1][1]
    return {
        "eye": axes.vector(eye),
        # In f64: f32 would round the target to half a unit at 5e6 units from the origin.
        "target": axes.vector([e + f * reach for e, f in zip(eye, forward)]),
        "up": axes.vector(up),
        "fov": 2.0 * math.degrees(math.atan(half_height)),
        "shift": [0.5 * projection[0][2], 0.5 * projection[1][2]],
        "pixel_aspect": half_width / half_height * height / width,
        "lens": lens,
    }


class Clipping:
    """Notes what the camera's clip distances would cut off in the first frame; tweenray has none."""

    def __init__(self, camera, report):
        place = camera.matrix_world.normalized()
        self.eye, self.forward = place.translation, -place.col[2].xyz
        self.name, self.report = camera.name, report
        self.start, self.end = camera.data.clip_start, camera.data.clip_end

    def note(self, ob, matrix):
        """Notes it of an object at `matrix`, by its bounding box."""
        corners = [(matrix @ Vector(corner) - self.eye).dot(self.forward) for corner in ob.bound_box]
        if 0.0 < max(corners) and min(corners) < self.start and self.start > USUAL_START:
            self.report.add(self.name, f"clip start {self.start:g}", "what is nearer is seen")
        if max(corners) > self.end:
            self.report.add(self.name, f"clip end {self.end:g}", "what is farther is seen")


def thin_lens(data, eye, forward, depsgraph, report, name):
    """The depth of field, or None where all is sharp."""
    dof = data.dof
    if not dof.use_dof:
        return None
    focus = dof.focus_distance
    if dof.focus_object is not None:
        at = dof.focus_object.evaluated_get(depsgraph).matrix_world.translation
        focus = abs((at - eye).dot(forward))
        if dof.focus_subtarget:
            report.add(name, "focus on a bone", "focus on the armature's origin")
    if dof.aperture_ratio != 1.0:
        report.add(name, f"aperture ratio {dof.aperture_ratio:g}", "the aperture is not squeezed")
    lens = {"radius": 0.5e-3 * data.lens / dof.aperture_fstop, "focus": max(focus, 1e-6)}
    if dof.aperture_blades >= 3:
        blades = min(dof.aperture_blades, 64)
        # Cycles has a corner half a side beyond the x axis; tweenray has one on the y axis.
        turn = math.degrees(dof.aperture_rotation) + 180.0 / blades - 90.0
        lens |= {"blades": blades, "blade_rotation": turn % (360.0 / blades)}
    return lens


def note_blades(records, name, report):
    """Notes apertures that change their blades during the shot of the scene `name`; tweenray has one shape for all frames."""
    lenses = [record["lens"] for record in records if record["lens"]]
    shapes = [(lens.get("blades", 0), lens.get("blade_rotation", 0.0)) for lens in lenses if lens["radius"] > 0.0]
    if any(a[0] != b[0] or abs(a[1] - b[1]) > 1e-3 for a, b in zip(shapes, shapes[1:])):
        report.add(name, "the blades of the aperture or their rotation differ between frames", "those of the first frame with depth of field")


def table(records):
    """The scene file's `[camera]` of one record a frame."""
    first = records[0]
    entries = {"frames": len(records), "fov": first["fov"], "up": first["up"]}
    if any(first["shift"]):
        entries["shift"] = first["shift"]
    if abs(first["pixel_aspect"] - 1.0) > 1e-6:
        entries["pixel_aspect"] = first["pixel_aspect"]
    lenses = [r["lens"] for r in records]
    own = next((lens for lens in lenses if lens), None)
    if own:
        entries["lens"] = dict(own)
    if all(r == first for r in records):
        entries["still"] = {"eye": first["eye"], "target": first["target"]}
        return entries
    entries["keys"] = [key(r, first, own) for r in records]
    return entries


def key(record, first, own):
    """The key pose of one frame: what differs from the camera's own."""
    entries = {name: record[name] for name in ("eye", "target", "up")}
    entries |= {name: record[name] for name in ("fov", "shift") if record[name] != first[name]}
    if own:
        lens = record["lens"] or {"radius": 0.0, "focus": own["focus"]}
        entries["lens"] = {"radius": lens["radius"], "focus": lens["focus"]}
    return entries
