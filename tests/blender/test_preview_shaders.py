"""The shaders that draw in previews translate to the Metal Shading Language, as passes do (compute/test_metal.py)."""

import shutil
import subprocess

import pytest

from shutter_addon.compute.passes import body

TOOLS = "glslangValidator", "spirv-cross"
SAMPLERS = {"FLOAT_2D_ARRAY": "sampler2DArray", "UINT_2D_ARRAY": "usampler2DArray"}
# Beside what preview.py gives each of them, those that all have.
COMMON = {"ModelViewProjectionMatrix": "MAT4", "srgbTarget": "BOOL"}
SHADERS = "show_picture", "show_coefficients", "show_scribbles"


@pytest.fixture(scope="module", autouse=True)
def _tools():
    if not all(map(shutil.which, TOOLS)):
        pytest.skip("NO TRANSLATION TO METAL: install Debian's glslang-tools and spirv-cross")


def completed(preview, name: str, stage: str) -> str:
    """The source of a stage with its interface in GLSL for Vulkan, as Blender's `gpu` module writes it."""
    constants = COMMON | preview._CONSTANTS[name]
    block = " ".join(f"{kind.lower()} {constant};" for constant, kind in constants.items())
    lines = ["#version 450", f"layout(push_constant, std430) uniform constants {{ {block} }} PushConstants;"]
    lines += [f"#define {constant} (PushConstants.{constant})" for constant in constants]
    if stage == "vert":
        lines += ["layout(location = 0) in vec2 corner;", "layout(location = 1) in vec2 place;"]
        lines += ["layout(location = 0) out vec2 at;", "#line 1", body("show_quad")]
    else:
        samplers = preview._SAMPLERS[name].items()
        lines += ["layout(location = 0) in vec2 at;", "layout(location = 0) out vec4 shown;"]
        lines += [f"layout(binding = {i}) uniform {SAMPLERS[kind]} {own};" for i, (own, kind) in enumerate(samplers)]
        lines += ["#line 1", body(name)]
    return "\n".join(lines)


def test_these_are_all(bpy):
    from shutter_addon.blender.interface import preview

    assert set(SHADERS) == preview._SAMPLERS.keys() == preview._CONSTANTS.keys()


@pytest.mark.parametrize("name", SHADERS)
@pytest.mark.parametrize(("stage", "function"), [("vert", "vertex"), ("frag", "fragment")])
def test_a_shader_translates(bpy, tmp_path, name, stage, function):
    from shutter_addon.blender.interface import preview

    binary, metal = tmp_path / "shader.spv", tmp_path / "shader.metal"
    compiled = subprocess.run(
        ["glslangValidator", "-V", "--target-env", "vulkan1.2", "--stdin", "-S", stage, "-o", binary],
        input=completed(preview, name, stage),
        capture_output=True,
        text=True,
    )
    assert compiled.returncode == 0, compiled.stdout
    command = ["spirv-cross", binary, "--msl", "--msl-version", "20200", "--output", metal]
    translated = subprocess.run(command, capture_output=True, text=True)
    assert translated.returncode == 0, translated.stderr
    assert f"\n{function} main0_out main0(" in metal.read_text()
