"""Strips of any footage, place, time and colour, drawn at random: `build` makes one of a seed in an edit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
from support import image_strip, write_movie

COUNT = 30  # frames of footage; of fewer, Blender does not tell whether they keep their own rate
MOVIES = {
    "ffv1 8 bit": ("mkv", "ffv1", "bgr0"),
    "ffv1 10 bit": ("mkv", "ffv1", "yuv422p10le"),
    "h264": ("mp4", "libx264", "yuv420p"),
    "h264 10 bit": ("mp4", "libx264", "yuv420p10le"),
    "mpeg4": ("avi", "mpeg4", "yuv420p"),
    "prores": ("mov", "prores_ks", "yuv422p10le"),
}
IMAGES = {
    "png": ("png", "uint8"),
    "png 16 bit": ("png", "uint16"),
    "jpeg": ("jpg", "uint8"),
    "tiff 16 bit": ("tif", "uint16"),
    "exr": ("exr", "half"),
}
RATES = (24, 25, 30, 50)
FILTERS = ("AUTO", "NEAREST", "BILINEAR", "CUBIC_BSPLINE", "CUBIC_MITCHELL", "BOX")
SPACES = ("sRGB", "sRGB", "sRGB", "Linear Rec.709", "Rec.1886", "AgX Log", "ACEScg", "AgX Base sRGB")
OWN_SPACES = (None, None, None, "Rec.1886")


@dataclass(frozen=True)
class Drawn:
    """A source strip, what it is, and frames of it.

    is_told: pixels are mixed with their neighbours in another colour space than the effect's (docs/manual.md)"""

    strip: Any
    words: str
    is_told: bool
    frames: list[int]


def build(edit: Any, folder: Path, seed: int) -> Drawn:
    """The strip of a seed, alone in an edit, which it changes."""
    rng = np.random.default_rng(seed)
    kind = str(rng.choice([*MOVIES, *IMAGES]))
    width, height = (int(2 * rng.integers(12, 33)) for _ in range(2))
    strip = _strip(edit, _pictures(rng, width, height), kind, folder, RATES[rng.integers(len(RATES))])
    edit.render.resolution_x, edit.render.resolution_y = (int(2 * rng.integers(12, 41)) for _ in range(2))
    edit.render.fps = int(rng.choice([24, 25, 30]))
    edit.sequencer_colorspace_settings.name = space = str(rng.choice(SPACES))
    if (own := OWN_SPACES[rng.integers(len(OWN_SPACES))]) is not None:
        strip.colorspace_settings.name = own
    is_mixed, placed = _placed(rng, strip, width, height)
    words = [kind, f"{width}×{height}", f"in {space}", own or "", placed, _timed(rng, strip)]
    frames = list(range(int(strip.left_handle), int(strip.right_handle)))
    if not strip.retiming_keys:  # what Blender shows of a slow one depends on what it has shown before
        frames = sorted(int(frame) for frame in rng.choice(frames, 3, replace=False))
    is_light = kind in ("png 16 bit", "tiff 16 bit", "exr")
    is_told = is_mixed and not is_light and strip.colorspace_settings.name != space
    return Drawn(strip, ", ".join(filter(None, words)), is_told, frames)


def _placed(rng: np.random.Generator, strip: Any, width: int, height: int) -> tuple[bool, str]:
    """Whether pixels are mixed, and what is done."""
    place, words = strip.transform, []
    place.filter = str(rng.choice(FILTERS))
    how = rng.choice(["there", "moved", "scaled", "turned", "all"])
    if how in ("moved", "all"):
        place.offset_x, place.offset_y = (int(n) for n in rng.integers(-9, 10, 2))
    if how in ("scaled", "all"):
        place.scale_x, place.scale_y = rng.uniform(0.3, 2.6, 2)
    if how in ("turned", "all"):
        place.rotation = math.radians(rng.uniform(-180, 180))
    is_mixed = how in ("scaled", "turned", "all") or place.filter.startswith("CUBIC")
    words.append(f"{how} by {place.filter}")
    if rng.random() < 0.3:
        strip.crop.min_x, strip.crop.max_y = (int(n) for n in rng.integers(0, min(width, height) // 3, 2))
        words.append("cropped")
    strip.use_flip_x, strip.use_flip_y = (bool(n) for n in rng.random(2) < 0.25)
    return is_mixed and place.filter != "NEAREST", " ".join(words)


def _timed(rng: np.random.Generator, strip: Any) -> str:
    how = str(rng.choice(["as it is", "slower", "faster", "reversed", "strobe", "trimmed"]))
    if how in ("slower", "faster"):
        strip.retiming_keys.add(timeline_frame=1)
        strip.retiming_keys[-1].timeline_frame = int(COUNT * (1.7 if how == "slower" else 0.6)) + 1
    strip.use_reverse_frames = how == "reversed"
    if how == "strobe":
        strip.strobe = 3
    if how == "trimmed":
        strip.left_handle = 4
    return how


def _pictures(rng: np.random.Generator, width: int, height: int) -> np.ndarray:
    """Ramps with sharp blocks of any colour (COUNT, H, W, 3) uint8, which move."""
    y, x = np.mgrid[:height, :width]
    ramp = np.stack([255 * x / width, 255 * y / height, 128 + 0 * x], axis=-1).astype(np.uint8)
    found = np.repeat(ramp[None], COUNT, axis=0)
    for i in range(COUNT):
        block = rng.integers(0, 256, (height // 8, width // 8, 3), dtype=np.uint8).repeat(4, 0).repeat(4, 1)
        found[i, i % 5 : i % 5 + len(block), i % 7 : i % 7 + block.shape[1]] = block
    return found


def _strip(edit: Any, pictures: np.ndarray, kind: str, folder: Path, rate: Any) -> Any:
    folder.mkdir(parents=True)
    if kind in MOVIES:
        suffix, codec, pixels = MOVIES[kind]
        path = write_movie(folder / f"movie.{suffix}", pictures, codec, pixels, rate)
        return edit.sequence_editor.strips.new_movie("movie", str(path), 1, 1)
    suffix, samples = IMAGES[kind]
    for i, picture in enumerate(pictures, 1):
        image = OpenImageIO.ImageBuf(np.ascontiguousarray(picture.astype(np.float32) / 255))
        image.set_write_format(samples)
        assert image.write(str(folder / f"a{i:02d}.{suffix}")), image.geterror()
    return image_strip(edit, folder / f"a01.{suffix}")
