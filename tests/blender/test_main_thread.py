"""Calls and sentences that wait for a timer of Blender's main thread."""

import pytest
from support import Like

from shutter_addon import blender
from shutter_addon.blender.data import data_format, main_thread
from shutter_addon.blender.interface import newer_files
from shutter_addon.core import told


@pytest.fixture
def window(bpy, monkeypatch):
    """As in a Blender with a window, but that nothing calls its timers."""
    for module in (main_thread, newer_files):
        monkeypatch.setattr(module, "bpy", Like(bpy, app=Like(bpy.app, background=False)))
    main_thread.register()
    yield bpy
    for timer in filter(bpy.app.timers.is_registered, main_thread.TIMERS + newer_files.TIMERS):
        bpy.app.timers.unregister(timer)


def test_calls_that_wait_are_made_after_a_file_is_loaded_and_the_extension_disabled(window, edit):
    (timer,), made = main_thread.TIMERS, []
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
    (timer,), made = main_thread.TIMERS, []
    told.forget()
    main_thread.soon(lambda: 1 / 0)
    main_thread.soon(lambda: made.append("next"))
    assert timer() > 0
    assert made == ["next"]
    assert [each.text for each in told.last()] == ["ZeroDivisionError"]
    assert "ZeroDivisionError: division by zero" in capfd.readouterr().err


def test_a_newer_file_is_told_once_while_there_is_a_window(window, edit, effect, monkeypatch):
    (timer,) = newer_files.TIMERS
    edit.virtual_shutter.format = data_format.FORMAT + 1
    newer_files.tell([edit])
    newer_files.tell([edit])
    window.app.timers.unregister(timer)
    assert not window.app.timers.is_registered(timer)
    newer_files.tell([edit])
    blender.unregister()
    waits = window.app.timers.is_registered(timer)
    blender.register()
    assert not waits
    context = Like(window.context, window_manager=Like(window.context.window_manager, windows=[]))
    monkeypatch.setattr(newer_files, "bpy", Like(window, context=context))
    assert timer() is None
