"""Read compute passes from the files in shaders/: each pass is a step of a file, with the names of what it binds.

A file with several steps has each between `#ifdef STEP` and `#endif`. Declarations are read here, because Blender's
`gpu` module needs them, and moderngl needs binding points. So #include and conditions are resolved here. A condition
consists of NAME, !NAME, NAME == number and defined(STEP), joined by && and ||; others are refused. Macros have the
values that Python gives, or 0.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

SHADERS = Path(__file__).resolve().parents[3] / "shaders"

_DIRECTIVE = re.compile(r"#\s*(\w+)\s*(.*)")
_TERM = re.compile(r"(!?)(?:defined\((\w+)\)|(\w+)(?: == (\d+))?)")
_LOCAL_SIZE = re.compile(r"layout\(local_size_x = (\d+)(?:, local_size_y = (\d+))?\) in;")
_SAMPLERS = re.compile(r"uniform (u?sampler2DArray) ([\w, ]+);")
_IMAGES = re.compile(r"layout\((\w+)\) (uniform (?:(readonly|writeonly) )?u?image2DArray) ([\w, ]+);")
_BLOCK = re.compile(r"layout\(std140\) uniform \w+ \{ vec4 (\w+)\[(\w+)\]; \};")
_CONSTANTS = re.compile(r"uniform (\w+) ([\w, ]+);")
_BETWEEN = re.compile(r"(in|out) (\w+) (\w+);")


@dataclass(frozen=True)
class Image:
    """An image array that a pass binds.

    Attributes:
        format: Its GLSL format, such as rgba32f.
        reads: Whether the pass loads from it.
        writes: Whether the pass stores to it.
    """

    format: str
    reads: bool
    writes: bool


@dataclass(eq=False)
class Pass:
    """A compute, vertex or fragment shader, with the names and types of what it binds. Made by `read_pass`.

    Attributes:
        file: The name of its file in shaders/, without .glsl.
        step: The macro that selects its part of the file; "" if the file has only one.
        defines: {name: value} of its other macros.
        source: The complete GLSL source, version 4.3.
        body: The source without `defines` and declarations, which Blender's `gpu` module adds.
        samplers: {name: GLSL type}.
        images: {name: Image}.
        constants: {name: GLSL type} of its uniforms.
        blocks: {name: length} of its uniform blocks, each an array of that many vec4.
        ins: {name: GLSL type} of the inputs of a vertex or fragment shader; empty for a compute shader.
        outs: {name: GLSL type} of its outputs; empty for a compute shader.
        local_size: The invocations of a workgroup (x, y, z).
    """

    file: str
    step: str
    defines: dict[str, int | str]
    source: str = ""
    body: str = ""
    samplers: dict[str, str] = field(default_factory=dict)
    images: dict[str, Image] = field(default_factory=dict)
    constants: dict[str, str] = field(default_factory=dict)
    blocks: dict[str, int] = field(default_factory=dict)
    ins: dict[str, str] = field(default_factory=dict)
    outs: dict[str, str] = field(default_factory=dict)
    local_size: tuple[int, int, int] = (64, 1, 1)

    def groups(self, extent: tuple[int, ...]) -> tuple[int, ...]:
        """Return the number of workgroups that cover `extent` invocations (x, y[, z])."""
        return tuple(-(-n // local) for n, local in zip((*extent, 1)[:3], self.local_size, strict=True))


@cache
def read_pass(file: str, step: str = "", **defines: int | str) -> Pass:
    """Read a pass from shaders/. The same arguments in the same order return the same object.

    Args:
        file: The file's name, without .glsl.
        step: The macro that selects a part of the file (#ifdef STEP); "" if the file has only one.
        defines: {name: value} of further macros, inserted as #define. Macros in conditions without a value are 0.

    Raises:
        ValueError: The file has a directive or condition that is not supported (see the module).
    """
    program = Pass(file, step, defines)
    source, body = [], []
    for line in _live(SHADERS / f"{file}.glsl", {step: 1, **defines}):
        declared = _declared(program, line.partition("  //")[0])
        source.append(declared or line)
        if not declared and not line.startswith("#line"):
            body.append(line)
    head = ["#version 430", *(f"#define {name} {value}" for name, value in defines.items())]
    if not program.outs:  # a stage that draws has some
        head.append("layout(local_size_x = {}, local_size_y = {}) in;".format(*program.local_size))
    program.source, program.body = "\n".join([*head, *source]), "\n".join(body)
    return program


def _declared(program: Pass, line: str) -> str:
    """Add what a line of GLSL declares (workgroup size, samplers, images, uniforms, inputs or outputs) to a pass.

    Args:
        program: The pass, which is modified.
        line: The line, without its comment.

    Returns:
        The declaration, with binding points for samplers, images and uniform blocks; "" if the line declares nothing.
    """
    defines, samplers, images = program.defines, len(program.samplers), len(program.images)
    if found := _LOCAL_SIZE.fullmatch(line):
        program.local_size = int(found[1]), int(found[2] or 1), 1
    elif found := _SAMPLERS.fullmatch(line):
        kind, names = found[1], found[2].split(", ")
        program.samplers |= dict.fromkeys(names, kind)
        return " ".join(f"layout(binding = {k}) uniform {kind} {name};" for k, name in enumerate(names, samplers))
    elif found := _IMAGES.fullmatch(line):
        form, kind, access, names = found[1], found[2], found[3], found[4].split(", ")
        image = Image(str(defines.get(form, form)), reads=access != "writeonly", writes=access != "readonly")
        program.images |= dict.fromkeys(names, image)
        return " ".join(f"layout(binding = {k}, {form}) {kind} {name};" for k, name in enumerate(names, images))
    elif found := _BLOCK.fullmatch(line):
        unit = len(program.blocks)
        program.blocks[found[1]] = int(defines.get(found[2], found[2]))
        return line.replace("(", f"(binding = {unit}, ", 1)
    elif found := _CONSTANTS.fullmatch(line):
        program.constants |= dict.fromkeys(found[2].split(", "), found[1])
    elif found := _BETWEEN.fullmatch(line):
        (program.ins if found[1] == "in" else program.outs)[found[3]] = found[2]
    else:
        return ""
    return line


def _live(path: Path, macros: Mapping[str, int | str]) -> Iterator[str]:
    """Yield the lines of a shader file, with conditions and #include resolved for some macros.

    Conditions, and lines for which they do not hold, become blank. Included files are inserted. A #line directive
    at the start and after each included file keeps line numbers right in the compiler's errors.

    Args:
        path: The shader file.
        macros: {name: value} of the macros; others are 0.

    Raises:
        ValueError: A directive or a condition is not supported.
    """
    yield "#line 1"
    around = [(True, True)]  # of the conditions around a line: whether its lines count, and no later branch can
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        word, rest = found.groups() if (found := _DIRECTIVE.fullmatch(line.partition("  //")[0])) else ("", "")
        if word in ("if", "ifdef"):
            reached, condition = around[-1][0], rest if word == "if" else f"defined({rest})"
            counts = reached and _holds(condition, macros)
            around.append((counts, counts or not reached))
        elif word in ("elif", "else"):
            is_over = around[-1][1]
            counts = not is_over and (word == "else" or _holds(rest, macros))
            around[-1] = counts, counts or is_over
        elif word == "endif":
            around.pop()
        elif word not in ("", "include", "define"):
            raise ValueError(f"{path.name}, line {number}: #{word} is not supported")
        live = around[-1][0]
        if live and word == "include":
            yield from _live(SHADERS / "include" / rest.strip('"'), macros)
            yield f"#line {number + 1}"
        else:
            yield line if live and word in ("", "define") else ""


def _holds(condition: str, macros: Mapping[str, int | str]) -> bool:
    """Return whether the condition of an #if, terms joined by && and ||, holds for macros {name: value}."""
    return any(all(_is(term, macros) for term in terms.split(" && ")) for terms in condition.split(" || "))


def _is(term: str, macros: Mapping[str, int | str]) -> bool:
    """Return whether a term of a condition holds: NAME, !NAME, NAME == number or defined(STEP)."""
    if not (found := _TERM.fullmatch(term)):
        raise ValueError(f"#if {term}: this condition is not supported")
    negated, step, name, number = found.groups()
    holds = step in macros if step else macros.get(name, 0) == int(number) if number else macros.get(name, 0) != 0
    return holds != bool(negated)
