"""Tracking against films whose motion is known: a part of one picture moves over another one."""

from pathlib import Path

import cv2
import footage
import numpy as np
import pytest

from shutter_addon.core.frames import light
from shutter_addon.core.model import scribbles
from shutter_addon.core.model.effect import Drawings, Moves, Region
from shutter_addon.core.model.keyframes import Constant, Keys
from shutter_addon.core.model.motions import Similarity
from shutter_addon.features.tracking import tracking
from shutter_addon.media import open_source
from shutter_addon.media.cuts import ShotSource
from shutter_addon.media.footage import Footage

ASSETS = Path(__file__).parents[2] / "assets"
SIZE = WIDTH, HEIGHT = 480, 270
PIXEL = WIDTH / 640  # errors are in pixels of 640
MIDDLE = 210 + 135j
RADII = 55, 45  # of the subject, an ellipse
LINE = [[0.40, 0.46], [0.44, 0.54], [0.48, 0.46]]


def still(name, index):
    with open_source(ASSETS / name) as source:
        return cv2.resize(source.read(index)[..., :3], SIZE, interpolation=cv2.INTER_AREA)


@pytest.fixture(scope="module")
def ground():
    return still("walkers.mp4", 10)


@pytest.fixture(scope="module")
def subject():
    return still("bigbuckbunny.mp4", 60)


class Film(footage.Film):
    def __init__(self, frames):
        self.frames = frames
        super().__init__(self.frame, len(frames))

    def frame(self, index):
        frame = self.frames[index]
        white = np.iinfo(frame.dtype).max if frame.dtype.kind == "u" else 1
        return np.dstack([frame, np.full(frame.shape[:2], white, frame.dtype)])


def motion(x=0.0, y=0.0, degrees=0.0, scale=1.0):
    """A similarity about the subject's middle."""
    turn = scale * np.exp(1j * np.radians(degrees))
    return Similarity(complex(turn), complex(MIDDLE + complex(x, y) - turn * MIDDLE))


def warped(picture, way, border=cv2.BORDER_REFLECT):
    turn, shift = way.turn, way.shift
    matrix = np.array([[turn.real, -turn.imag, shift.real], [turn.imag, turn.real, shift.imag]])
    return cv2.warpAffine(picture, matrix, SIZE, flags=cv2.INTER_LINEAR, borderMode=border)


def ellipse(middle, radii):
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    distance = np.hypot((x - middle.real) / radii[0], (y - middle.imag) / radii[1])
    return np.clip((1 - distance) * min(radii) + 0.5, 0, 1).astype(np.float32)


def film(subject, ground, path, count, start, *, shutter=0.0, covered=()):
    """A film, and the subject's true motion since the frame `start`; path: frame → arguments of `motion`. At `start`
    the subject lies in its picture's place.

    shutter: share of a frame's time for which it is exposed; covered: frames at which something lies over it"""
    frames, mask, began = [], ellipse(MIDDLE, RADII), motion(*path(start)).inverse()

    def way(time):
        return motion(*path(time)).after(began)

    for n in range(count):
        times = n + np.linspace(-shutter / 2, shutter / 2, 7) if shutter else [n]
        light = np.zeros((HEIGHT, WIDTH, 3), np.float32)
        for time in times:
            over = warped(mask, way(time), cv2.BORDER_CONSTANT)[..., None]
            light += (1 - over) * warped(ground, motion(-0.6 * (time - start), 0.2 * (time - start)))
            light += over * warped(subject, way(time))
        frame = light / len(times)
        if n in covered:
            over = ellipse(way(n)(MIDDLE), (95, 85))[..., None]
            frame = (1 - over) * frame + over * ground[::-1, ::-1]
        frame += np.random.default_rng(n).normal(0, 2, frame.shape)
        frames.append(np.clip(np.rint(frame), 0, 255).astype(np.uint8))
    return Film(frames), [way(n) for n in range(count)]


def strokes(kind):
    if kind == "line":
        return [np.array(LINE)]
    around = MIDDLE + np.array([complex(RADII[0] * np.cos(a), RADII[1] * np.sin(a)) for a in np.linspace(0, 6.1, 24)])
    return [np.stack([(around.real + 0.5) / WIDTH, 1 - (around.imag + 0.5) / HEIGHT], axis=1)]


def region(kind, *, drawn=None, location=(0.0, 0.0)):
    drawings = Drawings("r", (0.0,), (strokes(kind) if drawn is None else drawn,), ("linear",), WIDTH / HEIGHT)
    location = location if hasattr(location, "at") else Constant(location)
    return Region(moves=Moves(location), name="r", shutter=0, kind=kind, width=Constant(0.02), drawings=drawings)


