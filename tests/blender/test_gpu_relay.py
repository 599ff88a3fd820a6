"""Calls of another thread that Blender's main thread makes."""

from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from shutter_addon.blender.devices import gpu_relay, main_thread


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands still: `now` may be set forward, and `meanwhile` is called at the next look at the time."""

    def look():
        meanwhile, clock.meanwhile = clock.meanwhile, None
        if meanwhile:
            meanwhile()
        return clock.now

    clock = SimpleNamespace(now=1000.0, meanwhile=None)
    monkeypatch.setattr(gpu_relay, "time", SimpleNamespace(monotonic=look))
    return clock


def test_a_call_that_is_made_before_anyone_looks(bpy, monkeypatch, clock):
    """The main thread, waiting in `serve`, takes it as soon as it is there: it must look for the next all the same."""
    looking, made = [], []
    monkeypatch.setattr(main_thread, "soon", lambda function: function())
    monkeypatch.setattr(gpu_relay, "has_context", lambda: True)
    monkeypatch.setattr(gpu_relay, "gpu", Mock())
    monkeypatch.setattr(bpy.app.timers, "register", lambda look, **_: looking.append(look))

    def ask(what):
        clock.meanwhile = lambda: gpu_relay.serve(0.01)
        gpu_relay.ask(lambda: made.append(what), 0)

    ask("first")
    assert (made, len(looking)) == (["first"], 1)
    ask("second")
    assert (made, len(looking)) == (["first", "second"], 1)
    clock.now += 10
    assert looking[0]() is None  # after a rest it looks for none
    ask("third")
    assert (made, len(looking)) == (["first", "second", "third"], 2)
    clock.now += 10
    assert looking[1]() is None
