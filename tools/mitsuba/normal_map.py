"""Holds tweenray's ball with a normal map under the lamp to the formula of docs/decisions/030, evaluated in numpy.

    python3 tools/mitsuba/normal_map.py TWEENRAY FOLDER

Mitsuba counts the part of a lamp that both normals see; tweenray fades light that sinks towards the surface's own horizon. So
the two differ there by more than noise, and this shows that the rest is none of tweenray's.
"""

import os
import sys

import numpy as np

import compare
import balls

# Rays along each edge of a pixel, and points along each edge of the lamp.
RAYS, POINTS = 4, 12


def dot(a, b):
    return np.sum(a * b, axis=-1)


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def places():
    """Points of the ball that rays of all pixels meet, and whether they meet it."""
    eye = np.array(balls.EYE)
    forward = unit(-eye)
    right = unit(np.cross(forward, [0, 1, 0]))
    n = balls.EDGE * RAYS
    along = ((np.arange(n) + 0.5) / n * 2 - 1) * np.tan(np.radians(balls.FOV / 2))
    x, y = np.meshgrid(along, -along)
    towards = unit(forward + x[..., None] * right + y[..., None] * np.cross(right, forward))
    middle = -dot(towards, eye)
    inside = middle**2 - (eye @ eye - 1)
    return eye + (middle - np.sqrt(np.maximum(inside, 0)))[..., None] * towards, inside > 0


def mapped(p):
    """Normals of the map at points of the ball, as `balls.write_images` paints them."""
    theta, phi = np.arccos(np.clip(p[..., 1], -1, 1)), np.arctan2(p[..., 0], p[..., 2])
    s = 0.4 * np.sin(12 * phi), 0.4 * np.sin(12 * theta)
    sin, cos = np.sin(theta), np.cos(theta)
    along_u = np.stack([np.cos(phi), 0 * phi, -np.sin(phi)], -1)
    along_v = np.stack([-cos * np.sin(phi), sin, -cos * np.cos(phi)], -1)
    return s[0][..., None] * along_u + s[1][..., None] * along_v + np.sqrt(1 - s[0] ** 2 - s[1] ** 2)[..., None] * p


def picture():
    p, is_hit = places()
    n = mapped(p)
    centre, normal, edge, radiance = balls.LAMP
    normal = unit(np.array(normal))
    a = unit(np.cross([0, 1, 0], normal))
    b = np.cross(normal, a)
    own, tilted = 0, 0
    for i in np.ndindex(POINTS, POINTS):
        s, t = ((k + 0.5) / POINTS - 0.5 for k in i)
        to = np.array(centre) + edge * (s * a + t * b) - p
        square = dot(to, to)
        to = unit(to)
        share = radiance * (edge / POINTS) ** 2 * np.maximum(-(to @ normal), 0) / square
        own = own + share * np.maximum(dot(to, p), 0)
        tilted = tilted + share * np.maximum(dot(to, n), 0)
    g = own / np.maximum(tilted * dot(n, p), 1e-9)
    lit = 0.7 / np.pi * tilted * np.where(g < 1, g + g**2 - g**3, 1) * is_hit
    return lit.reshape(balls.EDGE, RAYS, balls.EDGE, RAYS).mean((1, 3))


def main():
    program, folder = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    os.makedirs(folder, exist_ok=True)
    balls.write(folder)
    ball = next(ball for ball in balls.all_of(folder, False) if ball.name == "normal map")
    formula = np.repeat(picture()[..., None], 3, 2)
    compare.report("normal map, by formula", formula, compare.by_tweenray(program, ball, folder))


if __name__ == "__main__":
    main()