def followed(source, kind, start, frames=None, **options):
    track = tracking.RegionTrack(options.pop("region", None) or region(kind))
    found = list(track.follow(Footage(source, lambda frame: frame), start, frames or range(source.count), **options))
    return {f.frame: f for f in found if not f.fault}, {f.frame: f.fault for f in found if f.fault}


def pixels(shape):
    points = np.concatenate(shape)
    return points[:, 0] * WIDTH - 0.5 + 1j * ((1 - points[:, 1]) * HEIGHT - 0.5)


def errors(tracked, truth, kind):
    """By frame, by how many pixels of 640 the farthest point of the shape is off."""
    shape, found = strokes(kind), {}
    for frame, each in tracked.items():
        p = each.placement
        moved = scribbles.transform(shape, p.location, p.rotation, p.scale, WIDTH / HEIGHT)
        found[frame] = np.abs(pixels(moved) - truth[frame](pixels(shape))).max() / PIXEL
    return found


def sure(tracked):
    return {frame for frame, each in tracked.items() if each.confidence > tracking.SURE}


def shake(t):
    jolts = np.random.default_rng(4).normal(0, 5, (2, 40))
    x, y = (np.interp(t, np.arange(40), row) for row in jolts)
    return 2.0 * t + x, 0.5 * t + y, 0.3 * t


# The way, the shutter, and how many of 24 frames are sure at least.
PATHS = {
    "shake": (shake, 0.0, 23),
    "zoom and turn": (lambda t: (1.5 * t, 0, 4.0 * t, 1.015**t), 0.0, 23),
    "blur": (lambda t: (45 * np.sin(t / 5), 8 * np.cos(t / 4)), 0.6, 16),
}


@pytest.mark.parametrize(
    ("name", "kind"), [("shake", "line"), ("shake", "lasso"), ("zoom and turn", "lasso"), ("blur", "line")]
)
def test_what_is_tracked_lies_within_a_pixel(subject, ground, name, kind):
    path, shutter, least = PATHS[name]
    source, truth = film(subject, ground, path, 24, 10, shutter=shutter)
    tracked, faults = followed(source, kind, 10)
    assert not faults
    assert sorted(tracked) == list(range(24))
    assert max(errors(tracked, truth, kind).values()) <= 1
    assert len(sure(tracked)) >= least


def test_a_subject_that_was_covered_is_found_again(subject, ground):
    source, truth = film(subject, ground, lambda t: (2.5 * t, 0.5 * t, t), 24, 4, covered=range(10, 15))
    tracked, faults = followed(source, "lasso", 4)
    assert not faults
    assert sure(tracked) == set(range(24)) - set(range(10, 15))
    off = errors(tracked, truth, "lasso")
    assert max(off[frame] for frame in sure(tracked)) <= 1
    assert max(off.values()) <= 3  # a straight way across what nobody saw


def test_a_subject_that_stays_covered_ends_it(subject, ground, monkeypatch):
    monkeypatch.setattr(tracking, "PATIENCE", 6)
    source, truth = film(subject, ground, lambda t: (2.0 * t,), 16, 2, covered=range(8, 16))
    tracked, faults = followed(source, "lasso", 2)
    assert faults == {8: tracking.COVERED}
    assert sorted(tracked) == list(range(8))
    assert max(errors(tracked, truth, "lasso").values()) <= 1


def test_a_subject_that_leaves_the_picture_and_comes_back(subject, ground):
    def path(t):
        return (-340 * np.sin(np.pi * np.clip((t - 5) / 18, 0, 1)),)

    source, truth = film(subject, ground, path, 30, 2)
    tracked, faults = followed(source, "line", 2)
    assert not faults
    off = errors(tracked, truth, "line")
    assert max(off[frame] for frame in sure(tracked)) <= 1
    assert {0, 5, 28, 29} <= sure(tracked)
    assert 14 not in sure(tracked)
    tracked, faults = followed(source, "line", 2, range(14))
    assert list(faults.values()) == [tracking.LEFT]


def test_a_subject_without_corners_is_never_sure(subject, ground):
    """All corners around it belong to a ground that stands still."""
    smooth = cv2.GaussianBlur(subject, (0, 0), 30) // 2 + 60
    source, truth = film(smooth, np.roll(ground, 60, axis=1), lambda t: (3 * t,), 10, 4)
    tracked, _ = followed(source, "line", 4)
    assert max(errors(tracked, truth, "line").values()) > 2
    assert sure(tracked) == {4}


