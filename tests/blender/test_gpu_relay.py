"""Calls of another thread that Blender's main thread makes."""

import queue


def test_a_call_that_is_made_before_anyone_looks(bpy, monkeypatch):
    """The main thread, waiting in `serve`, takes it as soon as it is there: it must look for the next all the same."""
    from shutter_addon.blender.devices import gpu_relay

    class TakenAtOnce(queue.SimpleQueue):
        def put(self, call):
            super().put(call)
            gpu_relay.serve(0.01)

    looking = []
    monkeypatch.setattr(gpu_relay, "_calls", TakenAtOnce())
    monkeypatch.setattr(gpu_relay, "has_context", lambda: True)
    monkeypatch.setattr(gpu_relay, "_finish_some", lambda: None)
    monkeypatch.setattr(bpy.app.timers, "register", lambda look, **_: looking.append(look))
    assert gpu_relay._called(lambda: "made").result(0) == "made"
    assert looking == [gpu_relay._look]
    monkeypatch.setattr(gpu_relay, "_REST", 0.0)
    gpu_relay._called(lambda: None).result(0)
    assert looking[0]() is None  # after a rest it looks for none
    gpu_relay._called(lambda: None).result(0)
    assert len(looking) == 2
