"""In-between frames beside frames of few samples that a denoiser filters: CPU seconds, PSNR and flicker.

    python3 tools/denoiser/compare.py TWEENRAY SCENE      (pip install numpy OpenEXR pyoidn)

The denoiser is Intel Open Image Denoise, at high quality, with albedo and normals of each frame (cleanAux). It filters frames of
16 camera samples with one sample of each light. PSNR and flicker (RMSE of the error of the change from one frame to the next,
of 255) are those of sRGB values, without exposure or tone curve, against a reference of many adaptive samples.

CPU seconds a frame of tweenray are those of the whole move over its frames, so loading and key frames are counted; the filter's are
those of filtering alone. Each run has random numbers of its own. Ratios of times are the median of the runs' own.
"""

import argparse
import ctypes
import importlib.util
import os
import re
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))

import measure

measure.require("numpy", "OpenEXR", "pyoidn")

import numpy as np

REFERENCE = ["--policy", "off", "--spp", "32..256", "--shadow-samples", "8", "--sky-samples", "8", "--seed", "1000003"]
TRACED = ["--policy", "off", "--spp", "16", "--shadow-samples", "1", "--sky-samples", "1", "--aovs", "albedo,normal"]
ALBEDO, NORMAL = ("albedo.R", "albedo.G", "albedo.B"), ("N.X", "N.Y", "N.Z")


def frames(text):
    ends = re.fullmatch(r"([1-9]\d*)\.\.([1-9]\d*)", text)
    if not ends or int(ends[1]) >= int(ends[2]):
        raise argparse.ArgumentTypeError(f"{text} is no range of two frames or more, such as 5..10")
    return range(int(ends[1]), int(ends[2]) + 1)


def options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tweenray", type=measure.program, metavar="TWEENRAY", help="the program")
    parser.add_argument("scene", metavar="SCENE", help="a scene file or mesh")
    measure.add_options(parser)
    text = "in-between frames that are filtered, and whose errors are measured (%(default)s)"
    parser.add_argument("--frames", type=frames, default="5..10", metavar="FIRST..LAST", help=text)
    return parser.parse_args()


class Denoiser:
    """A filter of Open Image Denoise 2, by its C interface, for frames of one size."""

    CPU, FLOAT3, HIGH = 1, 3, 6

    def __init__(self, width, height):
        self.images = {name: np.zeros((height, width, 3), np.float32) for name in ("color", "albedo", "normal", "output")}
        self.library = self.load()
        self.device = self.library.oidnNewDevice(self.CPU)
        self.library.oidnCommitDevice(self.device)
        self.filter = self.library.oidnNewFilter(self.device, b"RT")
        for name, image in self.images.items():
            place = image.ctypes.data_as(ctypes.c_void_p)
            self.library.oidnSetSharedFilterImage(self.filter, name.encode(), place, self.FLOAT3, width, height, 0, 0, 0)
        self.library.oidnSetFilterBool(self.filter, b"hdr", True)
        self.library.oidnSetFilterBool(self.filter, b"cleanAux", True)
        self.library.oidnSetFilterInt(self.filter, b"quality", self.HIGH)
        self.library.oidnCommitFilter(self.filter)
        self.check()

    @staticmethod
    def load():
        module = importlib.util.find_spec("pyoidn").submodule_search_locations[0]
        path = os.path.join(module, "oidn", "lib", "libOpenImageDenoise.so")
        try:
            library = ctypes.CDLL(path)
        except OSError as error:
            sys.exit(f"Open Image Denoise of the module pyoidn: {error}")
        pointer, text, size = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t
        declared = {
            "oidnNewDevice": (pointer, [ctypes.c_int]),
            "oidnCommitDevice": (None, [pointer]),
            "oidnGetDeviceError": (ctypes.c_int, [pointer, ctypes.POINTER(text)]),
            "oidnNewFilter": (pointer, [pointer, text]),
            "oidnSetSharedFilterImage": (None, [pointer, text, pointer, ctypes.c_int, *5 * [size]]),
            "oidnSetFilterBool": (None, [pointer, text, ctypes.c_bool]),
            "oidnSetFilterInt": (None, [pointer, text, ctypes.c_int]),
            "oidnCommitFilter": (None, [pointer]),
            "oidnExecuteFilter": (None, [pointer]),
        }
        for name, (result, parameters) in declared.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, parameters
        return library

    def check(self):
        message = ctypes.c_char_p()
        if self.library.oidnGetDeviceError(self.device, ctypes.byref(message)) != 0:
            sys.exit(f"Open Image Denoise: {(message.value or b'unknown error').decode()}")

    def filtered(self, colour, albedo, normal):
        """The filtered frame, and the CPU seconds of all threads that it took."""
        for name, image in (("color", colour), ("albedo", albedo), ("normal", normal)):
            self.images[name][:] = image
        begin = time.process_time()
        self.library.oidnExecuteFilter(self.filter)
        seconds = time.process_time() - begin
        self.check()
        return self.images["output"].copy(), seconds


