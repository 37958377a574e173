"""The export of a scene: evaluated as for a render, written as scene.toml, meshes, textures and report.txt.

A depsgraph for rendering (render levels of modifiers, render visibility, all particles) is given by Blender to a render
engine alone. So the export is one, `Engine`, which renders no pixel.
"""

import math
import os

import bpy
import numpy as np

from . import axes, camera, lights, toml
from .images import Images
from .materials import DEFAULT, Materials
from .meshes import Meshes, floats, free_name
from .report import Report, is_animated
from .world import World

# Object types without a surface, which are left out without a word.
SILENT = {"EMPTY", "CAMERA", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT_PROBE", "LIGHT"}
SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}
MOST_BYTES = 16 << 20
# To find what moves: instances (or thousands of points of meshes) that are looked at in all frames together, frames that are
# looked at however large the scene is, and points of a mesh.
MOST_COMPARED, FEWEST_FRAMES, MOST_POINTS = 100_000, 6, 2_000


class Engine(bpy.types.RenderEngine):
    """Lends its depsgraph to the export that is under way."""

    bl_idname = "TWEENRAY_EXPORT"
    bl_label = "tweenray export"
    bl_use_eevee_viewport = False

    export = None

    def render(self, depsgraph):
        """Takes the scene frame by frame; a failure is kept for `write`."""
        export = Engine.export
        if export is None or export.error is not None:
            return
        try:
            export.take(self, depsgraph)
        except Exception as error:
            export.error = error


def write(scene, folder):
    """Exports `scene` to `folder`. Gives the report's lines.

    Raises ValueError for what cannot be exported, OSError for what cannot be written.
    """
    if scene.camera is None and not any(marker.camera for marker in scene.timeline_markers):
        raise ValueError(f"{scene.name}: no camera; add one and make it active (Ctrl-0)")
    if not hasattr(scene, "cycles"):
        raise ValueError(f"{scene.name}: the add-on Cycles is off; switch it on in Edit, Preferences, Add-ons")
    os.makedirs(folder, exist_ok=True)
    export = Export(scene, folder)
    render = scene.render
    # Freestyle draws its lines in a depsgraph of its own, which crashes without a picture.
    switches = ("use_compositing", "use_sequencer", "use_freestyle", "use_multiview")
    kept = {name: getattr(render, name) for name in ("engine", *switches)}
    frame, camera_before = (scene.frame_current, scene.frame_subframe), scene.camera
    bpy.utils.register_class(Engine)
    try:
        # Materials, world and settings are read as they are in the file, to which animated values are written here.
        scene.frame_set(scene.frame_start)
        export.note_settings()
        export.settings = export.settings_table()
        export.sky = export.world.prepare(scene)
        for name in switches:
            setattr(render, name, False)
        render.engine = Engine.bl_idname
        Engine.export = export
        bpy.ops.render.render(scene=scene.name)
        if export.error is None and export.records:
            return export.finish()
    finally:
        Engine.export = None
        for name, value in kept.items():
            setattr(render, name, value)
        scene.frame_set(frame[0], subframe=frame[1])
        # Markers bind cameras to frames, and `frame_set` makes them active.
        scene.camera = camera_before
        bpy.utils.unregister_class(Engine)
    if export.error is not None:
        raise export.error
    raise ValueError(f"{scene.name}: Blender evaluated no view layer; enable one for rendering")