def figures(ground, ways, bends=0.0):
    """A film of figures that look alike, the later ones in front; by frame, how far each is from its picture's place.
    bends: pixels by which its rows sway, each otherwise at another time"""
    frames, (y, x) = [], np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    mottled = cv2.GaussianBlur(np.random.default_rng(5).normal(0, 1, (HEIGHT, WIDTH, 3)).astype(np.float32), (0, 0), 2)
    subject = 128 + 45 * mottled / mottled.std()
    for n in range(36):
        sway = x + np.float32(bends) * (np.sin(y / 14 + n / 3) - np.sin(y / 14)) * min(n / 10, 1)
        look, mask = (cv2.remap(each, sway, y, cv2.INTER_LINEAR) for each in (subject, ellipse(MIDDLE, (20, 60))))
        frame = ground.astype(np.float32)
        for way in ways:
            over = warped(mask, motion(way(n)), cv2.BORDER_CONSTANT)[..., None]
            frame = (1 - over) * frame + over * warped(look, motion(way(n)))
        frame += np.random.default_rng(n).normal(0, 2, frame.shape)
        frames.append(np.clip(np.rint(frame), 0, 255).astype(np.uint8))
    return Film(frames)


UPRIGHT = [np.array([[0.43, 0.36], [0.45, 0.5], [0.43, 0.64]])]


def test_a_jump_onto_a_lookalike_is_told(ground):
    """It is right up to where the one in front covers the subject, and follows that then: at full confidence, if one
    looked at the picture alone."""
    ways = (lambda n: 5.0 * n - 110), (lambda n: 90 - 5.0 * n)
    source = figures(ground, ways)
    lain = region("line", drawn=UPRIGHT, location=(-110 / WIDTH, 0.0))
    tracked, _faults = followed(source, "line", 0, region=lain)
    off = {n: abs(each.placement.location[0] * WIDTH - ways[0](n)) for n, each in tracked.items()}
    wrong = {n for n in off if off[n] > 20}
    assert len(wrong) > 10, "it has jumped"
    assert sure(tracked) >= set(range(min(wrong) - 3))
    assert not wrong & sure(tracked)
    frames = sorted(tracked)
    sure_of = np.array([tracked[n].confidence for n in frames])
    assert abs(tracking.lost(np.array(frames), sure_of) - min(wrong)) <= 3


def test_a_subject_that_bends_is_not_lost(ground):
    source = figures(ground, [lambda n: 4.0 * n - 80], bends=3.0)
    tracked, faults = followed(source, "line", 0, region=region("line", drawn=UPRIGHT, location=(-80 / WIDTH, 0.0)))
    assert not faults
    assert max(abs(each.placement.location[0] * WIDTH - 4.0 * n + 80) for n, each in tracked.items()) < 12
    assert len(sure(tracked)) >= 34


def test_where_a_subject_is_lost():
    for sure, expected in [
        ([1.0] * 20, None),
        ([1.0] * 5 + [0.2] * 7 + [1.0] * 8, None),  # covered for a moment
        ([1.0] * 5 + [0.2] * 8 + [1.0] * 7, 15),
        ([1.0] * 17 + [0.2] * 3, 27),
        ([0.2] * 4 + [1.0] * 16, 13),  # backward
    ]:
        assert tracking.lost(np.arange(10, 30), np.array(sure)) == expected


