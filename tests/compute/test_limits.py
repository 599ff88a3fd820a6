"""Passes suit every device on which they may run: they keep to the least of OpenGL 4.3, Vulkan 1.3 and Metal."""

import math
import re

import pytest
from all_passes import PASSES, told

from shutter_addon.compute.devices.passes import SHADERS, read_pass

# Images, samplers and uniform blocks of a pass; bytes of a block, and of all constants; invocations of a workgroup
# along each axis, and in all.
LIMITS = {
    # The OpenGL Graphics System, version 4.3 (core profile), its tables of implementation dependent values:
    # MAX_COMPUTE_IMAGE_UNIFORMS, MAX_COMPUTE_TEXTURE_IMAGE_UNITS, MAX_COMPUTE_UNIFORM_BLOCKS, MAX_UNIFORM_BLOCK_SIZE,
    # MAX_COMPUTE_UNIFORM_COMPONENTS (512 of four bytes), MAX_COMPUTE_WORK_GROUP_SIZE and _INVOCATIONS.
    "OpenGL 4.3": (8, 16, 12, 16384, 2048, (1024, 1024, 64), 1024),
    # Vulkan 1.3, "Required Limits": maxPerStageDescriptorStorageImages, maxPerStageDescriptorSampledImages,
    # maxPerStageDescriptorUniformBuffers, maxUniformBufferRange, maxPushConstantsSize, maxComputeWorkGroupSize and
    # maxComputeWorkGroupInvocations.
    "Vulkan 1.3": (4, 16, 12, 16384, 128, (128, 128, 64), 128),
    # What Blender's Metal backend binds (mtl_shader_generate.hh, mtl_capabilities.hh): images in 8 slots, samplers in
    # 64 behind them, blocks in 13, and all constants in one block of 4 KB. Workgroups: Apple's Metal Feature Set
    # Tables, "GPU implementation limits by family", from Apple4 on; less for a kernel that takes many registers, which
    # is another reason to stay far below.
    "Metal": (8, 64, 13, 65536, 4096, (1024, 1024, 1024), 1024),
}
BYTES = {"int": 4, "float": 4, "ivec2": 8, "vec2": 8, "ivec3": 16, "ivec4": 16}
# Apple's reference, MTLReadWriteTextureTier2: all Macs have it on which Blender 5 runs. The first line is tier 1.
METAL_LOADS_AND_STORES = {
    *("r32f", "r32ui", "r32i"),
    *(f"{size}{kind}" for size in ("rgba16", "r16") for kind in ("f", "ui", "i")),
    *(f"{size}{kind}" for size in ("rgba8", "r8") for kind in ("", "ui", "i")),
    *("rgba32f", "rgba32ui", "rgba32i"),
}
# SPIR-V, "Image Format": those that need the capability Shader alone. All others need Vulkan's optional feature
# shaderStorageImageExtendedFormats.
VULKAN_STORES = {
    *(f"rgba{bits}{kind}" for bits in (8, 16, 32) for kind in ("i", "ui")),
    *("rgba32f", "rgba16f", "r32f", "rgba8", "rgba8_snorm", "r32i", "r32ui"),
    "rgba16",  # the exception, for frames of 16 bits on Blender's device: others lose bits or take twice the memory
}
# What some device lacks, or Blender's Python: 64 and 16 bits, subgroups and their size, memory of a workgroup, atomics.
LACKED = r"double|dvec\d|dmat\w+|u?int(?:16|64)_t|shared|barrier|subgroup\w*|gl_Sub\w+|\w*[aA]tomic\w*"
MISSING = re.compile(rf"\b(?:{LACKED})\b")
# Words of C++14 and of the Metal Shading Language that GLSL leaves free: Blender gives Metal our names as they are.
# `st` and `texture` are its own macros.
WORDS_OF_METAL = set(
    re.findall(
        r"\w+",
        """alignas alignof and and_eq asm auto bitand bitor catch char class compl concept constexpr const_cast decltype
        delete dynamic_cast enum explicit export extern friend goto inline long mutable namespace new noexcept not
        not_eq nullptr operator or or_eq private protected public register reinterpret_cast requires short signed sizeof
        static static_assert static_cast template this thread_local throw try typedef typeid typename union unsigned
        using virtual volatile wchar_t xor xor_eq
        constant device fragment half kernel metal ray_data sampler st texture thread threadgroup
        threadgroup_imageblock uchar ushort vertex visible""",
    )
)
NAMED = re.compile(r"\b(?:void|bool|u?int|float|[biu]?vec[234]|mat[234]|Column)\s+(\w+)")


def code(program) -> str:
    return re.sub(r"//.*", "", program.body)


@pytest.mark.parametrize("api", LIMITS)
def test_passes_are_within_the_limits_of(api):
    images, samplers, blocks, block_bytes, constant_bytes, size, invocations = LIMITS[api]
    for program in PASSES:
        assert len(program.images) <= images, told(program)
        assert len(program.samplers) <= samplers, told(program)
        assert len(program.blocks) <= blocks, told(program)
        assert all(16 * length <= block_bytes for length in program.blocks.values()), told(program)
        assert sum(BYTES[kind] for kind in program.constants.values()) <= constant_bytes, told(program)
        assert all(own <= most for own, most in zip(program.local_size, size, strict=True)), told(program)
        assert math.prod(program.local_size) <= invocations, told(program)


def test_images_have_formats_that_every_vulkan_stores_and_metal_changes():
    for program in PASSES:
        assert {image.format for image in program.images.values()} <= VULKAN_STORES, told(program)
        for name, image in program.images.items():
            assert not (image.reads and image.writes) or image.format in METAL_LOADS_AND_STORES, (told(program), name)


def test_a_source_has_nothing_that_some_device_lacks():
    """Blender makes C++ of it by macros: there, arrays are no values, and a struct without a constructor has none."""
    for program in PASSES:
        text = code(program)
        assert not MISSING.findall(text), told(program)
        assert not re.findall(r"[(,]\s*(?:in\s+)?(?!out|inout)\w+\s+\w+\[", text), told(program)
        structs = re.findall(r"\bstruct\s+(\w+)", text)
        assert not [name for name in structs if re.search(rf"\b{name}\(", text)], told(program)


def test_no_name_is_a_word_of_metal():
    previews = [read_pass("show", step) for step in ("QUAD", "PICTURE", "COEFFICIENTS", "SCRIBBLES")]
    for program in (*PASSES, *previews):
        named = {*NAMED.findall(code(program)), *program.constants, *program.samplers}
        named |= {*program.images, *program.blocks}
        assert named, told(program)
        assert not named & WORDS_OF_METAL, told(program)
        assert not MISSING.findall(code(program)), told(program)


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
    files = [
        re.sub(r"(?m)  //.*$", "", path.read_text(encoding="utf-8")).splitlines() for path in SHADERS.rglob("*.glsl")
    ]
    for program in PASSES:
        _, *parts = re.split(r"(?m)^#line (\d+)$\n?", re.sub(r"(?m)  //.*$", "", program.source))
        for first, text in zip(parts[::2], parts[1::2], strict=True):
            for number, line in enumerate(text.splitlines(), int(first)):
                if line and "binding = " not in line:
                    assert any(line in file[number - 1 : number] for file in files), (told(program), number, line)
