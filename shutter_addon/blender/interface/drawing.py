"""Flat shapes and texts in a region, in its pixels."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import blf
import bpy
import gpu
import numpy as np
from bpy.types import PropertyGroup, Region
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix
from numpy.typing import ArrayLike

from ...core.pixels import patterns

Box = tuple[float, float, float, float]  # left, bottom, right, top, in pixels of a region

SIZE = 11  # of texts, in points
BACK = (0.08, 0.08, 0.08, 0.8)  # behind texts and bars, so that they are read over any footage


def ui_scale() -> float:
    """Pixels per unit of Blender's interface."""
    return bpy.context.preferences.system.ui_scale


def line_width() -> float:
    """Pixels of Blender's own lines: with the interface's scale, and thicker or thinner by its Line Width."""
    return bpy.context.preferences.system.pixel_size


def wrapped(words: str, width: float, size: float | None = None) -> list[str]:
    """Words in lines that are no wider, in pixels, as `text` draws them, or by default as Blender's interface does; a
    word stays whole."""
    blf.size(0, (size or bpy.context.preferences.ui_styles[0].widget.points) * ui_scale())
    lines = [""]
    for word in words.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and blf.dimensions(0, longer)[0] > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


@contextmanager
def pixel_space(region: Region) -> Iterator[None]:
    """Coordinates are the region's pixels, whatever was drawn before: Blender's own state varies in draw handlers."""
    with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        gpu.matrix.load_identity()
        width, height = region.width, region.height
        gpu.matrix.load_projection_matrix(
            Matrix(((2 / width, 0, 0, -1), (0, 2 / height, 0, -1), (0, 0, 1, 0), (0, 0, 0, 1)))
        )
        yield


def rectangles(boxes: Sequence[Box] | np.ndarray, colors: ArrayLike) -> None:
    """Filled boxes (n, 4) of left, bottom, right, top; colors: (n, 4), display code values with straight alpha."""
    if not len(boxes):
        return
    left, bottom, right, top = np.asarray(boxes, dtype=np.float32).T
    corners = np.stack([left, bottom, right, bottom, right, top, left, top], axis=1).reshape(-1, 2)
    first = 4 * np.arange(len(left), dtype=np.int32)[:, None]
    triangles = (first + np.array([0, 1, 2, 0, 2, 3], dtype=np.int32)).reshape(-1, 3)
    content = {"pos": corners, "color": np.repeat(np.asarray(colors, dtype=np.float32), 4, axis=0)}
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    gpu.state.blend_set("ALPHA")
    batch_for_shader(shader, "TRIS", content, indices=triangles).draw(shader)
    gpu.state.blend_set("NONE")


def bars(box: Box, shares: np.ndarray, color: Sequence[float]) -> list[Box]:
    """Bars side by side in a box, as high as their shares (n,) of it, 0 to 1, and never nothing; their boxes."""
    left, bottom, right, top = box
    edges = np.linspace(left, right, len(shares) + 1)
    thin = line_width()
    gap = thin if edges[1] - edges[0] > 3 * thin else 0.0
    heights = np.maximum(bottom + shares * (top - bottom), bottom + thin)
    ends = zip(edges.tolist(), edges[1:].tolist(), heights.tolist(), strict=False)
    boxes = [(start, bottom, end - gap, height) for start, end, height in ends]
    rectangles(boxes, np.tile(color, (len(boxes), 1)))
    return boxes


def swatch(left: float, bottom: float, size: float, shutter: PropertyGroup, index: int) -> None:
    """A square of a shutter's colour and of the pattern that it has at an index of the list, as mattes show it."""
    left, bottom = round(left), round(bottom)
    rectangles([(left, bottom, left + size, bottom + size)], [(*shutter.color, 1.0)])
    y, x = np.mgrid[: round(size), : round(size)]
    inked = np.argwhere(patterns.marks(index, (x + 0.5) / ui_scale(), (y + 0.5) / ui_scale()))[:, ::-1]
    corners = np.add(inked, (left, bottom))
    ink = (*patterns.ink(shutter.color), patterns.STRENGTH)
    rectangles(np.hstack([corners, corners + 1]), np.tile(ink, (len(corners), 1)))


def lines(points: ArrayLike, color: Sequence[float], closed: bool = False, width: float = 1.0) -> None:
    """A line through points (n, 2); width: in widths of Blender's own lines."""
    points = np.asarray(points, dtype=np.float32)
    if len(points) < 2:
        return
    steps = np.arange(len(points) if closed else len(points) - 1, dtype=np.int32)
    pairs = np.stack([steps, (steps + 1) % len(points)], axis=1)
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    shader.uniform_float("lineWidth", width * line_width())
    shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
    shader.uniform_float("color", color)
    gpu.state.blend_set("ALPHA")
    batch_for_shader(shader, "LINES", {"pos": points}, indices=pairs).draw(shader)
    gpu.state.blend_set("NONE")


def text(
    x: float,
    y: float,
    words: str,
    size: float = SIZE,
    color: Sequence[float] = (1, 1, 1, 0.9),
    until: float | None = None,
) -> None:
    """Words with their lower left corner at a point; until: the x where they are cut off."""
    blf.size(0, size * ui_scale())
    blf.color(0, *color)
    blf.position(0, x, y, 0)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 3, 0, 0, 0, 0.8)
    if until is not None:
        blf.enable(0, blf.CLIPPING)
        blf.clipping(0, x, y - size * ui_scale(), until, y + 2 * size * ui_scale())
    blf.draw(0, words)
    blf.disable(0, blf.SHADOW)
    blf.disable(0, blf.CLIPPING)


def plated(x: float, y: float, words: str) -> None:
    """As `text`, on a dark plate."""
    pad = 4 * ui_scale()
    rectangles([(x - pad, y - pad - 1, x + text_width(words) + pad, y + SIZE * ui_scale() + pad)], [BACK])
    text(x, y, words)


def text_width(words: str) -> float:
    """How wide `text` draws words, in pixels."""
    blf.size(0, SIZE * ui_scale())
    return blf.dimensions(0, words)[0]
