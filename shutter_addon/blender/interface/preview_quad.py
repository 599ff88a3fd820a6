"""Where a strip's picture lies in a preview, and what draws there: shaders/show.glsl."""

import gpu
import numpy as np
from bpy.types import Region
from gpu.types import GPUBatch, GPUShader
from gpu_extras.batch import batch_for_shader

from ...core.model.scribbles import mapped
from ...devices.passes import read_pass
from ..data import annotations, geometry
from ..data.preview_areas import Shown
from ..devices import blender_gpu
from .gizmo_groups import view


class Quad:
    """Where the picture of the strip that a preview shows lies in its region, the crop considered."""

    def __init__(self, region: Region, shown: Shown) -> None:
        self.view = view(shown.effect, shown.strip, region)
        strip, render = shown.strip, shown.scene.render
        half = np.array([render.resolution_x, render.resolution_y]) / 2
        self._image = mapped(geometry.image_to_region(region), np.array([-half, half]))
        crop, (width, height) = strip.crop, annotations.picture_size(shown.effect)
        self._low = np.array([crop.min_x / width, crop.min_y / height])
        self._high = 1 - np.array([crop.max_x / width, crop.max_y / height])

    def draw(self, name: str, textures: dict, left: float = 0.0, right: float = 1.0, **constants) -> None:
        """Draws from `left` to `right`, in fractions of the picture's width, by a step of shaders/show.glsl."""
        low, high = np.maximum(self._low, (left, 0)), np.minimum(self._high, (right, 1))
        if (low >= high).any():
            return
        corners = [(low[0], low[1]), (high[0], low[1]), (low[0], high[1]), (high[0], high[1])]  # as strips have them
        shader = shader_of(name)
        shader.bind()
        for sampler, texture in textures.items():
            shader.uniform_sampler(sampler, texture.gpu)
        for constant, value in constants.items():
            (shader.uniform_float if isinstance(value, float) else shader.uniform_int)(constant, value)
        where = {"corner": self.view.on_region(corners).tolist(), "place": corners}
        gpu.state.blend_set("ALPHA_PREMULT")
        self._clipped(batch_for_shader(shader, "TRI_STRIP", where), shader)
        gpu.state.blend_set("NONE")

    def _clipped(self, batch: GPUBatch, shader: GPUShader) -> None:
        """Draws as much as lies in the sequencer's image, which shows no more of a strip."""
        left, bottom, width, height = before = gpu.state.scissor_get()
        low = np.maximum(np.rint(self._image[0]), (left, bottom))
        high = np.minimum(np.rint(self._image[1]), (left + width, bottom + height))
        if (low < high).all():
            gpu.state.scissor_test_set(True)
            gpu.state.scissor_set(*map(int, (*low, *(high - low))))
            batch.draw(shader)
            gpu.state.scissor_set(*before)
            gpu.state.scissor_test_set(False)  # as it is where Blender has handlers draw


_shaders: dict = {}  # by step: to compile one takes long


def shader_of(name: str) -> GPUShader:
    """What draws by a step of shaders/show.glsl, compiled once."""
    if name not in _shaders:
        quad, shown = read_pass("show", "QUAD"), read_pass("show", name)
        between = gpu.types.GPUStageInterfaceInfo("show_interface")
        info = gpu.types.GPUShaderCreateInfo()
        for constant, kind in (quad.constants | shown.constants).items():
            info.push_constant(kind.upper(), constant)
        for slot, (sampler, kind) in enumerate(shown.samplers.items()):
            info.sampler(slot, blender_gpu.TYPES[kind], sampler)
        for slot, (given, kind) in enumerate(quad.ins.items()):
            info.vertex_in(slot, kind.upper(), given)
        for given, kind in quad.outs.items():
            between.smooth(kind.upper(), given)
        info.vertex_out(between)
        for slot, (given, kind) in enumerate(shown.outs.items()):
            info.fragment_out(slot, kind.upper(), given)
        info.vertex_source(quad.body)
        info.fragment_source(shown.body)
        _shaders[name] = gpu.shader.create_from_info(info)
    return _shaders[name]


def free() -> None:
    """Frees the shaders."""
    blender_gpu.free(*_shaders.values())
    _shaders.clear()
