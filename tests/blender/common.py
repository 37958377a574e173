"""What the tests of the Blender exporter share: exporting, reading what was written, comparing numbers."""

import math
import os
import sys
import tomllib
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "tools", "blender"))

import bpy
import numpy as np

from tweenray_export import scene as exporter

# Where exports go.
FOLDER = os.environ.get("TWEENRAY_EXPORTS", "")


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
