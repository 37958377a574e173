"""The world: one colour, an image of the sky, or whatever else its nodes are, rendered once into an image by Cycles."""

import math
import os
import tempfile

import bpy
import numpy as np

from .nodes import Place
from .report import is_animated
from .values import Reader, has_alpha

# Size of the image that a world of other nodes is rendered to, and samples a pixel.
SIZE, SAMPLES = (2048, 1024), 32


class World:
    """The `[sky]` of a scene. `prepare` is called before the scene is evaluated, since it renders."""

    def __init__(self, images, report):
        self.images, self.report = images, report

    def prepare(self, scene):
        """The `[sky]` table, or None where it is black."""
        world = scene.world
        if world is None:
            return None
        if is_animated(world) or is_animated(world.node_tree):
            self.report.add(world.name, "the world is animated", f"as at frame {scene.frame_start}")
        if not world.cycles_visibility.camera:
            self.report.add(world.name, "a world that is invisible to the camera", "it is seen")
        for ray in ("diffuse", "glossy", "transmission"):
            if not getattr(world.cycles_visibility, ray):
                self.report.add(world.name, f"a world that is invisible to {ray} rays", "they see it too")
        if world.node_tree is None:
            return self.constant(list(world.color))
        if world.node_tree.get_output_node("CYCLES") is None:
            return None
        copy = world.copy()
        # A world that the camera does not see would be rendered black.
        copy.cycles_visibility.camera = True
        # The values are those of the first frame, and the scene that renders the image stands at another.
        for block in (copy, copy.node_tree):
            block.animation_data_clear()
        try:
            return self.of_nodes(copy, world.name)
        finally:
            bpy.data.worlds.remove(copy)

    def of_nodes(self, world, name):
        """The table of a world that may be changed, and that the report calls `name`."""
        out = world.node_tree.get_output_node("CYCLES")
        if Place(out.inputs["Volume"]).fed() is not None:
            self.report.add(name, "the volume of the world", "none")
            # The volume would hide the surface in a rendered image.
            for link in list(out.inputs["Volume"].links):
                world.node_tree.links.remove(link)
        surface = Place(out.inputs["Surface"])
        rays = light_paths(surface)
        if rays:
            if "Is Camera Ray" in rays and hide_from_lights(world.node_tree):
                self.report.add(name, "what the camera alone sees of the world (Is Camera Ray)", "the camera sees the world that lights")
            if light_paths(surface):
                self.report.add(name, "nodes of the world that depend on the ray (Light Path)", "light and reflections have what a ray of the camera sees")
        fed = chosen(surface.fed())
        if fed is None:
            return None
        if fed.kind == "BACKGROUND":
            found = self.background(name, fed)
            if found is not False:
                return found
        return self.rendered(world, name)

    def background(self, name, fed):
        """The table of a background of one colour or image; False where it is another."""
        reader = Reader(name, self.report)
        strength, source = reader.of_place(fed.input("Strength")), fed.input("Color").fed()
        if strength is None or not strength.is_constant():
            return False
        factor = strength.grey()
        colour = reader.of_place(fed.input("Color"))
        if colour is not None and colour.is_constant():
            return self.constant([c * factor for c in colour.rgb()])
        if source is None or source.kind != "TEX_ENVIRONMENT" or source.node.image is None or factor <= 0.0:
            return None if factor == 0.0 else False
        turn = self.turn(source.input("Vector"), reader)
        if turn is None or source.node.projection != "EQUIRECTANGULAR":
            return False
        file = self.images.colour(source.node.image, has_alpha(source.node.image))
        # The middle of Blender's image is seen along +x, of tweenray's along -z.
        table = {"image": file, "rotate": (-90.0 - turn) % 360.0}
        return None if file is None else table | ({} if factor == 1.0 else {"strength": factor})

    @staticmethod
    def turn(place, reader):
        """By how many degrees the direction is turned about Blender's z before the image is looked up; None where it
        is more than turned so."""
        fed = place.fed()
        if fed is None or (fed.kind == "TEX_COORD" and fed.output.name == "Generated"):
            return 0.0
        if fed.kind != "MAPPING":
            return None
        before = fed.input("Vector").fed()
        rotation, scale = (reader.of_place(fed.input(name)) for name in ("Rotation", "Scale"))
        if before is None or before.kind != "TEX_COORD" or before.output.name != "Generated":
            return None
        if rotation is None or scale is None or not (rotation.is_constant() and scale.is_constant()):
            return None
        place = fed.input("Location")
        move = reader.of_place(place) if place is not None and fed.node.vector_type in ("POINT", "TEXTURE") else None
        is_moved = move is not None and (not move.is_constant() or any(move.constant))
        angles = list(rotation.constant)
        if is_moved or angles[0] or angles[1] or any(s != 1.0 for s in scale.constant):
            return None
        return math.degrees(-angles[2] if fed.node.vector_type == "TEXTURE" else angles[2])

    @staticmethod
    def constant(rgb):
        """A sky of one colour."""
        rgb = [max(float(c), 0.0) for c in rgb]
        return {"radiance": rgb} if max(rgb) > 0.0 else None

    def rendered(self, world, name):
        """The table of an image of the world, which Cycles renders."""
        self.report.add(name, "nodes of the world", f"an image of {SIZE[0]} x {SIZE[1]} that Cycles rendered of it")
        pixels = panorama(world)
        if not np.isfinite(pixels).all() or float(pixels.max()) <= 0.0:
            self.report.add(name, "the world is black or has no finite radiance", "no sky")
            return None
        return {"image": self.images.add(name, np.maximum(pixels, 0.0))}


