"""What goes on beside Blender: each way in which it ends, and what it lets go of."""

from types import SimpleNamespace

import pytest

from shutter_addon.blender.interface import operator_bases

TICK, ESCAPE = (SimpleNamespace(type=kind, value="PRESS") for kind in ("TIMER", "ESC"))
OTHER = SimpleNamespace(type="A", value="PRESS")


@pytest.fixture
def going(bpy):
    """One that has three steps, and what its timers are."""

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
    return Going(), context, timers


def test_it_ends_with_its_last_step(going):
    operator, context, timers = going
    assert operator.begin(context, waits=False) == {"RUNNING_MODAL"}
    assert [operator.modal(context, event) for event in (TICK, OTHER, TICK)] == [{"RUNNING_MODAL"}] * 3
    assert len(timers) == 1
    assert operator.modal(context, TICK) == {"FINISHED"}
    assert (operator.ends, operator.leaves, timers) == ("done", 1, [])


def test_escape_or_a_closed_window_ends_it_before_the_next_step(going):
    operator, context, timers = going
    operator.begin(context, waits=False)
    assert operator.modal(context, ESCAPE) == {"FINISHED"}
    assert (operator.ends, operator.left, timers) == ("stopped", 3, [])
    operator.ends, operator.leaves = None, 0
    operator.begin(context, waits=False)
    operator.cancel(context)
    assert (operator.ends, operator.leaves, timers) == (None, 1, [])


def test_an_error_that_nobody_expects_lets_go_of_its_timer(going):
    operator, context, timers = going
    operator.begin(context, waits=False)
    operator.left = None
    with pytest.raises(ZeroDivisionError):
        operator.modal(context, TICK)
    assert (operator.ends, operator.leaves, timers) == (None, 1, [])


def test_what_a_file_that_is_loaded_has_ended_ends_with_the_next_event(going, monkeypatch):
    operator, context, timers = going
    operator.begin(context, waits=False)
    stands = SimpleNamespace(context=context, data=SimpleNamespace(workspaces=[]))
    monkeypatch.setattr(operator_bases, "bpy", stands)
    operator_bases.end_all()
    assert timers == []
    assert operator.modal(context, OTHER) == {"FINISHED"}
    assert (operator.ends, operator.left) == ("done", 3)
