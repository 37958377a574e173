"""Image files beside the scene file: copies where tweenray reads them as Blender does, else written anew."""

import os
import shutil
import struct
import zlib

import bpy
import numpy as np

from .meshes import free_name, to_srgb

# Formats that tweenray reads, by the first bytes of a file.
KNOWN = {b"\x89PNG": ".png", b"\xff\xd8\xff": ".jpg", b"BM": ".bmp", b"#?RA": ".hdr", b"v/1\x01": ".exr"}
# Formats of floats, as Blender calls them. It gives the 16 bits of a PNG as floats, too.
FLOATS = ("OPEN_EXR", "OPEN_EXR_MULTILAYER", "HDR")
# Colour spaces of numbers, whose colours alpha never multiplies.
DATA = ("Non-Color", "Raw")
GREY = (0.2126, 0.7152, 0.0722)


class Images:
    """The images of an export, in the folder `textures` of `folder`."""

    def __init__(self, folder, report):
        self.folder, self.report = folder, report
        self._files, self._names = {}, set()
        self._transparent, self._greys = {}, {}

    def colour(self, image, times_alpha=False):
        """The file of an image of colours, `times_alpha` or as they are, or None where it has no pixels."""
        space = image.colorspace_settings.name
        # Blender decodes the floats of every space, but no codes other than sRGB.
        if not image.is_float and space not in (*DATA, "sRGB", "Linear Rec.709"):
            self.report.add(image.name, f"colour space {space}", "taken as linear light")
        if times_alpha and self.is_transparent(image):
            return self._once(image, "premultiplied", lambda: self._light(image, True))
        as_codes = space == "sRGB" and not image.is_float
        if as_codes or (self._is_light(image) and not self._is_premultiplied(image)):
            return self._once(image, "colour", lambda: self._copy(image) or self._codes(image))
        return self._once(image, "light", lambda: self._light(image))

    def product(self, image, factor, times_alpha=False):
        """The file of reflectances: an image's linear colours times three numbers, cut at 1; None where it has no pixels."""
        return self._once(image, ("product", *factor, times_alpha), lambda: self._product(image, factor, times_alpha))

    def data(self, image):
        """The file of an image of numbers (roughness, normals), or None; grey is that of Rec. 709 where it is coloured."""
        space = image.colorspace_settings.name
        if space in DATA or space.startswith("Linear"):
            return self._once(image, "colour", lambda: self._copy(image) or self._codes(image))
        return self._once(image, "grey", lambda: self._linear_codes(image))

    def alpha(self, image):
        """The file of an image whose alpha counts, which is not opaque all over."""
        return self._once(image, "colour", lambda: self._copy(image) or self._codes(image))

    def grey(self, image, channel=None, factor=(1.0, 1.0, 1.0), times_alpha=False):
        """The file of an image's linear colours times `factor` as grey: of one channel (r, g, b, a), or Blender's grey of all; cut at 1.
        None where it has no pixels."""
        kind = ("grey", channel, *factor, times_alpha)
        return self._once(image, kind, lambda: self._grey(image, channel, factor, times_alpha))

    def normals(self, image, turn):
        """The file of a normal map whose parts along u and v are multiplied by the matrix `turn`, or None."""
        return self._once(image, ("normals", *turn[0], *turn[1]), lambda: self._normals(image, turn))

    def mean(self, image, channel=None, times_alpha=False):
        """The mean linear colour, or of one channel the mean three times."""
        pixels = self._linear(image, times_alpha)
        if pixels is None:
            return [0.0, 0.0, 0.0]
        mean = [float(x) for x in pixels.mean(axis=(0, 1), dtype=np.float64)]
        return mean[:3] if channel is None else [mean["rgba".index(channel)]] * 3

    def is_grey(self, image):
        """Whether red, green and blue are the same everywhere."""
        if image.name_full not in self._greys:
            pixels = self._pixels(image)
            self._greys[image.name_full] = pixels is None or float(np.abs(pixels[..., :3] - pixels[..., :1]).max()) < 1e-6
        return self._greys[image.name_full]

    def add(self, name, pixels):
        """The file of an array of linear radiance, (rows, columns, 3), row 0 at the bottom."""
        return self._exr(name, np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=2))

    def _once(self, image, kind, make):
        key = (image.name_full, kind)
        if key not in self._files:
            self._files[key] = make()
            if self._files[key] is None:
                what = {"SEQUENCE": "an image sequence", "MOVIE": "a movie"}.get(image.source, "the image has no pixels")
                self.report.add(image.name, what, "one colour")
        return self._files[key]

    def _copy(self, image):
        """A copy of its file as it stands, or None where that cannot be read by tweenray or was changed in Blender."""
        if image.source != "FILE" or image.is_dirty:
            return None
        path = bpy.path.abspath(image.filepath, library=image.library)
        if image.packed_file is not None:
            return self._keep(image.name, image.packed_file.data)
        if not os.path.isfile(path):
            return None
        with open(path, "rb") as file:
            ending = ending_of(file.read(8))
        if ending is None:
            return None
        file = self._place(image.name, ending)
        shutil.copyfile(path, os.path.join(self.folder, file))
        return file

    def _keep(self, name, data):
        ending = ending_of(data[:8])
        return ending and self._write(name, ending, data)

    def _codes(self, image):
        """Its own numbers: 8 bits, or floats."""
        pixels = self._pixels(image)
        if pixels is None:
            return None
        if image.is_float:
            return self._exr(image.name, pixels)
        return self._write(image.name, ".png", png(np.rint(255.0 * np.clip(pixels, 0.0, 1.0)).astype(np.uint8)))

    def _light(self, image, times_alpha=False):
        pixels = self._linear(image, times_alpha)
        return None if pixels is None else self._exr(image.name, pixels)

    def _is_light(self, image):
        """Whether tweenray finds the linear colours in its file, which is of floats, as Blender does."""
        is_of_floats = image.is_float and (image.source != "FILE" or image.file_format in FLOATS)
        return is_of_floats and image.colorspace_settings.name in (*DATA, "Linear Rec.709")

    def _is_premultiplied(self, image):
        """Whether Blender's floats of the image are multiplied by an alpha below 1."""
        is_meant = image.alpha_mode in ("STRAIGHT", "PREMUL") and image.colorspace_settings.name not in DATA
        return image.is_float and is_meant and self.is_transparent(image)

    def is_transparent(self, image):
        """Whether its alpha is below 1 anywhere."""
        if image.name_full not in self._transparent:
            # Of grey, of three channels of 8 bits, and of HDR files there is no alpha to look at.
            has_alpha = image.channels == 4 and image.depth not in (8, 24) and image.file_format != "HDR"
            pixels = self._pixels(image) if has_alpha else None
            self._transparent[image.name_full] = pixels is not None and float(pixels[..., 3].min()) < 1.0
        return self._transparent[image.name_full]

    def is_opaque(self, image):
        """Whether it has pixels, and no alpha below 1."""
        return has_pixels(image) and not self.is_transparent(image)

    def _linear(self, image, times_alpha=False):
        """Linear colours `times_alpha` or as they are, and alpha, or None. Cycles multiplies codes by alpha before it decodes them."""
        pixels = self._pixels(image)
        if pixels is None:
            return None
        rgb, alpha = pixels[..., :3], pixels[..., 3:]
        if times_alpha and not image.is_float:
            rgb = rgb * alpha
        elif not times_alpha and self._is_premultiplied(image):
            rgb = rgb / np.where(alpha > 0.0, alpha, 1.0)
        elif times_alpha and self._is_of_16_bit_codes(image):
            rgb = from_srgb(to_srgb(rgb / np.where(alpha > 0.0, alpha, 1.0)) * alpha)
        if not image.is_float and image.colorspace_settings.name == "sRGB":
            rgb = from_srgb(rgb)
        return np.concatenate([rgb, alpha], axis=2)

    def _is_of_16_bit_codes(self, image):
        """Whether Cycles reads sRGB codes where Blender gives floats. Of packed files Cycles takes Blender's floats."""
        is_of_codes = image.colorspace_settings.name == "sRGB" and image.file_format not in FLOATS
        return image.is_float and is_of_codes and image.source == "FILE" and image.packed_file is None

    def _product(self, image, factor, times_alpha):
        pixels = self._linear(image, times_alpha)
        if pixels is None:
            return None
        pixels[..., :3] *= np.array(factor, dtype=np.float32)
        if float(pixels[..., :3].max()) > 1.0 + 1e-6:
            self.report.add(image.name, "reflectances above 1 where a factor multiplies the image", "1")
        pixels[..., :3] = np.clip(pixels[..., :3], 0.0, 1.0)
        return self._exr(image.name, pixels)

    def _linear_codes(self, image):
        pixels = self._linear(image)
        if pixels is None:
            return None
        return self._write(image.name, ".png", png(np.rint(65535.0 * np.clip(pixels, 0.0, 1.0)).astype(">u2")))

    def _grey(self, image, channel, factor, times_alpha):
        pixels = self._linear(image, times_alpha)
        if pixels is None:
            return None
        weights = np.array(GREY) * np.array(factor)
        grey = pixels[..., :3] @ weights if channel is None else pixels[..., "rgba".index(channel)] * weights.sum()
        grey = np.rint(65535.0 * np.clip(grey, 0.0, 1.0)).astype(">u2")[..., None]
        return self._write(image.name, ".png", png(np.repeat(grey, 3, axis=2)))

    def _normals(self, image, turn):
        pixels = self._linear(image)
        if pixels is None:
            return None
        pixels[..., :2] = 0.5 + (pixels[..., :2] - 0.5) @ np.array(turn, dtype=np.float32).T
        return self._write(image.name, ".png", png(np.rint(65535.0 * np.clip(pixels[..., :3], 0.0, 1.0)).astype(">u2")))

    def _pixels(self, image):
        """(rows, columns, 4), row 0 at the bottom, 0 for NaN; None where there are none."""
        if not has_pixels(image):
            return None
        width, height = image.size
        pixels = np.empty(4 * width * height, dtype=np.float32)
        image.pixels.foreach_get(pixels)
        pixels = np.where(np.isnan(pixels), np.float32(0.0), pixels) if image.is_float else pixels
        return pixels.reshape(height, width, 4)

    def _exr(self, name, pixels):
        file = self._place(name, ".exr")
        height, width = pixels.shape[:2]
        image = bpy.data.images.new("tweenray", width, height, alpha=True, float_buffer=True)
        try:
            image.colorspace_settings.name = "Non-Color"
            image.pixels.foreach_set(np.ascontiguousarray(pixels, dtype=np.float32).reshape(-1))
            image.filepath_raw, image.file_format = os.path.join(self.folder, file), "OPEN_EXR"
            image.save()
        finally:
            bpy.data.images.remove(image)
        return file

    def _write(self, name, ending, data):
        file = self._place(name, ending)
        with open(os.path.join(self.folder, file), "wb") as out:
            out.write(data)
        return file

    def _place(self, name, ending):
        os.makedirs(os.path.join(self.folder, "textures"), exist_ok=True)
        return "textures/" + free_name(os.path.splitext(name)[0], self._names) + ending


def has_pixels(image):
    """Whether an image has pixels, of four channels as Blender gives them; none is copied."""
    width, height = image.size
    return width > 0 and height > 0 and len(image.pixels) == 4 * width * height


def ending_of(head):
    """The ending of a file that opens with these bytes, or None where tweenray cannot read it."""
    return next((ending for magic, ending in KNOWN.items() if head.startswith(magic)), None)


def from_srgb(codes):
    """Linear light of codes from 0 to 1 (IEC 61966-2-1)."""
    return np.where(codes <= 0.04045, codes / 12.92, np.power((codes + 0.055) / 1.055, 2.4)).astype(np.float32)


def png(pixels):
    """A PNG file of (rows, columns, 3 or 4) whole numbers, row 0 at the bottom."""
    height, width, channels = pixels.shape
    bits = 8 * pixels.dtype.itemsize
    rows = pixels[::-1].reshape(height, -1).view(np.uint8)
    filtered = np.concatenate([np.zeros((height, 1), dtype=np.uint8), rows], axis=1)
    head = struct.pack(">IIBBBBB", width, height, bits, 6 if channels == 4 else 2, 0, 0, 0)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    body = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(filtered.tobytes(), 6)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body
