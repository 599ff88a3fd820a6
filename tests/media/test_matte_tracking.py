"""The motion of what a matte covers, against the truth: a subject over a ground that moves otherwise."""

import cv2
import numpy as np
import pytest

from shutter_addon.core.model.motions import Placement
from shutter_addon.features.tracking import matte_tracking

SIZE = 320, 180
RANDOM = np.random.default_rng(3)
GROUND, SKIN = (
    cv2.GaussianBlur((255 * RANDOM.random((400, 700))).astype(np.uint8), (0, 0), 2.5).astype(np.float32) * 3 - 255
    for _ in range(2)
)


def scene(frame, turn=0.0):
    """A picture and its matte: a disc that goes by (3, −1) pixels a frame, and turns; the ground by (−2, 0.5)."""
    x, y = 120 + 3 * frame, 110 - frame
    matrix = cv2.getRotationMatrix2D((350, 200), turn * frame, 1)
    matrix[:, 2] += (x - 350, y - 200)
    skin = cv2.warpAffine(SKIN, matrix, SIZE)
    ground = cv2.warpAffine(GROUND, np.float32([[1, 0, -100 - 2 * frame], [0, 1, -100 + 0.5 * frame]]), SIZE)
    rows, columns = np.indices(SIZE[::-1])
    matte = np.clip(45.5 - np.hypot(columns - x, rows - y), 0, 1).astype(np.float32)
    return np.clip(matte * skin + (1 - matte) * ground, 0, 255).astype(np.uint8), matte


@pytest.mark.parametrize("motion", ["rotation", "scale"])
def test_a_turn_is_found_where_it_is_asked_for(motion):
    (first, before), (second, after) = scene(0, turn=4), scene(1, turn=4)
    found = matte_tracking.moved(first, second, before, after, motion).motion
    assert abs(found(120 + 110j) - (123 + 109j)) < 0.5
    assert np.degrees(np.angle(found.turn)) == pytest.approx(-4, abs=0.4)
    assert abs(found.turn) == pytest.approx(1, abs=0.01)


class Footage:
    size = SIZE

    def want(self, frames):
        pass

    def picture(self, frame):
        return scene(frame)[0]

    def cut(self, before, after):
        return False


class Still:
    def placement(self, _frame):
        return Placement()

    def centre(self, _frame):
        return np.array([0.4, 0.4])


def follow(cover, start, frames):
    track = matte_tracking.MatteTrack(Still(), lambda frame, _size: cover(frame))
    return list(track.follow(Footage(), start, frames, motion="location"))


def test_steps_add_up_to_no_drift(monkeypatch):
    """Each frame is compared with the first one, also where the subject turns and only its location is asked for."""
    monkeypatch.setattr(Footage, "picture", lambda _self, frame: scene(frame, turn=2)[0])
    steps = follow(lambda frame: scene(frame)[1], 4, range(16))
    assert sorted(step.frame for step in steps) == list(range(16))
    for step in steps:
        x, y = np.multiply(step.placement.location, SIZE)
        assert np.hypot(x - 3 * (step.frame - 4), y - (step.frame - 4)) < 0.1
        assert step.confidence > 0.5


def test_it_ends_where_there_is_no_matte():
    def cover(frame):
        matte = scene(frame)[1]
        return matte if frame < 6 else 0 * matte

    steps = follow(cover, 4, range(4, 40))
    assert [step.frame for step in steps] == [4, 5, 6]
    assert steps[-1].fault == "the subject has left the picture"
    with pytest.raises(matte_tracking.TrackingError, match="the outline encloses nothing here"):
        follow(cover, 6, range(4, 40))
