"""Calls and sentences that wait for a timer of Blender's main thread."""

import contextlib

import pytest
from support import Like

from shutter_addon import blender
from shutter_addon.blender import handlers
from shutter_addon.blender.data import data_format
from shutter_addon.blender.devices import main_thread
from shutter_addon.core import recent_errors


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
    handlers.tell(data_format.note([edit]))
    context = Like(window.context, window_manager=Like(window.context.window_manager, windows=[]))
    monkeypatch.setattr(handlers, "bpy", Like(window, app=handlers.bpy.app, context=context))
    assert main_thread.call_waiting() > 0
    monkeypatch.setattr(handlers.operator_bases, "popup", lambda _context, words, **_looks: shown.append(words))
    context.temp_override, context.window_manager.windows = lambda **_window: contextlib.nullcontext(), [None]
    handlers.tell(data_format.note([edit]))
    assert main_thread.call_waiting() > 0
    assert ["newer version" in words for words in shown] == [True]
