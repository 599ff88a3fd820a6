"""How long a sensor reads out, found in footage that is exact: every row at its own moment."""

import numpy as np
import pytest

from shutter_addon.features.rolling_shutter import readout

WIDTH, HEIGHT, COUNT = 320, 240, 14
POLES = ((40, 9, 0.02), (90, 14, -0.03), (150, 7, 0.0), (215, 12, 0.05), (270, 10, -0.01), (330, 8, 0.0))


def pictures(share, motion=lambda t: 35 * np.sin(t / 3), *, poles=POLES, noise=0.0, count=COUNT):
    """Leaning poles before a sky, moved sideways; row y is filmed at t + share (y / H - 1/2)."""
    random = np.random.default_rng(0)
    y = (np.arange(HEIGHT) + 0.5)[:, None]
    x = np.arange(WIDTH)[None]
    for t in range(count):
        moved = motion(t + share * (y / HEIGHT - 0.5))
        picture = 150 + 30 * np.sin((x - moved) / 23) + 0.1 * y
        for left, wide, lean in poles:
            start = left + moved + lean * (y - HEIGHT / 2)
            covered = np.clip(np.minimum(x + 1, start + wide) - np.maximum(x, start), 0, 1)
            picture = picture * (1 - covered) + 60 * covered
        yield np.clip(np.rint(picture + random.normal(0, noise, picture.shape)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("share", [0, 0.1, 0.8, -0.5])
def test_a_readout_is_found(share):
    assert readout.of_pictures(list(pictures(share, noise=2))) == pytest.approx(share, rel=0.05, abs=0.01)


def test_of_a_camera_that_shakes_and_of_things_that_pass_each_at_its_own_speed():
    def shaken(t):
        return 9 * np.sin(1.1 * t) + 12 * np.sin(0.37 * t + 1) + 5 * np.sin(1.9 * t + 2)

    assert readout.of_pictures(list(pictures(0.5, shaken, noise=2))) == pytest.approx(0.5, rel=0.1)
    upper, lower = (list(pictures(0.3, lambda t, s=s: s * np.sin(t / 3))) for s in (30, -18))
    both = [np.where(np.arange(HEIGHT)[:, None] < HEIGHT / 2, a, b) for a, b in zip(upper, lower, strict=True)]
    assert readout.of_pictures(both) == pytest.approx(0.3, rel=0.1)


def test_it_says_why_it_cannot():
    for made, why in (
        ({"poles": (), "noise": 1}, readout.TOO_FEW_LINES),
        ({"motion": lambda t: 0 * t, "noise": 1}, readout.TOO_LITTLE_MOTION),
        ({"motion": lambda t: 2.0 * t}, readout.TOO_LITTLE_MOTION),
        ({"count": 5}, readout.TOO_FEW_FRAMES),
    ):
        with pytest.raises(readout.ReadoutError, match=why):
            readout.of_pictures(list(pictures(0.4, **made)))


def test_lines_that_turn_by_themselves_are_no_readout():
    frames = []
    for t in range(COUNT):
        poles = [(x, wide, 0.1 * np.sin(0.9 * t + k)) for k, (x, wide, _lean) in enumerate(POLES)]
        frames += pictures(0, lambda _t, t=t: 30 * np.sin(t / 3), poles=poles, count=1)
    with pytest.raises(readout.ReadoutError, match=readout.UNLIKE):
        readout.of_pictures(frames)
