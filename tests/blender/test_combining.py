"""Lightest, darkest and median in Blender: of walkers, of a layer, keyed, and as the sequencer renders them."""

import json

import numpy as np
import pytest
from support import effect_of, image_strip, recipe, request, write_frames

from shutter_addon.blender.rendering import sessions
from shutter_addon.core.frames import light
from shutter_addon.core.recipes import recipe_file
from shutter_addon.core.recipes.recipe import RecipeError

WIDTH, HEIGHT, COUNT, WINDOW = 96, 64, 16, 9


def street():
    """Empty, of noise that stands still."""
    return np.random.default_rng(3).integers(60, 200, (HEIGHT, WIDTH, 3), np.uint8)


def frame(index):
    """Two walkers, one bright and one dark, cross it in opposite directions."""
    picture = street()
    picture[12:28, 6 * index : 6 * index + 8] = 250
    picture[36:52, WIDTH - 8 - 6 * index : WIDTH - 6 * index] = 5
    return picture


@pytest.fixture
def edited(bpy, edit, tmp_path):
    """Makes an effect of a recipe of one shutter: its strip and the effect."""

    def make(*regions, bars=(1,) * WINDOW, **shutter):
        first = write_frames(tmp_path / "in", [frame(i) for i in range(COUNT)])
        source = image_strip(edit, first)
        said = recipe(WINDOW, bars, [1] + [0] * (WINDOW - 1), regions=regions, position="center")
        said["shutters"][0] |= shutter
        return effect_of(edit, source, said)

    yield make
    sessions.forget()


def picture(strip, effect, at):
    found = request(strip.id_data, effect, strip, at).picture()
    return 255 * light.to_encoded(found[..., :3].astype(float))


def test_a_median_is_the_empty_street(edited):
    """Each pixel is clear for more than half of the window."""
    found = picture(*edited(combine="median"), 8)
    noise = np.mean((found - street()) ** 2)
    assert 10 * np.log10(255**2 / noise) >= 38


def test_a_threshold_is_keyed(edited):
    """From where on the bright walker alone leaves a trail; behind it the shown frame stays."""
    keys = [{"frame": 4, "value": 2.0, "ease": "constant"}, {"frame": 8, "value": 0.8}]
    strip, effect = edited(combine="lightest", threshold=keys, softness=0.01)
    assert np.abs(picture(strip, effect, 6) - frame(5)).max() <= 1, "nothing is as light as that"
    found = picture(strip, effect, 8)
    trail = np.stack([frame(7 + k) for k in range(-4, 5)]).max(axis=0)
    assert np.abs(found[12:28] - np.where(trail[12:28] == 250, 250, frame(7)[12:28])).max() <= 1
    assert np.abs(found[36:] - frame(7)[36:]).max() <= 1, "the dark one stays where it is"


def test_a_layer_leaves_its_trail_before_a_sharp_street(edited):
    """A matte of the bright walker's row: what is behind it is the second shutter's, a single frame."""
    mask = [[[0, 1 - 28 / HEIGHT], [1, 1 - 28 / HEIGHT], [1, 1 - 12 / HEIGHT], [0, 1 - 12 / HEIGHT]]]
    row = {"shutter": "S0", "kind": "outline", "between": "straight", "layer": True, "strokes": mask}
    for mode, function in (("lightest", np.max), ("darkest", np.min), ("median", np.median)):
        strip, effect = edited(row, combine=mode)
        found = picture(strip, effect, 8)
        frames = np.stack([frame(7 + k) for k in range(-4, 5)])
        assert np.abs(found - function(frames, axis=0)).max() <= 1, mode


def test_an_average_has_no_threshold():
    said = recipe(2, [1, 0])
    said["shutters"][0]["threshold"] = 0.5
    with pytest.raises(RecipeError, match="only lightest and darkest have a threshold"):
        recipe_file.parse(json.dumps(said))
