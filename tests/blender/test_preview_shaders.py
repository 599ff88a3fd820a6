"""The shaders that draw in previews translate to the Metal Shading Language, as passes do (compute/test_metal.py)."""

import pytest

from shutter_addon.compute.devices.passes import read_pass


def completed(quad, shown, stage: str) -> str:
    """The source of a stage with its interface in GLSL for Vulkan, as Blender's `gpu` module writes it."""
    constants = quad.constants | shown.constants
    block = " ".join(f"{kind} {constant};" for constant, kind in constants.items())
    lines = ["#version 450", f"layout(push_constant, std430) uniform constants {{ {block} }} PushConstants;"]
    lines += [f"#define {constant} (PushConstants.{constant})" for constant in constants]
    own = quad if stage == "vert" else shown
    for way, names in (("in", own.ins), ("out", own.outs)):
        lines += [f"layout(location = {i}) {way} {kind} {name};" for i, (name, kind) in enumerate(names.items())]
    lines += [f"layout(binding = {i}) uniform {kind} {name};" for i, (name, kind) in enumerate(own.samplers.items())]
    return "\n".join([*lines, "#line 1", own.body])


@pytest.mark.parametrize("name", ["PICTURE", "COEFFICIENTS", "EDGES", "SCRIBBLES"])
@pytest.mark.parametrize(("stage", "function"), [("vert", "vertex"), ("frag", "fragment")])
def test_a_shader_translates(to_metal, name, stage, function):
    quad, shown = read_pass("show", "QUAD"), read_pass("show", name)
    assert quad.outs == shown.ins
    assert f"\n{function} main0_out main0(" in to_metal(completed(quad, shown, stage), stage)
