"""The effect as plain data: channels, and what is wrong at one frame alone."""

import dataclasses

import numpy as np
import pytest

from shutter_addon.core.messages import EffectError
from shutter_addon.core.model import effect, limits, mattes
from shutter_addon.core.model.frame_state import Options
from shutter_addon.core.model.keyframes import Bars, Constant, Keys, Samples, SourceTime
from shutter_addon.core.model.motions import Placement

FIRST, LAST = np.array([1.0, 0, 0, 0]), np.array([0, 0, 0, 1.0])


def made(bars, regions=(), **options) -> effect.Effect:
    shutter = effect.Shutter(name="Sharp", bars=bars)
    return effect.Effect((shutter,), tuple(regions), Constant(Options(4, **options)))


def region(strokes, placement=None, name="Face") -> effect.Region:
    drawings = effect.Drawings(name, (1.0,), (strokes,), ("linear",), 1.0, placement)
    return effect.Region(moves=effect.Moves(), name=name, shutter=0, kind="line", drawings=drawings)


def test_an_error_among_samples_is_raised_at_its_frame_alone():
    bars = Bars(Samples({1: FIRST, 2: EffectError("broken at two")}))
    assert made(bars).at(1).bars.tolist() == [FIRST.tolist()]
    with pytest.raises(EffectError, match="broken at two"):
        made(bars).at(2)
    with pytest.raises(KeyError):
        made(bars).at(3)


def keyed(first, last) -> Keys:
    return Keys((1.0, 5.0), tuple(map(np.array, (first, last))), ("linear", "linear"))


def changed(drawn=(1.0,), placement=None, **channels) -> effect.Effect:
    """An effect of a shutter, a scribble and a matte, all still but for these."""
    ramp = mattes.Ramp("linear")
    still = {"options": Options(4), "edge_aware": 0, "bars": FIRST, "width": 0.1}
    still |= {"content": ramp, "opacity": 1.0, "feather": 0.0}
    each = {name: Constant(value) for name, value in still.items()} | channels
    strokes = [np.array([[0.1, 0.2], [0.5, 0.9]])], [np.zeros((2, 2))]
    drawings = effect.Drawings("Face", drawn, strokes[: len(drawn)], ("linear",) * len(drawn), 1.0, placement)
    moves = effect.Moves(**{name: each[name] for name in ("location", "rotation", "scale") if name in each})
    line = effect.Region(moves=moves, shutter=0, kind="line", width=each["width"], drawings=drawings)
    matte = {name: each[name] for name in ("content", "opacity", "feather")}
    regions = line, effect.MatteRegion(moves=effect.Moves(), shutter=0, **matte)
    shutter = effect.Shutter(name="Sharp", bars=Bars(each["bars"]))
    return effect.Effect((shutter,), regions, each["options"], edge_aware=each["edge_aware"])


@pytest.mark.parametrize(
    "channels",
    [
        {"bars": keyed(FIRST, LAST)},
        {"options": Samples({1: Options(4), 3: Options(4, border=True)})},
        {"edge_aware": keyed(0.0, 1.0)},
        {"width": keyed(0.1, 0.2)},
        {"location": keyed((0, 0), (1, 1))},
        {"rotation": keyed(0, 90)},
        {"scale": keyed(1, 2)},
        {"drawn": (1.0, 5.0)},
        {"placement": Samples({1: np.eye(3), 3: np.diag([0.5, 0.5, 1])})},
        {"content": Samples({i: mattes.Ramp("linear", Placement((i, 0))) for i in (1, 3)})},
        {"content": effect.placed_ramp("linear", effect.Moves(rotation=keyed(0.0, 90.0)))},
        {"opacity": keyed(1.0, 0.5)},
        {"feather": keyed(0.0, 0.5)},
    ],
    ids=lambda channels: next(iter(channels)),
)
def test_what_changes_over_time_changes_the_state(channels):
    found = changed(**channels)
    assert found.at(1).key != found.at(3).key
    assert found.at(1).key == found.at(1).key == changed(**channels).at(1).key


def test_the_way_to_a_closed_shutter_is_no_displacement():
    keys = ((1.0, "linear"), (5.0, "linear"))
    closing = Bars(Keys((1.0, 5.0), (FIRST, 0 * FIRST), ("linear", "linear")), keys)
    assert closing.at(2, "displacement").tolist() == [0.75, 0, 0, 0]
    with pytest.raises(EffectError, match='shutter "Sharp" at frame 5: all bars are zero'):
        made(closing).at(5)


def test_time_that_stands_still_runs_as_it_came():
    frames, values = (1.0, 11.0, 21.0), (10.0, 5.0, 5.0)
    eases = ("linear",) * 3
    time = SourceTime(Keys(frames, values, eases), tuple(zip(frames, eases, strict=True)))
    assert time.at(6) == (7.5, True)
    assert time.at(11) == (5, True)
    assert time.at(40) == (5, True)
    jump = SourceTime(Keys((1.0, 11.0), (10.0, 5.0), ("constant",) * 2), ((1.0, "constant"), (11.0, "constant")))
    assert jump.at(20) == (5, False)
    still = dataclasses.replace(time, numbers=Keys(frames, (2.8467, 2.8467, 7.0), eases))
    assert {still.at(frame / 2) for frame in range(2, 22)} == {(2.8467, False)}


def test_strokes_far_off_and_too_many_points_are_refused():
    far = region([np.full((2, 2), 10 * limits.MAX_DISTANCE)], Constant(np.eye(3)))
    with pytest.raises(EffectError, match='region "Face": a point of its strokes is too far from the picture'):
        made(Bars(Constant(FIRST)), [far]).at(1)
    half = [np.zeros((limits.MAX_POINTS // 2 + 1, 2))]
    assert len(made(Bars(Constant(FIRST)), [region(half)]).at(1).shapes) == 1
    with pytest.raises(EffectError, match='region "Second": more than'):
        made(Bars(Constant(FIRST)), [region(half), region(half, name="Second")]).at(1)
    drawn = effect.Drawings("Outline", (1.0,), (half,), ("linear",), 1.0)
    outline = effect.OutlineRegion(
        moves=effect.Moves(), name="Outline", shutter=0, content=Constant(None), drawings=drawn
    )
    with pytest.raises(EffectError, match='region "Outline": more than'):
        made(Bars(Constant(FIRST)), [region(half), outline]).at(1)
