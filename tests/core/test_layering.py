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
from shutter_addon.core.pixels import layering
from shutter_addon.core.recipes import recipe_file

LINE = {"shutter": "S1", "name": "Cup", "strokes": [[[0.2, 0.4], [0.3, 0.6]]], "width": 0.1}
MOVED = LINE | {"keys": [{"frame": 1}, {"frame": 101, "location": [1.0, 0.0]}]}
RAMP = {"shutter": "S0", "name": "Ramp", "kind": "ramp", "ramp": "linear"}
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


def test_a_layer_is_no_scribble_of_what_lies_behind_it():
    state, found = layers(effect(LINE | {"layer": True}, LINE | {"name": "Other", "shutter": "S0"}))
    assert [shape.shutter for shape in state.shapes] == [0]
    assert found.shutters == (1,)
    # It is drawn over all others, which hold what is none of it.
    assert [shape.shutter for shape in found.scribbles[0].shapes] == [0, 1]


def test_a_matte_that_is_a_layer_is_laid_over_nothing():
    state, found = layers(effect(RAMP | {"layer": True}))
    assert state.mattes == ()
    assert found.shutters == (0,)
    assert {found.mattes[0][0].content.kind for _ in found.frames} == {"linear"}
    assert set(found.scribbles) == {None}


def test_there_are_none_without_one():
    assert layers(effect(LINE, RAMP))[1] is None


def test_its_mattes_are_known_in_the_window_and_as_far_as_plates_reach():
    _, found = layers(effect(MOVED | {"layer": True}))
    assert found.frames == range(18, 26)
    # A hundredth of the picture to the right with each frame.
    at = [state.shapes[0].strokes[0][0, 0] for state in found.scribbles]
    assert at == pytest.approx([0.2 + 0.01 * k for k in found.frames])


def test_the_frames_of_a_clip_that_is_short():
    found = layers(effect(MOVED | {"layer": True}), 60.0)[1]
    assert found.frames == range(57, 60)


def test_in_a_slow_source_between_two_timeline_frames():
    """Each timeline frame passes over two of the source's: what they show lies halfway."""
    _, found = layers(effect(MOVED | {"layer": True}), 11.0, shown=lambda frame: 2 * (int(frame) - 1))
    at = {k: state.shapes[0].strokes[0][0, 0] for k, state in zip(found.frames, found.scribbles, strict=True)}
    assert [at[k] for k in (20, 21, 22)] == pytest.approx([0.3, 0.305, 0.31])


def test_it_begins_and_ends_with_its_opacity():
    keys = [{"frame": 1, "value": 0, "ease": "constant"}, {"frame": 20, "value": 0.5}]
    found = effect(LINE | {"layer": True, "opacity": keys})
    assert layers(found, 19.0)[1] is None
    assert layers(found, 20.0)[1].opacities == (0.5,)
    assert layers(found)[1].scribbles[-1].shapes[0].opacity == 1  # it is weighed afterwards


def test_edges_are_followed_as_far_as_they_are_then():
    edges = [{"frame": 1, "value": 0}, {"frame": 101, "value": 1}]
    _, found = layers(effect(LINE | {"layer": True}, edge_aware=edges))
    assert [state.options.edge_aware for state in found.scribbles] == pytest.approx([0.01 * k for k in found.frames])


def test_the_cameras_motion_is_known_where_it_has_keys():
    assert layers(effect(LINE | {"layer": True}))[1].camera is None
    _, found = layers(effect(LINE | {"layer": True}, camera=[{"frame": 1}, {"frame": 101, "location": [1, 0]}]))
    turns, shifts = found.camera.at([20, 22])
    assert turns == pytest.approx(np.ones((2, 1)))
    assert shifts[:, 0] == pytest.approx([0, 0.02 * SOURCE.width])


def test_keys_are_equal_for_equal_layers_alone():
    found = effect(MOVED | {"layer": True})
    same, other = layers(found)[1], layers(effect(LINE | {"layer": True}))[1]
    assert layers(found)[1].key == same.key != other.key
    assert same.key_at(20) == layers(found, 22.0)[1].key_at(20)
    half = dataclasses.replace(same, opacities=(0.5,))
    assert half.key != same.key


def test_too_many_points_are_refused():
    strokes = [[[0.1, 0.1]] * limits.MAX_POINTS]
    found = effect(LINE | {"layer": True}, LINE | {"name": "Other"})
    region = dataclasses.replace(
        found.regions[1], drawings=dataclasses.replace(found.regions[1].drawings, strokes=([np.array(strokes[0])],))
    )
    with pytest.raises(EffectError, match="more than"):
        layers(dataclasses.replace(found, regions=(found.regions[0], region)))


def test_almost_nothing_of_a_scribble_is_nothing_and_almost_all_is_all():
    assert layering.matte_of([0.0, 0.2, 0.3, 0.4, 0.5, 0.9, 1.0]) == pytest.approx([0, 0, 0, 0.5, 1, 1, 1])
