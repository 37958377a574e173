"""Renders scenes made by script with Cycles and with tweenray, and prints how far they are apart.

    python3 tools/blender/round_trip.py TWEENRAY FOLDER [SCENE ...]      (a Python with the module bpy)

Cycles renders no light from surface to surface, as tweenray. Compared is linear radiance, clipped to [0, 1]: the root
mean square of the difference over all pixels, and over the 95 % that agree best. Each scene leaves `cycles.exr`,
`tweenray.exr` and `pair.png` (Cycles above, tweenray below it, ten times the difference at the bottom).
"""

import math
import os
import random
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy
import numpy as np

import stage
from tweenray_export import images, meshes, scene as export

# Most that 95 % of the pixels may differ by.
MOST = 0.01
SAMPLES = 256


def every_light():
    """Area lights of four shapes, point, spot with soft edge, sun, and a grey sky on a diffuse stage."""
    scene = stage.fresh()
    stage.background(scene, (0.05, 0.06, 0.08))
    white, red = stage.diffuse("white", (0.7, 0.7, 0.7)), stage.diffuse("red", (0.6, 0.1, 0.1))
    stage.place("floor", stage.plane(half=20.0, material=white))
    for x in (-3.0, -1.0, 1.0, 3.0):
        stage.place(f"cube {x}", stage.cube(half=0.4, material=red), (x, 0.0, 0.4), (0.0, 0.0, 20.0 * x))
    hard = {"use_soft_falloff": False}
    stage.light("square", "AREA", (-4.0, -2.0, 3.0), (-3.0, 0.0, 0.0), energy=60, size=0.8)
    stage.light("oblong", "AREA", (-1.5, -2.0, 3.0), (-1.0, 0.0, 0.0), energy=40, shape="RECTANGLE", size=1.5, size_y=0.3)
    stage.light("disk", "AREA", (1.0, -1.0, 3.0), (1.0, 0.0, 0.0), energy=40, shape="DISK", size=0.8, color=(1.0, 0.8, 0.5))
    ellipse = stage.light("ellipse", "AREA", (3.5, -2.0, 3.0), (3.0, 0.0, 0.0), energy=50, shape="ELLIPSE", size=1.2, size_y=0.5)
    ellipse.scale = (1.5, 1.0, 1.0)
    stage.light("ball", "POINT", (0.0, -2.5, 0.8), energy=20, shadow_soft_size=0.1, color=(0.6, 0.8, 1.0), **hard)
    stage.light("point", "POINT", (2.0, 1.5, 1.0), energy=30, shadow_soft_size=0.0)
    stage.light("spot", "SPOT", (-5.0, 3.0, 3.0), (-2.0, 1.5, 0.0), energy=400, spot_size=0.7, spot_blend=0.5, shadow_soft_size=0.1, **hard)
    stage.light("sun", "SUN", (0.0, 0.0, 5.0), energy=0.4, angle=0.05).rotation_euler = (0.6, 0.5, 0.0)
    return scene