def light_paths(place):
    """The names of the outputs of Light Path nodes that have a say in what feeds the input at `place`."""
    ahead, known, names = [place], set(), set()
    for place in ahead:
        fed = place.fed()
        if fed is None:
            continue
        if fed.kind == "LIGHT_PATH":
            names.add(fed.output.name)
            continue
        key = fed.node.as_pointer(), tuple(group.as_pointer() for group in fed.groups)
        if key not in known:
            known.add(key)
            ahead.extend(Place(socket, fed.groups) for socket in fed.node.inputs)
    return names


def hide_from_lights(tree):
    """Puts 0 for Is Camera Ray, as it is for rays that look for light. Gives whether a node of the tree took it."""
    links = [link for link in tree.links if link.from_node.type == "LIGHT_PATH" and link.from_socket.name == "Is Camera Ray"]
    if not links:
        return False
    zero = tree.nodes.new("ShaderNodeValue")
    zero.outputs[0].default_value = 0.0
    for socket in [link.to_socket for link in links]:
        tree.links.new(zero.outputs[0], socket)
    return True


def chosen(fed):
    """The shader that a Mix Shader of the factor 0 lets through."""
    while fed is not None and fed.kind == "MIX_SHADER":
        factor = fed.input(0).fed()
        if factor is None or factor.kind != "VALUE" or factor.output.default_value != 0.0:
            break
        fed = fed.input(1).fed()
    return fed


def panorama(world):
    """Radiance of `world` by latitude and longitude, (rows, columns, 3), row 0 straight down, +y in the middle."""
    scene = bpy.data.scenes.new("tweenray world")
    data = bpy.data.cameras.new("tweenray world")
    camera = bpy.data.objects.new("tweenray world", data)
    folder = tempfile.mkdtemp()
    path = os.path.join(folder, "world.exr")
    try:
        scene.world, scene.camera = world, camera
        scene.collection.objects.link(camera)
        camera.rotation_euler = (0.5 * math.pi, 0.0, 0.0)
        data.type, data.panorama_type = "PANO", "EQUIRECTANGULAR"
        render = scene.render
        render.engine = "CYCLES"
        scene.cycles.device, scene.cycles.samples = "CPU", SAMPLES
        scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
        scene.cycles.pixel_filter_type = "BOX"
        render.resolution_x, render.resolution_y, render.resolution_percentage = *SIZE, 100
        render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
        render.filepath = path
        bpy.ops.render.render(write_still=True, scene=scene.name)
        image = bpy.data.images.load(path)
        pixels = np.empty(4 * SIZE[0] * SIZE[1], dtype=np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return pixels.reshape(SIZE[1], SIZE[0], 4)[..., :3].copy()
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.objects.remove(camera)
        bpy.data.cameras.remove(data)
        if os.path.exists(path):
            os.remove(path)
        os.rmdir(folder)
