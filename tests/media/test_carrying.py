"""Mattes that are carried from drawings of outlines: a subject that turns and changes its shape over a ground that the
camera passes, both of them textured."""

import os
import tempfile
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from unittest import mock

import cv2
import footage
import numpy as np
import pytest

from shutter_addon.core.frames.light import to_encoded, to_linear
from shutter_addon.core.messages import MediaError
from shutter_addon.core.model import outlines
from shutter_addon.core.model.mattes import FileFrame, Matte
from shutter_addon.features.outlines import carried_mattes, carrying
from shutter_addon.features.outlines.subject_mattes import CarriedFile
from shutter_addon.features.tracking import matte_tracking
from shutter_addon.media import outlining
from shutter_addon.media.matte_values import MatteValues

WIDTH, HEIGHT, COUNT = 192, 128, 14


def texture(seed, size):
    noise = np.random.default_rng(seed).random((*size[::-1], 3), dtype=np.float32)
    soft = cv2.GaussianBlur(noise, (0, 0), 2.5)
    soft = (soft - soft.min(axis=(0, 1))) / np.ptp(soft, axis=(0, 1))
    return (255 * soft).astype(np.uint8)


GROUND, SKIN = texture(1, (2 * WIDTH, HEIGHT)), texture(2, (WIDTH, HEIGHT))


def curve(frame, count=48):
    """The subject's edge in pixels: a bean that turns, bends, and walks by 3 pixels a frame."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    radius = 26 + 7 * np.cos(2 * angle + 0.1 * frame) + 3 * np.sin(3 * angle - 0.2 * frame)
    return np.stack([60 + 3 * frame + radius * np.cos(angle), 64 + radius * np.sin(angle)], axis=1)


def strokes(frame):
    return [curve(frame) / (WIDTH, -HEIGHT) + (0, 1)]


def truth(frame):
    return outlines.coverage(strokes(frame), WIDTH, HEIGHT)


def ground(frame):
    """It goes to the left by 2 pixels a frame."""
    return GROUND[:, 2 * frame : 2 * frame + WIDTH]


def skin(frame):
    """It goes with the subject."""
    return cv2.warpAffine(SKIN, np.float32([[1, 0, 3 * frame - 30], [0, 1, 0]]), (WIDTH, HEIGHT))


def picture(frame):
    alpha = truth(frame)[..., None]
    return np.rint(alpha * skin(frame) + (1 - alpha) * ground(frame)).astype(np.uint8)


class Footage(footage.Film):
    """Frames of the scene, or of another ground from a cut on."""

    def __init__(self, folder, count=COUNT, cut=None, shows=picture):
        self.scene, self.cut, self.path = shows, cut, folder / "scene.png"
        self.path.write_bytes(b"the files of frames")
        self.files = (self.path,)
        super().__init__(self.frame, count)

    def open(self):
        return self

    def frame(self, index):
        shown = self.scene(index) if self.cut is None or index < self.cut else 255 - self.scene(index)[:, ::-1] // 3
        return np.dstack([shown, np.full(shown.shape[:2], 255, np.uint8)])


def iou(matte, frame):
    inside, wanted = matte > 0.5, truth(frame) > 0.5
    return (inside & wanted).sum() / (inside | wanted).sum()


def drawings(*frames):
    return tuple((frame, outlines.curves(strokes(frame))) for frame in frames)


@pytest.fixture(name="footage")
def _footage(tmp_path):
    return Footage(tmp_path)


@pytest.fixture
def carried(footage, tmp_path):
    return lambda *frames: CarriedFile(footage, drawings(*frames), tmp_path / "mattes").open()


def test_from_both_sides(carried):
    """Between drawings each matte is the subject's; flow alone leaves ten times as much elsewhere."""
    mattes = carried(0, COUNT - 1)
    found = [mattes.read(frame) for frame in range(COUNT)]
    assert min(iou(matte, frame) for frame, matte in enumerate(found)) > 0.96
    assert min(matte.max() for matte in found) == 1
    assert max(np.abs(matte - truth(frame)).mean() for frame, matte in enumerate(found)) < 0.005


def test_it_ends_at_a_cut(tmp_path):
    mattes = CarriedFile(Footage(tmp_path, 30, cut=15), drawings(9), tmp_path / "mattes").open()
    assert (mattes.read(13) * truth(13)).sum() > 0.9 * truth(13).sum()
    assert not mattes.read(15).any()
    assert not mattes.read(20).any()
    assert mattes.has(20), "that nothing is there is known from now on"


def test_it_fades_where_nothing_like_it_is_seen(tmp_path):
    """From one frame on the subject is gone, behind what is no cut."""
    footage = Footage(tmp_path, shows=lambda frame: picture(frame) if frame < 8 else ground(frame))
    mattes = CarriedFile(footage, drawings(4), tmp_path / "mattes").open()
    seen, gone = (mattes.read(frame).mean() for frame in (7, COUNT - 1))
    assert seen > 0.05
    assert gone < 0.1 * seen


