"""Windows that slide, and what they reach. tests/differential has what their shutters expose."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shutter_addon.core.model import shutters, windows
from shutter_addon.core.model.frame_state import FrameState, Options


def exposed(moment, index, direction, shot):
    """By shutters: how much of each frame they expose."""
    frames = windows.indices(moment.options, index, shot, direction)
    seen = set(frames.tolist())
    return [{f: float(bars[frames == f].sum()) for f in seen if bars[frames == f].any()} for bars in moment.bars]


def sliding(bars, **options):
    return FrameState(Options(np.shape(bars)[1], edges="slide", position="center", **options), np.array(bars, float))


def test_the_last_filmed_frame_lasts_as_long_as_others():
    """In moments as well, so that what lies at its end stays there."""
    still = sliding([[0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0], [1] * 12], step=4)
    found = exposed(windows.slid(still, 36, 1, range(37)), 36, 1, range(37))
    assert found == [{36: 4}, {**dict.fromkeys(range(28, 36), 1), 36: 4}]


@pytest.mark.parametrize("direction", [1, -1])
def test_what_is_smooth_slides_by_whole_filmed_frames(direction):
    """So that what is sharp is a filmed frame wherever it slides to, and a streak begins and ends with one."""
    bars = [[0, 0, 0, 1, 0], [0, 0, 1, 1, 1]]
    smooth = [shutters.smoothed(row, 4, backward=direction < 0) for row in bars]
    index, shot = (36, range(20, 37)) if direction > 0 else (20, range(20, 40))
    found = exposed(windows.slid(sliding(smooth, step=4), index, direction, shot), index, direction, shot)
    assert found[0] == {index: 1}  # which lay behind the shot's end
    assert (min(found[1]), max(found[1])) == ((28, 36) if direction > 0 else (20, 28))
    assert sum(found[1].values()) == pytest.approx(3)


@settings(max_examples=200, deadline=None)
@given(
    st.integers(1, 9).flatmap(
        lambda window: st.lists(
            st.lists(st.integers(0, 2), min_size=window, max_size=window).filter(any), min_size=1, max_size=3
        )
    ),
    st.sampled_from(["start", "center", "end"]),
    st.sampled_from([1, -1]),
    st.integers(1, 14),
    st.integers(0, 13),
)
def test_whatever_slides(bars, position, direction, count, place):
    moment = FrameState(Options(len(bars[0]), edges="slide", position=position), np.array(bars, float))
    shot = range(20, 20 + count)
    index = 20 + place % count
    held = FrameState(Options(len(bars[0]), position=position), moment.bars)
    found = exposed(windows.slid(moment, index, direction, shot), index, direction, shot)
    for before, after in zip(exposed(held, index, direction, range(100)), found, strict=True):
        first, last = min(before), max(before)
        assert sum(after.values()) == sum(before.values())
        if last - first >= count:  # it is longer than the shot
            continue
        by = min(after) - first
        assert after == {f + by: weight for f, weight in before.items()}
        assert by == 0 if first in shot and last in shot else by == max(shot[0] - first, min(shot[-1] - last, 0))


@given(
    st.integers(1, 12).flatmap(lambda window: st.lists(st.booleans(), min_size=window, max_size=window).filter(any)),
    st.sampled_from(["start", "center", "end"]),
    st.sampled_from([1, 2, 4]),
    st.sampled_from([1, -1]),
)
def test_what_a_window_reaches_is_what_its_shutters_expose(exposed, position, step, direction):
    options = Options(len(exposed), position=position, step=step)
    positions = windows.positions(options, 20, direction)
    state = FrameState(options, np.array([exposed], float))
    shown = positions[np.flatnonzero(exposed)]
    assert windows.reach(state, 20, direction) == (shown.min(), shown.max())
