"""Work that is broken off between its steps."""

import math
import threading

import pytest

from shutter_addon.core import stopping
from shutter_addon.core.caches import LastValue


def test_a_thread_is_told_what_was_said_on_it():
    with stopping.once(lambda: True), pytest.raises(stopping.StoppedError):
        stopping.check()
    stopping.check()
    with stopping.once(lambda: True):
        thread = threading.Thread(target=stopping.check)
        thread.start()
        thread.join()


def test_a_slice_ends_work_and_knows_what_is_kept():
    assert not stopping.Slices().next("key", 60, 60)()
    memo, over, endless = LastValue(), stopping.Slice(-math.inf, -math.inf), stopping.Slice(math.inf, math.inf)
    with stopping.once(over), pytest.raises(stopping.StoppedError):
        memo.get("key", stopping.check)
    assert not over.has_kept
    with stopping.once(endless):
        stopping.check()
        memo.get("key", lambda: 1)
    assert endless.has_kept
    again = stopping.Slice(math.inf, math.inf)
    with stopping.once(again):
        assert memo.get("key", lambda: 2) == 1
    assert not again.has_kept, "it was there"
    with stopping.once(stopping.Slice(-math.inf, math.inf)):  # it ends once something is kept
        stopping.check()
        memo.get("other", lambda: 1)
        with pytest.raises(stopping.StoppedError):
            stopping.check()
