"""The sources of passes suit every device, those that a test machine does not have included."""

import re

from all_passes import PASSES, told

from shutter_addon.devices.passes import SHADERS

# Of what is declared inside the sources, whatever it is: variables, parameters, functions.
DECLARED = re.compile(r"\b(?:bool|u?int|float|[biu]?vec[234])\s+(\w+)")


def bound(program) -> set[str]:
    return {*program.constants, *program.samplers, *program.images, *program.blocks}


def test_constants_and_textures_share_no_name_with_a_variable():
    """On Vulkan they are macros."""
    for program in PASSES:
        declared = set(DECLARED.findall(program.body))
        assert declared, told(program)
        assert not declared & bound(program), told(program)


def test_all_that_is_declared_is_read():
    """Blender declares it itself, and refuses constants that a source does not use."""
    for program in PASSES:
        assert not re.findall(r"(?m)^(?:layout|uniform|in |out ).*|^#(?!\s*define ).*", program.body), told(program)
        for name in bound(program):
            assert re.search(rf"\b{name}\b", re.sub("//.*", "", program.body)), (told(program), name)


def test_every_step_of_every_source_has_its_pass():
    for path in SHADERS.glob("*.glsl"):
        named = set(re.findall(r"(?:#ifn?def |defined\()(\w+)", path.read_text(encoding="utf-8")))
        passes = [program for program in PASSES if program.file == path.stem]
        assert passes or path.stem in ("blender_gpu", "show")
        assert not passes or named <= {name for program in passes for name in (program.step, *program.defines)}


def test_lines_are_numbered_as_in_the_files():
    """What compilers say of a line can be looked up."""
    files = [
        re.sub(r"(?m)  //.*$", "", path.read_text(encoding="utf-8")).splitlines() for path in SHADERS.rglob("*.glsl")
    ]
    for program in PASSES:
        _, *parts = re.split(r"(?m)^#line (\d+)$\n?", re.sub(r"(?m)  //.*$", "", program.source))
        for first, text in zip(parts[::2], parts[1::2], strict=True):
            for number, line in enumerate(text.splitlines(), int(first)):
                if line and "binding = " not in line:
                    assert any(line in file[number - 1 : number] for file in files), (told(program), number, line)
