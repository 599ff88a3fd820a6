"""What an effect's layers are at a frame: their mattes in the source's frames around it, and when these are shown."""

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest

from shutter_addon.core.messages import EffectError
from shutter_addon.core.model import limits
from shutter_addon.core.model.clip import Clip
from shutter_addon.core.model.state_at import state_at
from shutter_addon.core.pixels.layering import separated
from shutter_addon.core.recipes import recipe_file

LINE = {"shutter": "S1", "name": "Cup", "strokes": [[[0.2, 0.4], [0.3, 0.6]]], "width": 0.1}
MOVED = LINE | {"keys": [{"frame": 1}, {"frame": 101, "location": [1.0, 0.0]}]}
SOURCE = Clip(width=64, height=36, count=60)


def effect(*regions, **more):
    shutters = [{"name": f"S{i}", "bars": bars} for i, bars in enumerate(([1, 1, 1, 1], [1, 0, 0, 0]))]
    data = {"version": 2, "window": 4, "shutters": shutters, "regions": list(regions), "plate_reach": 2} | more
    return recipe_file.parse(json.dumps(data)).for_picture(SOURCE.width / SOURCE.height)


def layers(found, frame=21.0, shown=lambda frame: int(frame) - 1):
    """The effect at a frame, and its layers there; shown: the source frame at any."""
    time = SimpleNamespace(at=lambda other: (shown(other) + 1, False))
    state = state_at(dataclasses.replace(found, time=time), SOURCE, frame).state
    return state, state.layers


def test_its_mattes_are_known_in_the_window_and_as_far_as_plates_reach():
    _, found = layers(effect(MOVED | {"layer": True}))
    assert found.frames == range(18, 26)
    # A hundredth of the picture to the right with each frame.
    at = [state.shapes[0].strokes[0][0, 0] for state in found.scribbles]
    assert at == pytest.approx([0.2 + 0.01 * k for k in found.frames])


def test_it_begins_and_ends_with_its_opacity():
    keys = [{"frame": 1, "value": 0, "ease": "constant"}, {"frame": 20, "value": 0.5}]
    found = effect(LINE | {"layer": True, "opacity": keys})
    assert layers(found, 19.0)[1] is None
    assert layers(found, 20.0)[1].opacities == (0.5,)
    assert layers(found)[1].scribbles[-1].shapes[0].opacity == 1  # it is weighed afterwards


def test_keys_are_equal_for_equal_layers_alone():
    found = effect(MOVED | {"layer": True})
    same, other = layers(found)[1], layers(effect(LINE | {"layer": True}))[1]
    assert layers(found)[1].key == same.key != other.key
    assert same.key_at(20) == layers(found, 22.0)[1].key_at(20)
    assert dataclasses.replace(same, opacities=(0.5,)).key != same.key


def test_too_many_points_are_refused():
    found = effect(LINE | {"layer": True}, LINE | {"name": "Other"})
    drawings = dataclasses.replace(found.regions[1].drawings, strokes=([np.full((limits.MAX_POINTS, 2), 0.1)],))
    region = dataclasses.replace(found.regions[1], drawings=drawings)
    with pytest.raises(EffectError, match="more than"):
        layers(dataclasses.replace(found, regions=(found.regions[0], region)))


HEIGHT, WIDTH = 90, 120


def smooth(rng, *shape):
    """Colors (H, W, C) that change from place to place by waves."""
    y, x = np.mgrid[: shape[0], : shape[1]][..., None] / 10
    waves = rng.uniform(-1, 1, (2, 1, 1, shape[2])), rng.uniform(0, 6, (1, 1, shape[2]))
    return (0.5 + 0.4 * np.sin(waves[0][0] * x + waves[0][1] * y + waves[1])).astype(np.float32)


def disc(soft, radius=25.0):
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    return np.clip((radius - np.hypot(x - 60, y - 45)) / soft + 0.5, 0, 1).astype(np.float32)


@pytest.mark.parametrize(("soft", "most"), [(1.5, 0.1), (4, 0.25), (8, 0.5)])
def test_both_colours_are_nearer_than_the_mix(soft, most):
    rng, matte = np.random.default_rng(1), disc(soft)
    own, behind = 0.3 * smooth(rng, HEIGHT, WIDTH, 3) + [0.6, 0.1, 0.0], 0.3 * smooth(rng, HEIGHT, WIDTH, 3)
    m = matte[..., None]
    picture = (m * own + (1 - m) * behind).astype(np.float32)
    found = separated(picture, matte)
    for got, expected, weight in zip(found, (own, behind), (m, 1 - m), strict=True):
        mixed = (matte > 0.05) & (matte < 0.95)
        before, after = (np.abs(weight * (each - expected))[mixed].mean() for each in (picture, got))
        assert after < most * before


def test_what_is_not_mixed_stays_to_the_bit():
    rng, matte = np.random.default_rng(2), disc(4)
    picture = rng.random((HEIGHT, WIDTH, 3)).astype(np.float32)
    for got in separated(picture, matte):
        assert np.array_equal(got[(matte == 0) | (matte == 1)], picture[(matte == 0) | (matte == 1)])
        assert (got >= 0).all()


@pytest.mark.parametrize("size", [(1, 1), (2, 300), (37, 3)])
def test_small_pictures(size):
    rng = np.random.default_rng(4)
    picture, matte = rng.random((*size, 3)).astype(np.float32), rng.random(size).astype(np.float32)
    for got in separated(picture, matte):
        assert got.shape == picture.shape
        assert np.isfinite(got).all()


def test_where_the_picture_lies_changes_nothing():
    """What is looked at is a box around the mixed pixels."""
    rng, matte = np.random.default_rng(5), disc(4, radius=8.0)
    picture = rng.random((HEIGHT, WIDTH, 3)).astype(np.float32)
    wide = [np.pad(each, [(0, 0), (40, 60), (0, 0)][: each.ndim], mode="edge") for each in (picture, matte)]
    for got, more in zip(separated(picture, matte), separated(*wide), strict=True):
        assert np.allclose(got, more[:, 40 : 40 + WIDTH], atol=1e-5)
