"""Draw shapes, text and pictures over a preview, with Blender's `gpu` module. Coordinates are pixels of a region.

Pictures are drawn in place of a strip's own picture, with shaders/show.glsl.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import blf
import bpy
import gpu
import numpy as np
from bpy.types import PropertyGroup, Region
from gpu.types import GPUBatch, GPUShader
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix
from numpy.typing import ArrayLike

from ...compute.devices.passes import read_pass
from ...core.model.scribbles import mapped
from ...core.pixels import patterns
from ..data import annotations
from ..data.preview_areas import PreviewedStrip
from ..devices import blender_gpu
from .gizmo_groups import view

Box = tuple[float, float, float, float]  # left, bottom, right, top, in pixels of a region

SIZE = 11  # points, of texts
BACK = (0.08, 0.08, 0.08, 0.8)  # behind texts and bars, to be readable on any footage


def ui_scale() -> float:
    """Return how many pixels an interface unit has, which the screen's density and *Resolution Scale* determine."""
    return bpy.context.preferences.system.ui_scale


def line_width() -> float:
    """Return the width of Blender's own lines in pixels, which *Resolution Scale* and *Line Width* determine."""
    return bpy.context.preferences.system.pixel_size


def wrapped(words: str, width: float, size: float | None = None) -> list[str]:
    """Break a text between words into lines of at most `width` pixels. A word that is wider has a line of its own.

    Args:
        size: Size of the letters in points; None: as in Blender's panels.
    """
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
    """Make the region's pixels the coordinates of what is drawn within a `with` block, origin at the lower left.

    Needed because Blender calls draw handlers with different coordinates.
    """
    with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        gpu.matrix.load_identity()
        x, y = 2 / region.width, 2 / region.height
        gpu.matrix.load_projection_matrix(Matrix(((x, 0, 0, -1), (0, y, 0, -1), (0, 0, 1, 0), (0, 0, 0, 1))))
        yield


def rectangles(boxes: Sequence[Box] | np.ndarray, colors: ArrayLike) -> None:
    """Draw filled boxes.

    Args:
        boxes: (n, 4): left, bottom, right, top.
        colors: (n, 4): display values 0 to 1 with straight alpha.
    """
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
    """Draw bars side by side in a box, with narrow gaps if there is room, and return the box of each bar.

    Args:
        box: The box, in pixels of the region.
        shares: Heights (n,) as fractions 0 to 1 of the box's height. Each bar is at least line_width() high.
        color: Red, green, blue and alpha, display values 0 to 1.
    """
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
    """Draw a square with a shutter's color and pattern, which mark the shutter's pixels in the view *Mattes*.

    Args:
        left, bottom: Lower left corner, in pixels of the region.
        size: Side of the square in pixels.
        index: Index of the shutter, which determines the pattern.
    """
    left, bottom = round(left), round(bottom)
    rectangles([(left, bottom, left + size, bottom + size)], [(*shutter.color, 1.0)])
    y, x = np.mgrid[: round(size), : round(size)]
    inked = np.argwhere(patterns.marks(index, (x + 0.5) / ui_scale(), (y + 0.5) / ui_scale()))[:, ::-1]
    corners = np.add(inked, (left, bottom))
    ink = (*patterns.ink(shutter.color), patterns.STRENGTH)
    rectangles(np.hstack([corners, corners + 1]), np.tile(ink, (len(corners), 1)))


def lines(points: ArrayLike, color: Sequence[float], closed: bool = False, width: float = 1.0) -> None:
    """Draw a line through points (n, 2), in pixels. Draw nothing for fewer than 2 points.

    Args:
        color: Red, green, blue and alpha, display values 0 to 1.
        closed: Also draw from the last point to the first.
        width: Width of the line, in multiples of line_width().
    """
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


def text(x: float, y: float, words: str, until: float | None = None) -> None:
    """Draw a line of text, whose baseline begins at (x, y).

    Args:
        until: x at which the text is cut off; None: nowhere.
    """
    size = SIZE * ui_scale()
    blf.size(0, size)
    blf.color(0, 1, 1, 1, 0.9)
    blf.position(0, x, y, 0)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 3, 0, 0, 0, 0.8)
    if until is not None:
        blf.enable(0, blf.CLIPPING)
        blf.clipping(0, x, y - size, until, y + 2 * size)
    blf.draw(0, words)
    blf.disable(0, blf.SHADOW)
    blf.disable(0, blf.CLIPPING)


