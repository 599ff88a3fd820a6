"""Blender's own GPU as a device: what devices/gl.py does, through the `gpu` module, on OpenGL, Vulkan and Metal.

Nothing can be sent into a part of a texture from Python, and floats alone can be sent at all. So what is written goes
into a float texture of its own, small samples several to a float as whole numbers up to 2²⁴, which floats hold
exactly; a pass unpacks them into the layer. (Bit patterns would be simpler, but a GPU may flush denormal floats.)
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

from ...devices.device import Budget, Device, NoDeviceError, Texture, machine_memory, texel_bytes
from ...devices.llvmpipe import is_llvmpipe
from ...devices.passes import Pass, read_pass

TYPES = {"sampler2DArray": "FLOAT_2D_ARRAY", "usampler2DArray": "UINT_2D_ARRAY"}
_AS_IT_IS, _WHOLE, _OPAQUE_BYTES, _PAIRS_OF_BYTES, _SIXTEEN_BITS = range(5)
# Format (as in GLSL): NumPy's type of what is written and read, the format sent, how it is unpacked (UNPACK).
FORMATS = {
    "rgba8": (np.uint8, "RG32F", _PAIRS_OF_BYTES),
    "rgba16": (np.uint16, "RGBA32F", _SIXTEEN_BITS),
    "rgba16f": (np.float16, "RGBA32F", _AS_IT_IS),
    "rgba32f": (np.float32, "RGBA32F", _AS_IT_IS),
    "r32f": (np.float32, "R32F", _AS_IT_IS),
    "r32ui": (np.uint32, "R32F", _WHOLE),
    # Of passes alone: floats do not hold them, and Blender reads whole numbers of one component only.
    "rgba16ui": None,
    "rgba32ui": None,
}
# Bytes of the float texture by which something is sent, at most: larger arrays are sent by strips of rows.
_SENT_BYTES = 16 << 20


# Samplers and images, as many as any pass has; with OpenGL alone.
LETTING_GO = read_pass("blender_gpu", "LET_GO")


_unused: list = []  # objects of the gpu module that are to be freed


def has_context() -> bool:
    """Whether Blender's GPU is current on this thread: it is where Blender draws. It is not after a window was closed,
    until another one is drawn; a pass that is run then ends Blender, as does another one's shader that is freed."""
    try:
        gpu.types.GPUTexture((1, 1))
    except (RuntimeError, SystemError):  # the latter in the background, where nobody has called gpu.init()
        return False
    return True


def require_context() -> None:
    """NoDeviceError: Blender's GPU is not current on this thread."""
    if not has_context():
        raise NoDeviceError(rpt_("Blender's GPU cannot be used until a window is drawn"))


def free(*objects: object) -> None:
    """Frees textures and shaders to which nothing else refers: now, or once Blender's GPU is current."""
    _unused.extend(objects)
    if has_context():
        free_unused()


def free_unused() -> None:
    """Frees what was to be freed while Blender's GPU was not current; called where it is."""
    _unused.clear()


