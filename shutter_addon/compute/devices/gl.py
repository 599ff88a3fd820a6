"""A device on OpenGL: a moderngl context without a window (through EGL on Linux, WGL on Windows)."""

import ctypes
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import Any, Self

import moderngl
import numpy as np

from .device import Budget, Device, NoDeviceError, Texture, allowed, machine_memory
from .llvmpipe import is_llvmpipe
from .passes import Pass

_EGL = sys.platform == "linux"

# GLSL format: (components, moderngl's type, NumPy's type).
FORMATS = {
    "rgba8": (4, "f1", np.uint8),
    "rgba16": (4, "nu2", np.uint16),
    "rgba16f": (4, "f2", np.float16),
    "rgba32f": (4, "f4", np.float32),
    "r32f": (1, "f4", np.float32),
    "r32ui": (1, "u4", np.uint32),
    "rgba16ui": (4, "u2", np.uint16),
    "rgba32ui": (4, "u4", np.uint32),
}
# OpenGL functions that are called through ctypes (_gl).
_CALLED = "glUseProgram", "glDispatchCompute", "glFinish"
# GL_NVX_gpu_memory_info, also in Mesa's drivers: all memory of the GPU in kB.
_TOTAL_MEMORY = 0x9048
# GL_ATI_meminfo: the free texture memory in kB, the first of four numbers.
_FREE_MEMORY = 0x87FC


@contextmanager
def _kept_context() -> Iterator[None]:
    """Make this thread's current OpenGL context current again when the `with` block ends. Does nothing except on Linux.

    There (EGL) moderngl would leave the thread without a current context, even if it had Blender's.
    """
    if not _EGL:
        yield
        return
    egl = _egl()
    draw, read = (egl.eglGetCurrentSurface(which) for which in (0x3059, 0x305A))
    display, context = egl.eglGetCurrentDisplay(), egl.eglGetCurrentContext()
    try:
        yield
    finally:
        if context:
            egl.eglMakeCurrent(display, draw, read, context)


@cache
def _egl() -> ctypes.CDLL:
    """Return the EGL library."""
    egl = ctypes.CDLL("libEGL.so.1")
    for name in ("Context", "Display", "Surface"):
        getattr(egl, f"eglGetCurrent{name}").restype = ctypes.c_void_p
    egl.eglMakeCurrent.argtypes = [ctypes.c_void_p] * 4
    return egl


@cache
def _gl(name: str) -> Callable[..., Any]:
    """Return an OpenGL function to call through ctypes, such as "glFinish". It must have no result.

    Other Python threads run during its calls, since ctypes releases Python's global lock; moderngl does not.

    Args:
        name: The name of the function.

    Raises:
        NoDeviceError: On Linux: the driver has no such function.
        AttributeError: On Windows: the function is not in opengl32.dll, which has only those of OpenGL 1.1.
    """
    if sys.platform == "win32":
        return getattr(ctypes.windll.opengl32, name)  # this DLL has only those of OpenGL 1.1
    find = _egl().eglGetProcAddress
    find.restype, find.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    if not (address := find(name.encode())):  # a call would crash
        raise NoDeviceError(f"no {name}")
    return ctypes.CFUNCTYPE(None)(address)


def _memory(context: moderngl.Context, renderer: str) -> int | None:
    """Return the memory of the GPU of an OpenGL context in bytes, or None if it is unknown.

    llvmpipe has the machine's main memory. If the driver tells only the free memory, the result is that, rounded down
    to a power of two, so that it is likely to be the same at the next start.

    Args:
        context: The current context of this thread.
        renderer: The renderer's name, as the driver tells it.
    """
    if is_llvmpipe(renderer):
        return machine_memory()
    for extension, name in (("GL_NVX_gpu_memory_info", _TOTAL_MEMORY), ("GL_ATI_meminfo", _FREE_MEMORY)):
        if extension in context.extensions:
            kilobytes = (ctypes.c_int * 4)()
            _gl("glGetIntegerv")(ctypes.c_uint(name), kilobytes)
            if (memory := kilobytes[0] << 10) > 0:
                return memory if name == _TOTAL_MEMORY else 1 << memory.bit_length() - 1
    return None


