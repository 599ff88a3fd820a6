"""How much what is tracked counts, where its track ends."""

import pytest

from shutter_addon.core.model import keyframes, presence
from shutter_addon.core.model.presence import Gap, Stop

COVERED, BEHIND = Stop(50, True), Stop(9, False)
TRACKED = range(10, 50)


def counts(*arguments, **given):
    """By frame, from 0 to 79; all of it where there are no keys."""
    found = presence.keys(*arguments, **given)
    frames = [key.frame for key in found]
    assert frames == sorted(set(frames))
    if not found:
        return [1.0] * 80
    keys = keyframes.Keys(tuple(frames), tuple(key.value for key in found), tuple(key.ease for key in found))
    return [float(keys.at(frame)) for frame in range(80)]


def test_it_fades_while_it_is_still_seen_and_ends_at_once_at_a_cut():
    found = counts(TRACKED, [COVERED, BEHIND], [30])
    assert found[:10] == [0.0] * 10
    assert found[50:] == [0.0] * 30
    assert found[14:46] == [1.0] * 32
    assert found[10:14] == pytest.approx([0.2, 0.4, 0.6, 0.8])
    assert found[46:50] == pytest.approx([0.8, 0.6, 0.4, 0.2])
    assert counts(TRACKED, [Stop(50, True, True), Stop(9, False, True)], [30]) == [0.0] * 10 + [1.0] * 40 + [0.0] * 30
    assert presence.keys(TRACKED, [], [30]) == [], "there is no end"


def test_where_the_editor_has_put_it_all_of_it_counts():
    for start in (49, 48):
        found = counts(TRACKED, [COVERED], [start])
        assert found[: start + 1] == [1.0] * (start + 1)
        assert found[50] == 0


def test_fades_end_before_they_meet():
    """On the way to another key, and between gaps that are close."""
    found = counts([*range(10, 31), *range(40, 60)], [Stop(31, True), Stop(39, True)], [10, 59])
    assert found[31:40] == [0.0] * 9
    assert found[26:31] == pytest.approx([1, 0.8, 0.6, 0.4, 0.2])
    assert found[40:45] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1])
    found = counts([*range(10, 30), *range(33, 37), *range(40, 60)], [Stop(30, True), Stop(37, True)], [15])
    assert found[30:33] == [0.0] * 3
    assert found[37:40] == [0.0] * 3
    assert max(found[33:37]) > 0.4


def test_a_jump_from_which_it_goes_on_is_one_frame_long():
    found = counts(range(60), [Stop(30, True)], [0], fade=10)
    assert found[20:41] == pytest.approx([abs(frame - 30) / 10 for frame in range(20, 41)])
    assert presence.gaps(range(60), [Stop(frame, True) for frame in (30, 32, 33)]) == [Gap(30, 30), Gap(32, 33)]
