"""The passes: which GLSL source each runs, and what it binds.

A source in shaders/ has no interface of its own: its samplers, images and constants are declared here, and
written into it for moderngl, or given to Blender's `gpu` module, which declares them itself.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

SHADERS = Path(__file__).resolve().parents[2] / "shaders"
# Invocations of a workgroup (x, y, z): a square for passes that read a pixel's neighbours, else part of a row.
LOCAL_SIZE = (8, 8, 1)
LOCAL_ROW = (64, 1, 1)


@dataclass(frozen=True)
class Image:
    """An image array that a pass binds. format: as in GLSL; reads, writes: whether the pass loads from it and stores
    to it."""

    format: str
    reads: bool = False
    writes: bool = True


@dataclass(frozen=True)
class Pass:
    """A compute pass: a source in shaders/, and the interface that it is compiled with.

    name: of the source, shaders/NAME.glsl
    samplers: {name: GLSL type}
    images: {name: Image}
    constants: {name: GLSL type} of its uniforms
    defines: {name: value} of its preprocessor macros
    blocks: {name: length} of its uniform blocks, each an array of vec4
    local_size: invocations of a workgroup (x, y, z)
    """

    name: str
    samplers: dict[str, str] = field(default_factory=dict)
    images: dict[str, Image] = field(default_factory=dict)
    constants: dict[str, str] = field(default_factory=dict)
    defines: dict[str, int] = field(default_factory=dict)
    blocks: dict[str, int] = field(default_factory=dict)
    local_size: tuple[int, int, int] = LOCAL_SIZE

    def __hash__(self) -> int:
        return hash((self.name, *self.defines.values()))

    def groups(self, extent: tuple[int, ...]) -> tuple[int, ...]:
        """The workgroups that cover `extent` invocations (x, y[, z])."""
        return tuple(-(-n // local) for n, local in zip((*extent, 1)[:3], self.local_size, strict=True))


@cache
def body(name: str) -> str:
    """The source of a pass, its `#include "file"` lines replaced by the files of shaders/include."""
    return _included(SHADERS / f"{name}.glsl")


def _included(path: Path) -> str:
    text = path.read_text(encoding="utf-8")
    return re.sub(r'(?m)^#include "(.+)"$', lambda line: _included(SHADERS / "include" / line[1]), text)


@cache
def source(program: Pass) -> str:
    """The whole compute shader in GLSL 4.3, interface included."""
    x, y, z = program.local_size
    lines = ["#version 430", *(f"#define {name} {value}" for name, value in program.defines.items())]
    lines.append(f"layout(local_size_x = {x}, local_size_y = {y}, local_size_z = {z}) in;")
    for unit, (name, kind) in enumerate(program.samplers.items()):
        lines.append(f"layout(binding = {unit}) uniform {kind} {name};")
    for unit, (name, image) in enumerate(program.images.items()):
        access = "readonly " * (not image.writes) + "writeonly " * (not image.reads)
        kind = "uimage2DArray" if image.format.endswith("ui") else "image2DArray"
        lines.append(f"layout(binding = {unit}, {image.format}) uniform {access}{kind} {name};")
    for unit, (name, length) in enumerate(program.blocks.items()):
        lines.append(f"layout(std140, binding = {unit}) uniform {name}_block {{ vec4 {name}[{length}]; }};")
    lines += [f"uniform {kind} {name};" for name, kind in program.constants.items()]
    return "\n".join([*lines, "#line 1", body(program.name)])
