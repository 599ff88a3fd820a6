"""Calls of another thread that Blender's main thread makes."""

from types import SimpleNamespace
from unittest.mock import Mock

import pytest


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands still: `now` may be set forward, and `meanwhile` is called at the next look at the time."""
    from shutter_addon.blender.devices import gpu_relay

    def look():
        meanwhile, clock.meanwhile = clock.meanwhile, None
        if meanwhile:
            meanwhile()
        return clock.now

    clock = SimpleNamespace(now=1000.0, meanwhile=None)
    monkeypatch.setattr(gpu_relay, "time", SimpleNamespace(monotonic=look))
    return clock


@pytest.fixture
def relay(bpy, monkeypatch, clock):
    """As where Blender's GPU is current."""
    from shutter_addon.blender.devices import gpu_relay

    monkeypatch.setattr(gpu_relay, "has_context", lambda: True)
    monkeypatch.setattr(gpu_relay, "gpu", Mock())
    return gpu_relay


def test_the_main_thread_looks_for_calls_until_there_are_none_for_a_while(relay, clock):
    """Whether they come before it looks, or while it waits in `serve`."""
    made = []

    def call():
        return relay._called(lambda: made.append(len(made)))  # what a RelayedDevice's methods do

    assert not relay.look()
    for _ in range(2):
        call()
        assert relay.look()
        clock.now += 0.5
        assert relay.look()
        clock.now += 10
        assert not relay.look()
    clock.meanwhile = lambda: [call(), relay.serve(0.01)]
    call()
    assert relay.look()
    assert made == [0, 1, 2, 3]


def test_a_call_that_fails_and_one_that_is_not_waited_for(relay):
    made = []
    failing = relay._called(lambda: 1 / 0)  # what a RelayedDevice's methods do
    relay.ask(lambda: made.append("late"), 0)
    assert relay.look()
    assert isinstance(failing.exception(0), ZeroDivisionError)
    assert not made
