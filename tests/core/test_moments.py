"""Bars count filmed frames; a picture's weights are those of the moments that a clip has between them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_recipes import made

from shutter_addon.core.model import shutters, windows
from shutter_addon.core.model.clip import Clip
from shutter_addon.core.model.state_at import state_at

CLIP = Clip(width=160, height=100, count=40)
STEPS = [1, 2, 8, 16]


def state(shutters, steps, frame=20, direction=1, **options):
    """What is shown at a timeline frame of a clip that has moments, and the state."""
    window = len(shutters[0].get("bars") or shutters[0]["keys"][0]["bars"])
    effect = made(window, [{"name": str(i)} | each for i, each in enumerate(shutters)], **options).for_picture(1.6)
    if direction < 0:
        effect = replace(effect, time=SimpleNamespace(at=lambda other: (other, True)))
    moment = state_at(effect, CLIP.stepped(steps), frame)
    assert moment.direction == direction
    return moment.source_frame, moment.state


def exposed(shutters, steps, direction=1, **more):
    """{moment: weight} of the first shutter."""
    index, found = state(shutters, steps, direction=direction, **more)
    assert index == 19 * steps
    at = windows.positions(found.options, index, direction)
    return {int(place): weight for place, weight in zip(at, found.bars[0], strict=True) if weight}


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("position", ["start", "center", "end"])
@pytest.mark.parametrize("steps", STEPS)
def test_a_still_frame_is_the_filmed_one(steps, position, direction):
    for window in (1, 4, 7):
        still = {"bars": shutters.preset_bars("STILL", window, position).tolist()}
        assert exposed([still], steps, direction, position=position) == {19 * steps: 1}


def test_bars_are_interpolated_before_they_are_spread():
    """Half the way from a first frame to a third, by displacement, is the second: sharp, and no streak."""
    keys = [{"frame": 10, "bars": [1, 0, 0]}, {"frame": 30, "bars": [0, 0, 1]}]
    assert exposed([{"keys": keys}], 8) == pytest.approx({19 * 8 + 8: 1})


@pytest.mark.parametrize("last", [10, 13])
def test_what_rounding_leaves_beside_a_sharp_frame_makes_it_no_streak(last):
    """Of a still frame that is keyed from one end of the window to the other, wherever it is a filmed one."""
    bars = np.eye(last)[[0, last - 1]].tolist()
    keys = [{"frame": 5, "bars": bars[0]}, {"frame": 5 + 3 * (last - 1), "bars": bars[1]}]
    for at in range(last):
        _index, found = state([{"keys": keys}], 8, frame=5 + 3 * at)
        wanted = np.zeros(8 * last)
        wanted[8 * at] = 1
        assert found.bars[0] == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize("direction", [1, -1])
def test_on_the_timeline_a_shape_has_the_same_time(steps, direction):
    """180° of footage that runs four frames in one of the timeline is two of them, from the shown one on."""
    shutter = {"bars": [1, 1, 0, 0], "length": "timeline"}
    effect = made(4, [{"name": "A"} | shutter]).for_picture(1.6)
    way = SimpleNamespace(at=lambda frame: (20 + direction * 4 * (frame - 20), direction < 0))
    found = state_at(replace(effect, time=way), CLIP.stepped(steps), 20).state
    assert found.bars[0] == pytest.approx(np.repeat([1, 1, 0, 0], steps) / steps)


@pytest.mark.parametrize("direction", [1, -1])
def test_on_the_way_from_one_frame_to_the_next_a_sharp_frame_is_a_moment(direction):
    """Displacement passes through the moments, and no streak comes and goes between a sharp frame and a long one."""
    bars = {"sharp": [1, 0, 0, 0], "next": [0, 1, 0, 0], "long": [4, 4, 4, 4]}

    def between(first, second, share):
        keys = [{"frame": 16, "bars": bars[first]}, {"frame": 24, "bars": bars[second]}]
        _index, found = state([{"keys": keys}], 8, frame=16 + 8 * share, direction=direction)
        return found.bars[0]

    shown = 7 if direction < 0 else 0
    for eighths in range(9):
        assert np.flatnonzero(between("sharp", "next", eighths / 8) > 1e-9).tolist() == [shown + eighths]
    for share in (0.125, 0.25, 0.5):
        found = between("sharp", "long", share)
        length = (found > 1e-9 * found.sum()).sum()
        assert length == pytest.approx(1 + share * 24, abs=1)


@pytest.mark.parametrize("edges", ["hold", "shorten"])
@pytest.mark.parametrize("position", ["start", "center", "end"])
@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize("direction", [1, -1])
def test_a_threshold_counts_the_frame_that_is_shown(direction, steps, position, edges):
    shutter = {"bars": [0, 0, 1, 0], "combine": "lightest", "threshold": 0.5, "softness": 0}
    index, found = state([shutter], steps, direction=direction, position=position, edges=edges)
    assert windows.positions(found.options, index, direction)[found.options.shown] == index
    first, last = found.open_span
    assert first <= found.options.shown < last
