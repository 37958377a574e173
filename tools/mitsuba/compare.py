"""Renders scenes with Mitsuba 3 and with tweenray, and prints how far they are apart.

    python3 tools/mitsuba/compare.py TWEENRAY FOLDER [SCENE ...]      (a Python with the modules mitsuba and numpy)

Compared is linear radiance, clipped to [0, 1]: the root mean square of the difference over all pixels, and over the 95 %
that agree best. Where Mitsuba has another model of a material, a second row compares with tweenray's formula, written anew
as a BSDF of Mitsuba's (`formulas.py`); that row counts. Each scene leaves `mitsuba.exr`, `tweenray.exr` and `pair.png` (Mitsuba
above, tweenray below it, ten times the difference at the bottom).

    BALLS='glass|metal 0.9'       only the balls whose names begin so
    MITSUBA_VARIANT=scalar_rgb    another variant than llvm_ad_rgb, which needs LLVM 15 or newer (DRJIT_LIBLLVM_PATH); the balls'
                                  formulas take a variant with arrays
    SAMPLES=16384                 samples of Mitsuba's
"""

import os
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import numpy as np
import mitsuba as mi

mi.set_variant(os.environ.get("MITSUBA_VARIANT", "llvm_ad_rgb"))

import balls
import scenes

# Most that 95 % of the pixels may differ by.
MOST = 0.004
# Samples of Mitsuba's, in parts that fit in memory.
SAMPLES, PART = int(os.environ.get("SAMPLES", 1024)), 64


def by_mitsuba(described, samples=SAMPLES):
    built = mi.load_dict(described)
    parts = range(samples // PART)
    return np.mean([np.array(mi.render(built, spp=PART, seed=part)) for part in parts], axis=0)[..., :3]


def by_tweenray(program, scene, folder):
    with open(os.path.join(folder, "scene.toml"), "w") as out:
        out.write(scene.tweenray())
    samples = ["--spp", str(getattr(scene, "samples", 64)), "--shadow-samples", "16", "--sky-samples", "16", "--fog-samples", "8"]
    command = [program, "render", "scene.toml", "-o", "tweenray.exr", "--overwrite", "--quiet", "--policy", "off", *samples]
    subprocess.run(command, cwd=folder, check=True)
    return np.array(mi.Bitmap(os.path.join(folder, "tweenray.exr")))[..., :3]


def save(folder, mitsuba, tweenray):
    mi.Bitmap(mitsuba.astype(np.float32)).write(os.path.join(folder, "mitsuba.exr"))
    pair = [np.clip(picture, 0.0, 1.0) for picture in (mitsuba, tweenray)]
    rows = np.concatenate([*pair, 10.0 * np.abs(pair[0] - pair[1])]).astype(np.float32)
    picture = mi.Bitmap(rows).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, True)
    picture.write(os.path.join(folder, "pair.png"))


def report(name, mitsuba, tweenray):
    """Prints a row; gives the error of the pixels that agree best."""
    mitsuba, tweenray = np.clip(mitsuba, 0.0, 1.0), np.clip(tweenray, 0.0, 1.0)
    squares = np.sort(np.mean((mitsuba - tweenray) ** 2, axis=2).ravel())
    best = np.sqrt(np.mean(squares[: int(0.95 * len(squares))]))
    offset = 100.0 * (tweenray.mean() / mitsuba.mean() - 1.0)
    print(f"{name:28} {np.sqrt(squares.mean()):8.4f} {best:8.4f} {offset:10.2f} %", flush=True)
    return best


def one(program, name, place):
    scene = scenes.ALL[name]
    pictures = by_mitsuba(scene.mitsuba()), by_tweenray(program, scene, place)
    save(place, *pictures)
    return report(name, *pictures)


def many(program, name, place):
    balls.write(place)
    rows = []
    only = os.environ.get("BALLS")
    for ball in balls.all_of(place, name == "balls-environment"):
        if only and not any(ball.name.startswith(word) for word in only.split("|")):
            continue
        pictures = by_mitsuba(ball.mitsuba()), by_tweenray(program, ball, place)
        report(ball.name, *pictures)
        if ball.formula:
            pictures = by_mitsuba(ball.mitsuba(ball.formula)), pictures[1]
            report(f"{ball.name}, by formula", *pictures)
        rows.append(pictures)
    together = [np.concatenate(pictures, axis=1) for pictures in zip(*rows)]
    save(place, *together)
    return report(name, *together)


def main():
    program, folder = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    wanted = sys.argv[3:] or [*scenes.ALL, "balls-lamp", "balls-environment"]
    failed = []
    print(f"{'scene':28} {'RMSE':>8} {'of 95 %':>8} {'mean off by':>12}")
    for name in wanted:
        place = os.path.join(folder, name)
        os.makedirs(place, exist_ok=True)
        made = (one if name in scenes.ALL else many)(program, name, place)
        failed += [name] if made > MOST else []
    sys.exit(f"more than {MOST} apart: {', '.join(failed)}" if failed else 0)


if __name__ == "__main__":
    main()
