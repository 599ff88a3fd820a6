"""Where the points of the shown picture lie in frames of the source, by keys on the timeline."""

import dataclasses
from types import SimpleNamespace

import made_recipes
import numpy as np
import pytest
from made_recipes import key

from shutter_addon.core.model.clip import Clip
from shutter_addon.core.model.keyframes import Constant
from shutter_addon.core.model.state_at import smoothing, state_at

SOURCE = Clip(width=64, height=48, count=40)


def made(keys=(), position="start", edges="hold", follow="car", camera=(), strokes=(((0.4, 0.4), (0.6, 0.6)),)):
    region = {"shutter": "Long", "name": "car", "strokes": strokes, "keys": list(keys)}
    shutter = {"name": "Long", "bars": [1] * 6} | ({"follow": follow} if follow else {})
    return made_recipes.made(6, [shutter], [region], position=position, edges=edges, camera=list(camera))


def state_of(source, frame, index, direction=1, shown=None):
    """The effect at a frame; shown: the source frame at any, `index` at that one."""
    shown = shown or (lambda other: index + round(other - frame))
    time = SimpleNamespace(at=lambda other: (shown(other) + 1, direction < 0))
    effect = dataclasses.replace(source.for_picture(SOURCE.width / SOURCE.height), time=time)
    found = state_at(effect, SOURCE, frame)
    assert (found.source_frame, found.direction) == (index, direction)
    return found.state


def followed(*arguments, **given):
    return state_of(*arguments, **given).following


STRAIGHT = [key(0, (0, 0)), key(100, (1, 0.5))]


WHIRL = [key(1), key(2, (0.1, 0), 90, 2)]


def with_way(source, **way):
    return dataclasses.replace(source, shutters=(dataclasses.replace(source.shutters[0], **way),))


def test_the_location_alone_is_followed():
    """The center goes where it went, and nothing turns or grows about it."""
    found = followed(with_way(made(WHIRL), follow_motion="location"), 1, 0).at([0, 1])
    assert found[0] == pytest.approx(np.ones((2, 1)))
    assert found[1][1, 0] == pytest.approx(6.4)
    turned = followed(with_way(made(WHIRL), follow_motion="rotation"), 1, 0).at([1])[0][0, 0]
    assert turned == pytest.approx(-1j)


def test_smoothing_is_the_weighted_mean_of_the_frames_around():
    jump = [key(10, ease="constant"), key(20, (0.5, 0))]
    source = with_way(made(jump, "center"), follow_smooth=3)
    found = followed(source, 17, 16, shown=lambda f: int(f) - 1).at([19])[1][:, 0]
    weights = smoothing(3)
    # At frame 20 those from 20 on count, of 17 to 23; at frame 17 the last of 14 to 20.
    assert found[0] == pytest.approx(32 * (weights[3:].sum() - weights[-1]))


def test_shutters_may_follow_one_region_in_ways_of_their_own():
    source = made(WHIRL)
    other = dataclasses.replace(source.shutters[0], name="Other", follow_motion="location")
    found = followed(dataclasses.replace(source, shutters=(*source.shutters, other)), 1, 0).at([1])[0][0]
    assert found == pytest.approx([-2j, 1])


@pytest.mark.parametrize("keys", [[], STRAIGHT[:1], [key(0, scale=0), key(9, (1, 1))]])
def test_what_does_not_move_is_nothing_to_follow(keys):
    assert state_of(made(keys), 0, 0).key == made(keys, follow=None).for_picture(4 / 3).at(0).key
    no_size_later = [key(0), key(4, scale=0)]  # a point
    assert followed(made(no_size_later), 0, 0).at([4])[0][0, 0] == 0


@pytest.mark.parametrize("steps", [1, 8])
@pytest.mark.parametrize("layer", [False, True])
def test_moments_between_frames_ask_for_no_more_of_the_timeline(steps, layer):
    """Four times the window around the shown frame, and as far as what lies behind layers is looked for: whoever
    samples F-curves knows no other frames."""
    source, asked = made(STRAIGHT), []
    if layer:
        source = dataclasses.replace(
            source,
            shutters=tuple(dataclasses.replace(each, follow=None) for each in source.shutters),
            regions=tuple(dataclasses.replace(each, layer=True) for each in source.regions),
            options=Constant(dataclasses.replace(source.options.at(1), plate_reach=3)),
        )
    time = SimpleNamespace(at=lambda other: asked.append(other) or (20, False))
    effect = dataclasses.replace(source.for_picture(SOURCE.width / SOURCE.height), time=time)
    state_at(effect, SOURCE.stepped(steps), 50)
    reach = 4 * 6 + (3 if layer else 0)
    assert (min(asked), max(asked)) == (50 - reach, 50 + reach)
