"""Work that is broken off between its steps."""

import threading

import pytest

from shutter_addon.core import stopping


def test_a_thread_is_told_what_was_said_on_it():
    with stopping.once(lambda: True), pytest.raises(stopping.StoppedError):
        stopping.check()
    stopping.check()
    with stopping.once(lambda: True):
        thread = threading.Thread(target=stopping.check)
        thread.start()
        thread.join()
