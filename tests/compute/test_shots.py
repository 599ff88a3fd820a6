"""Windows end at the cuts of a source as at a clip's ends, on every device, against the float64 reference."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from test_composition import SHAPES, Footage, check, few_pieces, state

from shutter_addon.compute.renderer import Renderer
from shutter_addon.compute.request import Request
from shutter_addon.core.model import shutters
from shutter_addon.core.model.frame_state import FrameState, Options
from shutter_addon.features.smooth.smooth import SmoothSource
from shutter_addon.media.cuts import NEIGHBOURS, ShotSource

LENGTHS = 7, 6, 9
ENDS = np.cumsum((0, *LENGTHS))
SHOTS = {i: range(first, last) for first, last in pairwise(ENDS.tolist()) for i in range(first, last)}


def film(dtype=np.uint8, size=(37, 23)) -> Footage:
    """Three shots, each a texture that moves by a pixel a frame."""
    rng, width, height = np.random.default_rng(40), *size
    frames = []
    for length in LENGTHS:
        coarse = rng.random((height // 4 + 1, width // 4 + 1, 4)).repeat(4, 0).repeat(4, 1)[:height, :width]
        frames += [np.roll(coarse, k, axis=1) for k in range(length)]
    frames = np.stack(frames)
    frames[..., 3] = 1
    return Footage((frames * 255).astype(np.uint8) if dtype == np.uint8 else frames.astype(dtype))


class FilmOfShots(ShotSource):
    """With all its frames for the reference, as Footage has them."""

    @cache  # noqa: B019 - there are few of them
    def linear(self):
        return self._source.linear()


@cache
def shots_of(dtype) -> FilmOfShots:
    """The film, for tests that need not look for its cuts again and again."""
    return FilmOfShots(film(dtype))


@pytest.mark.parametrize("edges", ["hold", "mirror", "shorten", "slide"])
@pytest.mark.parametrize(
    ("position", "direction", "dtype"), [("start", 1, np.uint8), ("center", -1, np.float32), ("end", 1, np.uint8)]
)
def test_a_window_shows_its_own_shot_alone(device, edges, position, direction, dtype):
    rng = np.random.default_rng(41)
    for index in (0, 6, 7, 9, 21):
        where = {"edges": edges, "position": position}
        for moment in (state(rng, **where), few_pieces(rng, 8, light="encoded", **where)):
            check(device, shots_of(dtype), moment, index, direction, SHOTS[index])


def test_off_the_whole_clip_is_seen_and_nothing_looked_at(device):
    moment = state(np.random.default_rng(43), stop_at_cuts=False)
    plain, source = film(), film()
    one, other = Renderer(device, plain), Renderer(device, ShotSource(source))
    for index in (2, 3, 9, 5):
        assert np.array_equal(one.picture(Request(index, moment)), other.picture(Request(index, moment)))
    assert source.reads == plain.reads


def test_what_was_shown_before_leaves_no_trace(device):
    """Windows that go on, go back, jump, grow, shrink and turn around, with other light, and options on and off."""
    rng = np.random.default_rng(44)
    renderer = Renderer(device, ShotSource(film(size=(17, 9))))
    index = 4
    for _ in range(40):
        index = int(np.clip(index + rng.choice([1, 1, 1, -1, -2, 6, -9]), 0, 21))
        options = {"edges": ["hold", "mirror", "shorten", "slide"], "position": ["start", "center", "end"]}
        options |= {"light": ["linear", "encoded"], "stop_at_cuts": [True] * 4 + [False]}
        options |= {"edge_aware": [0.0, 0.0, 0.3, 1.0], "aggregate": [1, 1, 2]}
        moment = few_pieces(rng, **{name: rng.choice(values).item() for name, values in options.items()})
        moment.bars[:, rng.integers(4, 16) :] = 0
        asked = Request(index, moment, 1 if rng.random() > 0.3 else -1)
        fresh = Renderer(device, ShotSource(film(size=(17, 9))))
        assert np.array_equal(renderer.picture(asked), fresh.picture(asked))
        assert np.array_equal(renderer.coefficients(asked), fresh.coefficients(asked))
        fresh.release()


def test_within_a_shot_every_frame_is_decoded_once(device):
    rng, source = np.random.default_rng(45), film()
    source.frames = np.stack([np.roll(source.frames[0], k, axis=1) for k in range(22)])
    renderer, moment = Renderer(device, ShotSource(source)), few_pieces(rng, 6)
    for index in range(12):
        renderer.picture(Request(index, moment))
    assert sorted(source.reads) == list(range(max(source.reads) + 1))
    assert max(source.reads) <= 11 + 5 + NEIGHBOURS  # and those that have a say in a cut
    still = FrameState(Options(6), shutters.preset_bars("STILL", 6)[None])
    source.reads.clear()
    Renderer(device, ShotSource(source)).picture(Request(9, still))
    assert source.reads == [9]


def test_around_a_cut_no_frame_is_decoded_more_than_twice(device):
    source = film()
    renderer, moment = Renderer(device, ShotSource(source)), few_pieces(np.random.default_rng(46), 5)
    for index in range(22):
        renderer.picture(Request(index, moment))
    counts = np.bincount(source.reads, minlength=22)
    assert counts.max() <= 2
    assert counts.sum() <= 22 + 2 * 4


STEP = 4
BETWEEN = [0, 27, 51, 85]  # the middle one of a cut's pair of filmed frames, as 6 and 7, is the first one's


def with_between(dtype=np.uint8) -> Footage:
    filmed = film(dtype).frames
    noise = np.random.default_rng(48).random((len(filmed) * STEP - STEP + 1, *filmed.shape[1:]))
    every = (noise * 255).astype(np.uint8) if dtype == np.uint8 else noise.astype(dtype)
    every[..., 3] = filmed[0, 0, 0, 3]
    every[::STEP] = filmed
    return Footage(every)


@pytest.mark.parametrize("edges", ["hold", "mirror", "shorten", "slide"])
@pytest.mark.parametrize(("position", "dtype"), [("start", np.uint8), ("center", np.float32), ("end", np.uint8)])
def test_moments_are_of_the_shot_of_the_nearer_filmed_frame(device, edges, position, dtype):
    rng, source = np.random.default_rng(49), FilmOfShots(with_between(dtype), STEP)
    for first, stop in pairwise(BETWEEN):
        for index, direction in ((first + 9, -1), (stop - 1, 1)):
            moment = state(rng, edges=edges, position=position)
            check(device, source, moment, index, direction, range(first, stop))


def test_cuts_are_looked_for_in_filmed_frames_alone():
    source = with_between()
    shots = ShotSource(source, STEP)
    assert shots.lacking(20, 20, 40) == {20, 24, 28, 32, 36, 40}
    assert shots.around(20, 20, 40) == range(27)
    assert shots.around(20, 20, 26, known=True) == range(85)
    assert shots.around(40, 3, 60) == range(27, 51)
    assert {index % STEP for index in source.reads} == {0}
    assert len(source.reads) == len(set(source.reads))


READ = (
    ("hold", "center", 0),
    ("mirror", "start", 1),
    ("shorten", "center", 1),
    ("slide", "center", 0),
    ("hold", "end", 1),
)


@pytest.mark.parametrize(("edges", "position", "edge_aware"), READ)
def test_what_is_missing_is_what_is_read(device, edges, position, edge_aware):
    """Once cuts are known: as prefetching has it."""
    source, rng = film(), np.random.default_rng(47)
    moment = state(rng, 5, edges=edges, position=position, edge_aware=edge_aware)
    renderer = Renderer(device, ShotSource(source))
    for index in range(22):
        renderer.shot(Request(index, moment))  # which finds the cuts
    renderer.release()
    for index, direction in ((5, 1), (9, -1), (20, 1)):
        source.reads.clear()
        missing = renderer.missing(Request(index, moment, direction))
        renderer.picture(Request(index, moment, direction))
        assert set(source.reads) == missing
        renderer.release()


@pytest.mark.parametrize(("edges", "brightness"), [("hold", 1.0), ("mirror", 0.25), ("shorten", 1.0), ("slide", 0.25)])
def test_moments_show_nothing_of_the_next_shot(device, edges, brightness):
    """Whatever that is: a smooth exposure ends with the last filmed frame of its own."""

    def source(seed):
        found = film()
        texture = np.random.default_rng(seed).integers(0, 256, (7, 11, 3)).repeat(4, 0).repeat(4, 1)[:23, :37]
        found.frames[ENDS[1] : ENDS[2], ..., :3] = [np.roll(texture, k, axis=1) for k in range(LENGTHS[1])]
        found.frames[..., :3] = found.frames[..., :3] * brightness
        return ShotSource(SmoothSource(found, STEP), STEP)

    bars = np.stack([shutters.smoothed(bars, STEP) for bars in ([1, 1, 1, 1], [0, 1, 2, 0])])
    moment = FrameState(Options(4 * STEP, edges=edges, step=STEP), bars, SHAPES[:1])
    for index in (4 * STEP, 5 * STEP, 6 * STEP):
        first, second = (Renderer(device, source(seed)) for seed in (1, 2))
        picture = first.picture(Request(index, moment)).copy()
        first.release()
        np.testing.assert_array_equal(second.picture(Request(index, moment)), picture)
        assert first.source.around(index, 0, 40).stop == BETWEEN[1]
        second.release()
