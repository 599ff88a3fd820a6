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
LOCAL_SIZE = (8, 8, 1)


@dataclass(frozen=True)
class Image:
    """An image to store in: its format (as in GLSL), and whether the pass loads from it as well."""

    format: str
    reads: bool = False


@dataclass(frozen=True)
class Pass:
    """A compute pass. samplers: name → GLSL type; images: name → Image (arrays); constants: name → GLSL type;
    defines: name → value, for what is known before it is compiled."""

    name: str
    samplers: dict[str, str] = field(default_factory=dict)
    images: dict[str, Image] = field(default_factory=dict)
    constants: dict[str, str] = field(default_factory=dict)
    defines: dict[str, int] = field(default_factory=dict)

    def __hash__(self):
        return hash((self.name, *self.defines.values()))


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
    x, y, z = LOCAL_SIZE
    lines = ["#version 430", *(f"#define {name} {value}" for name, value in program.defines.items())]
    lines.append(f"layout(local_size_x = {x}, local_size_y = {y}, local_size_z = {z}) in;")
    for unit, (name, kind) in enumerate(program.samplers.items()):
        lines.append(f"layout(binding = {unit}) uniform {kind} {name};")
    for unit, (name, image) in enumerate(program.images.items()):
        access = "" if image.reads else "writeonly "
        kind = "uimage2DArray" if image.format.endswith("ui") else "image2DArray"
        lines.append(f"layout(binding = {unit}, {image.format}) uniform {access}{kind} {name};")
    lines += [f"uniform {kind} {name};" for name, kind in program.constants.items()]
    return "\n".join([*lines, "#line 1", body(program.name)])
