"""Lights and worlds."""

import math
import os

import bpy
import numpy as np

from common import FOLDER, Case, export, ply

import stage


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

    def test_portals_and_what_light_passes_through(self):
        stage.fresh()
        stage.light("window", "AREA", (0.0, 0.0, 3.0), energy=50.0).data.cycles.is_portal = True
        softbox = stage.light("softbox", "AREA", (0.0, 0.0, 3.0), energy=50.0)
        softbox.visible_camera = softbox.visible_diffuse = False
        found, lines, _ = export("portal")
        self.assertEqual(len(found["light"]), 1)
        self.noted(lines, "window", "portal")
        self.noted(lines, "softbox", "passes through", "camera does not see", "hides")
        self.noted(lines, "softbox", "diffuse rays")

    def test_an_emission_node_colours_a_light(self):
        for kind, where in (("AREA", "radiance"), ("POINT", "intensity"), ("SPOT", "intensity"), ("SUN", "irradiance")):
            stage.fresh()
            lamp = stage.light("lamp", kind, (0.0, 0.0, 3.0), energy=10.0, color=(1.0, 0.5, 1.0)).data
            plain = export("plain-light")[0]["light"][0]
            lamp.use_nodes = True
            emission = next(node for node in lamp.node_tree.nodes if node.type == "EMISSION")
            emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (0.5, 0.25, 0.0, 1.0), 3.0
            found, lines, _ = export("coloured-light")
            [(name, entry)] = found["light"][0].items()
            self.near(entry[where], [a * b for a, b in zip(plain[name][where], (1.5, 0.75, 0.0))])
            self.assertFalse(any("nodes of the light" in line for line in lines), lines)

    def mixed_by_light_paths(self, output):
        """A scene whose world mixes a blue background and, by an output of the Light Path node, a red one."""
        scene = stage.fresh()
        stage.background(scene, (0.0, 0.0, 0.5))
        tree = scene.world.node_tree
        seen, mix, path = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Background", "MixShader", "LightPath"))
        seen.inputs["Color"].default_value = (1.0, 0.0, 0.0, 1.0)
        tree.links.new(path.outputs[output], mix.inputs[0])
        for number, node in ((1, tree.nodes["Background"]), (2, seen)):
            tree.links.new(node.outputs[0], mix.inputs[number])
        tree.links.new(mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
        return scene

    def test_the_world_that_lights_is_exported_not_the_one_that_the_camera_sees(self):
        scene = self.mixed_by_light_paths("Is Camera Ray")
        found, lines, _ = export("camera-ray")
        self.near(found["sky"]["radiance"], [0.0, 0.0, 0.5])
        self.noted(lines, "World", "Is Camera Ray", "the world that lights")
        self.assertEqual((len(lines), len(bpy.data.worlds)), (1, 1))
        # The file's own world is as it was.
        mix = next(node for node in scene.world.node_tree.nodes if node.type == "MIX_SHADER")
        self.assertEqual(mix.inputs[0].links[0].from_node.type, "LIGHT_PATH")

    def test_worlds_that_depend_on_other_rays_are_noted(self):
        from tweenray_export import world

        size, world.SIZE = world.SIZE, (16, 8)
        try:
            scene = self.mixed_by_light_paths("Is Glossy Ray")
            for ray in ("diffuse", "glossy", "transmission"):
                setattr(scene.world.cycles_visibility, ray, False)
            lines = export("glossy-ray")[1]
        finally:
            world.SIZE = size
        self.noted(lines, "World", "depend on the ray")
        for ray in ("diffuse", "glossy", "transmission"):
            self.noted(lines, "World", f"invisible to {ray} rays")

    def rendered(self, scene, name):
        """(mean of the image that Cycles renders of a world of a gradient, the report's lines)."""
        from tweenray_export import world

        tree = scene.world.node_tree
        tree.links.new(tree.nodes.new("ShaderNodeTexGradient").outputs[0], tree.nodes["Background"].inputs["Color"])
        size, world.SIZE = world.SIZE, (16, 8)
        try:
            found, lines, folder = export(name)
        finally:
            world.SIZE = size
        image = bpy.data.images.load(os.path.join(folder, found["sky"]["image"]))
        return np.mean(np.array(image.pixels[:]).reshape(-1, 4)[:, :3]), lines

    def test_a_world_that_the_camera_does_not_see_still_lights(self):
        scene = stage.fresh()
        scene.world.cycles_visibility.camera = False
        mean, lines = self.rendered(scene, "invisible-sky")
        self.assertGreater(mean, 0.1)
        self.noted(lines, "invisible to the camera")
        self.assertFalse(scene.world.cycles_visibility.camera)

    def test_the_volume_of_a_world_does_not_hide_its_surface(self):
        scene = stage.fresh()
        tree = scene.world.node_tree
        volume = tree.get_output_node("CYCLES").inputs["Volume"]
        tree.links.new(tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], volume)
        mean, lines = self.rendered(scene, "misty-sky")
        self.assertGreater(mean, 0.1)
        self.noted(lines, "the volume of the world")
        self.assertTrue(volume.is_linked)

    def test_a_light_path_that_does_not_reach_the_surface_is_not_noted(self):
        scene = self.mixed_by_light_paths("Is Glossy Ray")
        tree = scene.world.node_tree
        path = next(node for node in tree.nodes if node.type == "LIGHT_PATH")
        tree.links.new(path.outputs["Is Camera Ray"], tree.nodes.new("ShaderNodeMath").inputs[0])
        lines = self.rendered(scene, "idle-camera-ray")[1]
        self.assertFalse(any("Is Camera Ray" in line for line in lines), lines)

    def test_a_background_and_images_of_the_sky(self):
        scene = stage.fresh()
        stage.background(scene, (0.1, 0.2, 0.4), 2.0)
        self.near(export("background")[0]["sky"]["radiance"], [0.2, 0.4, 0.8])
        import round_trip

        round_trip.sky(scene, 40.0)
        sky, lines, folder = export("sky")
        self.near([sky["sky"]["rotate"], sky["sky"]["strength"]], [230.0, 2.0], 1e-4)
        self.assertTrue(os.path.getsize(os.path.join(folder, sky["sky"]["image"])) > 1000)

    def test_alpha_multiplies_an_image_of_the_sky(self):
        tree = stage.fresh().world.node_tree
        node = tree.nodes.new("ShaderNodeTexEnvironment")
        node.image = stage.picture("thin", np.full((1, 2, 4), 0.5, dtype=np.float32), "Linear Rec.709")
        tree.links.new(node.outputs["Color"], tree.nodes["Background"].inputs["Color"])
        found, _, folder = export("thin-sky")
        image = bpy.data.images.load(os.path.join(folder, found["sky"]["image"]))
        self.near(image.pixels[:3], [0.25] * 3, 0.01)

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