def text_width(words: str) -> float:
    """Return the width in pixels of a text that `text` would draw."""
    blf.size(0, SIZE * ui_scale())
    return blf.dimensions(0, words)[0]


class Quad:
    """Draws pictures over a preview exactly where it shows an effect strip's own picture.

    They have the strip's transform and crop, and end where the sequencer's image ends.

    Attributes:
        shaders: Compiled shaders by the name of their pass, shared by all objects.
    """

    shaders: dict[str, GPUShader] = {}  # by pass, because compiling takes long

    def __init__(self, region: Region, shown: PreviewedStrip) -> None:
        self.view = view(shown.effect, shown.strip, region)
        strip, render = shown.strip, shown.scene.render
        half = np.array([render.resolution_x, render.resolution_y]) / 2
        self._image = mapped(annotations.image_to_region(region), np.array([-half, half]))
        crop, (width, height) = strip.crop, annotations.picture_size(shown.effect)
        self._low = np.array([crop.min_x / width, crop.min_y / height])
        self._high = 1 - np.array([crop.max_x / width, crop.max_y / height])

    def draw(self, name: str, textures: dict, left: float = 0.0, right: float = 1.0, **constants) -> None:
        """Draw a picture, or a part of its width, with a pass of shaders/show.glsl. What the strip crops is left out.

        Args:
            name: Name of the pass.
            textures: The textures that the pass reads, by sampler name.
            left: Left edge of the drawn part, as a fraction of the uncropped picture's width.
            right: Right edge of the drawn part, as a fraction of the uncropped picture's width.
            constants: Values of the pass's constants, by name, such as its opacity.
        """
        low, high = np.maximum(self._low, (left, 0)), np.minimum(self._high, (right, 1))
        if (low >= high).any():
            return
        corners = [(low[0], low[1]), (high[0], low[1]), (low[0], high[1]), (high[0], high[1])]  # triangle strip
        shader = shader_of(name)
        shader.bind()
        for sampler, texture in textures.items():
            shader.uniform_sampler(sampler, texture)
        for constant, value in constants.items():
            (shader.uniform_float if isinstance(value, float) else shader.uniform_int)(constant, value)
        where = {"corner": self.view.on_region(corners).tolist(), "place": corners}
        gpu.state.blend_set("ALPHA_PREMULT")
        self._clipped(batch_for_shader(shader, "TRI_STRIP", where), shader)
        gpu.state.blend_set("NONE")

    def _clipped(self, batch: GPUBatch, shader: GPUShader) -> None:
        """Draw a batch, but only inside the image that the sequencer shows, which cuts strips off as well."""
        left, bottom, width, height = before = gpu.state.scissor_get()
        low = np.maximum(np.rint(self._image[0]), (left, bottom))
        high = np.minimum(np.rint(self._image[1]), (left + width, bottom + height))
        if (low < high).all():
            gpu.state.scissor_test_set(True)
            gpu.state.scissor_set(*map(int, (*low, *(high - low))))
            batch.draw(shader)
            gpu.state.scissor_set(*before)
            gpu.state.scissor_test_set(False)  # Blender's state in draw handlers


def shader_of(name: str) -> GPUShader:
    """Return the compiled shader of a pass of shaders/show.glsl. It is compiled once, because that takes long."""
    if name not in Quad.shaders:
        quad, shown = read_pass("show", "QUAD"), read_pass("show", name)
        between = gpu.types.GPUStageInterfaceInfo("show_interface")
        info = blender_gpu.shader_info(shown.samplers, quad.constants | shown.constants)
        for slot, (given, kind) in enumerate(quad.ins.items()):
            info.vertex_in(slot, kind.upper(), given)
        for given, kind in quad.outs.items():
            between.smooth(kind.upper(), given)
        info.vertex_out(between)
        for slot, (given, kind) in enumerate(shown.outs.items()):
            info.fragment_out(slot, kind.upper(), given)
        info.vertex_source(quad.body)
        info.fragment_source(shown.body)
        Quad.shaders[name] = gpu.shader.create_from_info(info)
    return Quad.shaders[name]


def free() -> None:
    """Free the compiled shaders."""
    blender_gpu.free(*Quad.shaders.values())
    Quad.shaders.clear()
