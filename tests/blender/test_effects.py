"""A recipe in Blender's data, keys and annotations is the recipe: the same instant at every frame."""

import json

import numpy as np
import pytest
from support import effect_of, state, write_frames

from shutter_addon.blender.data import annotations, recipe_import
from shutter_addon.core.model.scribbles import mapped
from shutter_addon.core.recipes import recipe_file

RNG = np.random.default_rng(0)
EASES = ("linear", "bezier", "constant")


def bars(window):
    values = RNG.random(window).round(3) * (RNG.random(window) > 0.4)
    values[0] += 0.1
    return values.tolist()


def stroke(count):
    return RNG.random((count, 2)).round(3).tolist()


def keyed_recipe(window=8):
    return {
        "version": 2,
        "window": window,
        "position": "center",
        "light": "encoded",
        "exposure": "weighted",
        "edges": "mirror",
        "aggregate": 2,
        "border": True,
        "stop_at_cuts": False,
        "interpolation": "value",
        "shutters": [
            {"name": "Plain", "color": [0.1, 0.2, 0.3], "bars": bars(window)},
            {
                "name": "Keyed",
                "keys": [
                    {"frame": f, "bars": bars(window), "ease": e}
                    for f, e in zip((1, 7, 12, 20), [*EASES, "bezier"], strict=True)
                ],
            },
        ],
        "regions": [
            {"shutter": "Keyed", "name": "still", "width": 0.07, "strokes": [stroke(3), stroke(1)]},
            {
                "shutter": "Plain",
                "kind": "lasso",
                "strokes": [stroke(5)],
                "keys": [
                    {"frame": 2, "ease": "bezier", "location": [0.1, -0.2]},
                    {"frame": 6, "ease": "constant", "rotation": 50, "scale": 0.5},
                    {"frame": 9, "ease": "bezier", "strokes": [stroke(7)]},
                    {"frame": 15, "strokes": [stroke(4), stroke(2)], "location": [0.3, 0.3], "scale": 2},
                ],
            },
        ],
    }


@pytest.fixture
def effect_on(bpy, edit, tmp_path):
    """An image strip at frame 31 with a recipe's effect; gives a function of the strip's own frames."""

    def make(data, transform=None):
        first = write_frames(tmp_path / "in", np.zeros((2, 24, 40, 3), dtype=np.uint8))
        source = edit.sequence_editor.strips.new_image("images", str(first), 1, 31)
        source.right_handle = 71
        for name, value in (transform or {}).items():
            setattr(source.transform, name, value)
        strip, effect = effect_of(edit, source, data)
        return lambda frame: state(edit, effect, strip, frame + 30)

    return make


def check(instant, expected):
    assert instant.options == expected.options
    assert instant.bars == pytest.approx(expected.bars, abs=1e-5)
    assert instant.gains == pytest.approx(expected.gains, abs=1e-5)
    for shape, wanted in zip(instant.shapes, expected.shapes, strict=True):
        assert (shape.shutter, shape.kind) == (wanted.shutter, wanted.kind)
        assert shape.width == pytest.approx(wanted.width)
        for points, wanted_points in zip(shape.strokes, wanted.strokes, strict=True):
            assert points == pytest.approx(wanted_points, abs=1e-4)


def test_every_ease_and_every_kind_of_key(effect_on):
    data = keyed_recipe()
    at, source = effect_on(data), recipe_file.parse(json.dumps(data))
    for frame in np.arange(0, 24, 0.5):
        check(at(frame), source.for_picture(40 / 24).at(frame))


def test_a_moved_scaled_and_turned_strip(effect_on):
    """Strokes lie in image space, where annotations are; the effect finds them on the picture again."""
    data = keyed_recipe()
    at = effect_on(
        data, {"offset_x": 30, "offset_y": -9, "scale_x": 1.5, "scale_y": 0.7, "rotation": 0.6, "origin": (0.2, 0.9)}
    )
    check(at(8), recipe_file.parse(json.dumps(data)).for_picture(40 / 24).at(8))


def test_a_picture_point_lies_where_blender_draws_it(bpy, edit, render, tmp_path):
    """annotations.picture_to_image against a bright pixel block in a rendered, transformed strip."""
    picture = np.zeros((1, 40, 60, 3), dtype=np.uint8)
    picture[0, 10:14, 40:44] = 255  # centre: 42/60 across, 12/40 from the top
    strip = edit.sequence_editor.strips.new_image("image", str(write_frames(tmp_path / "in", picture)), 1, 1)
    edit.render.resolution_x, edit.render.resolution_y = 100, 80
    t = strip.transform
    t.offset_x, t.offset_y, t.scale_x, t.scale_y, t.rotation, t.origin = 7, -5, 1.2, 0.9, 0.5, (0.3, 0.6)
    shown = render(edit, [1])[1][..., 0]
    y, x = (np.indices(shown.shape).reshape(2, -1) * shown.ravel()).sum(axis=1) / shown.sum() + 0.5
    matrix = annotations.picture_to_image(strip, (60, 40))
    expected = mapped(matrix, np.array([[42 / 60, 1 - 12 / 40]]))[0]
    assert (x - 50, 40 - y) == pytest.approx(tuple(expected), abs=0.6)


def test_applying_another_recipe_leaves_nothing_of_the_first(bpy, edit, effect_on):
    effect_on(keyed_recipe())
    effect = edit.virtual_shutter.effects[0]
    strip = next(s for s in edit.sequence_editor.strips if s.type == "SCENE")
    plain = recipe_file.parse('{"version": 2, "window": 2, "shutters": [{"name": "A", "bars": [1, 0]}]}')
    recipe_import.apply(edit, effect, strip, plain)
    check(state(edit, effect, strip, 40), plain.for_picture(40 / 24).at(10))
    from bpy_extras import anim_utils

    animation = edit.animation_data
    bag = anim_utils.action_get_channelbag_for_slot(animation.action, animation.action_slot)
    assert not list(bag.fcurves)
    assert not list(effect.scene.annotation.layers)
