"""Work that is broken off, and goes on in another slice of time."""

import math

import pytest

from shutter_addon.core import stopping
from shutter_addon.core.memo import Memo
from shutter_addon.core.stopping import Slice, StoppedError


def test_a_slice_ends_work_and_knows_what_is_kept():
    memo, over, endless = Memo(), Slice(-math.inf), Slice(math.inf)
    with stopping.once(over), pytest.raises(StoppedError):
        memo.get("key", stopping.check)
    assert not over.has_kept
    with stopping.once(endless):
        stopping.check()
        memo.get("key", lambda: 1)
    assert endless.has_kept
    again = Slice(math.inf)
    with stopping.once(again):
        assert memo.get("key", lambda: 2) == 1
    assert not again.has_kept, "it was there"
