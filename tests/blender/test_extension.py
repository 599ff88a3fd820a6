"""The extension as Blender runs it, as a library and in a real one; and nothing that Blender deprecates is used."""

import json
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from support import EXTENSION, KEYED, ROOT, python, read_picture

TRACES = Path(__file__).parent / "traces.py"


def test_a_real_blender_keeps_nothing_of_a_disabled_extension(blender):
    done = blender("--python-exit-code", 1, "--python", TRACES)
    assert done.returncode == 0, done.stderr
    assert "NOTHING LEFT" in done.stdout
    assert "Traceback" not in done.stderr


def test_a_saved_edit_renders_the_same_in_a_real_blender(blender, command_here, bunny, tmp_path):
    """Plain `blender -b FILE -a`, another Python, another FFmpeg; moved to another folder with its footage."""
    footage = tmp_path / "here" / "footage" / "bunny.mp4"
    footage.parent.mkdir(parents=True)
    footage.write_bytes(bunny.read_bytes())
    save = tmp_path / "here" / "edit.blend"
    command_here(footage, "--output", tmp_path / "wheel", "--save", save, "--frames", "6:9", recipe=KEYED)
    (tmp_path / "here").rename(tmp_path / "there")
    done = blender(tmp_path / "there" / "edit.blend", "-o", f"{tmp_path}/real/", "-f", "6,9")
    assert done.returncode == 0, done.stderr
    for frame in (6, 9):
        ours, real = (read_picture(tmp_path / where / f"{frame:04d}.png") for where in ("wheel", "real"))
        assert np.abs(ours - real).max() <= 1, frame


def test_the_command_in_a_real_blender_gives_its_exit_code(blender, tmp_path):
    """What it renders there: test_devices.py compares it."""
    (tmp_path / "r.json").write_text(json.dumps(KEYED))
    options = ["--recipe", tmp_path / "r.json", "--output", tmp_path / "no"]
    refused = blender("-c", "shutter", "render", tmp_path / "none.mp4", *options)
    assert refused.returncode == 2
    assert "none.mp4" in refused.stderr
    assert "Traceback" not in refused.stderr


def test_python_ends_while_an_effect_is_shown(user_folder, bunny, tmp_path):
    """Blender disables the extension when Python's threads take no more work."""
    code = f"""
import sys, bpy, addon_utils
from importlib import import_module
addon_utils.enable({EXTENSION!r}, default_set=True)
sys.exit(import_module({EXTENSION!r} + ".shutter_addon.blender.command").main(sys.argv[1:]))
"""
    (tmp_path / "recipe.json").write_text(json.dumps(KEYED))
    options = ("--recipe", tmp_path / "recipe.json", "--output", tmp_path / "out", "--frames", 1)
    done = python("-c", code, "render", bunny, *options, BLENDER_USER_RESOURCES=str(user_folder))
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


# What is deprecated

FOLDERS = ("shutter_addon", "scripts", "gallery", "tests", "docs", ".")
SUFFIXES = {".py", ".md", ""}
# Scenes, clips and masks have properties of the same names, which stay.
OTHERS = {"scene", "effect_scene", "edit", "edit()", "film", "clip", "mask"}


def deprecated(bpy):
    """Names of strips' deprecated properties; and those of them that other types have as well."""
    strips, others = set(), set()
    for name in dir(bpy.types):
        rna = getattr(getattr(bpy.types, name), "bl_rna", None)
        for prop in rna.properties if rna else ():
            (strips if prop.is_deprecated and name.endswith("Strip") else others).add(prop.identifier)
    return strips, strips & others


def files():
    found = (path for folder in FOLDERS for path in (ROOT / folder).glob("*" if folder == "." else "**/*"))
    return [path for path in found if path.is_file() and path.suffix in SUFFIXES and ".venv" not in path.parts]


def uses(path, alone, shared):
    """Where a file uses a name which strips alone have, or one that others share, of a strip."""
    text = path.read_text(encoding="utf-8", errors="replace")
    if alone:
        yield from re.findall(rf"\b(?:{'|'.join(alone)})\b", text)
    if path.suffix == ".py":
        yield from (
            use for use in re.findall(rf"((?:\w+(?:\(\))?)?)\.({'|'.join(shared)})\b", text) if use[0] not in OTHERS
        )


def test_nothing_deprecated_of_strips(bpy):
    strips, shared = deprecated(bpy)
    assert len(strips) >= 9
    assert shared
    assert len(files()) > 100
    assert not {path: found for path in files() if (found := list(uses(path, strips - shared, shared)))}


def test_what_is_deprecated_fails(edit):
    """Of Blender and of Python."""
    strip = edit.sequence_editor.strips.new_effect("strip", "COLOR", 1, 1, length=9)
    name = next(prop.identifier for prop in strip.bl_rna.properties if prop.is_deprecated)
    with pytest.raises(SystemError):  # Blender gives the value beside the exception, which Python takes for a fault
        getattr(strip, name)
    with pytest.raises(PendingDeprecationWarning):
        warnings.warn("soon", PendingDeprecationWarning, stacklevel=1)
