"""The background behind what moves, where the camera stands still."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from test_subject_mattes import Footage, iou

from shutter_addon.core.messages import MediaError
from shutter_addon.features.outlines import carrying, subject_mattes
from shutter_addon.features.outlines.still_background import StillBackground, cleared
from shutter_addon.features.outlines.subject_mattes import CarriedFile, Found, MarkedSubject
from shutter_addon.media import flow

WIDTH, HEIGHT, COUNT = 240, 160, 32
WALL = cv2.resize(np.random.default_rng(2).integers(198, 208, (20, 40, 3), np.uint8), (WIDTH + 80, HEIGHT))


def body(frame):
    mask, x, y = np.zeros((HEIGHT, WIDTH), np.uint8), 40 + 6 * frame, 100 - round(30 * np.sin(frame / 5))
    cv2.ellipse(mask, (x, y), (24, 12), -25 * np.cos(frame / 5), 0, 360, 1, -1)
    return cv2.circle(mask, (x + 24, y - 12), 9, 1, -1) > 0, (x, y)


def picture(frame, pan=0):
    """A pale animal before a wall that is hardly darker, beside a blue pillar."""
    shown, (mask, (x, y)) = WALL[:, frame * pan : frame * pan + WIDTH].copy(), body(frame)
    shown[10:150, 20:60], shown[mask] = (60, 70, 150), (226, 220, 208)
    cv2.circle(shown, (x - 6, y - 2), 6, (185, 150, 120), -1)
    noise = 1.5 * np.random.default_rng(frame).standard_normal(shown.shape)
    return np.rint(np.clip(cv2.GaussianBlur(shown, (0, 0), 1.2) + noise, 0, 255)).astype(np.uint8)


def test_a_subject_that_is_hardly_seen_is_followed(tmp_path):
    x, y = body(3)[1]
    stroke = np.array([(x - 16, HEIGHT - y), (x + 14, HEIGHT - y)]) / (WIDTH, HEIGHT)
    footage, marked = Footage(tmp_path, count=COUNT, shows=picture), MarkedSubject({3: [stroke]}, {})
    one, again, other = (CarriedFile(footage, (), tmp_path / it, marked).open() for it in ("one", "one", "other"))
    found = one.read(6), again.read(8)
    assert min(iou(matte, body(frame)[0]) for frame, matte in zip((6, 8), found, strict=True)) > 0.95
    np.testing.assert_array_equal(other.read(8), found[1])


def shots(frame):
    if frame == 30:  # of 16 samples, 7 lie before the cut, and 8 after it
        raise MediaError("damaged")
    return picture(frame) if frame > 13 else 255 - picture(frame)


def test_the_background_is_that_of_the_shot():
    asked = StillBackground(shots, COUNT)
    assert asked.behind(8, shots(8)) is None
    found, wall = asked.behind(24, shots(24)), cv2.GaussianBlur(WALL[:, :WIDTH], (0, 0), 1.2)
    differ = np.abs(found.astype(float) - wall)[:, 70:].max(axis=2)
    assert np.percentile(differ, 97) < 6  # at few places, the animal is in half of the samples


@pytest.mark.parametrize(("count", "pan"), [(COUNT, 2), (1, 0), (7, 0)])
def test_without_enough_frames_of_a_view_there_is_none(count, pan):
    shown = [cv2.applyColorMap(picture(frame, pan), cv2.COLORMAP_HSV) for frame in range(count)]
    assert StillBackground(shown.__getitem__, count).behind(count // 2, shown[count // 2]) is None


def test_it_reads_a_few_frames_around():
    read = []
    StillBackground(lambda frame: read.append(frame) or WALL, 1000).behind(500, WALL)
    assert len(read) == 16
    assert 372 < min(read) < 470 < 530 < max(read) < 628


def test_what_is_no_part_of_the_subject_is_cleared():
    white, places = np.full((288, 512, 3), 255, np.uint8), flow.grid(288, 512)
    now, before, share = white.copy(), white.copy(), np.zeros((288, 512), np.float32)
    share[10:30, 10:40] = 1
    before[10:30, 10:40] = now[10:30, 14:44] = 160, 40, 40
    before[40:55, 60:80] = now[40:55, 60:80] = 40, 40, 160
    now[30:34, 14:44] = 210  # a shadow
    faded, carried, others = cleared(now, white, share, share, *map(carrying.lab, (now, before)), places)
    assert (faded[10:30, 14:44] == now[10:30, 14:44]).all()
    assert min(faded[40:55, 60:80].min(), faded[31:33, 16:42].min()) > 245
    assert (carried[20, 12], carried[20, 20], others[50, 70]) == (0, 1, 1)
    exact = SimpleNamespace(within=lambda *_: flow.look(share, places - np.float32((4, 0))))
    subject_mattes.followed(exact, before, now, Found(share, 0 * share, 1.0), pytest.fail)  # the network is certain
    colors = carrying.lab(before)
    assert cleared(before, before, share, share, colors, colors, places) is None  # it may have stood there all the time