@pytest.mark.parametrize(("soft", "scale", "most"), [(0, 1, 8), (1.2, 1, 10), (0, 3, 7.5)])
def test_edges_are_as_soft_as_the_pictures(soft, scale, most):
    """Of a subject that is mixed with what lies behind it in linear light, as by a lens, mean levels beside its true
    alpha. Its outlines are hard."""

    def alpha(frame):
        cover = outlines.coverage(strokes(frame), scale * WIDTH, scale * HEIGHT)
        return cv2.GaussianBlur(cover, (0, 0), soft) if soft else cover

    def mixed(frame):
        share = alpha(frame)[..., None]
        near, far = (cv2.resize(each(frame) / 510, share.shape[1::-1]) for each in (skin, ground))
        light = share * to_linear(near + 0.5) + (1 - share) * to_linear(far)
        return np.rint(255 * to_encoded(light)).astype(np.uint8)

    drawn = [carrying.Drawing(frame, truth(frame)) for frame in (0, 8)]
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (8 * scale + 1,) * 2)
    for each in carrying.carried(mixed, *drawn, range(1, 8, 3)):
        wanted = alpha(each.frame)
        inside = (wanted > 0.5).astype(np.uint8)
        around = cv2.dilate(inside, disc) > cv2.erode(inside, disc)
        assert np.abs(each.matte - 255 * wanted)[around].mean() <= most, each.frame


def test_it_is_quiet_where_nothing_moves():
    """Noise alone changes the pictures: mean levels from frame to frame within the subject."""
    random = np.random.default_rng(5)
    pictures = [np.clip(picture(4) + 6 * random.standard_normal(SKIN.shape), 0, 255).astype(np.uint8) for _ in range(9)]
    drawn = [carrying.Drawing(frame, truth(4)) for frame in (0, 8)]
    mattes = [each.matte.astype(float) for each in carrying.carried(pictures.__getitem__, *drawn, range(1, 8))]
    changes = [np.abs(after - before)[truth(4) > 0].mean() for before, after in pairwise(mattes)]
    assert np.mean(changes) <= 1
    strong = np.float32([0, 1e6])[:, None, None, None] * np.ones((3, 9, 9), np.float32)
    assert carrying.stillness(np.zeros((9, 9)), *strong) == pytest.approx(carrying.QUIET * np.exp(-1 / 4), rel=1e-4)


def test_mattes_are_kept(carried, footage, tmp_path):
    """The same matte again reads no frame; a drawing that changes leaves those alone that do not depend on it."""
    mattes = carried(0, 3, 6)
    first = [mattes.read(frame) for frame in range(8)]
    footage.asked.clear()
    again = carried(0, 3, 6)
    assert all((again.read(frame) == first[frame]).all() for frame in range(8))
    assert footage.asked == []
    other = CarriedFile(footage, (*drawings(0, 3), (6, drawings(5)[0][1])), tmp_path / "mattes").open()
    assert all((other.read(frame) == first[frame]).all() for frame in range(4))
    assert footage.asked == []
    assert (other.read(5) != first[5]).any()


def test_mattes_of_another_version_are_left_alone(carried, tmp_path, monkeypatch):
    monkeypatch.setattr(carried_mattes, "VERSION", carried_mattes.VERSION + 1)
    carried(0).read(0)
    (kept,) = (path for path in (tmp_path / "mattes").rglob("*.png") if path.name.startswith("00000000-"))
    before = kept.read_bytes()
    monkeypatch.undo()
    mattes = carried(0)
    assert not mattes.has(0)
    mattes.read(0)
    assert mattes.has(0)
    assert kept.read_bytes() == before


def test_who_shares_a_folder_carries_once(tmp_path):
    """Two that ask at the same time: one carries, the other waits, and reads no frame."""
    both = [Footage(tmp_path) for _ in range(2)]
    files = [CarriedFile(footage, drawings(0, 4), tmp_path / "mattes") for footage in both]
    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(lambda file: file.open().read(2), files)
    np.testing.assert_array_equal(first, second)
    assert sorted(bool(footage.asked) for footage in both) == [False, True]
    assert not list((tmp_path / "mattes").glob("*/.claim*"))


def test_confidence_is_kept(carried, footage):
    """It is high where the drawings show what lies between them, and low where they show something else."""
    mattes = carried(0, 4)
    assert mattes.confidence(2) is None
    mattes.read(2)
    assert mattes.confidence(2) == carried(0, 4).confidence(2) > 0.7
    away = tuple((x + 0.2, y) for x, y in drawings(4)[0][1][0])
    wrong = CarriedFile(footage, (*drawings(0), (4, (away,)))).open()
    wrong.read(2)
    assert wrong.confidence(2) < 0.5


