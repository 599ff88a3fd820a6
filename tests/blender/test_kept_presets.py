"""A shutter keeps to its preset while Frames, Position and Smooth change, until its bars are edited."""

import itertools

import made_recipes
import numpy as np
import pytest

from shutter_addon.blender.data import consistency, recipe_import, strips
from shutter_addon.blender.editing import bar_edits, shutter_edits
from shutter_addon.core.model import shutters

WINDOWS = 1, 2, 8, 32, 256


def bars(effect, index=1):
    return consistency.bars(effect.shutters[index])


def opened(effect, index=1):
    return np.flatnonzero(bars(effect, index)).tolist()


def made(name, effect):
    weights = shutters.preset_bars(name, effect.window, effect.position.lower())
    return pytest.approx(weights, abs=1e-7)


@pytest.mark.parametrize("name", shutters.PRESETS)
@pytest.mark.parametrize("position", ["START", "CENTER", "END"])
def test_it_is_what_the_preset_makes_however_it_came_there(effect, name, position):
    shutter_edits.apply_preset(effect, 1, name)
    for window in (*WINDOWS, 8, 1, 32):
        effect.window = window
        assert bars(effect) == made(name, effect)
    effect.position = position
    assert bars(effect) == made(name, effect)
    for smooth, window in itertools.product(("2", "8", "AUTO"), (32, 1, 2, 10)):
        effect.inbetween = smooth
        effect.window = window
        assert bars(effect) == made(name, effect)
        assert consistency.preset_of(effect, 1) == name


def by_hand(effect):
    bar_edits.paint(effect, 1, np.eye(8)[3])


def by_number(_effect):
    import bpy

    bpy.ops.shutter.bar_set("EXEC_DEFAULT", True, bar=4, weight=0.5)


def by_script(effect):
    effect.shutters[1].bars[7].weight = 0.25


def by_keys(effect):
    bar_edits.key_bars(effect, 1)


def by_recipe(effect):
    parts = [{"name": "A", "bars": [1] * 8}, {"name": "B", "bars": [1, *[0] * 7]}]
    scene, _, strip = strips.find_effect(effect.scene)
    recipe_import.apply(scene, effect, strip, made_recipes.made(8, parts))


@pytest.mark.parametrize("edited", [by_hand, by_number, by_script, by_keys, by_recipe])
def test_what_was_edited_keeps_its_shape(effect, edited):
    """Even if it is the preset's bars by chance on the way."""
    assert consistency.preset_of(effect, 1) == "STILL"
    edited(effect)
    assert consistency.preset_of(effect, 1) == ""
    before = bars(effect)
    effect.position = "CENTER"
    assert bars(effect).tolist() == before.tolist()
    for window in (1, 32):
        before = shutters.resample(bars(effect), window)
        effect.window = window
        assert bars(effect) == pytest.approx(before, abs=1e-6)


def test_where_the_position_is_keyed_it_is_that_of_the_frame(edit, effect):
    path = f"{effect.path_from_id()}.position"
    for frame, position in ((1, "START"), (9, "END")):
        effect.position = position
        edit.keyframe_insert(path, frame=frame)
    edit.frame_set(1)
    shutter_edits.apply_preset(effect, 1, "STILL")
    edit.frame_set(9)
    assert opened(effect) == [0], "keys change no bars"
    effect.window = 24
    assert opened(effect) == [23]