def shown(pictures):
    """sRGB values."""
    linear = np.clip(pictures, 0, 1, dtype=np.float64)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


class Candidate:
    """CPU seconds a frame, and errors, of the runs of one setting."""

    def __init__(self, name):
        self.name, self.times, self.errors, self.changes = name, [], [], []

    def add(self, seconds, pictures=None, reference=None):
        self.times.append(seconds)
        if pictures is not None:
            error = shown(pictures) - reference
            self.errors.append((error**2).mean())
            self.changes.append(((error[1:] - error[:-1]) ** 2).mean())
        print(f"run {len(self.times)}: {self.name}: {seconds:.3f} s a frame", file=sys.stderr, flush=True)

    def psnr(self):
        return -10 * np.log10(np.mean(self.errors))

    def flicker(self):
        return 255 * np.sqrt(np.mean(self.changes))


class Comparison:
    """The candidates, and what they render."""

    def __init__(self, given):
        self.given = given
        self.denoiser = Denoiser(*(int(edge) for edge in given.size.split("x")))
        self.alone, self.traced = Candidate("the filter alone"), Candidate("traced, 16 camera and 1 light sample")
        self.filtered = Candidate("traced and filtered")
        self.ours = [(Candidate(" ".join(setting)), setting) for setting in given.settings]
        with tempfile.TemporaryDirectory() as folder:
            ends = f"{given.frames[0]}..{given.frames[-1]}"
            measure.render(given.tweenray, given.scene, folder, "--size", given.size, "--frames", ends, *REFERENCE)
            self.reference = shown(self.pictures(folder))

    def pictures(self, folder, *channels):
        return [measure.frame(folder, number, *channels) for number in self.given.frames]

    def render(self, folder, seed, setting):
        """CPU seconds a frame of the whole move."""
        more = ["--size", self.given.size, *setting, "--seed", str(seed)]
        seconds = measure.render(self.given.tweenray, self.given.scene, folder, *more)
        return seconds / sum(name.endswith(".exr") for name in os.listdir(folder))

    def run_traced(self, seed):
        with tempfile.TemporaryDirectory() as folder:
            seconds = self.render(folder, seed, TRACED)
            inputs = [*zip(*(self.pictures(folder, *channels) for channels in ((), (ALBEDO,), (NORMAL,))))]
        # The first time, Open Image Denoise also starts its threads.
        self.denoiser.filtered(*inputs[0])
        outputs, times = zip(*(self.denoiser.filtered(*images) for images in inputs))
        filtering = sum(times) / len(times)
        self.alone.add(filtering)
        self.traced.add(seconds, [images[0] for images in inputs], self.reference)
        self.filtered.add(seconds + filtering, outputs, self.reference)

    def run(self, seed):
        self.run_traced(seed)
        for candidate, setting in self.ours:
            with tempfile.TemporaryDirectory() as folder:
                seconds = self.render(folder, seed, setting)
                candidate.add(seconds, self.pictures(folder), self.reference)


def report(made):
    names = [made.alone, made.traced, made.filtered, *(candidate for candidate, _ in made.ours)]
    width = max(len(candidate.name) for candidate in names)
    times = f"{'CPU s: min':>10} {'median':>8} {'max':>8}"
    print(f"{'':{width}} {times} {'PSNR':>6} {'flicker':>7} {'s/filter':>8} {'dB above':>8} {'flicker/':>8}")
    print(f"{made.alone.name:{width}}   {measure.spread(made.alone.times)}")
    for candidate in names[1:]:
        row = f"{candidate.name:{width}}   {measure.spread(candidate.times)} {candidate.psnr():6.2f} {candidate.flicker():7.3f}"
        row += f" {measure.ratio(candidate.times, made.alone.times):8.2f} {candidate.psnr() - made.filtered.psnr():+8.2f}"
        print(f"{row} {candidate.flicker() / made.filtered.flicker():8.2f}")
    print("s/filter: time over the filter's; dB above, flicker/: PSNR and flicker beside traced and filtered frames")


def main():
    given = options()
    made = Comparison(given)
    print(f"{given.scene}, frames {given.frames[0]}..{given.frames[-1]}, {given.size}, {measure.machine()}", flush=True)
    for seed in range(1, given.runs + 1):
        made.run(seed)
    report(made)


if __name__ == "__main__":
    main()
