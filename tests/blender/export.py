"""Tests of the Blender exporter: a scene for each feature, and the numbers in the files that it writes.

    python3 tests/blender/export.py FOLDER     (a Python with the module bpy; files are left in FOLDER)
"""

import math
import os
import sys
import tomllib
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "tools", "blender"))

import bpy
import numpy as np

import stage
from tweenray_export import scene as exporter

FOLDER = None


def export(name):
    """Exports the scene that is open: (scene file as tables, report's lines, folder)."""
    folder = os.path.join(FOLDER, name)
    lines = exporter.write(bpy.context.scene, folder)
    with open(os.path.join(folder, "scene.toml"), "rb") as file:
        return tomllib.load(file), lines, folder


def ply(path):
    """(names of the columns, vertices, triangles) of a binary PLY file."""
    with open(path, "rb") as file:
        data = file.read()
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode().split("\n")
    columns = [line.split()[-1] for line in lines if line.startswith("property float")]
    vertices, faces = (int(line.split()[-1]) for line in lines if line.startswith("element"))
    size = 4 * vertices * len(columns)
    rows = np.frombuffer(body[:size], "<f4").reshape(vertices, len(columns))
    triangles = np.frombuffer(body[size:], [("count", "u1"), ("at", "<i4", 3)])
    assert len(triangles) == faces and (triangles["count"] == 3).all()
    return columns, rows, triangles["at"]


def meshes(scene, name):
    """The `[[mesh]]` tables of an object."""
    return [mesh for mesh in scene.get("mesh", []) if mesh["name"] == name]


def seen_at(camera, key, point, width, height):
    """Image point (pixels, from the upper left corner) of a point of tweenray's world, by docs/camera-paths.md."""
    eye, target, up = (np.array(key.get(n, camera.get(n)), dtype=float) for n in ("eye", "target", "up"))
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    up, to = np.cross(right, forward), np.array(point, dtype=float) - eye
    high = math.tan(0.5 * math.radians(key.get("fov", camera["fov"])))
    wide = high * width / height * camera.get("pixel_aspect", 1.0)
    shift = key.get("shift", camera.get("shift", [0.0, 0.0]))
    x = to.dot(right) / to.dot(forward) / wide - 2.0 * shift[0]
    y = to.dot(up) / to.dot(forward) / high - 2.0 * shift[1]
    return 0.5 * (1.0 + x) * width, 0.5 * (1.0 - y) * height


class Case(unittest.TestCase):
    """Comparisons of lists of numbers."""

    def near(self, found, expected, tolerance=1e-5):
        found, expected = np.array(found, dtype=float), np.array(expected, dtype=float)
        self.assertEqual(found.shape, expected.shape)
        self.assertTrue(np.allclose(found, expected, rtol=tolerance, atol=tolerance), f"{found} is not {expected}")

    def noted(self, lines, *words):
        self.assertTrue(any(all(w in line for w in words) for line in lines), f"{words} not in {lines}")


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
        scene.camera.data.type = "ORTHO"
        with self.assertRaisesRegex(ValueError, "Camera: the camera's type is ORTHO"):
            export("ortho")
        scene.camera = None
        with self.assertRaisesRegex(ValueError, "no camera"):
            export("none")
        self.assertEqual(scene.render.engine, "CYCLES")


