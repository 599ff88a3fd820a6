"""Files of a newer version: they open with a sentence, and nothing of them is lost by saving. And older ones."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import stored
from support import ROOT, sequencer

from shutter_addon.blender import command
from shutter_addon.blender.data import data_format, preferences, property_copy
from shutter_addon.blender.editing import reconcile, undelete
from shutter_addon.core.recipes import recipe_file

NEWER = Path(__file__).with_name("newer_version.py")
SENTENCE = '"Edit" was saved by a newer version of Virtual Shutter (9.0.0): what this one does not know'


def newer_version(*arguments):
    """What a newer version finds in the file."""
    done = subprocess.run([sys.executable, NEWER, *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("VALUES ")]
    return json.loads(line.removeprefix("VALUES "))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """An edit of a newer version, and all that it stores in it."""
    folder = shutil.copytree(sorted((ROOT / "tests" / "saved").iterdir())[-1], tmp_path_factory.mktemp("newer") / "it")
    path = folder / "newer.blend"
    return path, newer_version("make", path, folder / "edit.blend")


@pytest.fixture
def newer(bpy, made, tmp_path, capfd):
    """The path of a copy, that is open, which one sentence says, and its edit."""
    path = shutil.copytree(made[0].parent, tmp_path / "it") / made[0].name
    capfd.readouterr()
    bpy.ops.wm.open_mainfile(filepath=str(path))
    said = capfd.readouterr().err
    assert said.startswith("Virtual Shutter: ")
    assert said.count(SENTENCE) == said.count("newer version") == 1
    return path, bpy.data.scenes["Edit"]


def test_nothing_of_it_is_lost_by_saving(bpy, newer, made):
    path, edit = newer
    assert edit.virtual_shutter.effects[0].position == ""
    bpy.context.view_layer.update()
    for frame in (4, 1):
        edit.frame_set(frame)
        bpy.ops.render.render(scene=edit.name)
    reconcile.update()
    bpy.ops.wm.save_mainfile()
    after = newer_version("read", path)
    assert list(stored.missing(made[1], after)) == []
    assert after["scenes"]["Edit"]["effects"][0]["position"] == "SCATTERED"
    assert after["scenes"]["Edit"]["effects"][0]["shutters"][0]["glows"][0]["strength"] == 4
    assert after["strips"]["Edit/regions effect"]["virtual_shutter_glow"] == "soft"
    assert after["saved by"]["Edit"] == [data_format.FORMAT + 1, "9.0.0"]


def test_a_copy_has_what_nobody_knows(newer):
    effects = newer[1].virtual_shutter.effects
    effects.add()
    property_copy.copy_properties(effects[0], effects[-1])
    kept, copied = (effects[i].bl_system_properties_get() for i in (0, -1))
    assert copied["glow"] == kept["glow"] == 0.75
    assert copied["position"] == kept["position"] == 3
    halo, glows = (effects[-1].shutters[0].bl_system_properties_get()[name] for name in ("halo", "glows"))
    assert halo["strength"] == 3
    assert [glow["strength"] for glow in glows] == [4]


def test_a_recipe_of_it_says_what_it_lacks(bpy, newer, tmp_path, capfd):
    _path, edit = newer
    with sequencer(bpy):
        edit.sequence_editor.active_strip = edit.sequence_editor.strips["combined effect"]
        assert bpy.ops.shutter.recipe_export(filepath=str(tmp_path / "recipe.json")) == {"FINISHED"}
    assert recipe_file.load(tmp_path / "recipe.json").options.at(1).window == 6
    assert "Warning: Data of a newer version of Virtual Shutter is left out" in capfd.readouterr().out


def test_a_linked_scene_of_it_stops_nothing(bpy, edit, made, capfd):
    """What is linked is left alone in any case; an appended one has all effects of the file left alone."""
    for link in (True, False):
        load = bpy.data.libraries.load(str(made[0]), link=link)
        with pytest.warns(UserWarning, match="does not contain"), load as (_found, wanted):
            wanted.scenes = ["not there", "Edit"]
        assert capfd.readouterr().err.count(SENTENCE) == 1
        assert data_format.is_file_newer() == (not link)


def test_the_command_says_it_and_check_refuses(bpy, newer, tmp_path, capfd):
    path, edit = newer
    edit.virtual_shutter.effects[0].position = "START"
    edit.virtual_shutter.effects[0].scene.render.use_border = False
    bpy.ops.wm.save_mainfile()
    capfd.readouterr()
    assert command.main(["render", str(path), "--frames", "15", "--output", str(tmp_path / "out")]) == 0
    assert SENTENCE in capfd.readouterr().err
    assert command.main(["check", str(path)]) == 2
    assert "the edit was saved by version 9.0.0 of the extension" in capfd.readouterr().err


def test_an_older_file_is_migrated_once(bpy, edit, effect, tmp_path):
    path = str(tmp_path / "older.blend")
    assert edit.virtual_shutter.format == data_format.FORMAT
    effect.window, effect.inbetween, edit.virtual_shutter.format = 8, "2", 1
    bpy.ops.wm.save_as_mainfile(filepath=path)
    for _ in range(2):
        bpy.ops.wm.open_mainfile(filepath=path)
        group = bpy.context.scene.virtual_shutter
        assert (group.effects[0].window, group.format) == (4, data_format.FORMAT)
        bpy.ops.wm.save_mainfile()


def test_what_is_made_of_older_effects_is_older(bpy, edit, effect):
    """Pasted into another edit, deleted and brought back: and saving makes nothing newer."""
    edit.virtual_shutter.format = 0
    copied = edit.copy()
    other = bpy.data.scenes.new("Other")
    other.sequence_editor_create().strips.new_scene("pasted", effect.scene, 2, 1)
    reconcile.update()
    undelete.keep(edit.virtual_shutter.effects[0])
    empty = bpy.data.scenes.new("Empty")
    undelete.restore(empty, edit.virtual_shutter.effects[0].identity)
    data_format.stamp_saved("9")
    assert [len(scene.virtual_shutter.effects) for scene in (copied, other, empty)] == [1, 1, 1]
    assert [scene.virtual_shutter.format for scene in (edit, copied, other, empty)] == [0, 0, 0, 0]
    data_format.migrate()
    assert {scene.virtual_shutter.format for scene in (edit, copied, other, empty)} == {data_format.FORMAT}


@pytest.mark.parametrize("number", [0, data_format.FORMAT + 1])
def test_an_effect_that_is_added_makes_nothing_older_or_newer(newer, number):
    newer[1].virtual_shutter.format = number
    data_format.new_effect(newer[1], data_format.FORMAT)
    assert newer[1].virtual_shutter.format == number


def test_a_device_that_a_newer_version_has_chosen(bpy):
    addons = bpy.context.preferences.addons
    addon = addons.new()
    try:
        addon.module = preferences.ADDON
        addon.preferences.device = "CPU"
        assert preferences.device() == "cpu"
        addon.preferences.bl_system_properties_get()["device"] = 99
        assert preferences.device() == "auto"
    finally:
        addons.remove(addon)