@pytest.mark.parametrize("kind", ["line", "lasso"])
def test_a_pattern_that_repeats_itself_is_never_sure(ground, kind):
    """Shaded checks that go by so quickly that the next period is nearer than their own place."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    shading = cv2.GaussianBlur(np.random.default_rng(0).normal(0, 120, (HEIGHT, WIDTH)), (0, 0), 6)
    checks = cv2.GaussianBlur(60 + 120.0 * ((x // 8 + y // 8) % 2) + shading, (0, 0), 1)
    cloth = np.dstack([checks] * 3).clip(0, 255).astype(np.uint8)
    source, truth = film(cloth, ground, lambda t: (10 * t,), 10, 4)
    tracked, _ = followed(source, kind, 4)
    assert max(errors(tracked, truth, kind).values()) > 10
    assert sure(tracked) == {4}


@pytest.mark.parametrize("change", ["location", "rotation"])
def test_only_what_is_asked_for_changes(subject, ground, change):
    source, _ = film(subject, ground, lambda t: (2 * t, 0, 2 * t, 1.01**t), 8, 2)
    tracked, _ = followed(source, "line", 2, motion=change)
    assert all(each.placement.scale == pytest.approx(1, abs=1e-12) for each in tracked.values())
    turned = tracked[7].placement.rotation
    assert turned == (0 if change == "location" else pytest.approx(-10, abs=1))
    assert tracked[7].placement.location[0] == pytest.approx(10 / WIDTH, abs=1.5 / WIDTH)


def test_between_two_keys_both_count(subject, ground):
    """A mended frame: what lies between is blended, and beyond it nothing is touched."""
    source, _ = film(subject, ground, lambda t: (3 * t,), 16, 2)
    moved = 0.01
    keys = Keys((0.0, 2.0, 12.0), ((0.0, 0.0), (0.0, 0.0), (30 / WIDTH + moved, 0.0)), ("linear",) * 3)
    tracked, faults = followed(source, "lasso", 2, region=region("lasso", location=keys), anchors=(12,))
    assert not faults
    assert sorted(tracked) == list(range(13))
    assert sure(tracked) == set(range(13))
    assert tracked[12].placement.location == pytest.approx((30 / WIDTH + moved, 0.0))
    for frame in range(2, 13):
        expected = 3 * (frame - 2) / WIDTH + moved * (frame - 2) / 10
        assert tracked[frame].placement.location[0] == pytest.approx(expected, abs=0.7 / WIDTH)


def test_the_order_of_reading_and_threads_change_no_bit(subject, ground, tmp_path):
    source, _ = film(subject, ground, shake, 10, 6)
    first = followed(source, "lasso", 6)
    threads, footage = cv2.getNumThreads(), Footage(source, lambda frame: frame)
    try:
        cv2.setNumThreads(1)
        cv2.setRNGSeed(5)
        for frame in (9, 3, 8, 0):
            footage.picture(frame)
        again = list(tracking.RegionTrack(region("lasso")).follow(footage, 6, range(10)))
    finally:
        cv2.setNumThreads(threads)
    assert again == list(first[0].values())


def test_backward_a_source_is_read_upwards(subject, ground):
    source, _ = film(subject, ground, lambda t: (t,), 10, 9)
    followed(source, "line", 9)
    assert source.asked == [9, *range(9)]
    source.asked.clear()
    followed(ShotSource(source), "line", 0)  # which also looks for cuts
    assert source.asked[2:] == [*range(10)]


def test_deep_and_linear_pictures_look_alike(subject):
    deep = Film([subject.astype(np.uint16) * 257])
    linear = Film([light.to_linear(subject / 255).astype(np.float32)])
    linear.transfer = "linear"
    plain, *others = (Footage(each, lambda frame: frame).picture(0) for each in (Film([subject]), deep, linear))
    for other in others:
        assert np.abs(plain.astype(int) - other).max() <= 1
    assert Footage(Film([subject.repeat(3, 0).repeat(3, 1)]), None).size == (960, 540)


class CutOut(Film):
    alpha = "straight"

    def frame(self, index):
        return self.frames[index]


@pytest.mark.parametrize(("kind", "dtype"), [("line", np.uint8), ("lasso", np.float32)])
def test_colours_that_are_hidden_mislead_nobody(subject, ground, kind, dtype):
    """A weak subject that moves; beyond its edge, colors of a still ground with an alpha of 0."""
    weak, mask = cv2.GaussianBlur(subject, (0, 0), 3), ellipse(MIDDLE, RADII)
    truth = [motion(4 * (n - 3)) for n in range(8)]
    frames = []
    for way in truth:
        over = warped(mask, way, cv2.BORDER_CONSTANT)[..., None]
        colours = np.where(over > 0.5, warped(weak, way), ground)
        frames.append(np.dstack([colours, np.rint(255 * over)]).astype(np.uint8))
    over_black = Film([np.rint(frame[..., :3] * (frame[..., 3:] / 255)).astype(np.uint8) for frame in frames])
    given = CutOut([frame / np.float32(255) if dtype == np.float32 else frame for frame in frames])
    pictures = [Footage(source, lambda frame: frame).picture(0) for source in (over_black, given)]
    assert np.abs(np.subtract(*pictures, dtype=int)).max() <= 1
    tracked, faults = followed(given, kind, 3)
    assert not faults
    assert max(errors(tracked, truth, kind).values()) <= 0.5


def test_what_cannot_be_tracked_is_one_sentence(subject):
    """Where regions have strokes; tests/blender/test_track_command.py has all else."""
    footage = Footage(Film([subject] * 3), lambda frame: frame)
    for given, start, fault in ((region("line"), 9, tracking.NOT_SHOWN), (region("line", drawn=[]), 1, tracking.EMPTY)):
        with pytest.raises(tracking.TrackingError, match=f"^{fault}$"):
            next(tracking.RegionTrack(given).follow(footage, start, range(3)))
