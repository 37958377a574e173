"""CPU time and error of the pan of scenes/spheres_on_terrain, by tweenray and by Mitsuba 3.

    python3 tools/mitsuba/pan.py TWEENRAY FOLDER      (pip install mitsuba numpy OpenEXR; Python 3.11 or newer)

Mitsuba renders by its variant llvm_ad_rgb, which needs LLVM 15 or newer (DRJIT_LIBLLVM_PATH), and by an integrator with the
light that tweenray has: direct light, mirrors and glass, and shadows of glass opaque. The truth is Mitsuba's, of four frames,
and stays in FOLDER. The MSE is of linear radiance clipped to [0, 1], over those frames and all runs.

CPU seconds of tweenray are those of the whole job, of Mitsuba those of rendering and writing frames: loading is printed
apart. Kernels that Mitsuba has not compiled before are compiled in the first run, which counts. Each run has random numbers
of its own. The ratio is the median of the runs' own.
"""

import argparse
import hashlib
import json
import os
import re
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.dirname(HERE))

import measure

measure.require("mitsuba", "numpy", "OpenEXR", "tomllib")

import numpy as np

SCENE = os.path.join(HERE, "..", "..", "scenes", "spheres_on_terrain", "scene.toml")
FRAMES = 16
# Frames of the 16 whose error is measured.
MEASURED = (3, 7, 11, 15)
# Few shadow samples are biased (docs/accuracy.md#bias).
CHECK = ["--policy", "off", "--spp", "64", "--shadow-samples", "8", "--sky-samples", "8"]


def samples(text, halves=1):
    """Mitsuba's sampler would round other numbers up; more than 64 are several passes."""
    number = measure.count(text)
    part = number / halves
    if part % 64 != 0 and part not in (1, 4, 9, 16, 25, 36, 49):
        times = "twice " if halves == 2 else ""
        raise argparse.ArgumentTypeError(f"{text} is neither a multiple of {64 * halves} nor {times}a square below 64")
    return number


def truth_samples(text):
    return samples(text, halves=2)


def frames(text):
    number = measure.count(text)
    if number == 1 or (number - 1) % (FRAMES - 1) != 0:
        raise argparse.ArgumentTypeError(f"{text} is not 1 more than a multiple of {FRAMES - 1}")
    return number


def options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tweenray", type=measure.program, metavar="TWEENRAY", help="the program")
    parser.add_argument("folder", metavar="FOLDER", help="for the truth, and for frames while they are needed")
    measure.add_options(parser)
    text = f"frames of the pan: {FRAMES}, or more on the same path, such as 136 (%(default)s)"
    parser.add_argument("--frames", type=frames, default=FRAMES, help=text)
    parser.add_argument("--samples", type=samples, default=64, help="Mitsuba's samples of a pixel (%(default)s)")
    parser.add_argument("--truth", type=truth_samples, default=2048, help="samples of the truth (%(default)s)")
    return parser.parse_args()


def write_scene(folder, move):
    """The scene file, with the number of frames of this move."""
    with open(SCENE) as file:
        text, changes = re.subn(r"(?m)^frames = \d+$", f"frames = {move}", file.read())
    if changes != 1:
        sys.exit(f"{SCENE} has not one line `frames = {FRAMES}`")
    path = os.path.join(folder, f"scene_{move}.toml")
    with open(path, "w") as file:
        file.write(text)
    return path


def by_mitsuba(folder, **job):
    """CPU seconds of loading and of rendering."""
    command = [sys.executable, os.path.join(HERE, "spheres_on_terrain.py"), json.dumps({"folder": folder, **job})]
    output = measure.run(command)[1]
    seconds = json.loads(output[output.rindex("{") :])
    return seconds["load"], seconds["render"]


def pictures(folder, move=FRAMES):
    """The measured frames, clipped."""
    step = (move - 1) // (FRAMES - 1)
    return np.clip([measure.frame(folder, 1 + (number - 1) * step) for number in MEASURED], 0, 1, dtype=np.float64)


