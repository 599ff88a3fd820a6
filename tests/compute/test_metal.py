"""Passes translate to the Metal Shading Language, by way of SPIR-V."""

import re
import shutil
import subprocess

import pytest
from all_passes import PASSES

from shutter_addon.compute.passes import body

TOOLS = "glslangValidator", "spirv-cross"


@pytest.fixture(scope="module", autouse=True)
def _tools():
    if not all(map(shutil.which, TOOLS)):
        pytest.skip("NO TRANSLATION TO METAL: install Debian's glslang-tools and spirv-cross")


def completed(program) -> str:
    """The source of a pass with its interface in GLSL for Vulkan, as Blender's `gpu` module writes it."""
    x, y, z = program.local_size
    lines = ["#version 450", *(f"#define {name} {value}" for name, value in program.defines.items())]
    lines.append(f"layout(local_size_x = {x}, local_size_y = {y}, local_size_z = {z}) in;")
    bound = []
    for name, image in program.images.items():
        access = "readonly " * (not image.writes) + "writeonly " * (not image.reads)
        bound.append((f"{image.format}, ", f"{access}{'u' * image.format.endswith('ui')}image2DArray {name};"))
    bound += [("", f"{kind} {name};") for name, kind in program.samplers.items()]
    bound += [("std140, ", f"{name}_block {{ vec4 {name}[{n}]; }};") for name, n in program.blocks.items()]
    lines += [f"layout({how}binding = {slot}) uniform {what}" for slot, (how, what) in enumerate(bound)]
    constants = " ".join(f"{kind} {name};" for name, kind in program.constants.items())
    lines.append(f"layout(push_constant, std430) uniform constants {{ {constants} }} PushConstants;")
    lines += [f"#define {name} (PushConstants.{name})" for name in program.constants]
    return "\n".join([*lines, "#line 1", body(program.name)])


@pytest.mark.parametrize("program", PASSES, ids=lambda program: program.name)
def test_a_pass_translates(program, tmp_path):
    binary, metal = tmp_path / "pass.spv", tmp_path / "pass.metal"
    compiled = subprocess.run(
        ["glslangValidator", "-V", "--target-env", "vulkan1.2", "--stdin", "-S", "comp", "-o", binary],
        input=completed(program),
        capture_output=True,
        text=True,
    )
    assert compiled.returncode == 0, compiled.stdout
    command = ["spirv-cross", binary, "--msl", "--msl-version", "20200", "--output", metal]
    translated = subprocess.run(command, capture_output=True, text=True)
    assert translated.returncode == 0, translated.stderr
    text = metal.read_text()
    assert "kernel void" in text
    bound = re.findall(r"(\w+) \[\[texture\(\d+\)\]\]", text)
    assert set(bound) == {*program.images, *program.samplers}
    changed = re.findall(r"access::read_write> (\w+) \[\[", text)
    assert set(changed) == {name for name, image in program.images.items() if image.reads and image.writes}
