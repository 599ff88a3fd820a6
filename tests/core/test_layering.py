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
    half = dataclasses.replace(same, opacities=(0.5,))
    assert half.key != same.key


def test_too_many_points_are_refused():
    strokes = [[[0.1, 0.1]] * limits.MAX_POINTS]
    found = effect(LINE | {"layer": True}, LINE | {"name": "Other"})
    drawings = dataclasses.replace(found.regions[1].drawings, strokes=([np.array(strokes[0])],))
    region = dataclasses.replace(found.regions[1], drawings=drawings)
    with pytest.raises(EffectError, match="more than"):
        layers(dataclasses.replace(found, regions=(found.regions[0], region)))
