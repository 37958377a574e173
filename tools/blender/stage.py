"""Small scenes made by script, for the tests of the exporter and for round_trip.py."""

import math

import bpy


def fresh(width=256, height=144, frames=1):
    """An empty scene with a camera, rendered by Cycles with the light paths of tweenray: no light from surface to surface."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    scene.frame_start, scene.frame_end = 1, frames
    scene.view_settings.view_transform = "Standard"
    cycles.device, cycles.samples = "CPU", 256
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.max_bounces, cycles.diffuse_bounces = 8, 0
    cycles.glossy_bounces = cycles.transmission_bounces = 8
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy = 0.0
    scene.world = bpy.data.worlds.new("World")
    background(scene, (0.0, 0.0, 0.0))
    camera = place("Camera", bpy.data.cameras.new("Camera"), (0.0, -8.0, 3.0))
    scene.camera = camera
    look_at(camera, (0.0, 0.0, 1.0))
    return scene


def background(scene, colour, strength=1.0):
    """A world of one colour."""
    node = scene.world.node_tree.nodes["Background"]
    node.inputs["Color"].default_value = (*colour, 1.0)
    node.inputs["Strength"].default_value = strength
    return node


def place(name, data, at=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), scale=(1.0, 1.0, 1.0)):
    """An object of `data` in the scene; `turn` in degrees."""
    ob = bpy.data.objects.new(name, data)
    ob.location, ob.scale = at, scale
    ob.rotation_euler = [math.radians(x) for x in turn]
    bpy.context.scene.collection.objects.link(ob)
    return ob


def look_at(ob, target):
    """Turns what looks along its -z (a camera, a light) to a point, level."""
    from mathutils import Vector

    ob.rotation_euler = (Vector(target) - ob.location).to_track_quat("-Z", "Y").to_euler()


def mesh(name, vertices, faces, material=None):
    """A mesh of faces."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    if material:
        data.materials.append(material)
    return data


def plane(name="floor", half=10.0, material=None):
    """A square about the origin, with a UV map."""
    corners = [(-half, -half, 0.0), (half, -half, 0.0), (half, half, 0.0), (-half, half, 0.0)]
    data = mesh(name, corners, [(0, 1, 2, 3)], material)
    layer = data.uv_layers.new(name="UVMap")
    for loop, uv in zip(layer.uv, [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]):
        loop.vector = uv
    return data


def ball(name="ball", radius=1.0, material=None, segments=64):
    """A smooth sphere of triangles and quads."""
    import bmesh

    build = bmesh.new()
    bmesh.ops.create_uvsphere(build, u_segments=segments, v_segments=segments // 2, radius=radius, calc_uvs=True)
    data = bpy.data.meshes.new(name)
    build.to_mesh(data)
    build.free()
    data.shade_smooth()
    if material:
        data.materials.append(material)
    return data


def cube(name="cube", half=1.0, material=None):
    """A cube about the origin."""
    import bmesh

    build = bmesh.new()
    bmesh.ops.create_cube(build, size=2.0 * half, calc_uvs=True)
    data = bpy.data.meshes.new(name)
    build.to_mesh(data)
    build.free()
    if material:
        data.materials.append(material)
    return data


def light(name, kind, at, target=None, **values):
    """A light; `values` are its properties."""
    data = bpy.data.lights.new(name, kind)
    for key, value in values.items():
        setattr(data, key, value)
    ob = place(name, data, at)
    if target is not None:
        look_at(ob, target)
    return ob


def empty_material(name):
    """A material with an output alone, its tree and the output's surface socket."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    out = tree.nodes.new("ShaderNodeOutputMaterial")
    return material, tree, out.inputs["Surface"]


def shader(name, kind, **inputs):
    """A material of one shader node; `inputs` by name, with _ for a space."""
    material, tree, out = empty_material(name)
    node = tree.nodes.new(kind)
    set_inputs(node, inputs)
    tree.links.new(node.outputs[0], out)
    return material


def set_inputs(node, inputs):
    """Sets inputs of a node by name, with _ for a space."""
    for key, value in inputs.items():
        socket = node.inputs[key.replace("_", " ")]
        socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value


def diffuse(name, colour):
    """A diffuse material."""
    return shader(name, "ShaderNodeBsdfDiffuse", Color=colour)


def principled(name, **inputs):
    """A principled material."""
    return shader(name, "ShaderNodeBsdfPrincipled", **inputs)


def picture(name, pixels, colour_space="sRGB", is_float=False):
    """An image of (rows, columns, 4) numbers, row 0 at the bottom, packed."""
    import numpy as np

    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=is_float)
    image.colorspace_settings.name = colour_space
    image.pixels.foreach_set(np.ascontiguousarray(pixels, dtype=np.float32).reshape(-1))
    image.update()
    image.pack()
    return image


def checks(rows=8, columns=8, dark=(0.2, 0.3, 0.6), bright=(0.9, 0.8, 0.3), cell=8):
    """Pixels of a chess board."""
    import numpy as np

    board = (np.arange(rows * cell)[:, None] // cell + np.arange(columns * cell)[None, :] // cell) % 2
    colours = np.array([(*dark, 1.0), (*bright, 1.0)], dtype=np.float32)
    return colours[board]
