"""The mathematics of shutters, as properties of random bars."""

from functools import partial

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from shutter_addon.core.model import shutters, windows
from shutter_addon.core.model.frame_state import Options

BAR = st.one_of(st.just(0.0), st.floats(1e-3, 1.0))


@st.composite
def bars_lists(draw, most=4):
    n, length = draw(st.integers(1, most)), draw(st.integers(1, 40))
    bars = draw(arrays(np.float64, (n, length), elements=BAR))
    assume((bars.sum(axis=1) > 0).all())
    return bars


@st.composite
def mixes(draw):
    bars = draw(bars_lists())
    c = draw(arrays(np.float64, len(bars), elements=st.floats(0, 1)))
    assume(c.sum() > 0.1)
    return bars, c / c.sum()


def brute_quantile(bars, z):
    """S⁻¹(z), right limit, by walking the accumulation."""
    total = shutters.accumulation(bars)
    for k in range(len(bars)):
        if total[k + 1] > z:
            return k + (z - total[k]) / (total[k + 1] - total[k])
    return float(np.flatnonzero(bars)[-1] + 1)


def brute_displace(bars, c, samples=200_000):
    """The interpolated shutter from many samples of the mixed quantile."""
    z = (np.arange(samples) + 0.5) / samples
    times = np.zeros(samples)
    for weight, shutter in zip(c, bars, strict=True):
        total = shutters.accumulation(shutter)
        k = np.searchsorted(total, z, side="right") - 1
        times += weight * (k + (z - total[k]) / (total[k + 1] - total[k]))
    counts = np.bincount(np.minimum(times.astype(int), bars.shape[1] - 1), minlength=bars.shape[1])
    return counts / samples


@given(bars_lists(), st.floats(0, 0.999))
def test_knots_hold_every_quantile(bars, z):
    knots = shutters.knots(bars)
    piece = min(np.searchsorted(knots.z, z, side="right") - 1, len(knots.start) - 1)
    u = (z - knots.z[piece]) / (knots.z[piece + 1] - knots.z[piece])
    times = knots.start[piece] + u * (knots.end[piece] - knots.start[piece])
    assume(np.abs(knots.z - z).min() > 1e-9)  # at a jump both limits are right
    assert times == pytest.approx([brute_quantile(b, z) for b in bars], abs=1e-6)


def test_a_box_has_two_knots_whatever_its_length():
    assert len(shutters.knots(np.ones((1, 200))).z) == 2
    assert len(shutters.knots(np.ones((3, 64))).z) == 2


@given(mixes())
def test_displacement_keeps_exposure_and_is_a_shutter(mix):
    bars, c = mix
    q = shutters.displace(bars, c)
    assert (q >= 0).all()
    assert q.sum() == pytest.approx(c @ bars.sum(axis=1))
    assert shutters.mix_exposure(bars, c) == pytest.approx(q.sum())


@pytest.mark.parametrize("seed", range(6))
def test_displacement_equals_brute_force(seed):
    rng = np.random.default_rng(seed)
    bars = rng.random((3, 24)) * (rng.random((3, 24)) > 0.4) + np.eye(3, 24) * 0.01
    c = rng.dirichlet(np.ones(3))
    q = shutters.displace(bars, c)
    assert q / q.sum() == pytest.approx(brute_displace(bars, c), abs=1e-4)


@given(bars_lists())
def test_a_pure_coefficient_gives_that_shutter(bars):
    for i, c in enumerate(np.eye(len(bars))):
        assert shutters.displace(bars, c) == pytest.approx(bars[i], abs=1e-9)
        assert shutters.mix(bars, c) == pytest.approx(bars[i], abs=1e-9)


@given(st.integers(2, 200), st.floats(0, 1))
def test_between_two_deltas_lies_a_delta_of_width_one(window, u):
    bars = np.zeros((2, window))
    bars[0, 0] = bars[1, -1] = 1
    q = shutters.displace(bars, [1 - u, u])
    time = u * (window - 1)
    expected = np.maximum(0, 1 - np.abs(np.arange(window) - time))
    assert q == pytest.approx(expected, abs=1e-9)
    assert shutters.mix(bars, [1 - u, u]) == pytest.approx([1 - u, *np.zeros(window - 2), u])


