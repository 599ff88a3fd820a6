"""The shaders that draw in previews translate to the Metal Shading Language, as passes do (compute/test_metal.py)."""

import pytest

from shutter_addon.devices.passes import body

SAMPLERS = {"FLOAT_2D_ARRAY": "sampler2DArray", "UINT_2D_ARRAY": "usampler2DArray"}
# Beside what preview_quad.py gives each of them, those that all have.
COMMON = {"ModelViewProjectionMatrix": "MAT4", "srgbTarget": "BOOL"}
SHADERS = "show_picture", "show_coefficients", "show_scribbles"


def completed(preview_quad, name: str, stage: str) -> str:
    """The source of a stage with its interface in GLSL for Vulkan, as Blender's `gpu` module writes it."""
    constants = COMMON | preview_quad.CONSTANTS[name]
    block = " ".join(f"{kind.lower()} {constant};" for constant, kind in constants.items())
    lines = ["#version 450", f"layout(push_constant, std430) uniform constants {{ {block} }} PushConstants;"]
    lines += [f"#define {constant} (PushConstants.{constant})" for constant in constants]
    if stage == "vert":
        lines += ["layout(location = 0) in vec2 corner;", "layout(location = 1) in vec2 place;"]
        lines += ["layout(location = 0) out vec2 at;", "#line 1", body("show_quad")]
    else:
        samplers = preview_quad.SAMPLERS[name].items()
        lines += ["layout(location = 0) in vec2 at;", "layout(location = 0) out vec4 shown;"]
        lines += [f"layout(binding = {i}) uniform {SAMPLERS[kind]} {own};" for i, (own, kind) in enumerate(samplers)]
        lines += ["#line 1", body(name)]
    return "\n".join(lines)


def test_these_are_all(bpy):
    from shutter_addon.blender.interface import preview_quad

    assert set(SHADERS) == preview_quad.SAMPLERS.keys() == preview_quad.CONSTANTS.keys()


@pytest.mark.parametrize("name", SHADERS)
@pytest.mark.parametrize(("stage", "function"), [("vert", "vertex"), ("frag", "fragment")])
def test_a_shader_translates(bpy, to_metal, name, stage, function):
    from shutter_addon.blender.interface import preview_quad

    text = to_metal(completed(preview_quad, name, stage), stage)
    assert f"\n{function} main0_out main0(" in text
