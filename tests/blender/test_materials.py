"""Materials and their images."""

import math
import os

import bpy
import numpy as np

from common import FOLDER, Case, export, ply

import stage


def light_of(code):
    """Linear light of an sRGB code above 0.04."""
    return ((code + 0.055) / 1.055) ** 2.4


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
        self.near(table["glass"]["roughness"], 0.3)
        table, _ = self.of(lambda: stage.principled("p", Transmission_Weight=0.25, Base_Color=(0.25, 1.0, 1.0)))
        p = table["principled"]
        self.near([p["transmission"], *p["tint"]], [0.25, 0.5, 1.0, 1.0])
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

    def test_the_tint_of_reflection_is_a_colour_or_an_image(self):
        table, lines = self.of(lambda: stage.principled("p", Specular_Tint=(1.0, 0.5, 0.25)))
        self.near(table["principled"]["specular_colour"], [1.0, 0.5, 0.25])
        self.assertEqual(lines, [])
        for inputs, what in (({"Metallic": 0.5}, "metal"), ({"Transmission_Weight": 0.5}, "glass"), ({"Transmission_Weight": 1.0}, "glass")):
            _, lines = self.of(lambda: stage.principled("p", Specular_Tint=(1.0, 0.5, 0.25), **inputs))
            self.noted(lines, "p", f"specular tint of {what}")
        link = lambda tree, node, shader: tree.links.new(node.outputs["Color"], shader.inputs["Specular Tint"])
        table, lines = self.of(lambda: self.mapped("t", "sRGB", np.ones((2, 2, 4), dtype=np.float32), link))
        self.assertTrue(os.path.exists(os.path.join(self.folder, table["principled"]["specular_texture"])))
        self.assertEqual(lines, [])

    def test_emission_from_an_image(self):
        def link(tree, node, shader):
            tree.links.new(node.outputs["Color"], shader.inputs["Emission Color"])
            shader.inputs["Emission Strength"].default_value = 3.0

        pixels = np.ones((2, 2, 4), dtype=np.float32)
        table, lines = self.of(lambda: self.mapped("t", "sRGB", pixels, link))
        self.near(table["emission"], [3.0] * 3)
        self.assertTrue(os.path.exists(os.path.join(self.folder, table["emission_texture"])))
        self.assertEqual((table["emits_back"], lines), (True, []))

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
            tree.links.new(channels.outputs["Red"], shader.inputs["Coat Weight"])
            tree.links.new(channels.outputs["Green"], shader.inputs["Coat Roughness"])
            tree.links.new(normal.outputs["Normal"], shader.inputs["Coat Normal"])

        table, lines = self.of(lambda: self.mapped("t", "Non-Color", grey, link))
        self.assertEqual(table["principled"]["roughness"]["channel"], "g")
        self.assertEqual(table["principled"]["metallic"]["channel"], "b")
        coat = [table["principled"][key]["channel"] for key in ("clearcoat", "clearcoat_roughness")]
        self.assertEqual(coat, ["r", "g"])
        self.assertEqual(table["normal_map"]["strength"], 0.5)
        self.assertEqual(table["principled"]["clearcoat_normal_map"], table["normal_map"])
        files = {table["alpha"], table["normal_map"]["file"], table["principled"]["roughness"]["file"]}
        self.assertEqual(len(files), 1)
        self.noted(lines, "t", "cut-outs")

    def test_a_coat_whose_image_is_missing_has_no_normals(self):
        """Scene files refuse normals of a coat that is not there."""
        def link(tree, node, shader):
            lost = tree.nodes.new("ShaderNodeTexImage")
            lost.image = bpy.data.images.new("lost", 2, 2)
            lost.image.source, lost.image.filepath = "FILE", "//no-such-file.png"
            tree.links.new(lost.outputs["Color"], shader.inputs["Coat Weight"])
            normal = tree.nodes.new("ShaderNodeNormalMap")
            tree.links.new(node.outputs["Color"], normal.inputs["Color"])
            tree.links.new(normal.outputs["Normal"], shader.inputs["Coat Normal"])

        pixels = np.full((2, 2, 4), 0.5, dtype=np.float32)
        table, lines = self.of(lambda: self.mapped("t", "Non-Color", pixels, link))
        self.assertEqual(table["principled"].get("clearcoat", 0.0), 0.0)
        self.assertNotIn("clearcoat_normal_map", table["principled"])
        self.noted(lines, "lost", "no pixels")

    def test_images_lie_by_the_uv_maps_that_they_name(self):
        def link(tree, node, shader):
            tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
            other = tree.nodes.new("ShaderNodeTexImage")
            other.image = node.image
            place = tree.nodes.new("ShaderNodeUVMap")
            place.uv_map = "Second"
            tree.links.new(place.outputs["UV"], other.inputs["Vector"])
            tree.links.new(other.outputs["Color"], shader.inputs["Roughness"])

        grey = np.full((2, 2, 4), 0.5, dtype=np.float32)
        stage.fresh()
        data = stage.plane(material=self.mapped("two", "Non-Color", grey, link))
        second = data.uv_layers.new(name="Second")
        turned = [(1.0, 0.0), (1.0, 2.0), (0.0, 2.0), (0.0, 0.0)]
        for loop, uv in zip(second.uv, turned):
            loop.vector = uv
        stage.place("floor", data)
        found, lines, folder = export("uv-sets")
        p = found["material"]["two"]["principled"]
        # Plainly by the active map.
        self.assertIsInstance(p["base_texture"], str)
        self.assertEqual((p["roughness"]["uv_set"], lines), (1, []))
        columns, rows, _ = ply(os.path.join(folder, found["mesh"][0]["file"]))
        self.assertEqual(columns[6:], ["s", "t", "s1", "t1"])
        pairs = {tuple(row[6:8]): tuple(row[8:10]) for row in rows.tolist()}
        self.assertEqual(pairs, dict(zip([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], turned)))

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

    def test_attributes_that_a_mesh_has_not_as_its_material_wants_them_are_noted(self):
        def painted(name, colours, uv_map):
            material = stage.principled(name)
            nodes, links = material.node_tree.nodes, material.node_tree.links
            shader, node, image, place = (nodes["Principled BSDF"], *(nodes.new(f"ShaderNode{kind}") for kind in ("VertexColor", "TexImage", "UVMap")))
            node.layer_name, place.uv_map = colours, uv_map
            image.image = stage.picture(f"{name}-image", np.full((2, 2, 4), 0.5, dtype=np.float32), "Non-Color")
            links.new(node.outputs["Color"], shader.inputs["Base Color"])
            links.new(place.outputs["UV"], image.inputs["Vector"])
            links.new(image.outputs["Color"], shader.inputs["Roughness"])
            return material

        stage.fresh()
        data = stage.mesh("bare", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], painted("p", "faces", "vectors"))
        data.attributes.new("faces", "FLOAT_COLOR", "FACE")
        data.attributes.new("vectors", "FLOAT_VECTOR", "CORNER")
        stage.place("bare", data)
        stage.place("floor", stage.plane(material=painted("q", "lost", "gone")))
        _, lines, _ = export("attributes")
        self.noted(lines, "bare", "the colour attribute faces", "FLOAT_COLOR", "FACE")
        self.noted(lines, "bare", "the UV map vectors", "FLOAT_VECTOR", "no texture coordinates")
        self.noted(lines, "floor", "the colour attribute lost, which it has not")
        self.noted(lines, "floor", "the UV map gone, which it has not", "active one")

    def test_group_sockets_of_one_name_are_told_apart(self):
        def grouped():
            tree = bpy.data.node_groups.new("group", "ShaderNodeTree")
            for kind in ("INPUT", "INPUT", "OUTPUT"):
                tree.interface.new_socket("Color", in_out=kind, socket_type="NodeSocketColor")
            ends = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
            tree.links.new(ends[0].outputs[1], ends[1].inputs[0])
            material = stage.diffuse("d", (1.0, 1.0, 1.0))
            nodes = material.node_tree.nodes
            group = nodes.new("ShaderNodeGroup")
            group.node_tree = tree
            group.inputs[0].default_value, group.inputs[1].default_value = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0)
            material.node_tree.links.new(group.outputs[0], nodes["Diffuse BSDF"].inputs["Color"])
            return material

        self.near(self.of(grouped)[0]["diffuse"], [0.0, 1.0, 0.0])

    def test_alpha_counts_as_cycles_counts_it(self):
        def painted(alpha_mode, is_cut=False):
            def made():
                image = bpy.data.images.new("half", 1, 1, alpha=True)
                image.pixels[:] = [1.0, 1.0, 1.0, 0.5]
                image.pack()
                image.alpha_mode = alpha_mode
                material = stage.principled("p")
                nodes, links = material.node_tree.nodes, material.node_tree.links
                texture = nodes.new("ShaderNodeTexImage")
                texture.image = image
                links.new(texture.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
                if is_cut:
                    links.new(texture.outputs["Alpha"], nodes["Principled BSDF"].inputs["Alpha"])
                return material

            return made

        def shown(table):
            file = table["principled"]["base_texture"]
            return bpy.data.images.load(os.path.join(self.folder, file)).pixels[0]

        # Its codes count times its alpha where no node takes that.
        self.near(shown(self.of(painted("STRAIGHT"))[0]), light_of(128.0 / 255.0), 0.01)
        table, _ = self.of(painted("STRAIGHT", True))
        self.near(shown(table), 1.0, 0.01)
        self.assertIn("alpha", table)
        table, _ = self.of(painted("NONE", True))
        self.near(shown(table), 1.0, 0.01)
        self.assertNotIn("alpha", table)

    def written(self, file, channels=4):
        """The numbers of a file as it stores them, (rows, columns, channels), row 0 at the bottom."""
        image = bpy.data.images.load(os.path.join(self.folder, file))
        image.colorspace_settings.name = "Non-Color"
        width, height = image.size
        return np.array(image.pixels[:]).reshape(height, width, 4)[..., :channels]

    def of_16_bits(self, colour_space, pixels, to, alpha_to=None):
        """A principled material whose input `to` shows a PNG of 16 bits that holds `pixels`."""
        from tweenray_export.images import png

        def link(tree, node, shader):
            path = os.path.join(FOLDER, "sixteen.png")
            with open(path, "wb") as file:
                file.write(png(np.rint(65535.0 * pixels).astype(">u2")))
            node.image = bpy.data.images.load(path)
            node.image.colorspace_settings.name = colour_space
            tree.links.new(node.outputs["Color"], shader.inputs[to])
            shader.inputs["Emission Strength"].default_value = 1.0
            if alpha_to:
                tree.links.new(node.outputs["Alpha"], shader.inputs[alpha_to])

        return self.of(lambda: self.mapped("t", "sRGB", pixels, link))

    def test_16_bits_of_linear_colours_become_floats(self):
        pixels = np.ones((1, 2, 4), dtype=np.float32)
        pixels[0, 0, :3] = (0.2, 0.6, 0.0)
        linear = [[(0.2, 0.6, 0.0), (1.0, 1.0, 1.0)]]
        decoded = [[(light_of(0.2), light_of(0.6), 0.0), (1.0, 1.0, 1.0)]]
        for space, light in (("Non-Color", linear), ("Linear Rec.709", linear), ("sRGB", decoded)):
            table, lines = self.of_16_bits(space, pixels, "Base Color")
            file = table["principled"]["base_texture"]
            self.assertEqual((file[-4:], lines), (".exr", []))
            self.near(self.written(file, 3), light, 1e-3)
            table, _ = self.of_16_bits(space, pixels, "Emission Color")
            self.near(self.written(table["emission_texture"], 3), light, 1e-3)
        table, lines = self.of_16_bits("Non-Color", pixels, "Roughness")
        self.assertEqual((table["principled"]["roughness"]["file"][-4:], lines), (".png", []))

    def test_16_bits_are_as_bright_where_a_node_takes_their_alpha(self):
        pixels = np.full((1, 2, 4), 0.6, dtype=np.float32)
        table, _ = self.of_16_bits("sRGB", pixels, "Base Color", "Alpha")
        self.near(self.written(table["principled"]["base_texture"], 3), np.full((1, 2, 3), light_of(0.6)), 1e-3)
        # Else the code 0.36 is shown, as in Cycles.
        table, _ = self.of_16_bits("sRGB", pixels, "Base Color")
        self.near(self.written(table["principled"]["base_texture"], 3), np.full((1, 2, 3), light_of(0.36)), 1e-3)

    def test_alpha_leaves_images_of_numbers_alone(self):
        pixels = np.full((1, 1, 4), 0.5, dtype=np.float32)
        link = lambda tree, node, shader: tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
        table, _ = self.of(lambda: self.mapped("t", "Non-Color", pixels, link))
        self.near(self.written(table["principled"]["base_texture"], 3), [[[128.0 / 255.0] * 3]], 1e-3)

    def test_vertex_colours_of_numbers_are_reported(self):
        inputs = {"Alpha": 1.0, "Metallic": 0.25, "Roughness": 0.5, "Transmission Weight": 0.0}

        def made():
            material = stage.principled("v", Metallic=0.25)
            tree = material.node_tree
            node = tree.nodes.new("ShaderNodeVertexColor")
            for name in inputs:
                tree.links.new(node.outputs["Color"], tree.nodes["Principled BSDF"].inputs[name])
            return material

        table, lines = self.of(made)
        for name in inputs:
            self.noted(lines, "v", f"{name} from the node", "VERTEX_COLOR", "own value")
        self.near([table["principled"][key] for key in ("metallic", "roughness")], [0.25, 0.5])
        self.assertNotIn("transmission", table["principled"])

    def test_masks_cut_by_the_grey_that_blender_sees(self):
        pixels = np.ones((1, 4, 4), dtype=np.float32)
        pixels[0, :, :3] = [(0.6, 0.6, 0.6), (1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (1.0, 1.0, 1.0)]
        pixels[0, 3, 3] = 0.0
        # Code 0.6 is less than half the light, and what is transparent is black.
        grey = [light_of(0.6), 1.0, 0.2126, 0.0]

        def cut(tree, node, shader):
            tree.links.new(node.outputs["Color"], shader.inputs["Alpha"])

        def mixed(tree, node, shader):
            mix, clear = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfTransparent")
            out = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
            for one, other in ((node.outputs["Color"], 0), (clear.outputs[0], 1), (shader.outputs[0], 2)):
                tree.links.new(one, mix.inputs[other])
            tree.links.new(mix.outputs[0], out.inputs["Surface"])

        for link in (cut, mixed):
            table, lines = self.of(lambda: self.mapped("t", "sRGB", pixels, link))
            self.near(self.written(table["alpha"])[0, :, 0], grey, 2e-3)
            self.near(self.written(table["alpha"])[0, :, 3], [1.0] * 4)
            self.noted(lines, "cut-outs")

        def red(tree, node, shader):
            channels = tree.nodes.new("ShaderNodeSeparateColor")
            tree.links.new(node.outputs["Color"], channels.inputs[0])
            tree.links.new(channels.outputs["Red"], shader.inputs["Alpha"])

        table, _ = self.of(lambda: self.mapped("t", "sRGB", pixels, red))
        self.near(self.written(table["alpha"])[0, :, 0], [grey[0], 1.0, 1.0, 0.0], 2e-3)

    def test_an_opaque_image_cuts_nothing(self):
        """Scene files would cut by its colours."""
        black = np.zeros((2, 2, 4), dtype=np.float32)
        black[..., 3] = 1.0
        link = lambda tree, node, shader: tree.links.new(node.outputs["Alpha"], shader.inputs["Alpha"])
        table, lines = self.of(lambda: self.mapped("t", "sRGB", black, link))
        self.assertNotIn("alpha", table)
        self.assertEqual(lines, [])

        def lost(tree, node, shader):
            node.image = bpy.data.images.new("lost", 2, 2)
            node.image.source, node.image.filepath = "FILE", "//no-such-file.png"
            link(tree, node, shader)

        table, lines = self.of(lambda: self.mapped("t", "sRGB", black, lost))
        self.assertNotIn("alpha", table)
        self.noted(lines, "lost", "no pixels")

    def normals(self, scale, turn, pixels, extension="REPEAT"):
        """(table, report) of a normal map below a Mapping node."""
        def link(tree, node, shader):
            mapping, place, normal = (tree.nodes.new(kind) for kind in ("ShaderNodeMapping", "ShaderNodeTexCoord", "ShaderNodeNormalMap"))
            mapping.inputs["Scale"].default_value, mapping.inputs["Rotation"].default_value = (*scale, 1.0), (0.0, 0.0, turn)
            tree.links.new(place.outputs["UV"], mapping.inputs["Vector"])
            tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
            tree.links.new(node.outputs["Color"], normal.inputs["Color"])
            tree.links.new(normal.outputs["Normal"], shader.inputs["Normal"])
            node.extension = extension

        return self.of(lambda: self.mapped("t", "Non-Color", pixels, link))

    def test_normals_keep_to_the_uv_map_below_a_mapping_node(self):
        pixels = np.ones((1, 1, 4), dtype=np.float32)
        pixels[0, 0, :3] = np.array([204.0, 153.0, 230.0]) / 255.0
        x, y = 0.6, 0.2
        # Along the axes of an image that lies so. Of quarter turns and mirrored axes it is exact, whatever the UV map.
        cases = [((1.0, 1.0), 0.0, (x, y), 0), ((2.0, 3.0), 0.0, (x, y), 0), ((1.0, -1.0), 0.0, (x, -y), 0), ((-1.0, 1.0), 0.0, (-x, y), 0)]
        cases += [((-2.0, -3.0), 0.0, (-x, -y), 0), ((1.0, 1.0), 0.5 * math.pi, (-y, x), 0)]
        c, s = math.cos(0.5), math.sin(0.5)
        cases += [((1.0, 1.0), 0.5, (c * x - s * y, s * x + c * y), 1), ((-2.0, 2.0), 0.5, (-c * x - s * y, -s * x + c * y), 1)]
        for scale, turn, expected, notes in cases:
            table, lines = self.normals(scale, turn, pixels)
            found = 2.0 * self.written(table["normal_map"]["file"])[0, 0, :3] - 1.0
            self.near(found, [*expected, 2.0 * 230.0 / 255.0 - 1.0], 1e-3)
            self.assertEqual(len(lines), notes, lines)
        self.noted(lines, "t", "normal map", "turned")
        _, lines = self.normals((1.0, 1.0), 0.0, pixels, "MIRROR")
        self.noted(lines, "t", "normal map", "mirrored at its edges")

    def test_how_an_image_node_looks_up_is_reported(self):
        def closest(node):
            node.interpolation = "Closest"

        def moved(node):
            node.texture_mapping.translation = (0.5, 0.0, 0.0)

        def mapped(node):
            node.id_data.links.new(node.id_data.nodes.new("ShaderNodeMapping").outputs["Vector"], node.inputs["Vector"])

        for change, word in ((closest, "interpolation Closest"), (moved, "texture mapping"), (mapped, "texture coordinates from Mapping")):
            def link(tree, node, shader):
                tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
                change(node)

            _, lines = self.of(lambda: self.mapped("t", "sRGB", np.ones((2, 2, 4), dtype=np.float32), link))
            self.assertEqual(len(lines), 1, lines)
            self.noted(lines, "t", word)

    def test_factors_above_1_are_multiplied_into_images(self):
        def multiplied(tree, one, factor):
            mix = tree.nodes.new("ShaderNodeMix")
            mix.data_type, mix.blend_type, mix.inputs["Factor"].default_value = "RGBA", "MULTIPLY", 1.0
            a, b = [s for s in mix.inputs if s.enabled and s.type == "RGBA"]
            b.default_value = (*factor, 1.0)
            tree.links.new(one, a)
            return next(s for s in mix.outputs if s.enabled)

        pixels = np.ones((1, 1, 4), dtype=np.float32)
        pixels[..., :3] = (51.0 / 255.0, 102.0 / 255.0, 204.0 / 255.0)

        def coloured(factor):
            return lambda tree, node, shader: tree.links.new(multiplied(tree, node.outputs["Color"], factor), shader.inputs["Base Color"])

        table, lines = self.of(lambda: self.mapped("t", "Non-Color", pixels, coloured((0.5, 2.0, 1.0))))
        p = table["principled"]
        self.near(p["base_colour"], [1.0] * 3)
        self.near(self.written(p["base_texture"])[0, 0, :3], [0.1, 0.8, 0.8], 1e-3)
        self.assertEqual(lines, [])
        _, lines = self.of(lambda: self.mapped("t", "Non-Color", pixels, coloured((0.5, 2.0, 2.0))))
        self.noted(lines, "t-image", "above 1")

        def metal(tree, node, shader):
            math_node = tree.nodes.new("ShaderNodeMath")
            math_node.operation, math_node.inputs[1].default_value = "MULTIPLY", 3.0
            tree.links.new(node.outputs["Color"], math_node.inputs[0])
            tree.links.new(math_node.outputs[0], shader.inputs["Metallic"])

        pixels[..., :3] = 51.0 / 255.0
        metallic = self.of(lambda: self.mapped("t", "Non-Color", pixels, metal))[0]["principled"]["metallic"]
        self.near([self.written(metallic["file"])[0, 0, 1], metallic.get("factor", 1.0)], [0.6, 1.0], 1e-3)

        def painted():
            material = stage.principled("v")
            tree = material.node_tree
            node = tree.nodes.new("ShaderNodeVertexColor")
            tree.links.new(multiplied(tree, node.outputs["Color"], (3.0, 3.0, 3.0)), tree.nodes["Principled BSDF"].inputs["Base Color"])
            return material

        _, lines = self.of(painted)
        self.noted(lines, "v", "factor above 1 of vertex colours")

    def test_what_has_no_material_is_blenders_default(self):
        stage.fresh()
        stage.place("floor", stage.plane())
        found, _, _ = export("default")
        self.near(found["material"]["tweenray_default"]["principled"]["base_colour"], [0.8] * 3)
