"""Shared parts of the comparisons: CPU seconds of a child process, exr frames, and figures of several runs."""

import argparse
import importlib.util
import os
import re
import resource
import shlex
import subprocess
import sys

# Few samples in two ways, and the default of README.md.
SETTINGS = (
    "--spp 1..4 --shadow-samples 1..4 --sky-samples 1;"
    "--spp 1..4 --shadow-samples 2 --sky-samples 2;"
    "--spp 4..16 --shadow-samples 16 --sky-samples 16"
)


def require(*modules):
    missing = [module for module in modules if importlib.util.find_spec(module) is None]
    if missing:
        text = f"This Python ({sys.version.split()[0]}) lacks {', '.join(missing)}: pip install mitsuba numpy OpenEXR pyoidn"
        sys.exit(text + ("; tomllib comes with Python 3.11" if "tomllib" in missing else ""))


def program(path):
    if not os.access(path, os.X_OK) or os.path.isdir(path):
        raise argparse.ArgumentTypeError(f"{path} is no program; ./x demo builds target/release/tweenray")
    return os.path.abspath(path)


def size(text):
    if not re.fullmatch(r"[1-9]\d*x[1-9]\d*", text):
        raise argparse.ArgumentTypeError(f"{text} is no size such as 640x360")
    return text


def count(text):
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"{text} is no number above 0")
    return int(text)


def settings(text):
    return [shlex.split(part) for part in text.split(";") if part.strip()]


def add_options(parser):
    """Options of both comparisons."""
    parser.add_argument("--size", type=size, default="640x360", help="pixels of a frame (%(default)s)")
    parser.add_argument("--runs", type=count, default=3, help="runs of each candidate, which take turns (%(default)s)")
    text = "options of tweenray render for each candidate, with semicolons between (%(default)s)"
    parser.add_argument("--settings", type=settings, default=SETTINGS, metavar="ARGS;ARGS", help=text)


def run(command):
    """CPU seconds, user and system, of a command and of all processes that it waits for; and its output."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"exit code {done.returncode} of {shlex.join(command)}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout


def render(tweenray, scene, folder, *options):
    """CPU seconds of tweenray, loading the scene and writing exr frames included."""
    pattern = os.path.join(folder, "frame_####.exr")
    return run([tweenray, "render", scene, "-o", pattern, "--quiet", "--no-video", *options])[0]


def frame(folder, number, channels=("R", "G", "B")):
    """One picture of three channels of an exr frame."""
    import numpy as np
    import OpenEXR

    with OpenEXR.File(os.path.join(folder, f"frame_{number:04}.exr"), separate_channels=True) as file:
        return np.stack([file.channels()[name].pixels for name in channels], -1).astype(np.float32)


def median(values):
    values = sorted(values)
    return 0.5 * (values[(len(values) - 1) // 2] + values[len(values) // 2])


def ratio(times, others):
    """Median of the runs' own ratios."""
    return median([a / b for a, b in zip(times, others)])


def spread(times):
    return f"{min(times):8.3f} {median(times):8.3f} {max(times):8.3f}"


def machine():
    return f"{os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}"
