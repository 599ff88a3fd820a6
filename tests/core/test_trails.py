"""Exposures that are open while what they follow moves by a set length, or for as long as a timeline frame."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_recipes import key, made

from shutter_addon.core.model import windows
from shutter_addon.core.model.clip import Clip
from shutter_addon.core.model.frame_state import Options
from shutter_addon.core.model.state_at import on_timeline, state_at, with_length
from shutter_addon.core.pixels import compositor

WINDOW = 24
SOURCE = Clip(width=160, height=100, count=60)


def open_frames(bars):
    """The length of a box."""
    return bars.sum() / bars.max()


def test_limits():
    box, way = np.ones(WINDOW), np.linspace(0, 1, WINDOW + 1)
    still = np.zeros(WINDOW + 1)
    quarter = np.r_[np.ones(6), np.zeros(18)]
    assert with_length(box, way, 2, 11.5) == pytest.approx(box)  # there are no more frames
    assert with_length(box, still, 0.1, 11.5) == pytest.approx(box)
    assert with_length(quarter, still, 0.1, 0.5) == pytest.approx(np.full(WINDOW, 0.25))
    assert with_length(box, way, 0, 11.5) == pytest.approx(WINDOW * np.eye(WINDOW)[11])  # the shown frame
    assert with_length(box, still, 0, 11.5) == pytest.approx(WINDOW * np.eye(WINDOW)[11])
    late_mover = np.r_[np.zeros(20), np.arange(5) / 4]
    assert with_length(box, late_mover, 0, 0.5) == pytest.approx(WINDOW * np.eye(WINDOW)[0])
    assert with_length(box, way, 1e-9, 11.5) == pytest.approx(WINDOW * np.eye(WINDOW)[11])
    late = np.r_[np.zeros(20), np.ones(4)]
    assert with_length(late, way, 0, 0.5) == pytest.approx(4 * np.eye(WINDOW)[20])  # the nearest open one
    assert with_length(np.ones(1), np.zeros(2), 0.3, 0.5).tolist() == [1]
    # What rounding leaves opens no bar.
    bars, way = np.r_[np.ones(4), np.zeros(4)], np.linspace(0, 1, 9)
    noisy = bars + np.r_[np.zeros(4), 1e-15, np.zeros(3)]
    assert with_length(noisy, way, 0.25, 0.5) == pytest.approx(with_length(bars, way, 0.25, 0.5))


# Of a subject that grows faster and faster, by its keys; a border that stands still behind it streaks.

SPEEDS = np.linspace(0.5, 4, SOURCE.count)  # pixels a frame
WAY = np.cumsum(SPEEDS) - SPEEDS[0]


def accelerating(trail, position="center", bars=(1.0,) * WINDOW, edges="hold", follow="car"):
    places = [(x / SOURCE.width, 0.0) for x in WAY]
    keys = [key(frame, place) for frame, place in enumerate(places, 1)]
    region = {"shutter": "S", "name": "car", "strokes": [[[0.1, 0.4], [0.2, 0.6]]], "keys": keys}
    shutter = {"name": "S", "bars": list(bars), "follow": follow} | ({} if trail is None else {"trail": trail})
    return made(len(bars), [shutter], [region], position=position, edges=edges, camera=keys)


def followed(source, frame):
    effect = source.for_picture(SOURCE.width / SOURCE.height)
    index, state, _direction = state_at(effect, SOURCE, frame)
    return state, index


def streak(source, frame):
    """How wide a border is in the picture that lies still in the footage: of an even ramp, 6 ∫ F (1 − F) dx."""
    state, index = followed(source, frame)
    still = np.broadcast_to((np.arange(400) > 200)[None, :, None], (1, 400, 4)).astype(float)
    still[..., 3] = 1
    frames = windows.indices(state.options, index, range(SOURCE.count))
    moves = state.following.at(frames)
    picture = compositor.compose(state, [still] * len(frames), frames >= 0, np.ones((1, 1, 400)), moves)
    grey = picture[0, :, 0]
    return 6 * (grey * (1 - grey)).sum()


@pytest.mark.parametrize("bars", [(1.0,) * WINDOW, (0.0,) * 11 + (1.0, 1.0) + (0.0,) * 11])
def test_what_slides_is_as_long_at_the_clips_end_and_lies_within(bars):
    source = accelerating(0.3, bars=bars, edges="slide")
    assert [streak(source, frame) for frame in (45, 57, 60)] == pytest.approx([30] * 3, rel=0.06)
    state, index = followed(source, SOURCE.count)
    assert windows.reach(state, index)[1] == SOURCE.count - 1
    held, index = followed(accelerating(0.3, bars=bars, edges="hold"), SOURCE.count)
    assert windows.reach(held, index)[1] > SOURCE.count + 3


def test_moments_count_as_the_parts_of_a_frame():
    plain, _ = followed(accelerating(0.2), 40)
    state = state_at(accelerating(0.2).for_picture(1.6), SOURCE.stepped(4), 40).state
    assert len(state.bars[0]) == 4 * WINDOW
    assert open_frames(state.bars[0]) == pytest.approx(4 * open_frames(plain.bars[0]), rel=0.03)
    assert state.bars[0].sum() == pytest.approx(plain.bars[0].sum())


OPEN = [1] * 8


def exposed(bars, speed=1.0, direction=1, here=100.0, after=None, before=None, **options):
    """Bars; speed: source frames a timeline frame, or `before` and `after`."""
    before = here - direction * speed if before is None else before
    after = here + direction * speed if after is None else after
    options = Options(len(bars), backward=direction < 0, **options)
    return on_timeline(np.array(bars, float), options, np.array([before, here, after]))


def test_as_it_was_filmed_and_slower_it_is_the_shown_frame():
    """Of moments, half the speed is two of four; a quarter more speed than filmed goes into the next frame."""
    for speed in (1, 0.3, 0):
        np.testing.assert_allclose(exposed(OPEN, speed), [8, 0, 0, 0, 0, 0, 0, 0], atol=1e-9)
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
        assert exposed([1] * window, 0, -1, step=4).tolist() == [0] * (window - 1) + [window]


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
