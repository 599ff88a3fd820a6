"""The extension as Blender runs it: linked into its user folder, in the wheel and in a real Blender."""

import json
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from support import EXTENSION, KEYED, python, read_picture

ROOT = Path(__file__).parents[2]
TRACES = Path(__file__).parent / "traces.py"


def test_a_real_blender_keeps_nothing_of_a_disabled_extension(blender):
    done = blender("--python-exit-code", 1, "--python", TRACES)
    assert done.returncode == 0, done.stderr
    assert "NOTHING LEFT" in done.stdout
    assert "Traceback" not in done.stderr


def test_the_manifest_is_valid(bpy, monkeypatch):
    import bl_pkg

    monkeypatch.setattr(sys, "argv", ["", "validate", str(ROOT)])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(Path(bl_pkg.__file__).parent / "cli" / "blender_ext.py"), run_name="__main__")
    assert ended.value.code == 0


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
