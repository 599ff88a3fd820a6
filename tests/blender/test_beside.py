"""What goes on beside Blender, and calls and sentences that wait for a timer of its main thread."""

from types import SimpleNamespace

import pytest
from support import Like

from shutter_addon import blender
from shutter_addon.blender import handlers
from shutter_addon.blender.data import data_format
from shutter_addon.blender.devices import main_thread
from shutter_addon.blender.interface import operator_bases
from shutter_addon.core import recent_errors

TICK, ESCAPE = (SimpleNamespace(type=kind, value="PRESS") for kind in ("TIMER", "ESC"))
OTHER = SimpleNamespace(type="A", value="PRESS")


@pytest.fixture
def going(bpy):
    """One that has begun and has three steps, and what its timers are."""

    class Going(operator_bases.Beside):
        left, ends, leaves, blocks = 3, None, 0, True

        def begin(self, context, waits):
            return None if waits else self.go_on(context)

        def goes_on(self, _context):
            if self.left is None:
                raise ZeroDivisionError
            self.left -= 1
            return self.left > 0

        def leave(self, context):
            self.leaves += 1
            super().leave(context)

        def end(self, _context, is_stopped):
            self.ends = "stopped" if is_stopped else "done"

    timers = []
    manager = SimpleNamespace(
        event_timer_add=lambda _seconds, window: timers.append(window) or window,
        event_timer_remove=timers.remove,
        modal_handler_add=lambda _operator: None,
    )
    context = SimpleNamespace(window_manager=manager, window=object())
    operator = Going()
    assert operator.begin(context, waits=False) == {"RUNNING_MODAL"}
    return operator, context, timers


def test_it_ends_with_its_last_step(going):
    operator, context, timers = going
    assert [operator.modal(context, event) for event in (TICK, OTHER, TICK)] == [{"RUNNING_MODAL"}] * 3
    assert len(timers) == 1
    assert operator.modal(context, TICK) == {"FINISHED"}
    assert (operator.ends, operator.leaves, timers) == ("done", 1, [])


def test_escape_or_a_closed_window_ends_it_before_the_next_step(going):
    operator, context, timers = going
    assert operator.modal(context, ESCAPE) == {"FINISHED"}
    assert (operator.ends, operator.left, timers) == ("stopped", 3, [])
    operator.ends, operator.leaves = None, 0
    operator.begin(context, waits=False)
    operator.cancel(context)
    assert (operator.ends, operator.leaves, timers) == (None, 1, [])


def test_an_error_that_nobody_expects_lets_go_of_its_timer(going):
    operator, context, timers = going
    operator.left = None
    with pytest.raises(ZeroDivisionError):
        operator.modal(context, TICK)
    assert (operator.ends, operator.leaves, timers) == (None, 1, [])


def test_what_a_file_that_is_loaded_has_ended_ends_with_the_next_event(going, monkeypatch):
    operator, context, timers = going
    stands = SimpleNamespace(context=context, data=SimpleNamespace(workspaces=[]))
    monkeypatch.setattr(operator_bases, "bpy", stands)
    operator_bases.end_all()
    assert timers == []
    assert operator.modal(context, OTHER) == {"FINISHED"}
    assert (operator.ends, operator.left) == ("done", 3)


# Calls that wait


@pytest.fixture
def window(bpy, monkeypatch):
    """As in a Blender with a window, but that nothing calls its timers."""
    for module in (main_thread, handlers):
        monkeypatch.setattr(module, "bpy", Like(bpy, app=Like(bpy.app, background=False)))
    main_thread.register()
    yield bpy
    main_thread.drop(main_thread.call_waiting)


def test_calls_that_wait_are_made_after_a_file_is_loaded_and_the_extension_disabled(window, edit):
    timer, made = main_thread.call_waiting, []
    main_thread.soon(lambda: made.append("loaded"))
    window.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert window.app.timers.is_registered(timer)
    timer()
    main_thread.soon(lambda: made.append("enabled"))
    blender.unregister()
    assert not window.app.timers.is_registered(timer)
    main_thread.soon(lambda: made.append("meanwhile"))
    blender.register()
    assert window.app.timers.is_registered(timer)
    timer()
    assert made == ["loaded", "enabled", "meanwhile"]


def test_a_call_that_fails_is_kept_for_the_report_and_ends_nothing(window, capfd):
    timer, made = main_thread.call_waiting, []
    recent_errors._lines = []  # private: what other tests told
    main_thread.soon(lambda: 1 / 0)
    main_thread.soon(lambda: made.append("next"))
    assert timer() > 0
    assert made == ["next"]
    assert "ZeroDivisionError [blender/devices/main_thread.py:" in recent_errors.last()[0]
    assert "ZeroDivisionError: division by zero" in capfd.readouterr().err


def test_a_newer_file_is_told_where_there_is_a_window(window, edit, effect, monkeypatch):
    shown = []
    edit.virtual_shutter.format = data_format.FORMAT + 1
    monkeypatch.setattr(handlers.render_job, "popup", lambda words, **_looks: shown.append(words))
    handlers.tell(data_format.note([edit]))
    assert main_thread.call_waiting() > 0
    assert ["newer version" in words for words in shown] == [True]