class Lights(Case):
    def one(self, kind, **values):
        stage.fresh()
        stage.light("lamp", kind, (1.0, 2.0, 3.0), **values)
        found, lines, folder = export(f"light-{kind}")
        return found, lines

    def test_area_lights_of_each_shape(self):
        found, _ = self.one("AREA", energy=50.0, shape="RECTANGLE", size=2.0, size_y=0.5)
        quad = found["light"][0]["quad"]
        self.near(np.cross(*quad["edges"]), [0.0, -1.0, 0.0])
        self.near(np.array(quad["corner"]) + 0.5 * np.sum(quad["edges"], axis=0), [1.0, 3.0, -2.0])
        self.near(quad["radiance"], [50.0 / math.pi] * 3)
        found, _ = self.one("AREA", energy=50.0, shape="DISK", size=2.0, color=(1.0, 0.5, 0.0))
        disk = found["light"][0]["disk"]
        self.near(disk["normal"], [0.0, -1.0, 0.0])
        self.near([disk["radius"], *disk["radiance"]], [1.0, *(50.0 / math.pi**2 * c for c in (1.0, 0.5, 0.0))])
        found, lines = self.one("AREA", energy=50.0, shape="ELLIPSE", size=2.0, size_y=1.0)
        self.noted(lines, "lamp", "ellipse", "16 quads")
        _, vertices, triangles = ply(os.path.join(FOLDER, "light-AREA", found["mesh"][0]["file"]))
        a, b, c = (vertices[triangles[:, k], :3].astype(float) for k in range(3))
        areas = 0.5 * np.cross(b - a, c - a)
        self.near(areas.sum(axis=0), [0.0, 0.0, -0.5 * math.pi], 1e-4)
        self.near(found["material"]["lamp_light"]["emission"], [50.0 / math.pi / (0.5 * math.pi)] * 3)
        _, lines = self.one("AREA", energy=50.0, spread=1.0)
        self.noted(lines, "lamp", "spread 57 degrees")

    def test_points_spots_and_suns(self):
        found, _ = self.one("POINT", energy=40.0, shadow_soft_size=0.0)
        point = found["light"][0]["point"]
        self.near([*point["position"], *point["intensity"]], [1.0, 3.0, -2.0] + [10.0 / math.pi] * 3)
        found, _ = self.one("POINT", energy=40.0, shadow_soft_size=0.5)
        ball = found["light"][0]["spot"]
        self.near([ball["radius"], ball["outer_angle"], ball["inner_angle"]], [0.5, 180.0, 180.0])
        stage.fresh()
        stage.light("lamp", "POINT", (0.0, 0.0, 3.0), energy=40.0, shadow_soft_size=0.5).visible_camera = True
        found = export("light-seen")[0]["light"][0]["sphere"]
        self.near(found["radiance"], [40.0 / (4.0 * math.pi**2 * 0.25)] * 3)
        found, lines = self.one("SPOT", energy=40.0, spot_size=1.2, spot_blend=1.0, shadow_soft_size=0.2)
        spot = found["light"][0]["spot"]
        self.near([spot["outer_angle"], spot["inner_angle"]], [math.degrees(0.6), 0.0], 1e-4)
        self.near(spot["direction"], [0.0, -1.0, 0.0])
        self.noted(lines, "lamp", "soft falloff")
        found, _ = self.one("SUN", energy=3.0, angle=0.1)
        sun = found["light"][0]["sun"]
        self.near([*sun["to_light"], *sun["irradiance"], sun["angle"]], [0.0, 1.0, 0.0, 3.0, 3.0, 3.0, math.degrees(0.1)])
        found, _ = self.one("SUN", energy=3.0, angle=0.0)
        self.assertIn("directional", found["light"][0])
        found, _ = self.one("POINT", energy=0.0)
        self.assertNotIn("light", found)

    def test_a_background_and_images_of_the_sky(self):
        scene = stage.fresh()
        stage.background(scene, (0.1, 0.2, 0.4), 2.0)
        self.near(export("background")[0]["sky"]["radiance"], [0.2, 0.4, 0.8])
        import round_trip

        round_trip.sky(scene, 40.0)
        sky, lines, folder = export("sky")
        self.near([sky["sky"]["rotate"], sky["sky"]["strength"]], [230.0, 2.0], 1e-4)
        self.assertTrue(os.path.getsize(os.path.join(folder, sky["sky"]["image"])) > 1000)

    def test_other_worlds_are_rendered_into_an_image(self):
        from tweenray_export import world

        size, world.SIZE = world.SIZE, (64, 32)
        try:
            scene = stage.fresh()
            tree = scene.world.node_tree
            gradient, ramp = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeSeparateXYZ")
            tree.links.new(gradient.outputs["Generated"], ramp.inputs[0])
            tree.links.new(ramp.outputs["X"], tree.nodes["Background"].inputs["Color"])
            found, lines, folder = export("nodes-sky")
        finally:
            world.SIZE = size
        self.noted(lines, "World", "rendered")
        image = bpy.data.images.load(os.path.join(folder, found["sky"]["image"]))
        pixels = np.array(image.pixels[:]).reshape(32, 64, 4)
        # Towards +x, which is right of the middle, the radiance is x; on the other side it is 0.
        self.near(pixels[16, 48, :3], [1.0] * 3, 0.02)
        self.near(pixels[16, 40, 0], math.sin(2.0 * math.pi * 8.5 / 64.0), 0.02)
        self.near(pixels[16, 16, :3], [0.0] * 3, 1e-3)


