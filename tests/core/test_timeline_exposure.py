"""Exposures whose length is the timeline's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shutter_addon.core.model import state_at
from shutter_addon.core.model.frame_state import Options

OPEN = [1] * 8


def exposed(bars, speed=1.0, direction=1, here=100.0, after=None, before=None, **options):
    """Bars; speed: source frames a timeline frame, or `before` and `after`."""
    before = here - direction * speed if before is None else before
    after = here + direction * speed if after is None else after
    options = Options(len(bars), backward=direction < 0, **options)
    return state_at.on_timeline(np.array(bars, float), options, np.array([before, here, after]))


def test_as_it_was_filmed_and_slower_it_is_the_shown_frame():
    """Of moments, half the speed is two of four; a quarter more speed than filmed goes into the next frame."""
    for speed in (1, 0.3, 0):
        bars = exposed(OPEN, speed)
        np.testing.assert_allclose(bars, [8, 0, 0, 0, 0, 0, 0, 0], atol=1e-9)
    np.testing.assert_allclose(exposed(OPEN, 2, step=4), [4, 4, 0, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(exposed(OPEN, 5, step=4), [1.6] * 5 + [0, 0, 0])


@pytest.mark.parametrize("position", ["start", "center", "end"])
def test_a_freeze_is_the_shown_frame(position):
    """Of moments as well, forward and backward, and in a window that is shorter than a filmed frame."""
    for direction, place in ((1, 0), (-1, 3)):
        options = Options(8, position=position, step=4)
        bars = exposed(OPEN, 0, direction, position=position, step=4)
        assert np.flatnonzero(bars).tolist() == [options.before + place]
    for window in (1, 2, 3):
        bars = exposed([1] * window, 0, -1, step=4)
        assert bars.tolist() == [0] * (window - 1) + [window]


@given(
    st.lists(st.floats(0, 5), min_size=1, max_size=20).filter(lambda bars: sum(bars) > 0.1),
    st.floats(0, 40),
    st.floats(0, 40),
    st.sampled_from(["start", "center", "end"]),
    st.sampled_from([1, 2, 4]),
    st.sampled_from([1, -1]),
)
def test_whatever_the_speed_is_light_stays_and_no_bar_is_negative(bars, earlier, later, position, step, direction):
    before, after = 100 - direction * earlier, 100 + direction * later
    found = exposed(bars, before=before, after=after, direction=direction, position=position, step=step)
    assert found.sum() == pytest.approx(sum(bars))
    assert (found >= 0).all()
