"""Meshes, instances, what is hidden, and the settings of a scene."""

import math
import os

import bpy
import numpy as np

from common import FOLDER, Case, export, exporter, meshes, ply

import stage


class Geometry(Case):
    def test_placement_normals_and_coordinates(self):
        stage.fresh()
        stage.place("floor", stage.plane(half=1.0), (1.0, 2.0, 3.0), (90.0, 0.0, 0.0), (2.0, 1.0, 1.0))
        found, _, folder = export("placed")
        columns, rows, triangles = ply(os.path.join(folder, found["mesh"][0]["file"]))
        self.assertEqual(columns, ["x", "y", "z", "nx", "ny", "nz", "s", "t"])
        self.assertEqual((len(rows), len(triangles)), (4, 2))
        self.near(rows[:, 3:6], [[0.0, 0.0, 1.0]] * 4)
        self.near(rows[:, 6:], 0.5 * (rows[:, :2] + 1.0))
        matrix = np.array(found["mesh"][0]["transform"][0]["matrix"])
        # (1, 1, 0) of the mesh is (3, 2, 4) in Blender, (3, 4, -2) in tweenray.
        self.near(matrix @ [1.0, 1.0, 0.0, 1.0], [3.0, 4.0, -2.0])

    def test_modifiers_and_split_normals(self):
        scene = stage.fresh()
        block = stage.place("block", stage.cube(), (0.0, 0.0, 1.0))
        subdivision = block.modifiers.new("smooth", "SUBSURF")
        subdivision.levels, subdivision.render_levels = 0, 2
        found, _, folder = export("modified")
        self.assertEqual(len(ply(os.path.join(folder, found["mesh"][0]["file"]))[2]), 6 * 16 * 2)
        block.modifiers.clear()
        found, _, folder = export("sharp")
        _, rows, triangles = ply(os.path.join(folder, found["mesh"][0]["file"]))
        self.assertEqual((len(rows), len(triangles)), (24, 12))

    def test_linked_duplicates_collections_particles_and_nodes_share_a_file(self):
        scene = stage.fresh()
        data = stage.cube(half=0.1)
        for i in range(5):
            stage.place(f"copy {i}", data, (i, 0.0, 0.0))
        kept = bpy.data.collections.new("kept")
        member = bpy.data.objects.new("member", data)
        kept.objects.link(member)
        empty = stage.place("collection", None, (0.0, 5.0, 0.0))
        empty.instance_type, empty.instance_collection = "COLLECTION", kept
        ground = stage.place("ground", stage.plane(half=2.0))
        ground.modifiers.new("seeds", "PARTICLE_SYSTEM")
        settings = ground.particle_systems[0].settings
        settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 7, 0, 0, 100
        settings.render_type, settings.instance_object, settings.physics_type = "OBJECT", member, "NO"
        found, _, folder = export("instances")
        files = [mesh["file"] for mesh in found["mesh"]]
        self.assertEqual(sorted(files.count(f) for f in set(files)), [1, 13])
        self.assertEqual(len(os.listdir(os.path.join(folder, "meshes"))), 2)
        self.near(meshes(found, "member")[0]["transform"][0]["matrix"][2][3], -5.0)

    def test_what_no_render_shows_is_left_out(self):
        scene = stage.fresh()
        stage.place("hidden", stage.cube()).hide_render = True
        stage.place("view", stage.cube()).hide_viewport = True
        stage.place("seen", stage.cube(material=stage.shader("clear", "ShaderNodeBsdfTransparent")))
        stage.place("flat", stage.cube(), scale=(1.0, 0.0, 1.0))
        found, lines, _ = export("hidden")
        self.assertEqual(meshes(found, "hidden") + meshes(found, "seen"), [])
        self.noted(lines, "flat", "scale of 0")

    def test_a_material_a_file_and_what_moves_is_noted(self):
        scene = stage.fresh(frames=3)
        data = stage.mesh("two", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], [(0, 1, 2), (1, 3, 2)], stage.diffuse("a", (1, 0, 0)))
        data.materials.append(stage.diffuse("b", (0, 1, 0)))
        data.polygons[1].material_index = 1
        mover = stage.place("two", data)
        for frame in (1, 3):
            mover.location.x = frame
            mover.keyframe_insert("location", frame=frame)
        scene.frame_set(2)
        found, lines, folder = export("two")
        self.assertEqual([m["material"] for m in found["mesh"]], ["a", "b"])
        self.assertEqual({len(ply(os.path.join(folder, m["file"]))[2]) for m in found["mesh"]}, {1})
        self.near(found["mesh"][0]["transform"][0]["matrix"][0][3], 1.0)
        self.noted(lines, "two", "moves or changes during the shot")
        self.assertEqual(scene.frame_current, 2)

    def test_movements_that_come_home_are_noted(self):
        scene = stage.fresh(frames=101)
        shaken = stage.place("shaken", stage.cube())
        # At home in the first, the middle and the last frame.
        for frame in range(1, 102, 25):
            shaken.location.x = (frame - 1) // 25 % 2
            shaken.keyframe_insert("location", frame=frame)
        stage.place("still", stage.cube())
        self.noted(export("shaken")[1], "shaken", "moves or changes")
        for cost in (1, 10**6):
            frames = exporter.compared_frames(101, cost)
            self.assertTrue({50, 100} <= frames <= set(range(1, 101)))
        self.assertLess(len(frames), 10)
        self.noted(self.with_budget(1), "shaken", "moves or changes")

    def with_budget(self, most):
        """The report where no more than `most` instances are looked at, and in few frames."""
        kept, exporter.MOST_COMPARED = exporter.MOST_COMPARED, most
        try:
            return export("budget")[1]
        finally:
            exporter.MOST_COMPARED = kept

    def test_particles_born_after_the_first_frame_count_in_the_budget(self):
        scene = stage.fresh(frames=40)
        block = stage.place("block", stage.cube())
        emitter = stage.place("emitter", stage.plane())
        emitter.modifiers.new("particles", "PARTICLE_SYSTEM")
        particles = emitter.particle_systems[0].settings
        particles.count, particles.frame_start, particles.frame_end, particles.lifetime = 500, 2.0, 3.0, 100.0
        particles.render_type, particles.instance_object = "OBJECT", block
        costs, real = [], exporter.places

        def counted(depsgraph):
            found = real(depsgraph)
            costs.append(len(found))
            return found

        exporter.places = counted
        try:
            self.with_budget(2_000)
        finally:
            exporter.places = real
        self.assertGreater(max(costs), 500)
        self.assertLessEqual(len(costs), 3 + exporter.FEWEST_FRAMES)

    def test_forms_that_change_inside_their_box_are_noted(self):
        scene = stage.fresh(frames=3)
        ball = stage.place("ball", stage.ball(segments=16))
        ball.shape_key_add(name="Basis")
        dent = ball.shape_key_add(name="dent")
        dent.data[20].co *= 0.5
        scroll = stage.place("scroll", stage.plane("scroll")).modifiers.new("scroll", "UV_WARP")
        for frame in (1, 3):
            dent.value, scroll.offset = 0.5 * (frame - 1), (frame, 0.0)
            dent.keyframe_insert("value", frame=frame)
            scroll.keyframe_insert("offset", frame=frame)
        stage.place("still", stage.ball("still", segments=16))
        lines = export("bent")[1]
        for name in ("ball", "scroll"):
            self.noted(lines, f"{name}: it moves or changes")
        self.assertEqual(len(lines), 2)

    def test_animation_in_a_group_of_a_group_is_noted(self):
        stage.fresh(frames=3)
        inner, outer = (bpy.data.node_groups.new(name, "ShaderNodeTree") for name in ("inner", "outer"))
        outer.nodes.new("ShaderNodeGroup").node_tree = inner
        value = inner.nodes.new("ShaderNodeValue")
        material = stage.diffuse("grouped", (1.0, 1.0, 1.0))
        material.node_tree.nodes.new("ShaderNodeGroup").node_tree = outer
        stage.place("block", stage.cube(material=material))
        self.assertEqual(export("groups")[1], [])
        action = bpy.data.actions.new("without curves")
        inner.animation_data_create().action = action
        self.assertEqual(export("groups")[1], [])
        inner.animation_data_clear()
        value.outputs[0].keyframe_insert("default_value", frame=1)
        self.noted(export("groups")[1], "grouped", "it is animated")

    def test_text_and_curves_are_meshes_and_other_kinds_are_noted(self):
        stage.fresh()
        curve = bpy.data.curves.new("letter", "FONT")
        curve.body, curve.extrude = "T", 0.1
        stage.place("letter", curve)
        stage.place("fog", bpy.data.volumes.new("fog"))
        found, lines, folder = export("kinds")
        self.assertTrue(len(ply(os.path.join(folder, meshes(found, "letter")[0]["file"]))[2]) > 10)
        self.noted(lines, "fog", "VOLUME", "not exported")


