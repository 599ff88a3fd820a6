"""The sources of passes suit every device, those that a test machine does not have included."""

import re

import pytest
from all_passes import PASSES

from shutter_addon.devices.passes import SHADERS, body

# Of what is declared inside the sources, whatever it is: variables, parameters, functions.
DECLARED = re.compile(r"\b(?:bool|u?int|float|[biu]?vec[234])\s+(\w+)")
BYTES = {"int": 4, "float": 4, "ivec2": 8, "vec2": 8}


@pytest.mark.parametrize("program", PASSES, ids=lambda program: program.name)
def test_constants_and_textures_share_no_name_with_a_variable(program):
    """On Vulkan they are macros."""
    declared = set(DECLARED.findall(body(program.name)))
    assert declared
    assert not declared & {*program.constants, *program.samplers, *program.images, *program.blocks}


@pytest.mark.parametrize("program", PASSES, ids=lambda program: program.name)
def test_constants_fit(program):
    """128 bytes are what every Vulkan driver has."""
    assert sum(BYTES[kind] for kind in program.constants.values()) <= 128


def test_every_source_has_its_pass():
    names = {program.name for program in PASSES} | {"unpack"}
    passes = {path.stem for path in SHADERS.glob("*.glsl") if not path.stem.startswith("show_")}  # those draw
    assert names == passes