def test_many_coefficients_at_once():
    rng = np.random.default_rng(0)
    bars, c = rng.random((3, 10)), rng.dirichlet(np.ones(3), (4, 5))
    for function in (shutters.displace, shutters.mix):
        q = function(bars, c)
        assert q.shape == (4, 5, 10)
        assert q[2, 3] == pytest.approx(function(bars, c[2, 3]))


@pytest.mark.parametrize(
    ("bars", "sentence"),
    [
        ([], "1 to 256"),
        ([1.0] * 257, "1 to 256"),
        ([[1.0]], "1 to 256"),
        ([0.0, 0.0], "never opens"),
        ([1.0, -0.1], "negative"),
        ([1.0, float("nan")], "finite"),
        ([1.0, float("inf")], "finite"),
        ([1.0, 1e6 + 0.1], "above a million"),
        ([1e308] * 256, "above a million"),
        ([1e-46], "less than a millionth"),
        ([1e-40] * 256, "less than a millionth"),
    ],
)
def test_no_shutter(bars, sentence):
    with pytest.raises(shutters.ShutterError, match=sentence):
        shutters.check_bars(bars)


@pytest.mark.parametrize("bars", [[1e-6], [1e-7] * 10, [1e6] * 256, [1e-46, 1.0], [0.1, 1e-40]])
def test_a_shutter_is_one_as_float32_too(bars):
    """What a recipe may hold, Blender's properties can: of the smallest numbers they keep none."""
    shutters.check_bars(bars)
    shutters.check_bars(np.float32(bars))


def test_open_span():
    assert shutters.open_span([[0, 0, 1, 0], [0, 1, 0, 0]]) == (1, 3)
    assert shutters.open_span(np.ones((1, 1))) == (0, 1)


@given(bars_lists(most=1), st.integers(1, 80))
def test_another_window_keeps_the_share_of_light(bars, window):
    new = shutters.resample(bars[0], window)
    assert new.shape == (window,)
    assert (new >= -1e-12).all()
    assert new.mean() == pytest.approx(bars[0].mean())
    assert new.max() <= bars[0].max() + 1e-12


@given(bars_lists(most=1), st.integers(1, 80))
def test_another_window_keeps_the_shape(bars, window):
    """What has been gathered by any share of the window is the same, at every boundary of the new bars."""
    new = shutters.accumulation(shutters.resample(bars[0], window))
    old = shutters.accumulation(bars[0])
    at = np.linspace(0, 1, window + 1)
    assert new == pytest.approx(np.interp(at, np.linspace(0, 1, len(old)), old), abs=1e-9)


@given(bars_lists(most=1), st.floats(0.01, 100))
def test_an_angle_is_that_of_the_shape_however_bright(bars, gain):
    angle = shutters.open_angle(bars[0])
    assert 0 < angle <= 360 + 1e-9
    assert shutters.open_angle(bars[0] * gain) == pytest.approx(angle)


@given(st.integers(1, 256), st.floats(0.01, 360))
def test_a_disc_has_its_angle(window, degrees):
    bars = np.clip(window * degrees / 360 - np.arange(window), 0, 1)
    # A slit narrower than one bar is a dimmer bar: its angle is that bar's.
    assert shutters.open_angle(bars) == pytest.approx(max(degrees, 360 / window))


def test_a_closed_shutter_has_no_angle():
    assert shutters.open_angle([0.0, 0.0]) == 0


STEPS = st.sampled_from([1, 2, 4, 8, 16])


def overlap(first, second):
    """How long two spans of time are open together."""
    return max(min(first[1], second[1]) - max(first[0], second[0]), 0.0)


def light(lit, steps):
    """{moment: weight}, by {filmed frame: bar}. A bar is spread evenly over the half intervals from its frame to those
    beside it that are open; a moment gets what lies nearer to it than to any other."""
    found = {}
    for frame, bar in lit.items():
        spans = [(min(end, frame), max(end, frame)) for end in (frame - 0.5, frame + 0.5) if lit.get(2 * end - frame)]
        if steps == 1 or not spans:
            found[frame * steps] = found.get(frame * steps, 0) + bar
            continue
        for moment in range((frame - 1) * steps, (frame + 1) * steps + 1):
            own = (moment - 0.5) / steps, (moment + 0.5) / steps
            part = sum(overlap(own, span) for span in spans) / (0.5 * len(spans))
            found[moment] = found.get(moment, 0) + bar * part
    return {moment: weight for moment, weight in found.items() if weight}