class Settings(Case):
    def test_size_frames_rate_exposure_and_tone(self):
        scene = stage.fresh(400, 200, frames=1)
        scene.frame_start, scene.frame_end, scene.render.resolution_percentage = 10, 12, 50
        scene.render.fps, scene.render.fps_base = 30, 1.001
        scene.cycles.film_exposure, scene.view_settings.exposure = 2.0, 1.0
        found, _, _ = export("settings")
        self.assertEqual((found["settings"]["size"], found["camera"]["frames"]), ([200, 100], 3))
        self.near([found["settings"]["fps"], found["settings"]["exposure"]], [30.0 / 1.001, 4.0])
        self.assertEqual((found["settings"]["tone"], found["settings"]["bounces"]), ("srgb", 8))
        scene.view_settings.view_transform = "AgX"
        self.noted(export("settings")[1], "AgX", "filmic")

    def test_everything_at_once(self):
        import round_trip

        scene = round_trip.every_material()
        for i, kind in enumerate(("POINT", "SPOT", "SUN")):
            stage.light(kind, kind, (i - 1.0, -1.0, 4.0), energy=2.0)
        scene.camera.data.dof.use_dof = True
        found, _, _ = export("everything")
        self.assertEqual(len(found["light"]), 4)
        self.assertEqual(len(found["mesh"]), 11)


