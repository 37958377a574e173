"""Renders scenes with Mitsuba 3 and with tweenray, and prints how far they are apart.

    python3 tools/mitsuba/compare.py TWEENRAY FOLDER [SCENE ...]      (a Python with the modules mitsuba and numpy)

Compared is linear radiance, clipped to [0, 1]: the root mean square of the difference over all pixels, and over the 95 %
that agree best. Each scene leaves `mitsuba.exr`, `tweenray.exr` and `pair.png` (Mitsuba above, tweenray below it, ten
times the difference at the bottom).
"""

import os
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import numpy as np
import mitsuba as mi

mi.set_variant(os.environ.get("MITSUBA_VARIANT", "llvm_ad_rgb"))

import scenes

# Most that 95 % of the pixels may differ by.
MOST = 0.004
# Samples of Mitsuba's, in parts that fit in memory.
SAMPLES, PART = 1024, 64


def by_mitsuba(scene):
    built = mi.load_dict(scene.mitsuba())
    parts = range(SAMPLES // PART)
    return np.mean([np.array(mi.render(built, spp=PART, seed=part)) for part in parts], axis=0)[..., :3]


def by_tweenray(program, scene, folder):
    with open(os.path.join(folder, "scene.toml"), "w") as out:
        out.write(scene.tweenray())
    arguments = ["--policy", "off", "--spp", "64", "--shadow-samples", "16", "--sky-samples", "16", "--fog-samples", "8"]
    command = [program, "render", "scene.toml", "-o", "tweenray.exr", "--overwrite", "--quiet", *arguments]
    subprocess.run(command, cwd=folder, check=True)
    return np.array(mi.Bitmap(os.path.join(folder, "tweenray.exr")))[..., :3]


def save_pair(path, mitsuba, tweenray):
    difference = 10.0 * np.abs(mitsuba - tweenray)
    rows = np.concatenate([mitsuba, tweenray, difference]).astype(np.float32)
    mi.Bitmap(rows).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, True).write(path)


def main():
    program, folder = os.path.abspath(sys.argv[1]), sys.argv[2]
    wanted = sys.argv[3:] or list(scenes.ALL)
    failed = False
    print(f"{'scene':24} {'RMSE':>8} {'of 95 %':>8} {'mean off by':>12}")
    for name in wanted:
        scene = scenes.ALL[name]
        place = os.path.join(folder, name)
        os.makedirs(place, exist_ok=True)
        scene.write_files(place)
        mitsuba = by_mitsuba(scene)
        mi.Bitmap(mitsuba.astype(np.float32)).write(os.path.join(place, "mitsuba.exr"))
        tweenray = by_tweenray(program, scene, place)
        clipped = [np.clip(picture, 0.0, 1.0) for picture in (mitsuba, tweenray)]
        save_pair(os.path.join(place, "pair.png"), *clipped)
        squares = np.sort(np.mean((clipped[0] - clipped[1]) ** 2, axis=2).ravel())
        best = np.sqrt(np.mean(squares[: int(0.95 * len(squares))]))
        offset = 100.0 * (clipped[1].mean() / clipped[0].mean() - 1.0)
        failed |= best > MOST
        print(f"{name:24} {np.sqrt(squares.mean()):8.4f} {best:8.4f} {offset:10.2f} %", flush=True)
    sys.exit(f"more than {MOST} apart" if failed else 0)


if __name__ == "__main__":
    main()
