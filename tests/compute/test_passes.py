"""The sources of passes suit every device, those that a test machine does not have included."""

import re

import pytest

from shutter_addon.compute import diffusion_gpu, edge_diffusion_gpu, gpu, matting, window
from shutter_addon.compute.passes import SHADERS, Pass, body

PASSES = [
    value for made in (diffusion_gpu, edge_diffusion_gpu) for value in vars(made).values() if isinstance(value, Pass)
]
PASSES += [gpu.composition(way, 3, "frames", 1, 2, True, False) for way in ("pieces", "frames", "search", "value")]
PASSES += [
    gpu.composition(way, 3, stored, 1, 2, True, False)
    for way in ("frames", "search", "value")
    for stored in ("sums", "tiles")
]
for tiled in (True, False):
    PASSES += [gpu.composition_of_sums(4, 2, True, tiled, False)]
    PASSES += [window.accumulation(1, again, False, tiled) for again in (True, False)]
PASSES += [window.packing(1, True), *(matting.blend_pass(2, adds) for adds in (False, True))]
PASSES += [
    gpu.composition_of_moved(way, 2, 3, 3, packed, 1, shortened, False, False, True, (True, False))
    for way in ("frames", "search", "value")
    for packed, shortened in ((True, True), (False, False))
]
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
