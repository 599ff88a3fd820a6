"""Passes translate to the Metal Shading Language, by way of SPIR-V."""

import re

from all_passes import PASSES, told


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
    return "\n".join([*lines, "#line 1", program.body])


def test_passes_translate(to_metal):
    for program in PASSES:
        text = to_metal(completed(program), "comp")
        assert "kernel void" in text, told(program)
        bound = re.findall(r"(\w+) \[\[texture\(\d+\)\]\]", text)
        assert set(bound) == {*program.images, *program.samplers}, told(program)
        changed = re.findall(r"access::read_write> (\w+) \[\[", text)
        expected = {name for name, image in program.images.items() if image.reads and image.writes}
        assert set(changed) == expected, told(program)