class BlenderDevice(Device):
    """A Device, wherever Blender's GPU context is current: in draw handlers, or after gpu.init().

    What begins with _ gets and gives the gpu module's own textures; RelayedDevice has it called elsewhere."""

    def __init__(self, budget: Budget | None = None, ask_others: Callable[[], None] | None = None) -> None:
        super().__init__(budget, ask_others)
        self._shaders: dict[Pass, gpu.types.GPUShader] = {}
        self._spare: Texture | None = None
        self.name = gpu.platform.renderer_get()
        self.max_layers = gpu.capabilities.max_texture_layers_get()
        self.max_size = gpu.capabilities.max_texture_size_get()
        self.budget.tell(machine_memory() if is_llvmpipe(self.name) else None)

    def current(self) -> AbstractContextManager[BlenderDevice]:
        """See Device. NoDeviceError: Blender's GPU is not current on this thread."""
        require_context()
        free_unused()
        return self._cleared()

    def freeing(self) -> AbstractContextManager[BlenderDevice]:
        """See Device."""
        return nullcontext(self)

    def _cleared(self) -> AbstractContextManager[BlenderDevice]:
        if gpu.platform.backend_type_get() == "OPENGL":
            self._let_go()
        return nullcontext(self)

    def _let_go(self) -> None:
        """Has the current OpenGL context bind no texture of ours any more.

        An engine's render and what Blender draws have a context each. A texture that is freed in one of them stays
        bound in the other; and a new one that gets its number is taken for bound there, by Blender as by Mesa, so that
        passes would read and write the old one."""
        if self._spare is None:
            self._spare = Texture(None, (1, 1, 1), "rgba32f", self._make(1, 1, 1, "rgba32f"))
        spares = dict.fromkeys((*LETTING_GO.samplers, *LETTING_GO.images), self._spare)
        self.run(LETTING_GO, (1, 1), textures=spares, images=spares, layer=0)

    def _make(self, width: int, height: int, layers: int, kind: str) -> gpu.types.GPUTexture:
        try:
            return gpu.types.GPUTexture((width, height), layers=layers, format=kind.upper())
        except RuntimeError as error:
            raise NoDeviceError(str(error)) from None

    def _free(self, own: gpu.types.GPUTexture) -> None:
        free(own)

    def write(self, texture: Texture, array: np.ndarray, layer: int = 0, *, opaque: bool = False) -> None:
        height, width = array.shape[:2]
        _, sent_format, packing = _exchanged(texture)
        if texture.kind == "rgba8" and opaque:
            sent_format, packing = "R32F", _OPAQUE_BYTES
        rows = max(1, _SENT_BYTES // (width * texel_bytes(sent_format.lower())))
        for top in range(0, height, rows):
            strip = array[top : top + rows]
            sent = (width, len(strip)), sent_format, _buffer("FLOAT", _packed(strip, packing))
            self._send(texture.gpu, unpacking(texture.kind, packing), sent, top, layer)

    def send(self, texture: Texture, frame: np.ndarray) -> Texture:
        """See Device. Numbers are what is sent anyway."""
        height, width = frame.shape[:2]
        if width * height * texel_bytes("r32f") > _SENT_BYTES:
            return super().send(texture, frame)
        data = _buffer("FLOAT", _packed(frame, _OPAQUE_BYTES))
        return Texture(None, (width, height, 1), "r32f", _of_numbers((width, height), "R32F", data))

    def _send(self, stored: gpu.types.GPUTexture, program: Pass, sent: tuple, top: int, layer: int) -> None:
        """sent: arguments of _of_numbers, first the size"""
        textures, size = {"sent": _of_numbers(*sent)}, sent[0]
        constants = {"size": size, "top": top, "layer": layer}
        BlenderDevice._dispatch(self, program, program.groups(size), textures, {"stored": stored}, {}, constants)

    def read(self, texture: Texture) -> np.ndarray:
        """See Device."""
        width, height, layers = texture.size
        dtype, _, packing = _exchanged(texture)
        components = 4 if texture.kind.startswith("rgba") else 1
        sample, kind = (np.uint32, "UINT") if packing == _WHOLE else (np.float32, "FLOAT")
        array = np.empty((layers, height, width, components), sample)
        for layer, pixels in enumerate(array):
            self._read(texture.gpu, layer, (0, 0, width, height), components, kind, pixels)
        if kind == "FLOAT" and np.dtype(dtype).kind == "u":
            array = np.rint(array * np.float32(np.iinfo(dtype).max))
        return array.astype(dtype, copy=False)

    def _read(self, texture: gpu.types.GPUTexture, *arguments: Any) -> None:
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
        for name, uniform in uniforms.items():  # which must outlive the dispatch
            shader.uniform_block(name, uniform)
        for name, kind in program.constants.items():
            set_constant = shader.uniform_float if kind in ("float", "vec2") else shader.uniform_int
            set_constant(name, constants[name])
        gpu.compute.dispatch(shader, *groups)  # which makes the next one wait for what this one stores

    def release(self) -> None:
        free(*self._shaders.values(), self._spare)
        self._shaders, self._spare = {}, None


def texel(texture: Texture, x: int, y: int) -> np.ndarray:
    """The numbers (4 · layers,) float32 of all layers of an rgba32f texture at a texel; nothing else is read."""
    layers = texture.size[2]
    values = np.empty((layers, 4), np.float32)
    for layer, pixel in enumerate(values):
        _read_layer(texture.gpu, layer, (x, y, 1, 1), 4, "FLOAT", pixel)
    return values.reshape(-1)


def _read_layer(
    texture: gpu.types.GPUTexture, layer: int, box: tuple, components: int, kind: str, pixels: np.ndarray
) -> None:
    """By a framebuffer, for GPUTexture.read() gives a first layer alone. box: left, bottom, width and height"""
    framebuffer = gpu.types.GPUFrameBuffer(color_slots={"texture": texture, "layer": layer})
    with framebuffer.bind():
        framebuffer.read_color(*box, components, 0, kind, data=_buffer(kind, pixels))


@cache
def opens_in_background() -> bool:
    """Whether Blender's GPU can be used without a window; it is from then on, on the main thread.

    Another Blender tries first: where there is none, 5.2's gpu.init() does not raise, it crashes."""
    try:
        subprocess.run(_trial(), check=True, capture_output=True, timeout=60)
        gpu.init()
    except (OSError, SystemError, subprocess.SubprocessError):
        return False
    return True


def _trial() -> list[str]:
    """The command that tries gpu.init() with this process's backend."""
    if bpy.app.module:
        return [sys.executable, "-c", "import bpy, gpu; gpu.init()"]
    given = dict(pairwise(sys.argv)).get("--gpu-backend", bpy.context.preferences.system.gpu_backend.lower())
    options = ["--background", "--factory-startup", "--gpu-backend", given, "--python-exit-code", "1"]
    return [bpy.app.binary_path, *options, "--python-expr", "import gpu; gpu.init()"]


def unpacking(kind: str, packing: int) -> Pass:
    return read_pass("blender_gpu", "UNPACK", PACKING=packing, FORMAT=kind)


def _exchanged(texture: Texture) -> tuple:
    """The entry of FORMATS. TypeError: Blender neither sends nor reads such a texture; asked to read one, it leaves
    the memory as it was, without an error."""
    if (entry := FORMATS[texture.kind]) is None:
        raise TypeError(f"{texture.kind}: such a texture is written and read by passes alone on Blender's GPU")
    return entry


def _of_numbers(size: tuple[int, int], kind: str, data: gpu.types.Buffer) -> gpu.types.GPUTexture:
    """A texture of these numbers. NoDeviceError: the GPU has no room for it."""
    try:
        return gpu.types.GPUTexture(size, layers=1, format=kind, data=data)
    except RuntimeError as error:
        raise NoDeviceError(str(error)) from None


def _buffer(kind: str, array: np.ndarray) -> gpu.types.Buffer:
    """Blender's view of a contiguous array: nothing is copied."""
    return gpu.types.Buffer(kind, array.size, array.reshape(-1))


def _packed(array: np.ndarray, packing: int) -> np.ndarray:
    if packing == _OPAQUE_BYTES:
        packed = np.empty(array.shape[:2], np.float32)
        return np.bitwise_and(array.view(np.int32)[..., 0], np.int32(0xFFFFFF), out=packed, casting="unsafe")
    if packing == _PAIRS_OF_BYTES:
        array = array.view(np.uint16)
    return array.astype(np.float32, copy=False)


def _compiled(program: Pass) -> gpu.types.GPUShader:
    info = gpu.types.GPUShaderCreateInfo()
    for name, value in program.defines.items():
        info.define(name, str(value))
    for slot, (name, kind) in enumerate(program.samplers.items()):
        info.sampler(slot, TYPES[kind], name)
    for slot, (name, image) in enumerate(program.images.items()):
        kind = "UINT_2D_ARRAY" if image.format.endswith("ui") else "FLOAT_2D_ARRAY"
        qualifiers = {way for way, used in (("READ", image.reads), ("WRITE", image.writes)) if used}
        info.image(slot, image.format.upper(), kind, name, qualifiers=qualifiers)
    for slot, (name, length) in enumerate(program.blocks.items()):
        info.uniform_buf(slot, "vec4", f"{name}[{length}]")
    for name, kind in program.constants.items():
        info.push_constant(kind.upper(), name)
    info.local_group_size(*program.local_size)
    info.compute_source(program.body)
    return gpu.shader.create_from_info(info)
