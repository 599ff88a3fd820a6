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


@pytest.mark.parametrize(("size", "count", "place"), [(99, 300, 98), (100_000, 300, 99_999), (200_000, 256, 8192)])
def test_each_file_of_a_long_sequence_counts(bpy, saved, tmp_path, size, count, place):
    """Files of one size, as of DPX."""
    first = write_frames(tmp_path, np.zeros((1, 4, 4, 3), np.uint8))
    for number in range(2, count + 1):
        first.with_name(f"f{number:04d}.png").write_bytes(bytes(size))
    bpy.data.images.load(str(first)).source = "SEQUENCE"
    before = versions.of_edit(saved)
    first.with_name("f0002.png").write_bytes(bytes(place) + b"1" + bytes(size - place - 1))
    assert versions.of_edit(saved).key != before.key


def _tiles(bpy, folder):
    image = bpy.data.images.new("wood", 4, 4, tiled=True)
    image.filepath = str(folder / "wood.<UDIM>.png")
    image.tiles.new(1002)


def _volumes(bpy, folder):
    smoke = bpy.data.volumes.new("smoke")
    smoke.filepath, smoke.is_sequence = str(folder / "smoke_0002.vdb"), True


def _images(bpy, folder):
    write_frames(folder, np.zeros((2, 4, 4, 3), np.uint8))
    bpy.data.images.load(str(folder / "f0002.png")).source = "SEQUENCE"


@pytest.mark.parametrize(
    ("name_files", "names"),
    [
        (_tiles, ["wood.1001.png", "wood.1002.png"]),
        (_volumes, ["smoke_0001.vdb", "smoke_0002.vdb", "smoke_0003.vdb"]),
        (_images, ["f0001.png", "f0002.png"]),
    ],
)
def test_each_file_of_what_is_shown_counts(bpy, saved, tmp_path, name_files, names):
    """Blender shows files of a sequence by their number, those before the one that is named as well."""
    name_files(bpy, tmp_path)
    paths = [tmp_path / name for name in names]
    keys = []
    for path in [None, *paths]:
        for each in paths:
            each.write_bytes(b"newer" if each == path else b"as it was")
        keys.append(versions.of_edit(saved).key)
    assert len(set(keys)) == len(keys)
    assert set(paths) <= set(versions.read_files(saved))


def test_a_missing_file_hides_no_other(bpy, saved, tmp_path):
    _tiles(bpy, tmp_path)
    (tmp_path / "wood.1002.png").write_bytes(b"as it was")
    before = versions.of_edit(saved)
    (tmp_path / "wood.1002.png").write_bytes(b"newer")
    newer = versions.of_edit(saved)
    (tmp_path / "wood.1002.png").rename(tmp_path / "wood.1001.png")
    assert len({before.key, newer.key, versions.of_edit(saved).key}) == 3
