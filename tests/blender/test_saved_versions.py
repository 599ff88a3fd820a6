"""What every version has saved, from 0.1.0 on, is opened by this one: nothing is lost, pictures are the same."""

import json
import shutil
import tomllib

import pytest
import saved_pictures
import stored
from made_recipes import comes_back
from support import ROOT

from shutter_addon.blender.data import data_format
from shutter_addon.core.recipes import recipe_file

SAVED = ROOT / "tests" / "saved"


def numbers(folder):
    return [int(part) for part in folder.name.split(".")]


FOLDERS = sorted(SAVED.glob("[0-9]*/"), key=numbers)


@pytest.fixture(params=FOLDERS, ids=lambda folder: folder.name)
def folder(request, tmp_path):
    """A copy of what a version has saved."""
    return shutil.copytree(request.param, tmp_path / "saved")


def lost(folder):
    """What the edit that is open lacks of what the version had stored in it, or of what has become of that."""
    values = json.loads((folder / "values.json").read_text())
    if json.loads((folder / "names.json").read_text())["format"] < 2:
        for effect in (effect for scene in values["scenes"].values() for effect in scene["effects"]):
            count_filmed(effect)
        for annotation in values["annotations"].values():
            annotation.pop("virtual_shutter_names")
    return list(stored.missing(values, stored.values()))


def count_filmed(effect):
    """What an effect's values are by format 2: bars count filmed frames, each the mean of its moments' bars. A window
    that ended within a frame is in no saved file."""
    for gone in ("bars_per_frame", "inbetween_method", "inbetween_place"):
        del effect[gone]
    del effect["camera"]["follow_clip"]
    for region in effect["regions"]:
        del region["follow_frame"], region["follow_stamp"]
    steps = int(effect["inbetween"])
    effect["window"] //= steps
    for shutter in effect["shutters"] if steps > 1 else ():
        weights = [bar["weight"] for bar in shutter["bars"]]
        means = [sum(weights[k : k + steps]) / steps for k in range(0, len(weights), steps)]
        shutter["bars"] = [{"weight": mean} for mean in means]
        if means.count(0) == len(means) - 1 and max(means) < 1:
            shutter["preset"] = ""  # a part of a frame was no still one


def test_this_version_has_kept_its_files():
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]
    assert SAVED / version in FOLDERS, "run scripts/save_version.py"


def test_nothing_is_lost(bpy, folder, capfd):
    edit = str(folder / "edit.blend")
    bpy.ops.wm.open_mainfile(filepath=edit)
    bpy.context.view_layer.update()
    assert lost(folder) == []
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=edit)
    assert lost(folder) == []
    assert "newer version" not in capfd.readouterr().err
    # Blender stores where its file browser was: nothing of the machine.
    spaces = (space for screen in bpy.data.screens for area in screen.areas for space in area.spaces)
    browsers = [space.params for space in spaces if space.type == "FILE_BROWSER" and space.params]
    assert {browser.directory for browser in browsers} == {b"//"}


def test_pictures_are_the_same(bpy, folder, tmp_path, same_pixels):
    count = 0
    for name, frame, expected in saved_pictures.kept(folder):
        picture = saved_pictures.rendered(folder, name, frame, tmp_path / f"{name}{frame}")
        same_pixels(picture, expected, 1, f"{folder.name}-{name}-{frame}")
        count += 1
    assert count >= 7


def test_recipes_are_read_and_written(folder):
    for path in (path for path in folder.glob("*.json") if path.name not in ("names.json", "values.json")):
        assert comes_back(recipe_file.load(path))


def test_what_older_versions_do_not_know_has_another_format():
    """Else they would open it without a word, and show other pictures."""
    before, now = json.loads((FOLDERS[-1] / "names.json").read_text()), stored.names()
    for kind, number, where in (
        ("properties", "format", "FORMAT of blender/data/data_format.py"),
        ("fields", "recipe", "`version` of a Recipe"),
    ):
        changed = before[kind] != now[kind]
        assert not changed or now[number] > before[number], (
            f"raise the {where}; before a release, remove its folder of tests/saved and run scripts/save_version.py"
        )


def test_everything_that_is_stored_is_in_the_files(bpy, monkeypatch):
    monkeypatch.setattr(data_format, "migrate", lambda: None)  # which may leave something out
    bpy.ops.wm.open_mainfile(filepath=str(FOLDERS[-1] / "edit.blend"))
    properties = json.loads((FOLDERS[-1] / "names.json").read_text())["properties"]
    assert stored.unused() & {f"{name}.{prop}" for name, props in properties.items() for prop in props} == set()
