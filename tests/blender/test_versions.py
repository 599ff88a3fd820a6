"""The version of an edit: whatever changes its pictures is another version."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from support import write_frames

from shutter_addon.blender.data import versions


@pytest.fixture
def saved(bpy, edit, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edit.blend"))
    return bpy.context.scene


@pytest.mark.parametrize("name", ["OCIO", "BLENDER_OCIO"])
def test_a_studios_colours_are_another_version(bpy, saved, tmp_path, monkeypatch, name):
    own = versions.of_edit(saved)
    monkeypatch.setenv(name, str(tmp_path / "config.ocio"))
    assert versions.of_edit(saved) == own  # Blender takes its own where the file is missing
    its_own = Path(bpy.utils.system_resource("DATAFILES", path="colormanagement")) / "config.ocio"
    shutil.copy(its_own, tmp_path)  # as another Blender, which this one was started by, has it
    assert versions.of_edit(saved) == own
    (tmp_path / "config.ocio").write_text("a studio's")
    studios = versions.of_edit(saved)
    (tmp_path / "config.ocio").write_text("a newer one")
    newer = versions.of_edit(saved)
    monkeypatch.setenv(name, "ocio://default")
    assert len({own.key, studios.key, newer.key, versions.of_edit(saved).key}) == 4


@pytest.mark.parametrize("size", [99, 100_000])
def test_each_file_of_a_long_sequence_counts(bpy, saved, tmp_path, size):
    """Files of one size, as of DPX."""
    first = write_frames(tmp_path, np.zeros((1, 4, 4, 3), np.uint8))
    for number in range(2, 301):
        first.with_name(f"f{number:04d}.png").write_bytes(bytes(size))
    bpy.data.images.load(str(first)).source = "SEQUENCE"
    before = versions.of_edit(saved)
    assert before.footage[0].files == 300
    first.with_name("f0002.png").write_bytes(bytes(size - 1) + b"1")
    assert versions.of_edit(saved).key != before.key
