"""Mattes of a subject from strokes: figures that walk over a ground that the camera passes, found by the network that
Virtual Shutter brings."""

import shutil
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import cv2
import numpy as np
import pytest
from test_carrying import Footage

from shutter_addon.core.messages import MediaError
from shutter_addon.core.model import outlines
from shutter_addon.features.outlines import subject_mattes
from shutter_addon.features.outlines.subject_mattes import CarriedFile, Found, MarkedSubject, Network
from shutter_addon.media.files import MODEL

WIDTH, HEIGHT, COUNT = 240, 160, 5
GROUND = cv2.resize(np.random.default_rng(1).integers(90, 130, (12, 40, 3), np.uint8), (2 * WIDTH, HEIGHT))


def figures(frame):
    one, other = np.zeros((2, HEIGHT, WIDTH), np.uint8)
    cv2.ellipse(one, (70 + 3 * frame, 95), (22, 40), 0, 0, 360, 1, -1)
    cv2.circle(one, (70 + 3 * frame, 45), 14, 1, -1)
    cv2.rectangle(other, (165 + 3 * frame, 50), (205 + 3 * frame, 130), 1, -1)
    return one > 0, other > 0


def picture(frame, noise=0, seed=0):
    shown = GROUND[:, 2 * frame : 2 * frame + WIDTH].copy()
    for mask, color in zip(figures(frame), ((225, 60, 40), (240, 235, 90)), strict=True):
        shown[mask] = color
    shown = cv2.GaussianBlur(shown, (0, 0), 0.8).astype(np.float64)
    shown += noise * np.random.default_rng(seed).standard_normal(shown.shape)
    return np.rint(np.clip(shown, 0, 255)).astype(np.uint8)


def stroke(x, top, bottom):
    return np.array([(x, HEIGHT - top), (x, HEIGHT - bottom)]) / (WIDTH, HEIGHT)


def on_first(frame):
    return stroke(70 + 3 * frame, 45, 115)


def on_second(frame):
    return stroke(185 + 3 * frame, 65, 115)


def iou(matte, mask):
    return ((matte > 0.5) & mask).sum() / ((matte > 0.5) | mask).sum()


@pytest.fixture
def opened(tmp_path):
    def made(strokes, nots=None, drawings=(), **what):
        footage = Footage(tmp_path, **{"count": COUNT, "shows": picture} | what)
        return CarriedFile(footage, drawings, tmp_path / "mattes", MarkedSubject(strokes, nots or {})).open()

    return made


def test_one_stroke_gives_the_subject_in_all_frames(opened):
    mattes = opened({1: [on_first(1)]})
    assert not mattes.has(COUNT - 1)
    assert mattes.confidence(COUNT - 1) is None
    for frame in (COUNT - 1, 0):
        assert iou(mattes.read(frame), figures(frame)[0]) > 0.9
    assert all(mattes.confidence(frame) > 0.5 for frame in range(COUNT))
    assert iou(outlines.coverage(mattes.curves(4), WIDTH, HEIGHT), figures(4)[0]) > 0.9


def test_not_this_takes_a_part_away_from_there_on(opened):
    """Even at a frame that has no other stroke, and not where it does not reach."""
    both = {0: [on_first(0), on_second(0)]}
    mattes = opened(both, {2: [on_second(2)]})
    first, second = figures(3)
    assert iou(mattes.read(0), figures(0)[0] | figures(0)[1]) > 0.9
    assert iou(mattes.read(3), first) > 0.85
    assert mattes.read(3)[second].mean() < 0.02


def test_a_drawing_overrules_the_network(opened):
    square = np.array([(0.3, 0.3), (0.5, 0.3), (0.5, 0.7), (0.3, 0.7)])
    mattes = opened({0: [on_first(0)], 2: [on_first(2)]}, drawings=((2, outlines.curves([square])),))
    drawn = outlines.coverage([square], WIDTH, HEIGHT) > 0.5
    assert iou(mattes.read(2), drawn) > 0.9
    assert iou(mattes.read(0), figures(0)[0]) > 0.9
    assert mattes.confidence(2) == 1