class AddOn(Case):
    def test_the_operator_writes_the_folder_of_its_file_and_reports(self):
        import tweenray_export

        stage.fresh()
        stage.place("floor", stage.plane(material=stage.principled("p", Sheen_Weight=0.5)))
        tweenray_export.register()
        try:
            folder = os.path.join(FOLDER, "operator")
            done = bpy.ops.export_scene.tweenray(filepath=os.path.join(folder, "scene.toml"))
        finally:
            tweenray_export.unregister()
        self.assertEqual(done, {"FINISHED"})
        with open(os.path.join(folder, "report.txt"), encoding="utf-8") as file:
            self.assertIn("p: sheen: none", file.read())

    def test_the_operator_reports_what_blender_refuses(self):
        import tweenray_export

        scene = stage.fresh(4, 4)
        scene.render.resolution_percentage = 1
        tweenray_export.register()
        try:
            with self.assertRaises(RuntimeError) as raised:
                bpy.ops.export_scene.tweenray(filepath=os.path.join(FOLDER, "refused", "scene.toml"))
        finally:
            tweenray_export.unregister()
        self.assertNotIn("Traceback", str(raised.exception))

    def test_text_and_curves_are_placed_once(self):
        scene = stage.fresh()
        text = bpy.data.curves.new("words", "FONT")
        text.body, text.extrude = "tw", 0.1
        stage.place("words", text)
        kept = bpy.data.collections.new("kept")
        kept.objects.link(bpy.data.objects.new("inside", text))
        empty = stage.place("collection", None, (0.0, 5.0, 0.0))
        empty.instance_type, empty.instance_collection = "COLLECTION", kept
        ring = bpy.data.curves.new("ring", "CURVE")
        ring.dimensions, ring.bevel_depth = "3D", 0.1
        ring.splines.new("POLY").points.add(3)
        for point, at in zip(ring.splines[0].points, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 1)]):
            point.co = (*at, 1.0)
        stage.place("ring", ring)
        drop = bpy.data.metaballs.new("drop")
        drop.elements.new()
        stage.place("drop", drop)
        found, _, folder = export("curves")
        self.assertEqual(sorted(mesh["name"] for mesh in found["mesh"]), ["drop", "inside", "ring", "words"])
        for mesh in found["mesh"]:
            self.assertGreater(len(ply(os.path.join(folder, mesh["file"]))[2]), 10)

    def test_values_are_those_of_the_first_frame_wherever_the_file_stands(self):
        scene = stage.fresh(frames=9)
        material = stage.diffuse("changing", (1.0, 0.0, 0.0))
        colour = material.node_tree.nodes["Diffuse BSDF"].inputs["Color"]
        block = stage.place("vanishing", stage.cube(material=material))
        for frame, value, hidden in ((1, (0.0, 0.0, 1.0, 1.0), False), (9, (1.0, 0.0, 0.0, 1.0), True)):
            colour.default_value, block.hide_render = value, hidden
            colour.keyframe_insert("default_value", frame=frame)
            block.keyframe_insert("hide_render", frame=frame)
            scene.view_settings.exposure = float(frame - 1)
            scene.keyframe_insert("view_settings.exposure", frame=frame)
        scene.frame_set(9)
        found, lines, _ = export("changing")
        self.near(found["material"]["changing"]["diffuse"], [0.0, 0.0, 1.0])
        self.assertNotIn("exposure", found["settings"])
        self.noted(lines, "changing", "animated", "frame 1")
        self.noted(lines, "vanishing", "disappears")
        self.noted(lines, "Scene", "animated settings")
        self.assertEqual(scene.frame_current, 9)

    def test_materials_of_libraries_are_told_from_those_of_the_same_name(self):
        stage.fresh()
        library = os.path.join(FOLDER, "library.blend")
        block = stage.place("linked", stage.cube(material=stage.diffuse("paint", (1.0, 0.0, 0.0))))
        bpy.data.libraries.write(library, {block})
        scene = stage.fresh()
        stage.place("own", stage.cube(material=stage.diffuse("paint", (0.0, 0.0, 1.0))))
        with bpy.data.libraries.load(library, link=True) as (inside, loaded):
            loaded.objects = ["linked"]
        scene.collection.objects.link(loaded.objects[0])
        found, _, _ = export("library")
        for name, colour in (("own", [0.0, 0.0, 1.0]), ("linked", [1.0, 0.0, 0.0])):
            [mesh] = meshes(found, name)
            self.near(found["material"][mesh["material"]]["diffuse"], colour)

    def test_what_the_scene_has_and_tweenray_has_not_is_noted(self):
        scene = stage.fresh(100, 300)
        render, layer = scene.render, scene.view_layers[0]
        render.resolution_percentage, render.film_transparent, render.use_freestyle = 29, True, True
        scene.cycles.diffuse_bounces = 4
        scene.world.cycles_visibility.camera = False
        scene.camera.data.clip_start, scene.camera.data.clip_end = 8.0, 9.0
        layer.material_override = stage.diffuse("all", (1, 1, 1))
        kept = bpy.data.collections.new("cut out")
        scene.collection.children.link(kept)
        layer.layer_collection.children["cut out"].holdout = True
        stage.place("floor", stage.plane())
        found, lines, _ = export("settings")
        self.assertEqual(found["settings"]["size"], [29, 87])
        scene.sequence_editor_create().strips.new_effect("colour", "COLOR", 1, 1, length=10)
        self.noted(export("strips")[1], "strips of the video sequencer")
        for words in (("transparent film",), ("Freestyle",), ("surface to surface",), ("invisible to the camera",), ("clip start 8",), ("clip end 9",), ("material override",), ("cut out", "holdout")):
            self.noted(lines, *words)
        self.assertTrue(render.use_freestyle)