class Export:
    """What was gathered of a scene."""

    def __init__(self, scene, folder):
        self.scene, self.folder, self.report = scene, folder, Report()
        images = Images(folder, self.report)
        self.materials = Materials(images, self.report)
        self.meshes = Meshes(folder, self.materials, self.report)
        self.world = World(images, self.report)
        self.settings, self.sky, self.error = None, None, None
        self.records, self.placed, self.lamps = [], [], []
        self.used, self.clipping = set(), None

    def take(self, engine, depsgraph):
        """The scene at its first frame, and the camera at every frame."""
        if self.records:
            self.report.add(depsgraph.view_layer.name, "a further view layer", "the first alone")
            return
        scene = self.scene
        frames = range(scene.frame_start, scene.frame_end + 1, scene.frame_step)
        for frame in frames:
            engine.frame_set(frame, 0.0)
            # First, since a camera that cannot be exported shall leave no files.
            self.camera(depsgraph)
            if frame == frames[0]:
                self.note_layer(depsgraph.view_layer)
                self.clipping = camera.Clipping(scene.camera.evaluated_get(depsgraph), self.report)
                self.geometry(depsgraph)
                before = places(depsgraph)
                dearest = cost(before)
                compared = {frames[i] for i in compared_frames(len(frames), dearest)}
            elif frame in compared:
                now = places(depsgraph)
                self.note_moves(before, now, frames[0])
                # Particles may be born: fewer of the frames to come are compared where each costs more.
                if (price := cost(now)) > dearest:
                    dearest = price
                    compared &= {frames[i] for i in compared_frames(len(frames), dearest)}
        camera.note_blades(self.records, scene.name, self.report)

    def camera(self, depsgraph):
        ob = depsgraph.scene.camera
        if ob is None:
            raise ValueError(f"{self.scene.name}: no camera at frame {depsgraph.scene.frame_current}")
        ob = ob.evaluated_get(depsgraph)
        self.records.append(camera.record(ob, depsgraph, size(self.scene), self.report))

    def note_moves(self, before, now, frame):
        for key in (key for key in before if key not in now):
            self.report.add(key[0], "it disappears during the shot", f"it stays as at frame {frame}")
        bent = {}
        for key in now:
            name = key[0]
            if key not in before:
                self.report.add(name, "it appears during the shot", f"it is absent, as at frame {frame}")
                continue
            (place, form), (new_place, new_form) = before[key], now[key]
            # Many objects share a form, which is compared once.
            pair = id(form), id(new_form)
            if pair not in bent:
                bent[pair] = form[0] != new_form[0] or differ(form[1], new_form[1])
            if bent[pair] or differ(place, new_place):
                self.report.add(name, "it moves or changes during the shot", f"it stays as at frame {frame}")

    def note_settings(self):
        """Notes settings of the scene that tweenray has not, and what of it is animated."""
        scene, render = self.scene, self.scene.render
        if scene.cycles.diffuse_bounces > 0 and scene.cycles.max_bounces > 0:
            self.report.add(scene.name, "light from surface to surface (diffuse bounces)", "none")
        if render.film_transparent:
            self.report.add(scene.name, "a transparent film", "the sky is seen")
        nodes = getattr(scene, "compositing_node_group", None) or (scene.use_nodes and getattr(scene, "node_tree", None))
        if render.use_compositing and nodes:
            self.report.add(scene.name, "compositing", "none")
        if render.use_sequencer and any(strip.type != "SOUND" and not strip.mute for strip in strips(scene)):
            self.report.add(scene.name, "strips of the video sequencer", "the picture of the scene's camera")
        if render.use_freestyle:
            self.report.add(scene.name, "Freestyle", "no lines")
        if render.use_multiview:
            self.report.add(scene.name, "stereoscopy", "the camera's own view")
        if scene.cycles.pixel_filter_type != "BOX" and not math.isclose(scene.cycles.filter_width, 1.5, rel_tol=1e-3):
            self.report.add(scene.name, f"a pixel filter {scene.cycles.filter_width:g} wide", "tweenray's own width")
        if is_animated(scene):
            self.report.add(scene.name, "animated settings", f"as at frame {scene.frame_start}")

    def note_layer(self, layer):
        """Notes what a view layer changes of objects."""
        if layer.material_override is not None:
            self.report.add(layer.name, "a material override", "each object's own material")
        collections = [layer.layer_collection]
        for collection in collections:
            collections.extend(collection.children)
            for use, what in ((collection.holdout, "holdout"), (collection.indirect_only, "indirect only")):
                if use and not collection.exclude:
                    self.report.add(collection.name, what, "its objects are ordinary surfaces")

    def geometry(self, depsgraph):
        # Curves, text, surfaces and metaballs come as they are, and their meshes once more as instances.
        meshed = {i.object.original for i in depsgraph.object_instances if is_mesh_of_another(i.object)}
        for instance in depsgraph.object_instances:
            ob = instance.object
            if not instance.show_self or (ob.type != "MESH" and ob.original in meshed):
                continue
            if ob.type == "LIGHT":
                self.light(ob, instance.matrix_world.copy())
            elif ob.type in SURFACES:
                self.surface(instance, depsgraph)
            elif ob.type not in SILENT:
                self.report.add(ob.name, f"an object of the type {ob.type}", "not exported")
            if instance.show_particles and any(s.settings.render_type == "PATH" for s in ob.particle_systems):
                self.report.add(ob.name, "hair", "not exported")

    def light(self, ob, matrix):
        if getattr(ob.data.cycles, "is_portal", False):
            self.report.add(ob.name, "a portal", "not exported: it gives no light of its own")
            return
        if is_animated(ob.data) or is_animated(ob.data.node_tree):
            self.report.add(ob.name, "its light is animated", f"as at frame {self.scene.frame_start}")
        for ray in ("diffuse", "glossy", "transmission", "volume_scatter"):
            if not getattr(ob, f"visible_{ray}"):
                self.report.add(ob.name, f"a light that {ray.replace('_', ' ')} rays do not see", "it lights everything")
        linking = ob.light_linking
        if linking.receiver_collection is not None or linking.blocker_collection is not None:
            self.report.add(ob.name, "light linking", "it lights everything")
        entries, quads = lights.export(ob, matrix, self.materials, self.report)
        self.lamps.extend(entries)
        if quads is not None:
            corners, radiance = quads
            name = f"ellipse {ob.name}"
            file = self.meshes.quads(name, corners)
            identity = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]
            self.placed.append((ob.name, file, {"emission": radiance}, axes.matrix(identity)))

    def surface(self, instance, depsgraph):
        ob, matrix = instance.object, instance.matrix_world
        if abs(matrix.to_3x3().determinant()) < 1e-30:
            self.report.add(ob.name, "a scale of 0 flattens it", "not exported")
            return
        self.note_visibility(ob)
        self.clipping.note(ob, matrix)
        for file, material in self.meshes.parts(instance, depsgraph):
            made = self.materials.made(material)
            if not made.is_seen:
                continue
            name = material.name_full if material else DEFAULT
            is_new = material and name not in self.used
            if is_new and (is_animated(material) or is_animated(material.node_tree)):
                self.report.add(name, "it is animated", f"as at frame {self.scene.frame_start}")
            self.used.add(name)
            self.placed.append((ob.name, file, name, axes.matrix(matrix)))

    def note_visibility(self, ob):
        for ray in ("camera", "diffuse", "glossy", "transmission", "shadow"):
            if not getattr(ob, f"visible_{ray}"):
                self.report.add(ob.name, f"invisible to {ray} rays", "seen by all rays")
        if ob.is_holdout or ob.is_shadow_catcher:
            self.report.add(ob.name, "holdout or shadow catcher", "an ordinary surface")

    # ---- the scene file ----------------------------------------------------------------------------

    def finish(self):
        """Writes scene file and report; gives the report's lines."""
        text = self.text()
        if len(text.encode()) > MOST_BYTES:
            raise ValueError(
                f"{self.scene.name}: {len(self.placed)} placed meshes make a scene file over {MOST_BYTES >> 20} MB; "
                "join objects that stand still (Ctrl-J) or realize instances"
            )
        for name, content in (("scene.toml", text), ("report.txt", self.report.text())):
            with open(os.path.join(self.folder, name), "w", encoding="utf-8", newline="\n") as out:
                out.write(content)
        return self.report.lines()

    def text(self):
        """The scene file."""
        frames = f"frames {self.scene.frame_start} to {self.scene.frame_end}"
        parts = [f"# {toml.value(self.scene.name)} from Blender {bpy.app.version_string}, {frames}\n"]
        parts += [toml.table("[settings]", self.settings), camera_text(self.records)]
        if self.sky:
            parts.append(toml.table("[sky]", self.sky))
        parts += [toml.table("[[light]]", lamp) for lamp in self.lamps]
        tables = self.materials.tables(self.used)
        for name, file, material, matrix in self.placed:
            if isinstance(material, dict):
                tables[name + " light"] = material
        taken = set()
        names = {name: free_name(name, taken) for name in tables}
        parts += [toml.table(f"[material.{toml.key(names[name])}]", table) for name, table in tables.items()]
        for name, file, material, matrix in self.placed:
            material = names[name + " light" if isinstance(material, dict) else material]
            entries = {"name": name, "file": file, "material": material, "transform": [{"matrix": matrix}]}
            parts.append(toml.table("[[mesh]]", entries))
        return "\n".join(parts)

    def settings_table(self):
        """Image size, frame rate, exposure, tone curve, bounces, and the pixel filter of Cycles."""
        scene, render = self.scene, self.scene.render
        if render.use_motion_blur:
            self.report.add(scene.name, "motion blur", "none")
        if render.use_border:
            self.report.add(scene.name, "a render region", "the whole picture")
        if scene.frame_step != 1:
            self.report.add(scene.name, f"frame step {scene.frame_step}", "each rendered frame is one of the shot")
        cycles, view = scene.cycles, scene.view_settings
        exposure = cycles.film_exposure * 2.0 ** view.exposure
        filters = {"BOX": "box", "GAUSSIAN": "gaussian", "BLACKMAN_HARRIS": "blackman-harris"}
        bounces = min(cycles.max_bounces, max(cycles.glossy_bounces, cycles.transmission_bounces))
        entries = {
            "size": list(size(scene)),
            "fps": render.fps / render.fps_base,
            "filter": filters.get(cycles.pixel_filter_type, "box"),
            "bounces": min(bounces, 1024),
            "tone": self.tone(view),
        }
        return entries | ({} if math.isclose(exposure, 1.0) else {"exposure": exposure})

    def tone(self, view):
        """The tone curve that comes nearest to the view transform."""
        exact = {"Standard": "srgb", "Raw": "linear"}
        if view.view_transform not in exact:
            self.report.add(self.scene.name, f"the view transform {view.view_transform}", "the tone curve filmic, which looks otherwise; exr files stay linear")
        if view.look not in ("None", "") or view.gamma != 1.0 or view.use_curve_mapping:
            self.report.add(self.scene.name, "look, gamma or curves of the view", "none")
        return exact.get(view.view_transform, "filmic")


