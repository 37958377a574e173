"""The camera in the scene file, against what Blender projects."""

import math
import os

import bpy
import numpy as np

from common import FOLDER, Case, export, seen_at

import stage


class Cameras(Case):
    def test_lens_shift_roll_and_shape_of_pixels_are_what_blender_projects(self):
        from bpy_extras.object_utils import world_to_camera_view
        from mathutils import Vector

        scene = stage.fresh(200, 100, frames=5)
        camera, point = scene.camera, Vector((0.7, 0.4, 1.3))
        for frame, lens, shift, turn in ((1, 30.0, 0.1, (70, 20, 10)), (5, 70.0, -0.2, (80, -30, -5))):
            camera.data.lens, camera.data.shift_x, camera.data.shift_y = lens, shift, 0.5 * shift
            camera.rotation_euler = [math.radians(x) for x in turn]
            for holder, key in ((camera, "rotation_euler"), (camera.data, "lens"), (camera.data, "shift_x"), (camera.data, "shift_y")):
                holder.keyframe_insert(key, frame=frame)
        found, lines, _ = export("camera")
        self.assertEqual((found["camera"]["frames"], len(found["camera"]["keys"])), (5, 5))
        for frame, key in enumerate(found["camera"]["keys"], 1):
            scene.frame_set(frame)
            bpy.context.view_layer.update()
            x, y, _ = world_to_camera_view(scene, camera, point)
            ours = seen_at(found["camera"], key, (point.x, point.z, -point.y), 200, 100)
            self.near(ours, (200.0 * x, 100.0 * (1.0 - y)), 1e-3)
        self.assertEqual(scene.frame_current, 5)

    def test_the_active_camera_is_restored_where_markers_bind_others(self):
        scene = stage.fresh(frames=2)
        active = scene.camera
        other = active.copy()
        scene.collection.objects.link(other)
        scene.timeline_markers.new("cut", frame=1).camera = other
        scene.camera = active
        export("bound")
        self.assertEqual(scene.camera, active)
        other.data = other.data.copy()
        other.data.type = "ORTHO"
        with self.assertRaises(ValueError):
            export("bound")
        self.assertEqual(scene.camera, active)

    def test_sensor_fit_decides_the_field_of_view(self):
        for fit, width, height, tangent in (("HORIZONTAL", 200, 100, 0.25 * 36 / 50), ("VERTICAL", 200, 100, 0.5 * 24 / 50), ("AUTO", 100, 200, 0.5 * 36 / 50)):
            scene = stage.fresh(width, height)
            scene.camera.data.sensor_fit, scene.camera.data.lens = fit, 50.0
            camera = export(f"fit-{fit}")[0]["camera"]
            self.near(camera["fov"], 2.0 * math.degrees(math.atan(tangent)))
            self.near(camera["still"]["eye"], [0.0, 3.0, 8.0])
        scene.render.pixel_aspect_x = 2.0
        self.near(export("oblong")[0]["camera"]["pixel_aspect"], 2.0)

    def test_depth_of_field_has_blenders_aperture_and_focus(self):
        scene = stage.fresh(frames=3)
        camera = scene.camera.data
        camera.lens, camera.dof.use_dof, camera.dof.aperture_fstop, camera.dof.aperture_blades = 80.0, True, 2.0, 5
        for frame, focus in ((1, 3.0), (3, 9.0)):
            camera.dof.focus_distance = focus
            camera.dof.keyframe_insert("focus_distance", frame=frame)
        found = export("focus")[0]["camera"]
        self.assertEqual(found["lens"]["blades"], 5)
        self.near([key["lens"]["focus"] for key in found["keys"]], [3.0, 6.0, 9.0], 0.05)
        self.near([key["lens"]["radius"] for key in found["keys"]], [0.5e-3 * 80.0 / 2.0] * 3)
        scene = stage.fresh()
        scene.camera.data.dof.use_dof = True
        scene.camera.data.dof.focus_object = stage.place("aim", None, (0.0, 0.0, 1.0))
        self.near(export("aim")[0]["camera"]["lens"]["focus"], math.sqrt(68.0))

    def test_cameras_without_perspective_and_none_are_refused_by_name(self):
        scene = stage.fresh()
        stage.place("floor", stage.plane())
        scene.camera.data.type = "ORTHO"
        with self.assertRaisesRegex(ValueError, "Camera: the camera's type is ORTHO"):
            export("ortho")
        self.assertFalse(os.path.exists(os.path.join(FOLDER, "ortho", "meshes")))
        scene.camera = None
        with self.assertRaisesRegex(ValueError, "no camera"):
            export("none")
        self.assertEqual(scene.render.engine, "CYCLES")

    def test_a_camera_far_from_the_origin_looks_where_blenders_looks(self):
        scene = stage.fresh(frames=3)
        camera = scene.camera
        camera.location = (3e6, -4e6, 2e6)
        turn = (math.radians(80.0), 0.0)
        for frame in (1, 2, 3):
            camera.rotation_euler = (*turn, 1e-4 * frame)
            camera.keyframe_insert("location", frame=frame)
            camera.keyframe_insert("rotation_euler", frame=frame)
        found = export("far")[0]["camera"]
        for frame, key in enumerate(found["keys"], 1):
            eye, target = (np.array(key[name]) for name in ("eye", "target"))
            high, around = turn[0], 1e-4 * frame
            forward = [-math.sin(around) * math.sin(high), -math.cos(high), -math.cos(around) * math.sin(high)]
            self.near((target - eye) / np.linalg.norm(target - eye), forward, 3e-7)

    def test_a_camera_that_its_parent_shears_is_noted(self):
        scene = stage.fresh()
        parent = stage.place("parent", None, turn=(0.0, 0.0, 20.0), scale=(1.0, 1.0, 1.0))
        scene.camera.parent = parent
        self.assertEqual(export("unsheared")[1], [])
        parent.scale = (1.0, 2.0, 1.0)
        self.noted(export("sheared")[1], "Camera", "sheared")

    def test_cameras_of_markers_share_their_blades_and_need_no_active_camera(self):
        scene = stage.fresh(frames=4)
        other = stage.place("other", bpy.data.cameras.new("other"), (5.0, 0.0, 1.0))
        for frame, camera in ((1, scene.camera), (3, other)):
            scene.timeline_markers.new(camera.name, frame=frame).camera = camera
            camera.data.dof.use_dof, camera.data.dof.aperture_blades = True, 5
        scene.camera = None
        found, lines, _ = export("markers")
        self.near([key["eye"] for key in found["camera"]["keys"]], [[0.0, 3.0, 8.0]] * 2 + [[5.0, 1.0, 0.0]] * 2)
        self.assertEqual(lines, [])
        other.data.dof.aperture_blades = 7
        found, lines, _ = export("markers")
        self.assertEqual(found["camera"]["lens"]["blades"], 5)
        self.noted(lines, "Scene", "blades", "differ")
