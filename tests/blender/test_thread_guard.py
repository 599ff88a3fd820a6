"""Threads of the extension touch nothing of Blender; all tests here are watched for it (thread_guard)."""

import thread_guard

from shutter_addon.blender.data import selection
from shutter_addon.blender.rendering import session
from shutter_addon.core import stopping, threads


def test_a_render_works_on_threads_that_touch_no_data(bpy, edit, render, effect):
    thread_guard.seen.clear()
    render(edit, [1, 2])
    assert {"media/prefetch.py: PrefetchSource._next", "compute/renderer.py: Renderer.picture"} <= thread_guard.seen
    assert not thread_guard.faults()


def test_data_and_calls_on_a_thread_are_found(bpy, effect):
    import gpu

    selection.active_shutter(effect)
    assert not thread_guard.faults()
    threads.start(selection.active_shutter, effect).result()
    found = thread_guard.faults()
    assert "blender/data/selection.py: active_shutter runs on a thread" in found
    assert any("active_shutter has effect" in fault for fault in found)
    threads.start(selection.active, bpy.context).exception()
    assert any("has context" in fault for fault in thread_guard.faults())
    # And calls from modules that never import Blender.
    timers, texts, scenes = bpy.app.timers, bpy.app.translations, bpy.data.scenes
    for function in (timers.is_registered, texts.pgettext_rpt, scenes.get, gpu.types.GPUTexture):
        threads.start(session.broken_off, stopping.never, function, "Shutter").exception()
        found = [fault.partition(" calls ")[0] for fault in thread_guard.faults()]
        assert found == ["blender/rendering/session.py: broken_off"], function