def test_processes_make_the_same_mattes_and_nothing_twice(opened, tmp_path):
    """Each begins where it is asked. A further keyframe leaves the chains of others."""
    strokes = {0: [on_first(0)]}
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda frame: opened(strokes).read(frame), (2, 1)))
    shutil.move(tmp_path / "mattes", tmp_path / "others")
    alone = opened(strokes)
    assert all(np.array_equal(alone.read(frame), matte) for frame, matte in zip((2, 1), found, strict=True))
    more = opened(strokes | {4: [on_first(4)]})
    assert np.array_equal(more.read(1), alone.read(1))
    assert not more._source.asked  # private: nobody else is told which frames were read
    assert not np.array_equal(more.read(2), alone.read(2))


def test_deleted_mattes_are_made_again(opened, tmp_path):
    mattes = opened({0: [on_first(0)]})
    made = mattes.read(2)
    shutil.rmtree(tmp_path / "mattes")
    assert np.array_equal(mattes.read(2), made)


@pytest.mark.parametrize(("damaged", "missing"), [(0, 2), (1, 2), (2, 0)])
def test_damaged_mattes_end_nothing(opened, tmp_path, damaged, missing):
    mattes = opened({0: [on_first(0)]})
    made, sure = mattes.read(2), mattes.confidence(2)
    files = sorted((tmp_path / "mattes").rglob("*.png"))
    files[damaged].write_bytes(files[1].read_bytes()[:-100])
    files[missing].unlink()
    again = opened({0: [on_first(0)]})
    assert np.array_equal(again.read(2), made)
    assert again.confidence(2) == sure


def test_it_ends_at_a_cut(opened):
    mattes = opened({1: [on_first(1)]}, count=30, cut=3)
    assert iou(mattes.read(2), figures(2)[0]) > 0.9
    assert not mattes.read(3).any()
    assert mattes.confidence(3) == 1


def test_it_is_quiet_where_nothing_moves(opened):
    mattes = opened({0: [on_first(0)]}, shows=lambda frame: picture(0, noise=6, seed=frame))
    shown = [255 * mattes.read(frame) for frame in range(1, 4)]
    around = cv2.dilate(figures(0)[0].astype(np.uint8), np.ones((9, 9))) > 0
    assert max(np.abs(b - a)[around].mean() for a, b in pairwise(shown)) <= 1.5


def test_what_moves_with_the_ground_does_not_become_a_part():
    class Greedy:
        def within(self, picture, box, share):
            return np.maximum(figure, ground).astype(np.float32)

    nothing = np.zeros((HEIGHT, WIDTH), np.float32)
    subject = Found(figures(0)[0].astype(np.float32), nothing, 1.0)
    for frame in range(1, 5):
        figure, ground = figures(frame)[0], np.zeros((HEIGHT, WIDTH), bool)
        ground[70:120, 100 - 2 * frame : 140 - 2 * frame] = True
        subject, _still = subject_mattes.followed(Greedy(), picture(frame - 1), picture(frame), subject, pytest.fail)
        assert iou(subject.share, figure) > 0.85
        beside = cv2.dilate(figure.astype(np.uint8), np.ones((13, 13))) == 0
        assert subject.share[ground & beside].mean() < 0.1


def test_a_chain_is_no_surer_than_its_keyframe(opened, monkeypatch):
    share = figures(0)[0].astype(np.float32)
    monkeypatch.setattr(subject_mattes, "found", lambda *_: Found(share, np.zeros_like(share), 0.1))
    mattes = opened({0: [on_first(0)]})
    assert iou(mattes.read(2), figures(2)[0]) > 0.85
    assert mattes.confidence(2) == 0.1


def test_models_that_cannot_be_used(tmp_path):
    damaged, foreign = tmp_path / "damaged.onnx", tmp_path / "foreign.onnx"
    damaged.write_bytes(MODEL.read_bytes()[:100_000])
    foreign.write_bytes(b"no model at all" * 100)
    for path in (damaged, foreign):
        with pytest.raises(MediaError, match=f"{path.name}: is damaged, or no ONNX model that OpenCV can run"):
            Network(path)
    with pytest.raises(MediaError, match=r"^missing\.onnx: cannot be read \(No such file or directory\)$"):
        CarriedFile(
            Footage(tmp_path, COUNT, shows=picture), (), subject=MarkedSubject({}, {}), model=tmp_path / "missing.onnx"
        ).open()
    assert subject_mattes.MODEL == MODEL
