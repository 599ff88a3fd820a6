"""Guides of edge-aware diffusion, and what a renderer reads and keeps for them."""

import numpy as np
import pytest
from scipy import ndimage
from test_composition import LEVEL, SHAPES, Footage, few_pieces
from test_shots import BETWEEN, STEP, film, with_between

from shutter_addon.compute import guide
from shutter_addon.compute.cpu import CPUCompositor
from shutter_addon.compute.renderer import Renderer
from shutter_addon.compute.request import Request
from shutter_addon.core.model.frame_state import FrameState, Options
from shutter_addon.media.cuts import ShotSource


def texture(height, width, seed=0, rows=48) -> np.ndarray:
    """Smooth display values (height, width, 3), 0 to 1, between random ones in so many rows."""
    coarse = np.random.default_rng(seed).random((rows, rows * width // height, 3))
    y, x = ((np.arange(n) + 0.5) * rows / height - 0.5 for n in (height, width))
    at = np.meshgrid(y, x, indexing="ij")
    return np.stack([ndimage.map_coordinates(coarse[..., k], at, order=1, mode="nearest") for k in range(3)], -1)


def source_of(*pictures, dtype=np.uint8, **kind) -> Footage:
    """Frames of pictures (h, w, 3 or 4), of values as they are stored."""
    frames = np.stack([np.dstack([p, np.ones(p.shape[:2])]) if p.shape[2] == 3 else p for p in pictures])
    if np.dtype(dtype).kind == "u":
        frames = np.rint(frames * np.iinfo(dtype).max)
    return Footage(frames.astype(dtype), **kind)


def guide_of(source, index=0, block=1, step=1) -> np.ndarray:
    return guide.Guides(source).guide(guide.guiding(index, step, range(source.count)), block)


def smoothed(picture, block=1) -> np.ndarray:
    """The reference: a Gaussian in float64, then means of blocks."""
    short = min(picture.shape[:2])
    picture = ndimage.gaussian_filter(picture.astype(float), (short / 240, short / 240, 0), mode="nearest")
    down, right = (-n % block for n in picture.shape[:2])
    picture = np.pad(picture, ((0, down), (0, right), (0, 0)), mode="edge")
    height, width = (n // block for n in picture.shape[:2])
    return picture.reshape(height, block, width, block, 3).mean(axis=(1, 3)) * short / (240 * block)


@pytest.mark.parametrize("block", [1, 2, 4])
@pytest.mark.parametrize("size", [(90, 120), (241, 323), (723, 1081)])
def test_it_is_the_smoothed_frame(size, block):
    """On cells of so many pixels: from 480 rows on 2 × 2, from 960 on 4 × 4."""
    picture, block = texture(*size), max(block, guide.cell_of(min(size)))
    found, expected = guide_of(source_of(picture), block=block), smoothed(picture, block)
    assert found.dtype == np.float32
    assert found.shape == expected.shape
    # The largest pictures are smoothed from cells of 2 × 2 pixels, which takes some of the sharpest detail.
    scale = min(size) / (240 * block)
    assert np.abs(found - expected).max() <= (4 if min(size) > 720 else 1) * LEVEL * scale
    assert np.abs(found - expected).mean() <= 0.5 * LEVEL * scale


@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_what_is_transparent_is_black(transfer):
    picture, alpha = texture(90, 120), texture(90, 120, 1)[..., :1]
    straight = source_of(np.dstack([picture, alpha]), dtype=np.float32, alpha="straight", transfer=transfer)
    shaded = np.dstack([picture * alpha, alpha])
    premultiplied = source_of(shaded, dtype=np.float32, alpha="premultiplied", transfer=transfer)
    assert np.abs(guide_of(straight) - guide_of(premultiplied)).max() <= LEVEL / 16
    hidden = np.dstack([picture, np.zeros_like(alpha)])
    assert not guide_of(source_of(hidden, alpha="straight", dtype=np.uint16)).any()


def test_frames_beside_it_steady_a_still_picture():
    rng, still = np.random.default_rng(2), 0.2 + 0.6 * texture(240, 320)
    noisy = [np.clip(still + rng.normal(0, 0.04, still.shape), 0, 1) for _ in range(6)]
    clean = smoothed(still)
    alone = guide_of(source_of(noisy[2])) - clean
    steady = [guide_of(source_of(*noisy), index) for index in (2, 3)]
    assert np.std(steady[0] - clean) <= 0.7 * np.std(alone)
    change = guide_of(source_of(noisy[3])) - guide_of(source_of(noisy[2]))
    assert np.std(steady[1] - steady[0]) <= 0.55 * np.std(change)


def test_what_moves_stays_as_it_is_shown():
    """A disk in front of a still picture, which is elsewhere in every frame: a plain mean would be 20 levels off."""
    y, x = np.mgrid[:240, :320]
    pictures = []
    for k in range(5):
        disk = (y - 120) ** 2 + (x - 60 - 50 * k) ** 2 < 20**2
        pictures.append(np.where(disk[..., None], 0.9, 0.2 + 0.4 * texture(240, 320)))
    for index in range(5):
        assert np.abs(guide_of(source_of(*pictures), index) - smoothed(pictures[index])).max() <= 5 * LEVEL


def test_those_beside_are_filmed_frames_of_the_shot():
    assert guide.guiding(7, 1, range(20)) == (7, 5, 6, 8, 9)
    assert guide.guiding(0, 1, range(20)) == (0, 1, 2)
    assert guide.guiding(7, 1, range(7, 9)) == (7, 8)
    assert guide.guiding(16, 8, range(99)) == (16, 0, 8, 24, 32)
    assert guide.guiding(17, 8, range(99)) == (17, 8, 16, 24, 32)


def guided(rng, window=6, strength=1.0, **options):
    return few_pieces(rng, window, shapes=SHAPES[:2], edge_aware=strength, **options)


class Cut(ShotSource):
    """With a cut before frame 7, however alike the shots are."""

    def around(self, index, low, high, *, known=False):
        if not low < 7 <= high:
            return range(self.count)
        return range(7) if index < 7 else range(7, self.count)


def test_nothing_is_taken_from_beyond_a_cut():
    rng = np.random.default_rng(51)
    frames = np.stack([np.roll(film().frames[0], k // 7, axis=1) for k in range(14)])
    frames[7:] -= np.minimum(frames[7:], 4)
    for position in ("start", "end"):
        moment, found = guided(rng, 4, position=position), []
        for source in (Cut(Footage(frames)), Footage(frames[:7])):
            found.append(Renderer(CPUCompositor(), source).coefficients(Request(6, moment)))
        assert np.array_equal(*found)


def reads(moment, method) -> list[int]:
    source = film()
    getattr(Renderer(CPUCompositor(), ShotSource(source)), method)(Request(3, moment))
    return source.reads


def test_at_0_nothing_more_is_read():
    rng = np.random.default_rng(52)
    still = FrameState(Options(4), np.eye(4)[[0, 0]], SHAPES[:1])  # the frame alone, everywhere
    other = FrameState(Options(4, border=True), still.bars, SHAPES[:1])
    assert reads(still, "picture") == reads(other, "picture") == [3]
    assert reads(other, "coefficients") == []
    along_edges = FrameState(Options(4, border=True, edge_aware=0.5), still.bars, SHAPES[:1])
    assert sorted(reads(along_edges, "coefficients")) == [1, 2, 3, 4, 5]
    everywhere = FrameState(Options(4, edge_aware=0.5), still.bars, SHAPES[:1])  # there is one shutter alone
    assert reads(everywhere, "picture") == [3]
    assert guided(rng, 4, 0.0).key != guided(np.random.default_rng(52), 4, 0.5).key


def test_frames_of_the_window_are_not_read_again():
    """Played forward from the window's start, and backward from its end, within a shot."""
    source, rng = film(), np.random.default_rng(53)
    source.frames = np.stack([np.roll(source.frames[0], k, axis=1) for k in range(22)])
    moment = guided(rng, 6)
    renderer = Renderer(CPUCompositor(), ShotSource(source))
    for index in range(12):
        renderer.picture(Request(index, moment))
    assert len(source.reads) == len(set(source.reads))


def test_in_betweens_that_guide_are_needed():
    source = with_between()
    renderer = Renderer(CPUCompositor(), ShotSource(source, STEP))
    still = FrameState(Options(1, step=STEP, edge_aware=1.0), np.ones((2, 1)), SHAPES[:1])
    moment = FrameState(Options(1, border=True, step=STEP, edge_aware=1.0), np.ones((2, 1)), SHAPES[:1])

    def needed(index, moment):
        renderer.shot(Request(index, moment))  # which finds the cuts
        renderer.release()
        return renderer.missing(Request(index, moment))

    assert needed(42, still) == {42}
    assert needed(42, moment) == {36, 40, 42, 44, 48}
    first = BETWEEN[1]
    assert needed(first + 1, moment) == {28, 32, 36}
    assert needed(first + 2, moment) == {29, 28, 32, 36}