class GLDevice(Device):
    """A device on a new OpenGL 4.3 context without a window.

    Do not use it on a thread that has a current GLX context, such as Blender's main thread on X11: EGL does not replace
    that context, and OpenGL calls would go to it.

    Args:
        budget: The memory that textures may take, shared with other devices on the same GPU. None: a new budget of its
            own (`allowed`).
        ask_others: As for Device.

    Raises:
        NoDeviceError: There is no OpenGL 4.3.
    """

    takes_planes = True

    def __init__(self, budget: Budget | None = None, ask_others: Callable[[], None] | None = None) -> None:
        backend: dict[str, Any] = {"backend": "egl"} if _EGL else {}
        try:
            with _kept_context():
                self._context = moderngl.create_context(standalone=True, require=430, **backend)
                for name in _CALLED if _EGL else ():  # to fail here if one is missing, and not while rendering
                    _gl(name)
                with self._context:  # not current afterwards, so that another thread can use it
                    info = self._context.info
                    budget = budget or Budget(allowed(_memory(self._context, info["GL_RENDERER"])))
        except Exception as error:  # moderngl raises whatever its platform raises
            raise NoDeviceError(f"no OpenGL 4.3: {error}") from None
        super().__init__(budget, ask_others)
        self._programs: dict[Pass, tuple[moderngl.ComputeShader, dict[str, Any]]] = {}
        self._blocks: dict[int, moderngl.Buffer] = {}
        self.name = info["GL_RENDERER"]
        self.max_layers = info["GL_MAX_ARRAY_TEXTURE_LAYERS"]
        self.max_size = info["GL_MAX_TEXTURE_SIZE"]

    @contextmanager
    def current(self) -> Iterator[Self]:
        """Make the context current on this thread until the `with` block ends, and then the previous one again."""
        with _kept_context(), self._context:
            yield self

    freeing = current  # else another context's textures with the same numbers would be freed

    def _make(self, width: int, height: int, layers: int, kind: str) -> moderngl.TextureArray:
        components, dtype, _ = FORMATS[kind]
        texture = self._context.texture_array((width, height, layers), components, dtype=dtype)
        # moderngl does not check this: a texture without memory would read as black.
        if (fault := self._context.error) != "GL_NO_ERROR":
            texture.release()
            raise NoDeviceError(fault)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def _free(self, own: moderngl.TextureArray) -> None:
        own.release()

    def write(self, texture: Texture, array: np.ndarray, layer: int = 0, *, opaque: bool = False) -> None:
        """Fill a layer of a texture, or its first rows (Device.write). `opaque` has no effect here."""
        height, width = array.shape[:2]
        texture.gpu.write(array, viewport=(0, 0, layer, width, height, 1), alignment=1)

    def read(self, texture: Texture) -> np.ndarray:
        """Return a copy (layers, height, width, components) of a texture (Device.read)."""
        components, _, dtype = FORMATS[texture.kind]
        width, height, layers = texture.size
        array = np.empty((layers, height, width, components), dtype=dtype)
        self.finish()
        texture.gpu.read_into(array, alignment=1)
        return array

    def _dispatch(self, program: Pass, groups: tuple[int, ...], textures: dict, images: dict, *given: Mapping) -> None:
        if program not in self._programs:
            shader = self._context.compute_shader(program.source)
            self._programs[program] = shader, {name: shader[name] for name in shader}
        (shader, used), (blocks, constants) = self._programs[program], given
        for unit, texture in enumerate(textures.values()):
            texture.use(unit)
        for unit, (name, image) in enumerate(program.images.items()):
            images[name].bind_to_image(unit, read=image.reads, write=image.writes)
        for unit, name in enumerate(program.blocks):
            buffer = self._blocks.get(unit)
            if buffer is None or buffer.size < blocks[name].nbytes:
                buffer = self._blocks[unit] = self._context.buffer(reserve=blocks[name].nbytes)
            buffer.write(blocks[name])
            buffer.bind_to_uniform_block(unit)
        for name, value in constants.items():
            if name in used:  # the compiler removes unused constants
                used[name].value = value
        # A software renderer returns when the pass is done. Through ctypes, other Python threads run meanwhile.
        if _EGL:
            _gl("glUseProgram")(ctypes.c_uint(shader.glo))
            _gl("glDispatchCompute")(*map(ctypes.c_uint, groups))
        else:
            shader.run(*groups)
        self._context.memory_barrier()

    def finish(self) -> None:
        """Wait until all passes are done. On Linux, other Python threads run meanwhile."""
        _gl("glFinish")() if _EGL else self._context.finish()

    def release(self) -> None:
        """Free the context (Device.release)."""
        self._context.release()