def exposed(weights, steps, index=10, direction=1):
    """{moment: weight} of a window's weights, around a filmed frame."""
    positions = windows.positions(Options(len(weights), step=steps), index * steps, direction)
    return {int(at): weight for at, weight in zip(positions, weights, strict=True) if weight}


@given(bars_lists(most=1), STEPS, st.sampled_from([1, -1]))
def test_a_bar_is_spread_towards_its_open_neighbours(bars, steps, direction):
    found = shutters.smoothed(bars[0], steps, backward=direction < 0)
    assert found.shape == (len(bars[0]) * steps,)
    assert found.sum() == pytest.approx(bars[0].sum())
    wanted = light({10 + direction * k: bar for k, bar in enumerate(bars[0]) if bar}, steps)
    there = exposed(found, steps, direction=direction)
    assert there.keys() == wanted.keys()
    assert there == pytest.approx(wanted)


@given(bars_lists(most=1))
def test_in_one_step_bars_are_what_they_are(bars):
    assert shutters.smoothed(bars[0], 1).tolist() == bars[0].tolist()
    assert shutters.smoothed(bars[0], 1, backward=True).tolist() == bars[0].tolist()
    assert shutters.held(bars[0], 1).tolist() == bars[0].tolist()
    assert shutters.filmed(bars[0], 1, "end", np.array).bars.tolist() == bars[0].tolist()


@given(bars_lists(most=1), STEPS, st.booleans())
def test_a_level_streak_has_the_same_light(bars, steps, backward):
    """Open where the other is; and filmed frames stand to one another as their bars."""
    found = shutters.smoothed(bars[0], steps, backward=backward, level=True)
    assert found.sum() == pytest.approx(bars[0].sum())
    assert ((found > 0) == (shutters.smoothed(bars[0], steps, backward=backward) > 0)).all()
    frames = found[steps - 1 :: steps] if backward else found[::steps]
    assert frames / frames.max() == pytest.approx(bars[0] / bars[0].max())


def test_what_rounding_leaves_opens_no_bar():
    for level in (False, True):
        moments = shutters.smoothed([1e-12, 1.0, 0.0, 1e-13], 8, level=level)
        assert moments == pytest.approx(np.eye(32)[8], abs=1e-9)


def test_what_is_sharp_stays_so_and_a_box_is_one_streak():
    assert exposed(shutters.smoothed([0, 0, 3, 0], 8), 8) == {96: 3}
    assert exposed(shutters.smoothed([0, 0, 3, 0], 8, backward=True), 8, direction=-1) == {64: 3}
    assert exposed(shutters.smoothed([1, 0, 1, 0], 4), 4) == {40: 1, 48: 1}
    box = exposed(shutters.smoothed([1, 1, 1], 4), 4)
    assert sorted(box) == list(range(40, 49))  # from its first frame to its last
    assert [box[at] for at in range(40, 49)] == pytest.approx([1 / 4, 1 / 2, 3 / 8, *[1 / 4] * 3, 3 / 8, 1 / 2, 1 / 4])


@given(bars_lists(most=1), STEPS)
def test_what_is_held_lasts_from_its_frame_to_the_next(bars, steps):
    found = shutters.held(bars[0], steps)
    assert len(found) == len(bars[0]) * steps
    for k, bar in enumerate(bars[0]):
        assert found[k * steps : (k + 1) * steps] == pytest.approx(np.full(steps, bar / steps))


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("position", ["start", "center", "end"])
@given(bars_lists(most=1), STEPS)
def test_bars_of_moments_become_those_of_filmed_frames(position, direction, bars, steps):
    """Each filmed frame keeps its light, wherever a window of moments began and ended around the shown one."""

    def of_frames(weights, step):
        positions = windows.positions(Options(len(weights), position, step=step), 100 * step, direction)
        frames = np.zeros(200)
        np.add.at(frames, positions // step, weights)
        return frames

    found = shutters.filmed(bars[0], steps, position, partial(shutters.held, steps=steps)).bars
    assert len(found) == -(-len(bars[0]) // steps)
    assert of_frames(found, 1) * steps == pytest.approx(of_frames(bars[0], steps))


@given(bars_lists(most=1), STEPS, st.sampled_from(["start", "center", "end"]))
def test_a_whole_frame_of_equal_bars_is_one_of_them(bars, steps, position):
    found = shutters.filmed(np.repeat(bars[0], steps), steps, position, partial(shutters.held, steps=steps))
    assert (found.bars, found.lost) == (pytest.approx(bars[0]), None)
