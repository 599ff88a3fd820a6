"""The passes: each a step of a file in shaders/, and what it binds.

A file is GLSL that declares what each of its steps binds, between `#ifdef STEP` and `#endif` where it has several. That
is read here: Blender's `gpu` module has to be told what is declared, and moderngl where it is bound. So #include and
conditions are resolved here: of steps, and of macros whose values Python gives. A condition is NAME, !NAME,
NAME == number or defined(STEP), or several of these joined by && and ||.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

SHADERS = Path(__file__).resolve().parents[2] / "shaders"

_DIRECTIVE = re.compile(r"#\s*(include|ifdef|ifndef|if|elif|else|endif)\b\s*(.*)")
_LOCAL_SIZE = re.compile(r"layout\(local_size_x = (\d+)(?:, local_size_y = (\d+))?(?:, local_size_z = (\d+))?\) in;")
_SAMPLERS = re.compile(r"uniform (u?sampler2DArray) ([\w, ]+);")
_IMAGES = re.compile(r"layout\((\w+)\) (uniform (?:(readonly|writeonly) )?u?image2DArray) ([\w, ]+);")
_BLOCK = re.compile(r"layout\(std140\) uniform \w+ \{ vec4 (\w+)\[(\w+)\]; \};")
_CONSTANTS = re.compile(r"uniform (\w+) ([\w, ]+);")
_BETWEEN = re.compile(r"(in|out) (\w+) (\w+);")


@dataclass(frozen=True)
class Image:
    """An image array that a pass binds. format: as in GLSL; reads, writes: whether the pass loads from it and stores
    to it."""

    format: str
    reads: bool
    writes: bool


@dataclass(frozen=True, eq=False)
class Pass:
    """A compute pass, or a stage of what draws; `read_pass` gives it.

    file, step: in shaders/, without .glsl; the step is "" where the file has one alone
    defines: {name: value} of its other macros
    source: the whole compute shader in GLSL 4.3
    body: that without macros and declarations, for Blender's `gpu` module, which writes them
    samplers: {name: GLSL type}
    images: {name: Image}
    constants: {name: GLSL type} of its uniforms
    blocks: {name: length} of its uniform blocks, each an array of vec4
    ins, outs: {name: GLSL type} of what a stage that draws gets and gives
    local_size: invocations of a workgroup (x, y, z)
    """

    file: str
    step: str
    defines: dict[str, int | str]
    source: str
    body: str
    samplers: dict[str, str]
    images: dict[str, Image]
    constants: dict[str, str]
    blocks: dict[str, int]
    ins: dict[str, str]
    outs: dict[str, str]
    local_size: tuple[int, int, int]

    def groups(self, extent: tuple[int, ...]) -> tuple[int, ...]:
        """The workgroups that cover `extent` invocations (x, y[, z])."""
        return tuple(-(-n // local) for n, local in zip((*extent, 1)[:3], self.local_size, strict=True))


@cache
def read_pass(file: str, step: str = "", **defines: int | str) -> Pass:
    """The pass of a step of shaders/FILE.glsl, compiled with these macros; the same one for the same arguments."""
    samplers, images, constants, blocks, local_size = {}, {}, {}, {}, (1, 1, 1)
    between = {"in": {}, "out": {}}
    source = ["#version 430", *(f"#define {name} {value}" for name, value in defines.items())]
    body = []
    for line in _live(SHADERS / f"{file}.glsl", {step: 1, **defines}):
        declared, bound = line.partition("  //")[0], [line]
        if found := _LOCAL_SIZE.fullmatch(declared):
            local_size = tuple(int(size or 1) for size in found.groups())
        elif found := _SAMPLERS.fullmatch(declared):
            kind, names = found[1], found[2].split(", ")
            bound = [
                f"layout(binding = {unit}) uniform {kind} {name};" for unit, name in enumerate(names, len(samplers))
            ]
            samplers |= dict.fromkeys(names, kind)
        elif found := _IMAGES.fullmatch(declared):
            form, declares, access, names = *found.groups()[:3], found[4].split(", ")
            bound = [
                f"layout(binding = {unit}, {form}) {declares} {name};" for unit, name in enumerate(names, len(images))
            ]
            image = Image(defines.get(form, form), reads=access != "writeonly", writes=access != "readonly")
            images |= dict.fromkeys(names, image)
        elif found := _BLOCK.fullmatch(declared):
            bound = [line.replace("(", f"(binding = {len(blocks)}, ", 1)]
            blocks[found[1]] = int(defines.get(found[2], found[2]))
        elif found := _CONSTANTS.fullmatch(declared):
            constants |= dict.fromkeys(found[2].split(", "), found[1])
        elif found := _BETWEEN.fullmatch(declared):
            between[found[1]][found[3]] = found[2]
        elif not line.startswith("#line"):
            body.append(line)
        source.append(" ".join(bound))
    texts = "\n".join(source), "\n".join(body)
    bindings = samplers, images, constants, blocks, between["in"], between["out"]
    return Pass(file, step, defines, *texts, *bindings, local_size)


# Of a condition: whether its lines count, whether those of a later branch may, or none any more.
_LIVE, _WAITS, _OVER = range(3)


def _live(path: Path, macros: dict) -> Iterator[str]:
    """The lines of a source whose conditions hold, others blank; includes in place, numbered for compilers."""
    yield "#line 1"
    around = []  # the states of the conditions around a line
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        word, rest = found.groups() if (found := _DIRECTIVE.fullmatch(line.partition("  //")[0])) else ("", "")
        if word in ("if", "ifdef", "ifndef"):
            condition = {"if": rest, "ifdef": f"defined({rest})", "ifndef": f"!defined({rest})"}[word]
            reached = all(state == _LIVE for state in around)
            around.append((_LIVE if _holds(condition, macros) else _WAITS) if reached else _OVER)
        elif word in ("elif", "else"):
            if around[-1] != _WAITS:
                around[-1] = _OVER
            elif word == "else" or _holds(rest, macros):
                around[-1] = _LIVE
        elif word == "endif":
            around.pop()
        live = all(state == _LIVE for state in around)
        if live and word == "include":
            yield from _live(SHADERS / "include" / rest.strip('"'), macros)
            yield f"#line {number + 1}"
        else:
            yield line if live and not word else ""


def _holds(condition: str, macros: dict) -> bool:
    return any(all(_is(term, macros) for term in terms.split(" && ")) for terms in condition.split(" || "))


def _is(term: str, macros: dict) -> bool:
    """KeyError: Python gives no value for the macro."""
    name, _, number = term.removeprefix("!").partition(" == ")
    if name.startswith("defined("):
        found = name[8:-1] in macros
    else:
        found = macros[name] == int(number) if number else macros[name] != 0
    return found != term.startswith("!")
