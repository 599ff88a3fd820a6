"""Blender's own GPU as a device for compute passes, through the `gpu` module, on OpenGL, Vulkan and Metal.

Python can only send floats, and only whole textures. So data is sent in a float texture, and a pass unpacks it into a
layer of the wanted texture. Small samples are packed into whole numbers up to 2²⁴, which floats hold exactly. (Bit
patterns would be simpler, but a GPU may flush denormal floats.)
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import cache
from itertools import pairwise
from typing import Any

import bpy
import gpu
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from gpu.types import GPUTexture

from ...compute.devices.device import Budget, Device, NoDeviceError, Texture, allowed, machine_memory, texel_bytes
from ...compute.devices.llvmpipe import is_llvmpipe
from ...compute.devices.passes import Pass, read_pass

_TYPES = {"sampler2DArray": "FLOAT_2D_ARRAY", "usampler2DArray": "UINT_2D_ARRAY"}
_AS_IT_IS, _WHOLE, _OPAQUE_BYTES, _PAIRS_OF_BYTES, _SIXTEEN_BITS = range(5)
# GLSL format: NumPy's type, the format that is sent, how it is unpacked (UNPACK). Only passes use rgba16ui and
# rgba32ui: floats cannot hold them, and Blender reads whole numbers only of one component.
FORMATS: dict[str, tuple] = {
    "rgba8": (np.uint8, "RG32F", _PAIRS_OF_BYTES),
    "rgba16": (np.uint16, "RGBA32F", _SIXTEEN_BITS),
    "rgba16f": (np.float16, "RGBA32F", _AS_IT_IS),
    "rgba32f": (np.float32, "RGBA32F", _AS_IT_IS),
    "r32f": (np.float32, "R32F", _AS_IT_IS),
    "r32ui": (np.uint32, "R32F", _WHOLE),
}
# The most bytes of the float texture that sends data. Larger arrays are sent in bands of rows.
_SENT_BYTES = 16 << 20
# Has as many samplers and images as any pass. Only OpenGL needs it.
LETTING_GO = read_pass("blender_gpu", "LET_GO")


def has_context() -> bool:
    """Tell whether Blender's GPU can be used on this thread now, as it can where Blender draws.

    After a window was closed, it cannot be used until another window is drawn. Running a pass or freeing a shader
    meanwhile would crash Blender.
    """
    try:
        GPUTexture((1, 1))
    except (RuntimeError, SystemError):  # SystemError: in the background without gpu.init()
        return False
    return True


def require_context() -> None:
    """Check that Blender's GPU can be used on this thread now.

    Raises:
        NoDeviceError: It cannot.
    """
    if not has_context():
        raise NoDeviceError(rpt_("Blender's GPU cannot be used until a window is drawn"))


def free(*objects: object) -> None:
    """Free textures and shaders of the `gpu` module: now, or when Blender's GPU can next be used (free_unused)."""
    BlenderDevice.unused.extend(objects)
    if has_context():
        free_unused()


def free_unused() -> None:
    """Free the textures and shaders that `free` had to postpone. To be called where Blender's GPU can be used."""
    BlenderDevice.unused.clear()


