"""Stills: rows of labelled panels on a dark sheet. Pictures are (height, width, 3) float32, code values of 0 to 1."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from OpenImageIO import FLOAT, UINT8, ImageBuf, ImageBufAlgo, ImageSpec

WIDTH = 1600
GAP = 16
TEXT = 26
SHEET, GROUND = 0.07, 0.16  # greys of the sheet, and behind bars
INK = (0.93, 0.93, 0.93)
FAINT = (0.62, 0.62, 0.62)


@dataclass(frozen=True)
class Panel:
    """A picture, and words below it."""

    picture: np.ndarray
    words: str


def sheet(*rows: np.ndarray, caption: str = "") -> np.ndarray:
    """Rows of the same width below each other, with a margin; the caption in small type."""
    rows = [*rows, lettering(caption, rows[0].shape[1], 18, FAINT)] if caption else rows
    return np.pad(below(*rows), ((GAP, GAP), (GAP, GAP), (0, 0)), constant_values=SHEET)


def row(*panels: Panel) -> np.ndarray:
    """Panels beside each other, all as high, together WIDTH pixels wide."""
    shares = np.array([panel.picture.shape[1] / panel.picture.shape[0] for panel in panels])
    height = round((WIDTH - GAP * (len(panels) - 1)) / shares.sum())
    edges = np.round(np.cumsum([0, *(shares * height + GAP)])).astype(int)
    edges[-1] = WIDTH + GAP  # whatever rounding has left
    places = zip(panels, edges, edges[1:], strict=False)
    return beside(*(labelled(scaled(each.picture, b - a - GAP, height), each.words) for each, a, b in places))


def beside(*pictures: np.ndarray, gap: int = GAP) -> np.ndarray:
    """Pictures from left to right with gaps, the sheet below shorter ones."""
    height = max(picture.shape[0] for picture in pictures)
    padded = [_padded(picture, below=height - picture.shape[0], right=gap) for picture in pictures]
    return np.concatenate(padded, axis=1)[:, :-gap]


def below(*pictures: np.ndarray, gap: int = GAP) -> np.ndarray:
    """Pictures of the same width from top to bottom with gaps."""
    return np.concatenate([_padded(picture, below=gap) for picture in pictures])[:-gap]


def labelled(picture: np.ndarray, words: str) -> np.ndarray:
    """The picture with words below it."""
    return np.concatenate([picture, lettering(words, picture.shape[1])])


def lettering(words: str, width: int, size: int = TEXT, color=INK) -> np.ndarray:
    """A line of text on the sheet, (about 1.6 · size, width, 3), its start at the left."""
    return written(_plain(round(1.6 * size), width), words, (0, round(1.18 * size)), size, color)


def graph(bars, color, width: int, height: int, words: str = "", size: int = 24) -> np.ndarray:
    """A shutter's bars (L,) as a bar graph in its color, the highest one fills it; words stand above the bars."""
    bars = np.asarray(bars) / np.max(bars)
    picture = _plain(height, width, GROUND)
    room = height - 14 - (round(1.3 * size) if words else 0)
    edges = np.linspace(8, width - 8, len(bars) + 1)
    gap = 2 if edges[1] - edges[0] >= 6 else 0
    for bar, left, right in zip(bars, edges, edges[1:], strict=False):
        span = slice(round(left), max(round(left) + 1, round(right) - gap))
        picture[-10:-8, span] = np.multiply(color, 0.5)
        picture[height - 8 - round(bar * room) : height - 8, span] = color
    return written(picture, words, (8, round(1.05 * size)), size)


def written(picture: np.ndarray, words: str, place, size: int = TEXT, color=INK) -> np.ndarray:
    """The picture with words in it; place: x and y of the first letter's lower left corner, from the top left."""
    image = ImageBuf(np.ascontiguousarray(picture, dtype=np.float32))
    if words and not ImageBufAlgo.render_text(image, *place, words, size, "DroidSans", color):
        raise RuntimeError(f"OpenImageIO cannot write words: {image.geterror()}")
    return image.get_pixels(FLOAT)


def inset(picture: np.ndarray, small: np.ndarray, corner: str = "bottom right", margin: int = 14) -> np.ndarray:
    """The picture with a small one in a corner, framed by a thin line."""
    small = np.pad(small, ((2, 2), (2, 2), (0, 0)), constant_values=0.93)
    result, (height, width) = picture.copy(), small.shape[:2]
    top = margin if "top" in corner else picture.shape[0] - margin - height
    left = margin if "left" in corner else picture.shape[1] - margin - width
    result[top : top + height, left : left + width] = small
    return result


def scaled(picture: np.ndarray, width: int, height: int | None = None) -> np.ndarray:
    """The picture at another size; by default its sides keep their ratio."""
    height = height or round(picture.shape[0] * width / picture.shape[1])
    if picture.shape[:2] == (height, width):
        return picture
    wanted = ImageBuf(ImageSpec(width, height, 3, FLOAT))
    ImageBufAlgo.resize(wanted, ImageBuf(np.ascontiguousarray(picture, dtype=np.float32)))
    return np.clip(wanted.get_pixels(FLOAT), 0, 1)


def save(picture: np.ndarray, path: Path) -> None:
    """Writes a picture as 8-bit PNG or JPEG, whole or not at all. OSError: it cannot be written."""
    part = path.with_name(f".part-{path.name}")
    image = ImageBuf(np.ascontiguousarray((np.clip(picture, 0, 1) * 255 + 0.5).astype(np.uint8)))
    image.specmod().attribute("Compression", "jpeg:78" if path.suffix == ".jpg" else "zip")
    try:
        if not image.write(str(part), UINT8):
            raise OSError(f"{path}: {image.geterror()}")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _plain(height: int, width: int, color=SHEET) -> np.ndarray:
    return np.full((height, width, 3), color, dtype=np.float32)


def _padded(picture: np.ndarray, below: int = 0, right: int = 0) -> np.ndarray:
    height, width = picture.shape[:2]
    result = _plain(height + below, width + right)
    result[:height, :width] = picture
    return result