class Materials(Case):
    def of(self, material):
        stage.fresh()
        made = material()
        stage.place("floor", stage.plane(material=made))
        found, lines, folder = export("material")
        self.folder = folder
        self.assertEqual(found["mesh"][0]["material"], list(found["material"])[0])
        return found["material"][made.name], lines

    def test_principled_inputs(self):
        table, lines = self.of(lambda: stage.principled("p", Base_Color=(0.2, 0.3, 0.4), Metallic=0.5, Roughness=0.25, IOR=1.6, Coat_Weight=0.5, Coat_Roughness=0.1))
        p = table["principled"]
        self.near(p["base_colour"], [0.2, 0.3, 0.4])
        self.near([p[k] for k in ("metallic", "roughness", "ior", "clearcoat", "clearcoat_roughness")], [0.5, 0.25, 1.6, 0.5, 0.1])
        self.assertEqual(lines, [])
        table, _ = self.of(lambda: stage.principled("p", Specular_IOR_Level=0.0))
        self.assertEqual(table["principled"]["specular"], 0)
        table, _ = self.of(lambda: stage.principled("p", Specular_IOR_Level=1.0, IOR=1.5))
        self.near(table["principled"]["ior"], (1.0 + math.sqrt(0.08)) / (1.0 - math.sqrt(0.08)))
        table, lines = self.of(lambda: stage.principled("p", Subsurface_Weight=0.5, Sheen_Weight=0.1, Alpha=0.5))
        for word in ("subsurface", "sheen", "alpha 0.5"):
            self.noted(lines, "p", word)
        table, lines = self.of(lambda: stage.principled("p", Transmission_Weight=1.0, Base_Color=(0.25, 1.0, 1.0), IOR=1.3, Roughness=0.3))
        self.near([table["glass"]["ior"], *table["glass"]["tint"]], [1.3, 0.5, 1.0, 1.0])
        self.noted(lines, "p", "glass of roughness 0.3")
        table, lines = self.of(lambda: stage.principled("p", Emission_Color=(1.0, 0.5, 0.25), Emission_Strength=4.0))
        self.near(table["emission"], [4.0, 2.0, 1.0])
        self.assertTrue(table["emits_back"])

    def test_simple_shaders_and_mixes(self):
        import round_trip

        self.near(self.of(lambda: stage.diffuse("d", (0.1, 0.2, 0.3)))[0]["diffuse"], [0.1, 0.2, 0.3])
        table, _ = self.of(lambda: stage.shader("g", "ShaderNodeBsdfGlossy", Color=(0.5, 0.6, 0.7), Roughness=0.3))
        self.near([*table["mirror"], table["roughness"]], [0.5, 0.6, 0.7, 0.3])
        table, _ = self.of(lambda: stage.shader("g", "ShaderNodeBsdfGlass", Color=(0.5, 0.6, 0.7), Roughness=0.0, IOR=1.4))
        self.near([*table["glass"]["tint"], table["glass"]["ior"]], [0.5, 0.6, 0.7, 1.4])
        table, _ = self.of(lambda: stage.shader("e", "ShaderNodeEmission", Color=(0.5, 0.6, 0.7), Strength=2.0))
        self.near(table["emission"], [1.0, 1.2, 1.4])
        table, lines = self.of(lambda: round_trip.mixed("m", 0.25))
        self.near([*table["diffuse"], *table["mirror"]], [0.525, 0.225, 0.075] + [0.225] * 3)
        self.assertEqual(lines, [])
        table, lines = self.of(lambda: stage.shader("s", "ShaderNodeBsdfToon"))
        self.noted(lines, "s", "BSDF_TOON", "diffuse grey")

    def mapped(self, name, colour_space, wanted, link):
        """A principled material with a picture; `link(tree, image node, shader)` connects them."""
        material = stage.principled(name)
        tree = material.node_tree
        shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = stage.picture(f"{name}-image", wanted, colour_space)
        link(tree, node, shader)
        return material

    def test_images_with_mapping_keep_their_codes(self):
        pixels = np.ones((2, 2, 4), dtype=np.float32)
        pixels[0, 0], pixels[1, 1] = (1.0, 0.2, 0.0, 1.0), (0.0, 0.4, 0.6, 1.0)

        def link(tree, node, shader):
            mapping = tree.nodes.new("ShaderNodeMapping")
            mapping.inputs["Scale"].default_value = (2.0, 3.0, 1.0)
            mapping.inputs["Rotation"].default_value = (0.0, 0.0, 0.5)
            mapping.inputs["Location"].default_value = (0.25, 0.0, 0.0)
            place = tree.nodes.new("ShaderNodeTexCoord")
            tree.links.new(place.outputs["UV"], mapping.inputs["Vector"])
            tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
            tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
            node.extension = "EXTEND"

        table, lines = self.of(lambda: self.mapped("t", "sRGB", pixels, link))
        texture = table["principled"]["base_texture"]
        self.near([*texture["scale"], texture["rotate"], *texture["offset"]], [2.0, 3.0, math.degrees(0.5), 0.25, 0.0])
        self.assertEqual((texture["wrap"], lines), ("clamp", []))
        copy = bpy.data.images.load(os.path.join(self.folder, texture["file"]))
        self.near(np.array(copy.pixels[:]).reshape(2, 2, 4), pixels, 1.0 / 255.0)

    def test_roughness_normals_and_cut_outs_from_images(self):
        grey = np.ones((4, 4, 4), dtype=np.float32) * 0.5
        grey[..., 3] = np.arange(4) / 3.0

        def link(tree, node, shader):
            tree.links.new(node.outputs["Color"], shader.inputs["Roughness"])
            tree.links.new(node.outputs["Alpha"], shader.inputs["Alpha"])
            normal = tree.nodes.new("ShaderNodeNormalMap")
            normal.inputs["Strength"].default_value = 0.5
            tree.links.new(node.outputs["Color"], normal.inputs["Color"])
            tree.links.new(normal.outputs["Normal"], shader.inputs["Normal"])
            channels = tree.nodes.new("ShaderNodeSeparateColor")
            tree.links.new(node.outputs["Color"], channels.inputs[0])
            tree.links.new(channels.outputs["Blue"], shader.inputs["Metallic"])

        table, lines = self.of(lambda: self.mapped("t", "Non-Color", grey, link))
        self.assertEqual(table["principled"]["roughness"]["channel"], "g")
        self.assertEqual(table["principled"]["metallic"]["channel"], "b")
        self.assertEqual(table["normal_map"]["strength"], 0.5)
        files = {table["alpha"], table["normal_map"]["file"], table["principled"]["roughness"]["file"]}
        self.assertEqual(len(files), 1)
        self.noted(lines, "t", "cut-outs")

    def test_roughness_of_a_coloured_image_is_blenders_grey(self):
        colours = np.ones((2, 2, 4), dtype=np.float32)
        colours[..., :3] = (1.0, 0.0, 0.0)
        link = lambda tree, node, shader: tree.links.new(node.outputs["Color"], shader.inputs["Roughness"])
        table, _ = self.of(lambda: self.mapped("t", "Non-Color", colours, link))
        grey = bpy.data.images.load(os.path.join(self.folder, table["principled"]["roughness"]["file"]))
        grey.colorspace_settings.name = "Non-Color"
        self.near(grey.pixels[:3], [0.2126] * 3, 2e-4)

    def test_vertex_colours_and_groups(self):
        def make():
            material = stage.principled("v")
            tree = material.node_tree
            shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
            node = tree.nodes.new("ShaderNodeVertexColor")
            node.layer_name = "paint"
            tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
            group = bpy.data.node_groups.new("number", "ShaderNodeTree")
            group.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketFloat")
            value, out = group.nodes.new("ShaderNodeValue"), group.nodes.new("NodeGroupOutput")
            value.outputs[0].default_value = 0.125
            group.links.new(value.outputs[0], out.inputs[0])
            outer = tree.nodes.new("ShaderNodeGroup")
            outer.node_tree = group
            tree.links.new(outer.outputs[0], shader.inputs["Roughness"])
            return material

        stage.fresh()
        data = stage.plane(material=make())
        layer = data.color_attributes.new("paint", "FLOAT_COLOR", "POINT")
        for item, red in zip(layer.data, (0.0, 0.5, 1.0, 0.25)):
            item.color = (red, 0.0, 1.0, 1.0)
        stage.place("floor", data)
        found, lines, folder = export("colours")
        table = found["material"]["v"]
        self.assertTrue(table["vertex_colours"])
        self.near(table["principled"]["roughness"], 0.125)
        columns, rows, _ = ply(os.path.join(folder, found["mesh"][0]["file"]))
        red = rows[:, columns.index("red")]
        self.near(sorted(red), [0.0, 0.537099, 0.735357, 1.0], 1e-4)


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
        self.noted(lines, "two", "moves during the shot")
        self.assertEqual(scene.frame_current, 2)

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


if __name__ == "__main__":
    FOLDER = os.path.abspath(sys.argv.pop(1))
    unittest.main(argv=sys.argv[:1])
