"""Cuts: films, pieces of them joined at known places, and what looks like a cut and is none."""

import sys
from pathlib import Path

import numpy as np
import pytest
from footage import Film

from shutter_addon.media import open_source
from shutter_addon.media.cuts import NEIGHBOURS, ShotSource, is_cut, signature

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def film(bunny):
    """Every frame of the bunny, a quarter as wide and high: (132, 180, 320, 4) uint8."""
    with open_source(bunny) as source:
        return np.stack([source.read(i)[2::4, 2::4] for i in range(source.count)])


def noise(count: int, seed: int) -> np.ndarray:
    coarse = np.random.default_rng(seed).integers(20, 230, (23, 80, 4))
    fine = coarse.repeat(8, 0).repeat(8, 1)[:180].astype(np.uint8)
    return np.stack([fine[:, k : k + 320] for k in range(count)])


def found(frames, transfer="srgb") -> list[int]:
    pictures = [signature(frame, transfer) for frame in frames]
    sides = [(pictures[max(i - NEIGHBOURS, 0) : i], pictures[i : i + NEIGHBOURS]) for i in range(1, len(pictures))]
    return [i for i, (before, after) in enumerate(sides, 1) if is_cut(before, after)]


def test_footage_that_moves_hard_has_no_cuts_and_joined_footage_has_all():
    """A round of the script that measures it; what it says of shots of one and two frames is in its docstring."""
    sys.path.insert(0, str(ROOT / "scripts"))
    import cut_quality

    numbers = cut_quality.measure(1, 3)
    hard = {"cut: shots of 1 and 2 frames", "cut: on twos and threes"}
    assert {kind: counts for kind, counts in numbers.items() if counts[1] or (counts[2] and kind not in hard)} == {}


def test_films_without_cuts_have_none(film, bunny):
    assert found(film) == []
    with open_source(bunny.with_name("pedestrians.avi")) as source:
        assert found(source.read(i) for i in range(source.count)) == []


def test_any_type_of_samples_and_light(film):
    frames = np.concatenate([film[:8], noise(8, 6)])
    assert found(frames.astype(np.uint16) * 257) == [8]
    scene = (frames.astype(np.float32) / 255) ** 2.2 * 4
    scene[3, :8, :8], scene[4, 0, 0] = 1e5, np.nan
    assert found(scene, transfer="linear") == [8]


@pytest.mark.parametrize("black", [np.s_[:, :22], np.s_[:, :, :40], np.s_[:, :90, :160]])
def test_cuts_between_pictures_that_are_black_in_part(film, black):
    frames = np.concatenate([film[:10], film[60:70, :, ::-1]])
    frames[black] = 0
    assert found(frames) == [10]
    # Small frames
    assert signature(np.zeros((4, 4, 4), np.uint8), "srgb").shape == (4, 4, 3)
    assert signature(np.zeros((2160, 16, 4), np.float16), "linear").shape == (18, 16, 3)


def as_source(frames):
    return Film(lambda index: frames[index].copy(), len(frames))


def test_shots_end_at_cuts_and_at_the_clips_ends(film):
    frames = [*film[:10], *noise(8, 10), *film[90:100, :, ::-1]]
    shots = ShotSource(as_source(frames))
    for index, shot in ((0, range(10)), (9, range(10)), (10, range(10, 18)), (17, range(10, 18)), (27, range(18, 28))):
        assert shots.around(index, -5, 40) == shot
        assert ShotSource(as_source(frames)).around(index, index - 11, index + 11) == shot
        assert shots.around(index, index, index) == range(28)


def test_where_a_frame_cannot_be_read_there_is_no_cut(film):
    for lost, shot in (({4}, range(10)), ({4, 9}, range(18))):
        source = as_source([*film[:10], *noise(8, 11)])
        source.lost = lost
        assert ShotSource(source).around(2, 0, 17) == shot


@pytest.mark.parametrize("lost", [9, 10, 4])
def test_what_a_lost_frame_hid_is_found_when_it_is_back(film, lost):
    """Whether it lay at the cut or beside it, and though the same object looked for the cut before."""
    source = as_source([*film[:10], *noise(8, 11)])
    source.lost = {lost}
    shots = ShotSource(source)
    shots.around(2, 0, 17)
    source.lost = set()
    assert shots.around(2, 0, 17) == range(10)
    assert shots.lacking(2, 0, 9) == set()


def test_frames_that_nobody_reads_are_let_go(film):
    """A look through a whole film, as for its shots, keeps those around the last window."""
    for step in (1, 8):
        shots = ShotSource(as_source(film.repeat(step, 0)[: 131 * step + 1]), step)
        for index in range(shots.count):
            shots.around(index, index, index + 3)
            low, high = index - NEIGHBOURS * step, index + 3 + NEIGHBOURS * step
            assert all(low <= i <= high for i in shots.handed())