def every_material():
    """Balls of many materials on a floor with an image, under a softbox and an image of the sky."""
    scene = stage.fresh()
    add = lambda name, ball, x, y: stage.place(name, stage.ball(name, 0.55, ball), (x, y, 0.55))
    floor, tree, out = stage.empty_material("floor")
    shader, image = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeTexImage")
    image.image = stage.picture("board", stage.checks())
    tree.links.new(image.outputs["Color"], shader.inputs["Color"])
    tree.links.new(shader.outputs[0], out)
    stage.place("floor", stage.plane(half=6.0, material=floor))
    kinds = {
        "plastic": stage.principled("plastic", Base_Color=(0.8, 0.1, 0.1), Roughness=0.3),
        "matte": stage.principled("matte", Base_Color=(0.2, 0.5, 0.8), Roughness=0.9),
        "gold": stage.principled("gold", Base_Color=(1.0, 0.77, 0.34), Metallic=1.0, Roughness=0.2),
        "steel": stage.shader("steel", "ShaderNodeBsdfGlossy", Color=(0.6, 0.6, 0.65), Roughness=0.0),
        "brushed": stage.shader("brushed", "ShaderNodeBsdfGlossy", Color=(0.6, 0.6, 0.65), Roughness=0.4),
        "glass": stage.shader("glass", "ShaderNodeBsdfGlass", Color=(0.9, 1.0, 0.9), Roughness=0.0, IOR=1.45),
        "clear": stage.principled("clear", Base_Color=(0.8, 0.9, 1.0), Roughness=0.0, Transmission_Weight=1.0),
        "coat": stage.principled("coat", Base_Color=(0.05, 0.3, 0.1), Roughness=0.6, Coat_Weight=1.0),
        "none": stage.diffuse("clay", (0.5, 0.4, 0.3)),
        "mixed": mixed("mixed", 0.3),
    }
    for i, (name, material) in enumerate(kinds.items()):
        add(name, material, -3.0 + 1.5 * (i % 5), 1.0 - 1.7 * (i // 5))
    sky(scene)
    stage.light("softbox", "AREA", (-3.0, -4.0, 5.0), (0.0, 0.0, 0.5), energy=300, size=2.0)
    return scene


def mixed(name, share):
    """Diffuse and a mirror."""
    material, tree, out = stage.empty_material(name)
    mix = tree.nodes.new("ShaderNodeMixShader")
    for i, (kind, colour) in enumerate((("ShaderNodeBsdfDiffuse", (0.7, 0.3, 0.1)), ("ShaderNodeBsdfGlossy", (0.9, 0.9, 0.9)))):
        node = tree.nodes.new(kind)
        stage.set_inputs(node, {"Color": colour, "Roughness": 0.0})
        tree.links.new(node.outputs[0], mix.inputs[i + 1])
    mix.inputs[0].default_value = share
    tree.links.new(mix.outputs[0], out)
    return material


def sky(scene, turn=40.0):
    """An image of the sky, brightest at one place, turned."""
    rows, columns = np.mgrid[0:64, 0:128]
    height, around = (rows + 0.5) / 64.0 - 0.5, (columns + 0.5) / 128.0
    pixels = np.ones((64, 128, 4), dtype=np.float32)
    glow = np.exp(-((around - 0.3) ** 2 + (0.5 * height - 0.1) ** 2) / 0.01)
    for channel, base in enumerate((0.15, 0.2, 0.3)):
        pixels[..., channel] = np.where(height > 0.0, base, 0.1) + (1.0 - 0.2 * channel) * glow
    tree = scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = stage.picture("sky", pixels, "Linear Rec.709", True)
    mapping, place = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, math.radians(turn))
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
    tree.links.new(node.outputs["Color"], tree.nodes["Background"].inputs["Color"])


def moving_camera():
    """A camera that moves and tracks an object by a constraint while it zooms and shifts; its last frame is compared."""
    scene = stage.fresh(frames=12)
    stage.background(scene, (0.2, 0.25, 0.3))
    stage.place("floor", stage.plane(half=15.0, material=stage.diffuse("floor", (0.5, 0.5, 0.5))))
    for i in range(7):
        angle = 0.9 * i
        at = (3.0 * math.cos(angle), 3.0 * math.sin(angle), 0.5)
        colour = (0.2 + 0.1 * i, 0.5, 0.8 - 0.1 * i)
        stage.place(f"cube {i}", stage.cube(half=0.5, material=stage.diffuse(f"colour {i}", colour)), at, (0, 0, 25 * i))
    aim = stage.place("aim", None, (0.5, 0.0, 0.6))
    camera = scene.camera
    track = camera.constraints.new("TRACK_TO")
    track.target, track.track_axis, track.up_axis = aim, "TRACK_NEGATIVE_Z", "UP_Y"
    camera.data.sensor_fit = "VERTICAL"
    for frame, at, lens, shift in ((1, (0.0, -9.0, 2.0), 35.0, 0.0), (12, (7.0, -4.0, 3.5), 50.0, 0.15)):
        camera.location, camera.data.lens, camera.data.shift_x, camera.data.shift_y = at, lens, shift, -shift
        camera.keyframe_insert("location", frame=frame)
        for key in ("lens", "shift_x", "shift_y"):
            camera.data.keyframe_insert(key, frame=frame)
    stage.light("sun", "SUN", (0.0, 0.0, 5.0), energy=2.0, angle=0.02).rotation_euler = (0.7, 0.3, 0.0)
    return scene


def depth_of_field():
    """Rows of bright balls through a wide aperture of six blades."""
    scene = stage.fresh()
    stage.background(scene, (0.4, 0.4, 0.45))
    stage.place("floor", stage.plane(half=30.0, material=stage.diffuse("floor", (0.25, 0.25, 0.25))))
    for i in range(12):
        colour = (0.9 - 0.07 * i, 0.3, 0.1 + 0.07 * i)
        at = (-2.5 + 0.5 * i, -5.0 + 1.3 * i, 0.3)
        stage.place(f"ball {i}", stage.ball(f"ball {i}", 0.3, stage.diffuse(f"colour {i}", colour), 32), at)
    camera = scene.camera.data
    camera.lens = 60.0
    camera.dof.use_dof, camera.dof.focus_distance = True, 8.0
    camera.dof.aperture_fstop, camera.dof.aperture_blades, camera.dof.aperture_rotation = 0.15, 6, 0.3
    stage.light("sun", "SUN", (0.0, 0.0, 5.0), energy=1.5, angle=0.01).rotation_euler = (0.7, 0.3, 0.0)
    return scene


def duplicates():
    """2,000 linked duplicates of one mesh."""
    scene = stage.fresh()
    stage.background(scene, (0.3, 0.35, 0.45))
    dice = random.Random(7)
    stage.place("floor", stage.plane(half=40.0, material=stage.diffuse("floor", (0.3, 0.35, 0.2))))
    rock = stage.ball("rock", 0.25, stage.diffuse("rock", (0.5, 0.45, 0.4)), 12)
    for i in range(2000):
        at = (dice.uniform(-12, 12), dice.uniform(-6, 30), dice.uniform(0.0, 0.2))
        size = [dice.uniform(0.4, 1.4) for _ in range(3)]
        stage.place(f"rock {i}", rock, at, (0.0, 0.0, dice.uniform(0, 360)), size)
    stage.light("sun", "SUN", (0.0, 0.0, 5.0), energy=2.5, angle=0.01).rotation_euler = (0.8, 0.4, 0.0)
    return scene


SCENES = [every_light, every_material, moving_camera, depth_of_field, duplicates]


def main(tweenray, folder, names):
    """Renders the scenes and prints the table; whether all are within the limit."""
    rows, good = [], True
    for make in SCENES:
        if names and make.__name__ not in names:
            continue
        where = os.path.join(os.path.abspath(folder), make.__name__)
        os.makedirs(where, exist_ok=True)
        scene = make()
        last = scene.frame_end
        notes = export.write(scene, where)
        ours, theirs = rendered(tweenray, where, last), cycles(scene, where, last)
        difference = np.clip(ours, 0.0, 1.0) - np.clip(theirs, 0.0, 1.0)
        squares = np.sort((difference**2).mean(axis=2).reshape(-1))
        best = math.sqrt(squares[: int(0.95 * len(squares))].mean())
        rows.append((make.__name__, math.sqrt(squares.mean()), best, notes))
        good = good and best <= MOST
        pair(where, theirs, ours, difference)
    print(f"\n| scene | RMSE | RMSE of the best 95 % | within {MOST} |\n|---|---|---|---|")
    for name, whole, best, notes in rows:
        print(f"| {name} | {whole:.4f} | {best:.4f} | {'yes' if best <= MOST else 'NO'} |")
    for name, _, _, notes in rows:
        print("".join(f"{name}: {note}\n" for note in notes), end="")
    return good


def rendered(tweenray, where, frame):
    """tweenray's picture of a frame."""
    out = os.path.join(where, "tweenray.exr")
    samples = ["--spp", str(SAMPLES), "--shadow-samples", "4", "--sky-samples", "4", "--overwrite", "--policy", "off"]
    words = [tweenray, "render", os.path.join(where, "scene.toml"), "-o", out, "--frames", str(frame), *samples]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    return read(out)


def cycles(scene, where, frame):
    """Cycles' picture of a frame."""
    out = os.path.join(where, "cycles.exr")
    scene.frame_set(frame)
    scene.render.engine, scene.cycles.samples, scene.render.filepath = "CYCLES", SAMPLES, out
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    bpy.ops.render.render(write_still=True)
    return read(out)


def read(path):
    """Linear radiance, (rows, columns, 3), row 0 at the bottom."""
    image = bpy.data.images.load(path)
    width, height = image.size
    pixels = np.empty(4 * width * height, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[..., :3]


def pair(where, theirs, ours, difference):
    """The pictures above one another."""
    rows = [10.0 * np.abs(difference), meshes.to_srgb(ours), meshes.to_srgb(theirs)]
    codes = np.rint(255.0 * np.clip(np.concatenate(rows), 0.0, 1.0)).astype(np.uint8)
    with open(os.path.join(where, "pair.png"), "wb") as out:
        out.write(images.png(codes))


if __name__ == "__main__":
    if len(sys.argv) < 3:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    sys.exit(0 if main(sys.argv[1], sys.argv[2], sys.argv[3:]) else 1)
