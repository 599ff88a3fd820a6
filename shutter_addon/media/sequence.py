"""Frames of an image sequence, or of one image: the samples that the files hold, whatever their format."""

import bisect
import re
from pathlib import Path

import numpy as np
from OpenImageIO import ImageInput, ImageSpec, geterror

from .errors import MediaError
from .files import check_file, check_index

# Blender takes these for scene linear, even logarithmic DPX, and every other format for sRGB, even float TIFF.
LINEAR_SUFFIXES = frozenset({".exr", ".hdr", ".rgbe", ".dpx", ".cin"})
OTHER_SUFFIXES = ".png .jpg .jpeg .jpe .tif .tiff .tga .bmp .webp .jp2 .j2k .j2c .jxl .psd .sgi .rgb .rgba .bw .ppm"
IMAGE_SUFFIXES = LINEAR_SUFFIXES.union(OTHER_SUFFIXES.split())
SAMPLES = {"uint8": np.uint8, "uint16": np.uint16, "half": np.float16}  # all others are read as float


class SequenceSource:
    """Images as frames.

    Found beside its first file, frame i is the file whose number is i above the first's; where a number is missing,
    the file before it holds. With `files` (an image strip's list) frame i is files[i].
    Samples are as stored: straight alpha stays straight, EXIF orientation is left alone, as in Blender; an EXR's data
    window is laid into its display window. All frames must have the first one's size and sample type.
    """

    def __init__(self, path, *, files=None, fps=None, alpha=None):
        path = Path(path)
        self.fps = fps
        if files is None:
            self.path = check_file(path)
            self._starts, self._files = _numbered(path)
        else:
            folder = path if path.is_dir() else path.parent
            self._files = [folder / file for file in files]
            if not self._files:
                raise MediaError(f"{path.name}: an image sequence without files")
            self._starts = range(len(self._files))
            self.path = check_file(self._files[0])
        self.count = self._starts[-1] + 1
        image, spec, layer = _open(self.path)
        image.close()
        self.width, self.height = spec.full_width, spec.full_height
        self.dtype = _dtype(spec)
        self.transfer = "linear" if self.path.suffix.lower() in LINEAR_SUFFIXES else "srgb"
        self.alpha = "opaque" if len(layer) in (1, 3) else alpha or self._usual_alpha()
        self.options = {}

    @property
    def files(self):
        """The file of each frame."""
        return [self._files[bisect.bisect_right(self._starts, index) - 1] for index in range(self.count)]

    def read(self, index):
        """The frame as a new array (height, width, 4), RGBA, top row first.

        Raises MediaError for a file that is missing, damaged or unlike the first, IndexError outside 0 … count-1."""
        check_index(self, index)
        path = check_file(self._files[bisect.bisect_right(self._starts, index) - 1])
        image, spec, layer = _open(path)
        try:
            self._check_like_first(path, spec)
            return self._expand(_samples(image, spec, layer, path), spec)
        finally:
            image.close()

    def _check_like_first(self, path, spec):
        size, dtype = (spec.full_width, spec.full_height), _dtype(spec)
        if size != (self.width, self.height):
            raise MediaError(f"{path.name}: is {size[0]}×{size[1]}, but {self.path.name} is {self.width}×{self.height}")
        if dtype != self.dtype:
            raise MediaError(f"{path.name}: has {dtype} samples, but {self.path.name} has {self.dtype}")

    def _usual_alpha(self):
        """What Blender assumes, whatever a TIFF says of itself."""
        deep_tiff = self.path.suffix.lower() in (".tif", ".tiff") and self.dtype == np.uint16
        return "premultiplied" if self.transfer == "linear" or deep_tiff else "straight"

    def _expand(self, samples, spec):
        """Y, YA, RGB or RGBA samples as RGBA, at their place in the display window; nothing is there outside them."""
        picture = np.zeros((self.height, self.width, 4), self.dtype)
        y, rows = _overlap(spec.y - spec.full_y, spec.height, self.height)
        x, columns = _overlap(spec.x - spec.full_x, spec.width, self.width)
        inside, samples = picture[y, x], samples[rows, columns]
        colours, has_alpha = (3, 1)[samples.shape[2] < 3], samples.shape[2] % 2 == 0
        inside[..., :3] = samples[..., :colours]
        opaque = np.iinfo(self.dtype).max if self.dtype.kind == "u" else 1
        inside[..., 3] = samples[..., -1] if has_alpha else opaque
        return picture

    def close(self):
        """Nothing stays open between frames."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def _overlap(offset, length, whole):
    """Where `length` samples that begin at `offset` lie within 0 … whole, as slices of the whole and of the samples."""
    start, stop = max(offset, 0), max(min(offset + length, whole), 0)
    return slice(start, max(stop, start)), slice(start - offset, max(stop, start) - offset)


def _numbered(path):
    """(frame numbers from 0, files) from that file on: those that differ in the last number of the name only."""
    match = re.fullmatch(r"(.*?)(\d+)(\D*)", path.stem)
    if match is None:
        return [0], [path]
    prefix, digits, suffix = match.groups()
    alike = re.compile(re.escape(prefix) + r"(\d+)" + re.escape(suffix + path.suffix))
    first, found = int(digits), {}
    for file in sorted(path.parent.iterdir()):
        match = alike.fullmatch(file.name)
        if match and int(match[1]) >= first and (int(match[1]) not in found or len(match[1]) == len(digits)):
            found[int(match[1])] = file
    return [number - first for number in sorted(found)], [found[number] for number in sorted(found)]


def _open(path):
    """(open image, spec, its colour channels' positions: Y, YA, RGB or RGBA)."""
    wishes = ImageSpec()
    wishes.attribute("oiio:UnassociatedAlpha", 1)  # no premultiplication on reading
    image = ImageInput.open(str(path), wishes)
    if image is None:
        raise MediaError(f"{path.name}: cannot be read as an image ({_sentence(geterror())})")
    names, part = [], 0
    while image.seek_subimage(part, 0):
        spec = image.spec()
        layer = _colour_channels(spec.channelnames)
        if layer and not spec.deep:
            return image, image.spec(), layer
        names += spec.channelnames
        part += 1
    image.close()
    raise MediaError(f"{path.name}: no colour channels, only {', '.join(names)}")


def _colour_channels(names):
    """Where the first layer that has colours keeps them: plain names before layers, "Combined" before other ones."""
    layers = {}
    for position, name in enumerate(names):
        layer, _, channel = name.rpartition(".")
        layers.setdefault(layer, {})[channel.upper()] = position
    order = sorted(layers, key=lambda layer: (layer != "", not layer.endswith("Combined")))
    for wanted in ("RGBA", "RGB", "YA", "Y"):
        for layer in order:
            if all(channel in layers[layer] for channel in wanted):
                return [layers[layer][channel] for channel in wanted]
    return []


def _dtype(spec):
    return np.dtype(SAMPLES.get(str(spec.format), np.float32))


def _samples(image, spec, layer, path):
    """The layer's samples (height, width, channels) of the data window."""
    kinds = {np.uint8: "uint8", np.uint16: "uint16", np.float16: "half", np.float32: "float"}
    first, stop = min(layer), max(layer) + 1
    samples = image.read_image(image.current_subimage(), 0, first, stop, kinds[_dtype(spec).type])
    if samples is None or image.has_error:
        raise MediaError(f"{path.name}: cannot be decoded ({_sentence(image.geterror())})")
    return samples.reshape(spec.height, spec.width, stop - first)[..., [channel - first for channel in layer]]


def _sentence(text):
    return " ".join(text.split()) or "unknown format"
