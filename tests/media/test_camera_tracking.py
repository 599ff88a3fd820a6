"""Tracking the camera against films in which it is known: a picture seen through a camera that shakes, turns and pans,
and a subject in front of it that has a motion of its own."""

from functools import cache

import cv2
import numpy as np
import pytest
from test_tracking import HEIGHT, MIDDLE, PIXEL, SIZE, WIDTH, Film, ellipse, region, still, warped

from shutter_addon.core.model import motions
from shutter_addon.core.model.effect import STILL_CAMERA
from shutter_addon.core.model.keyframes import Keys
from shutter_addon.core.model.motions import Similarity
from shutter_addon.features.tracking import camera_tracking, tracking
from shutter_addon.media.footage import Footage

ENDS = np.array([0, WIDTH - 1, 1j * (HEIGHT - 1), WIDTH - 1 + 1j * (HEIGHT - 1)])
CENTRE = np.array([0.5, 0.5])
RADII = 185, 120  # of the subject, which covers more than half of the picture
VELOCITY = 4  # of the subject across the picture, in pixels


@cache
def scenery():
    """A wide picture: a film's frame and its mirror image, 960 pixels."""
    half = still("bigbuckbunny.mp4", 60)
    return np.concatenate([half, half[:, ::-1]], axis=1)


def seen_from(frame, pan):
    """The motion from the scenery to what a shaken camera sees of it."""
    turn = (1 + 0.02 * np.sin(frame / 5)) * np.exp(1j * np.radians(2 * np.sin(1.3 * frame)))
    middle = complex(WIDTH, HEIGHT) / 2
    place = 270 + pan * frame + 10 * np.sin(2.1 * frame) + 1j * (HEIGHT / 2 + 6 * np.cos(1.7 * frame))
    return Similarity(complex(turn), complex(middle - turn * place))


def ways(count, pan=0.0):
    return [seen_from(n, pan).after(seen_from(0, pan).inverse()) for n in range(count)]


def film(count, pan=0.0, subject=None):
    frames = []
    for n in range(count):
        frame = warped(scenery(), seen_from(n, pan)).astype(np.float32)
        if subject is not None:
            aside = Similarity(1, complex(VELOCITY * (n - count / 2), 0))
            over = warped(ellipse(MIDDLE, RADII), aside, cv2.BORDER_CONSTANT)[..., None]
            frame += over * (warped(subject, aside) - frame)
        frame += np.random.default_rng(n).normal(0, 2, frame.shape)
        frames.append(np.clip(np.rint(frame), 0, 255).astype(np.uint8))
    return Film(frames), ways(count, pan)


def lasso(count):
    turns = np.linspace(0, 6.1, 24)
    points = MIDDLE + RADII[0] * np.cos(turns) + 1j * RADII[1] * np.sin(turns)
    shape = np.stack([points.real / WIDTH, 1 - points.imag / HEIGHT], axis=1)
    way = tuple((VELOCITY * (n - count / 2) / WIDTH, 0.0) for n in (0, count))
    return region("lasso", drawn=[shape], location=Keys((0, count), way, ("linear", "linear")))


def tracked(source, regions=(), start=0, camera=STILL_CAMERA, **options):
    """The placements by frame, and the faults by frame."""
    footage = Footage(source, lambda frame: frame)
    track = camera_tracking.CameraTrack(camera, regions)
    found = list(track.follow(footage, start, range(source.count), **options))
    return {f.frame: f for f in found if not f.fault}, {f.frame: f.fault for f in found if f.fault}


def error(found, truth, first, second):
    """By how many pixels of 640 a corner of the picture is off, from one frame to another."""
    placements = (found[frame].placement for frame in (first, second))
    motion = motions.motion_between(*placements, CENTRE, CENTRE, SIZE)
    return np.abs(motion(ENDS) - truth[second].after(truth[first].inverse())(ENDS)).max() / PIXEL


def test_a_shaken_camera_is_found_behind_a_subject_that_covers_most_of_it():
    source, truth = film(16, subject=still("walkers.mp4", 10))
    found, faults = tracked(source, [lasso(16)], start=6)
    assert (faults, found.keys()) == ({}, set(range(16)))
    assert max(error(found, truth, 6, frame) for frame in found) < 1
    assert min(each.confidence for each in found.values()) > tracking.SURE
    mistaken, _ = tracked(source, start=6)
    assert max(error(mistaken, truth, 6, frame) for frame in mistaken) > 10


def test_a_shaken_camera_does_not_drift_and_one_that_pans_is_found_from_later_frames():
    """The second leaves all that the first frame has; from each frame to the tenth behind it, it is right."""
    source, truth = film(24)
    found, _ = tracked(source)
    assert max(error(found, truth, 0, frame) for frame in found) < 0.15
    source, truth = film(28, pan=20)
    found, faults = tracked(source)
    assert (faults, len(found)) == ({}, 28)
    assert abs(truth[-1].shift) > WIDTH
    assert max(error(found, truth, frame, frame + 10) for frame in range(18)) < 0.4


def test_frames_that_show_nothing_of_it_are_bridged_and_many_end_it(monkeypatch):
    source, truth = film(12)
    for n in (4, 5):
        source.frames[n][:] = 255
    found, faults = tracked(source)
    assert faults == {}
    assert [n for n, each in found.items() if each.confidence == 0] == [4, 5]
    assert max(error(found, truth, 0, n) for n in (3, 6, 11)) < 0.3
    monkeypatch.setattr(tracking, "PATIENCE", 6)
    black = [np.zeros_like(source.frames[0])] * 8
    found, faults = tracked(Film([*film(4)[0].frames, *black]))
    assert (max(found), faults) == (3, {4: camera_tracking.UNLIKE})


def test_behind_a_jump_it_goes_on_from_where_it_was(monkeypatch):
    """Of a place that no cut is told by. What happened at the jump nobody knows; on both sides all is right."""
    monkeypatch.setattr(tracking, "PATIENCE", 6)
    shot = film(14)[0].frames
    upside_down = [np.ascontiguousarray(frame[::-1]) for frame in shot]
    found, faults = tracked(Film([*shot[:8], *upside_down]))
    assert (set(found), faults) == (set(range(22)), {8: camera_tracking.GOES_ON})
    assert found[8].placement == found[7].placement
    assert max(error(found, ways(8), 0, frame) for frame in range(8)) < 0.3
    alone = tracked(Film(upside_down))[0]
    step = np.subtract(*(found[n].placement.location for n in (20, 8)))
    expected = np.subtract(*(alone[n].placement.location for n in (12, 0)))
    assert step == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_near_and_far_that_move_differently_are_not_sure(share):
    """The lower half is nearer: for a camera that walks past two planes, or around a ground."""
    source, _truth = film(16)
    rows = np.arange(HEIGHT, dtype=np.float32)[:, None] / HEIGHT - 0.5
    depth = np.broadcast_to(np.where(rows > 0, 1, 0) if share < 1 else rows, (HEIGHT, WIDTH)).astype(np.float32)
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    for n, frame in enumerate(source.frames):
        source.frames[n] = cv2.remap(frame, x + 3 * n * depth, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    found, _ = tracked(source)
    assert [n for n in found if n > 8 and found[n].confidence >= tracking.SURE] == []
    frames = sorted(found)
    assert tracking.lost(np.array(frames), np.array([found[n].confidence for n in frames])) <= 8