def camera_text(records):
    """The `[camera]` table, with the keys a line each."""
    entries = camera.table(records)
    keys = entries.pop("keys", None)
    text = toml.table("[camera]", entries)
    if keys:
        text += "keys = [\n" + "".join(f"    {toml.value(key)},\n" for key in keys) + "]\n"
    return text


def strips(scene):
    """The strips of the scene's video sequencer."""
    editor = scene.sequence_editor
    # They are `sequences` before Blender 4.4.
    return getattr(editor, "strips", None) or getattr(editor, "sequences", []) if editor else []


def size(scene):
    """(width, height) of the picture, pixels."""
    render = scene.render
    percent = render.resolution_percentage
    return max(render.resolution_x * percent // 100, 1), max(render.resolution_y * percent // 100, 1)


def is_mesh_of_another(ob):
    """Whether it is the mesh that Blender made of a curve, text, surface or metaball."""
    return ob.type == "MESH" and ob.original.type != "MESH"


def compared_frames(count, cost):
    """The numbers, from 1 to `count` - 1, of the frames that are compared with frame 0, of which each costs `cost`: all, or
    the middle, the last and a few at irregular places, which no period of a movement fits."""
    most = max(MOST_COMPARED // cost, FEWEST_FRAMES)
    if count - 1 <= most:
        return set(range(1, count))
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    return {count // 2, count - 1} | {1 + int((k * golden % 1.0) * (count - 1)) for k in range(1, most - 1)}


def cost(found):
    """What `places` costs: instances, and points of the different forms by the thousand."""
    forms = {id(form): form for _, form in found.values()}
    return 1 + len(found) + (sum(count for count, _ in forms.values())) // 1000


def places(depsgraph):
    """{(name, which of its instances): (numbers of its placement, its form)} of what is seen."""
    found, forms = {}, {}
    for instance in depsgraph.object_instances:
        ob = instance.object
        if instance.show_self and ob.type in SURFACES | {"LIGHT"}:
            parent = instance.parent.name if instance.parent else ""
            key = ob.data.as_pointer()
            if key not in forms:
                forms[key] = form(ob)
            place = [x for row in instance.matrix_world for x in row]
            found[ob.name, ob.type, parent, tuple(instance.persistent_id)] = place, forms[key]
    return found


def form(ob):
    """(how many points and corners an object has, numbers that change where it is bent or where a light gets brighter). The numbers
    of a mesh are its box, evenly chosen points and texture coordinates, as float32: there may be thousands of meshes."""
    if ob.type == "LIGHT":
        return 0, np.array([ob.data.energy, *ob.data.color], dtype=np.float32)
    box = np.array(ob.bound_box, dtype=np.float32).reshape(-1)
    if ob.type != "MESH":
        return 0, box
    mesh = ob.data
    points = floats(mesh.vertices, "co", len(mesh.vertices), 3)
    parts = [box, thinned(points)]
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    if layer is not None:
        parts.append(thinned(floats(layer.uv, "vector", len(layer.uv), 2)))
    return len(points) + len(mesh.loops), np.concatenate(parts, dtype=np.float32)


def thinned(rows):
    """The numbers of at most `MOST_POINTS` rows at even distances."""
    return rows[:: 1 + len(rows) // MOST_POINTS].reshape(-1)


def differ(before, now):
    """Whether numbers differ by more than rounding."""
    if isinstance(before, list):
        return before != now and any(abs(a - b) > 1e-5 * max(1.0, abs(a)) for a, b in zip(before, now))
    if before.shape != now.shape:
        return True
    with np.errstate(invalid="ignore"):
        return bool((np.abs(before - now) > 1e-5 * np.maximum(1.0, np.abs(before))).any())