class BlenderDevice(Device):
    """Blender's GPU as a Device, for code that runs where the GPU can be used: in draw handlers, or after gpu.init().

    Private methods take and return the gpu module's textures. RelayedDevice calls them on the main thread.

    Attributes:
        unused: Textures and shaders of all devices, to be freed when Blender's GPU can next be used.
    """

    unused: list = []  # objects of the gpu module, to be freed once Blender's GPU is current

    def __init__(self, budget: Budget | None = None, ask_others: Callable[[], None] | None = None) -> None:
        self.name = gpu.platform.renderer_get()
        memory = machine_memory() if is_llvmpipe(self.name) else None
        super().__init__(budget or Budget(allowed(memory)), ask_others)
        self._shaders: dict[Pass, gpu.types.GPUShader] = {}
        self._spare: Texture | None = None
        self.max_layers = gpu.capabilities.max_texture_layers_get()
        self.max_size = gpu.capabilities.max_texture_size_get()

    def current(self) -> AbstractContextManager[BlenderDevice]:
        """Check that Blender's GPU can be used on this thread now, and return a context in which passes run.

        Raises:
            NoDeviceError: It cannot be used.
        """
        require_context()
        free_unused()
        return self._cleared()

    def freeing(self) -> AbstractContextManager[BlenderDevice]:
        """Return a context in which textures may be released. They are freed once Blender's GPU can be used."""
        return nullcontext(self)

    def _cleared(self) -> AbstractContextManager[BlenderDevice]:
        """Unbind textures on OpenGL, and return the context for a `with` block in which passes run.

        Blender has one OpenGL context for an engine's render and another for drawing. A texture that is freed in one of
        them stays bound in the other. A new texture may get the same number there. Blender and Mesa then take it to be
        bound already, so passes would use the freed one.
        """
        if gpu.platform.backend_type_get() == "OPENGL":
            if self._spare is None:
                self._spare = Texture(None, (1, 1, 1), "rgba32f", self._make(1, 1, 1, "rgba32f"))
            spares = dict.fromkeys((*LETTING_GO.samplers, *LETTING_GO.images), self._spare)
            self.run(LETTING_GO, (1, 1), textures=spares, images=spares, layer=0)
        return nullcontext(self)

    def _make(self, width: int, height: int, layers: int, kind: str) -> GPUTexture:
        return _new((width, height), kind.upper(), layers=layers)

    def _free(self, own: GPUTexture) -> None:
        free(own)

    def write(self, texture: Texture, array: np.ndarray, layer: int = 0, *, opaque: bool = False) -> None:
        height, width = array.shape[:2]
        _, sent_format, packing = FORMATS[texture.kind]
        if texture.kind == "rgba8" and opaque:
            sent_format, packing = "R32F", _OPAQUE_BYTES
        rows = max(1, _SENT_BYTES // (width * texel_bytes(sent_format.lower())))
        for top in range(0, height, rows):
            strip = array[top : top + rows]
            sent = (width, len(strip)), sent_format, _buffer("FLOAT", _packed(strip, packing))
            unpacking = read_pass("blender_gpu", "UNPACK", PACKING=packing, FORMAT=texture.kind)
            self._send(texture.gpu, unpacking, sent, top, layer)

    def send(self, texture: Texture, frame: np.ndarray) -> Texture:
        """Send an opaque 8-bit frame to the GPU for the next pass, as Device.send does.

        Args:
            texture: An rgba8 texture of the frame's size, used only if the frame is too large to be sent at once.
            frame: (rows, width, 4) uint8.

        Returns:
            The texture for that pass: a new one of r32f with the numbers R + 256 G + 65536 B, or else `texture`.
        """
        height, width = frame.shape[:2]
        if width * height * texel_bytes("r32f") > _SENT_BYTES:
            return super().send(texture, frame)
        data = _buffer("FLOAT", _packed(frame, _OPAQUE_BYTES))
        return Texture(None, (width, height, 1), "r32f", _new((width, height), "R32F", data))

    def _send(self, stored: GPUTexture, program: Pass, sent: tuple, top: int, layer: int) -> None:
        """Send one band of rows of a frame to the GPU, and run the pass that unpacks it into a texture.

        Args:
            stored: The texture to fill.
            program: The pass that unpacks.
            sent: The band: size (width, rows), format and buffer, the first arguments of _new.
            top: Row in the layer at which the band begins.
            layer: Which layer of `stored` is filled.
        """
        textures, size = {"sent": _new(*sent)}, sent[0]
        constants = {"size": size, "top": top, "layer": layer}
        BlenderDevice._dispatch(self, program, program.groups(size), textures, {"stored": stored}, {}, constants)

    def read(self, texture: Texture) -> np.ndarray:
        """Return a copy of a texture (layers, height, width, components) in its format's NumPy type.

        Raises:
            KeyError: Its format is none of FORMATS.
        """
        width, height, layers = texture.size
        dtype, _, packing = FORMATS[texture.kind]
        components = 4 if texture.kind.startswith("rgba") else 1
        sample, kind = (np.uint32, "UINT") if packing == _WHOLE else (np.float32, "FLOAT")
        array = np.empty((layers, height, width, components), sample)
        for layer, pixels in enumerate(array):
            self._read(texture.gpu, layer, (0, 0, width, height), components, kind, pixels)
        if kind == "FLOAT" and np.dtype(dtype).kind == "u":
            array = np.rint(array * np.float32(np.iinfo(dtype).max))
        return array.astype(dtype, copy=False)

    def _read(self, texture: GPUTexture, *arguments: Any) -> None:
        _read_layer(texture, *arguments)

    def _dispatch(self, program: Pass, groups: tuple[int, ...], textures: dict, images: dict, *given: Mapping) -> None:
        blocks, constants = given
        shader = self._shaders.get(program)
        if shader is None:
            shader = self._shaders[program] = _compiled(program)
        shader.bind()
        for name, texture in textures.items():
            shader.uniform_sampler(name, texture)
        for name, image in images.items():
            shader.image(name, image)
        uniforms = {name: gpu.types.GPUUniformBuf(_buffer("FLOAT", blocks[name])) for name in program.blocks}
        for name, uniform in uniforms.items():  # they must live until the dispatch
            shader.uniform_block(name, uniform)
        for name, kind in program.constants.items():
            set_constant = shader.uniform_float if kind in ("float", "vec2") else shader.uniform_int
            set_constant(name, constants[name])
        gpu.compute.dispatch(shader, *groups)  # the next one waits for what this one stores

    def release(self) -> None:
        free(*self._shaders.values(), self._spare)
        self._shaders, self._spare = {}, None


def texel(texture: Texture, x: int, y: int) -> np.ndarray:
    """Return what an rgba32f texture holds at one texel, (4 · layers,) float32: four numbers for each layer."""
    values = np.empty((texture.size[2], 4), np.float32)
    for layer, pixel in enumerate(values):
        _read_layer(texture.gpu, layer, (x, y, 1, 1), 4, "FLOAT", pixel)
    return values.reshape(-1)


def _read_layer(texture: GPUTexture, layer: int, box: tuple, components: int, kind: str, pixels: np.ndarray) -> None:
    """Read a rectangle of one layer of a texture into an array. GPUTexture.read() could read only the first layer.

    Args:
        layer: Index of the layer.
        box: Left, bottom, width and height of the rectangle, in texels.
        components: Numbers that each texel has: 1 or 4.
        kind: "FLOAT" or "UINT", the type of the numbers.
        pixels: Contiguous array that is filled with them.
    """
    framebuffer = gpu.types.GPUFrameBuffer(color_slots={"texture": texture, "layer": layer})
    with framebuffer.bind():
        framebuffer.read_color(*box, components, 0, kind, data=_buffer(kind, pixels))


@cache
def opens_in_background() -> bool:
    """Tell whether Blender's GPU can be used without a window. If so, make it usable on the main thread.

    A second Blender process tries it first, because without a GPU, gpu.init() of Blender 5.2 crashes. The answer is
    cached.
    """
    try:
        subprocess.run(_trial(), check=True, capture_output=True, timeout=60)
        gpu.init()
    except (OSError, SystemError, subprocess.SubprocessError):
        return False
    return True


def _trial() -> list[str]:
    """Return the command line of a process that tries gpu.init() with the GPU backend of this process."""
    if bpy.app.module:
        return [sys.executable, "-c", "import bpy, gpu; gpu.init()"]
    given = dict(pairwise(sys.argv)).get("--gpu-backend", bpy.context.preferences.system.gpu_backend.lower())
    options = ["--background", "--factory-startup", "--gpu-backend", given, "--python-exit-code", "1"]
    return [bpy.app.binary_path, *options, "--python-expr", "import gpu; gpu.init()"]


def _new(size: tuple[int, int], kind: str, data: gpu.types.Buffer | None = None, layers: int = 1) -> GPUTexture:
    """Make a texture, an array of layers.

    Args:
        size: Width and height in texels.
        kind: The format, such as "RGBA32F".
        data: Numbers to fill it with; None: its content is undefined.
        layers: Number of layers.

    Raises:
        NoDeviceError: The GPU has no room for it.
    """
    try:
        return GPUTexture(size, layers=layers, format=kind, data=data)
    except RuntimeError as error:
        raise NoDeviceError(str(error)) from None


def _buffer(kind: str, array: np.ndarray) -> gpu.types.Buffer:
    """Return a buffer of the `gpu` module that shares the memory of a contiguous array.

    Args:
        kind: "FLOAT" or "UINT".
        array: The array, of float32 or uint32.
    """
    return gpu.types.Buffer(kind, array.size, array.reshape(-1))


def _packed(array: np.ndarray, packing: int) -> np.ndarray:
    if packing == _OPAQUE_BYTES:
        packed = np.empty(array.shape[:2], np.float32)
        return np.bitwise_and(array.view(np.int32)[..., 0], np.int32(0xFFFFFF), out=packed, casting="unsafe")
    if packing == _PAIRS_OF_BYTES:
        array = array.view(np.uint16)
    return array.astype(np.float32, copy=False)


def shader_info(samplers: Mapping[str, str], constants: Mapping[str, str]) -> gpu.types.GPUShaderCreateInfo:
    """Return the description of a shader for the `gpu` module, with its samplers and constants declared.

    Args:
        samplers: GLSL type of each sampler, by name.
        constants: GLSL type of each push constant, by name.
    """
    info = gpu.types.GPUShaderCreateInfo()
    for slot, (name, kind) in enumerate(samplers.items()):
        info.sampler(slot, _TYPES[kind], name)
    for name, kind in constants.items():
        info.push_constant(kind.upper(), name)
    return info


def _compiled(program: Pass) -> gpu.types.GPUShader:
    info = shader_info(program.samplers, program.constants)
    for name, value in program.defines.items():
        info.define(name, str(value))
    for slot, (name, image) in enumerate(program.images.items()):
        kind = "UINT_2D_ARRAY" if image.format.endswith("ui") else "FLOAT_2D_ARRAY"
        qualifiers = {way for way, used in (("READ", image.reads), ("WRITE", image.writes)) if used}
        info.image(slot, image.format.upper(), kind, name, qualifiers=qualifiers)
    for slot, (name, length) in enumerate(program.blocks.items()):
        info.uniform_buf(slot, "vec4", f"{name}[{length}]")
    info.local_group_size(*program.local_size)
    info.compute_source(program.body)
    return gpu.shader.create_from_info(info)