def test_curves_around_what_is_carried(carried):
    """Drawn, straight as long as nothing is carried, and then around that, to a fraction of a pixel."""
    mattes = carried(0, 6)
    assert mattes.curves(0) == drawings(0)[0][1]
    middle = [(curve(0) + curve(6)) / 2 / (WIDTH, -HEIGHT) + (0, 1)]
    np.testing.assert_allclose(mattes.curves(3)[0], middle[0])
    matte, found = mattes.read(3), mattes.curves(3)
    assert sum(map(len, found)) < 150
    assert np.abs(outlines.coverage(found, WIDTH, HEIGHT) - (matte > 0.5)).mean() < 0.004


@pytest.mark.parametrize("off", [0.25, 1.0])
def test_traced(off):
    """A ring that the picture's edge cuts through, and a spot that is none."""
    y, x = np.indices((90, 120)) + 0.5
    away = np.hypot(x - 100, y - 40)
    matte = np.clip(30.5 - away, 0, 1) * np.clip(away - 14.5, 0, 1)
    matte[80, 5] = 1
    found = outlining.traced(matte.astype(np.float32), off)
    assert len(found) == 2
    matte[80, 5] = 0
    apart = np.abs(outlines.coverage(found, 120, 90) - matte)
    assert apart.max() <= off + 0.5
    assert apart.mean() <= 0.02 * off + 0.005
    assert outlining.traced(np.zeros((4, 4), np.float32)) == ()


def test_what_stands_in(footage, tmp_path):
    """A reader that has no time takes a straight outline, and tells which matte it lacks; once that is there, it
    counts."""
    file, late = CarriedFile(footage, drawings(0, 6), tmp_path / "mattes"), []
    reader = MatteValues(WIDTH, HEIGHT, late=lambda *which: late.append(which))
    matte = Matte(0, FileFrame(file))
    ((first_key, first),) = reader.values((matte,), 3, 1)
    assert late == [(file, 3)]
    middle = [(curve(0) + curve(6)) / 2 / (WIDTH, -HEIGHT) + (0, 1)]
    np.testing.assert_allclose(first, outlines.coverage(middle, WIDTH, HEIGHT), atol=1e-6)
    expected = file.open().read(3)
    ((key, values),) = reader.another().values((matte,), 3, 1)
    assert key != first_key
    assert len(late) == 1
    np.testing.assert_array_equal(values, expected)
    assert reader.values((matte,), 40, 1)[0][1].shape == (HEIGHT, WIDTH)


def test_a_folder_that_takes_nothing(footage, tmp_path, monkeypatch):
    """Mattes are kept elsewhere then, for all who ask; those that were in it before are read there."""
    good = CarriedFile(footage, drawings(0, 4), tmp_path / "mattes").open()
    expected = [good.read(frame) for frame in (2, 4)]
    (tmp_path / "file").write_text("")  # where the folder would be: rights refuse root nothing
    file = CarriedFile(footage, drawings(0, 4), tmp_path / "file")
    assert not file.open().has(2)
    np.testing.assert_array_equal([file.open().read(frame) for frame in (2, 4)], expected)
    assert file.open().has(2)
    carried_mattes._writable.cache_clear()  # private: it lasts as long as the program
    monkeypatch.setattr(tempfile, "TemporaryFile", mock.Mock(side_effect=PermissionError))  # it may only be read
    assert good.has(2)
    carried_mattes._temporary.cache_clear()  # private: as before
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "file"))
    with pytest.raises(MediaError, match="mattes cannot be written anywhere"):
        CarriedFile(footage, drawings(0, 4), tmp_path / "file" / "other").open().read(2)


@pytest.mark.parametrize("size", [(4, 4), (8, 8), (12, 1920), (1920, 24)])
def test_any_picture_that_blender_renders_is_large_enough(size):
    """Of the smallest ones, and of those that are so narrow that little of them is left in the working picture."""
    pictures = np.random.default_rng(1).integers(0, 256, (5, *size, 3), dtype=np.uint8)
    cover = outlines.coverage([[(0.1, 0.1), (0.9, 0.1), (0.5, 0.9)]], *carrying.working_size(*size[::-1]))
    ends = (carrying.Drawing(frame, cover) for frame in (0, 4))
    assert [each.matte.shape for each in carrying.carried(pictures.__getitem__, *ends, range(1, 4))] == 3 * [size]
    whole = np.ones(size, np.float32)
    step = matte_tracking.moved(pictures[0, ..., 0].copy(), pictures[1, ..., 0].copy(), whole, whole, "location")
    assert step is None or 0 <= step.confidence <= 1


@pytest.mark.skipif(os.name != "posix", reason="links need no rights there alone")
def test_nothing_is_kept_behind_a_link(carried, tmp_path):
    carried(0).read(0)
    (place,) = (tmp_path / "mattes").iterdir()
    place.rename(outside := tmp_path / "outside")
    place.symlink_to(outside)
    before = sorted(outside.iterdir()), outside.stat().st_mtime_ns  # which tells of what was made and removed
    with pytest.raises(MediaError, match="it is a link, and none is followed"):
        carried(0, 6).read(3)
    assert (sorted(outside.iterdir()), outside.stat().st_mtime_ns) == before
