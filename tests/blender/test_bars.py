"""Bars: a shutter keeps to its preset until they are edited; where the bar editor has them, and what a stroke does."""

import itertools

import made_recipes
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shutter_addon.blender.data import consistency, recipe_import, strips
from shutter_addon.blender.editing import bar_edits, shutter_edits
from shutter_addon.blender.interface import bar_editor, probe_gizmo
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


# The editor

WIDTH = 2000  # of the region


def centre(place, bar, weight):
    left, bottom, right, top = place.box
    return left + (bar + 0.5) * (right - left) / place.count, bottom + weight / place.top * (top - bottom)


@st.composite
def strokes(draw):
    """Bars and two ends (bar, weight) of a stroke, some beyond the bars."""
    count = draw(st.integers(1, 60))
    end = st.tuples(st.integers(-3, count + 2), st.floats(-0.5, 2.5))
    return np.array(draw(st.lists(st.floats(0, 2), min_size=count, max_size=count))), draw(end), draw(end)


@given(st.integers(1, 256), st.integers(1, 4000), st.floats(0, 5), st.floats(0.5, 3))
def test_the_bars_lie_in_the_region(count, width, most, unit):
    place = bar_editor.layout(width, np.full(count, most), unit)
    left, bottom, right, top = place.frame
    assert 0 < left < place.box[0] < place.box[2] < right
    assert right < width or width < 80 * unit
    assert 0 < bottom < place.box[1] < place.box[3] < top
    assert place.top == max(1.0, most)
    for bar in range(count):
        x, y = centre(place, bar, most)
        assert place.bar_at(x) == bar
        assert place.weight_at(y) == pytest.approx(most)
        assert place.contains(x, y)
    assert place.bar_at(left - 100) == 0
    assert place.bar_at(right + 100) == count - 1
    assert place.weight_at(bottom - 100) == 0
    assert not place.contains(right, bottom)
    assert not place.contains(left, top)


def test_many_bars_take_more_room_until_the_region_ends():
    widths = [bar_editor.layout(WIDTH, np.ones(n), 1.0).frame[2] for n in (1, 8, 32, 64, 200, 256)]
    assert widths == sorted(widths)
    assert widths[0] < widths[2] < widths[3] < widths[4] == widths[5] < WIDTH


@given(strokes())
def test_a_stroke_gives_every_bar_it_crosses_its_height(stroke):
    values, (first, low), (last, high) = stroke
    place = bar_editor.layout(WIDTH, values, 1.0)
    given_values = values.copy()
    new = bar_editor.painted(values, place, centre(place, first, low), centre(place, last, high), snap=False)
    assert np.array_equal(values, given_values)
    a, b = (min(max(bar, 0), len(values) - 1) for bar in (first, last))
    crossed = range(min(a, b), max(a, b) + 1)
    for bar in range(len(values)):
        if bar not in crossed:
            assert new[bar] == values[bar]
    u = np.abs(np.array(crossed) - a) / abs(b - a) if a != b else np.ones(1)
    heights = np.clip((1 - u) * low + u * high, 0, place.top)
    assert new[list(crossed)] == pytest.approx(heights, abs=1e-6)


@given(strokes())
def test_a_snapped_stroke_gives_tenths(stroke):
    values, (first, low), (last, high) = stroke
    place = bar_editor.layout(WIDTH, values, 1.0)
    ends = centre(place, first, low), centre(place, last, high)
    free, snapped = (bar_editor.painted(values, place, *ends, snap) for snap in (False, True))
    changed = free != values
    assert snapped[changed] * 10 == pytest.approx(np.round(snapped[changed] * 10), abs=1e-9)
    assert np.abs(snapped - free).max() <= 0.1 + 1e-9
    assert (snapped >= 0).all()


@given(st.floats(0, 1), st.floats(0, 1), st.integers(1, 8), st.floats(0.5, 2))
def test_the_box_lies_in_the_region_and_beside_the_point(bpy, x, y, count, unit):
    size = 1600, 1000
    point = x * size[0], y * size[1]
    frame, bars, lines = probe_gizmo.layout(point, size, count, unit)
    left, bottom, right, top = frame
    assert 0 <= left < bars[0] < bars[2] < right <= size[0]
    assert 0 <= bottom < lines[-1] <= lines[0] < bars[1] < bars[3] < top <= size[1]
    assert len(lines) == count
    assert not (left < point[0] < right and bottom < point[1] < top)