class Truth:
    """Two halves with random numbers of their own, which tell the truth's own error."""

    def __init__(self, folder, size, number):
        scene = write_scene(folder, FRAMES)
        with open(scene, "rb") as file:
            version = hashlib.sha256(file.read()).hexdigest()[:8]
        halves = []
        for seed in (1, 2):
            place = os.path.join(folder, f"truth_{size[0]}x{size[1]}_{number}_{version}_{seed}")
            if not os.path.isdir(place):
                # A folder that has its final name is whole.
                part = f"{place}.part"
                os.makedirs(part, exist_ok=True)
                by_mitsuba(part, scene=scene, frames=MEASURED, move=FRAMES, size=size, samples=number // 2, seed=seed)
                os.rename(part, place)
            halves.append(pictures(place))
        self.pictures = sum(halves) / 2
        self.own_mse = ((halves[0] - halves[1]) ** 2).mean() / 4

    def mse(self, others):
        return ((others - self.pictures) ** 2).mean()


def check(tweenray, truth, folder, size):
    """How far tweenray is from the truth with many samples: no more than noise, if both have the same light."""
    scene = write_scene(folder, FRAMES)
    with tempfile.TemporaryDirectory(dir=folder) as place:
        for number in MEASURED:
            measure.render(tweenray, scene, place, "--size", size, "--frames", str(number), *CHECK)
        ours = pictures(place)
    offset, mean = (ours - truth.pictures).mean(), truth.pictures.mean()
    print(f"tweenray {' '.join(CHECK)}: mean off by {offset:+.6f} ({100 * offset / mean:+.2f} %), MSE {truth.mse(ours):.2e}", flush=True)


class Candidate:
    """Times and errors of the runs of one setting; `job` renders into a folder and gives seconds of loading and of the rest."""

    def __init__(self, name, job):
        self.name, self.job = name, job
        self.loads, self.times, self.errors = [], [], []

    def run(self, seed, folder, truth, move):
        with tempfile.TemporaryDirectory(dir=folder) as place:
            load, seconds = self.job(place, seed)
            self.errors.append(truth.mse(pictures(place, move)))
        self.loads.append(load)
        self.times.append(seconds)
        print(f"run {len(self.times)}: {self.name}: {seconds:.2f} s", file=sys.stderr, flush=True)


def candidates(given, folder, size):
    scene, all_frames = write_scene(folder, given.frames), [*range(1, given.frames + 1)]
    described = {"scene": scene, "frames": all_frames, "move": given.frames, "size": size, "samples": given.samples}
    # Seeds 1 and 2 are the truth's.
    made = [Candidate(f"Mitsuba, {given.samples} samples", lambda place, run: by_mitsuba(place, seed=2 + run, **described))]
    for setting in given.settings:
        more = ["--size", given.size, *setting]
        job = lambda place, run, more=more: (0, measure.render(given.tweenray, scene, place, *more, "--seed", str(run)))
        made.append(Candidate(f"tweenray {' '.join(setting)}", job))
    return made


def report(made):
    mitsuba = made[0]
    width = max(len(candidate.name) for candidate in made)
    print(f"Mitsuba's loading, not counted: {measure.spread(mitsuba.loads)} CPU s")
    print(f"{'':{width}} {'CPU s: min':>10} {'median':>8} {'max':>8} {'MSE':>9} {'of Mitsuba':>10} {'Mitsuba takes':>13}")
    for candidate in made:
        mse, others = (sum(c.errors) / len(c.errors) for c in (candidate, mitsuba))
        times = measure.ratio(mitsuba.times, candidate.times)
        print(f"{candidate.name:{width}}   {measure.spread(candidate.times)} {mse:9.2e} {mse / others:10.2f} {times:7.2f} times")


def main():
    given = options()
    os.makedirs(given.folder, exist_ok=True)
    folder, size = os.path.abspath(given.folder), [int(edge) for edge in given.size.split("x")]
    truth = Truth(folder, size, given.truth)
    print(f"{given.frames} frames, {given.size}, {measure.machine()}")
    print(f"truth, {given.truth} samples: MSE of its own {truth.own_mse:.2e}", flush=True)
    check(given.tweenray, truth, folder, given.size)
    made = candidates(given, folder, size)
    for run in range(1, given.runs + 1):
        for candidate in made:
            candidate.run(run, folder, truth, given.frames)
    report(made)


if __name__ == "__main__":
    main()
