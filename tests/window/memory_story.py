"""Little memory on the GPU: a film as a job of the window has what the preview holds freed, and the preview has what
the film kept freed; on moderngl's device, then on Blender's. SHUTTER_MEGABYTES is the limit."""

import os
from contextlib import suppress

import bpy
from driver import NAME, area_of, edit, film, part, rendering, saw, until
from given_edit import opened

FRAMES = 4
MEGABYTES = int(os.environ["SHUTTER_MEGABYTES"])


def sessions():
    return part("blender.rendering.sessions")


def held(which):
    """What a session's textures take, and the kind of its window; None: it has none."""
    # Whoever asks a session for its renderer has it made, and the memory that it takes is what is told here.
    device, (*_, (_key, renderer)) = which._compositor.result().device, which._renderers.values()
    window = renderer._window  # likewise
    kind = type(window).__name__ if window is not None and window.is_open else None
    return sum(texture.bytes for texture in device._held), kind  # a budget is shared with the other session's


def shown():
    frame = edit().frame_current % FRAMES + 1
    edit().frame_set(frame)
    area_of("SEQUENCE_EDITOR", "PREVIEW").tag_redraw()
    window = sessions().SESSIONS.window
    # As in `held`.
    yield from until(lambda: window._renderers and held(window)[1], "the preview is composed", 60)
    yield 1.0


def told_in_the_preview():
    preview = part("blender.interface.preview")
    said, wrapped = [], preview.drawing.wrapped

    def noted(words, *room):
        if len(room) == 2:  # unlike in panels, which give no size
            said.append(words)
        return wrapped(words, *room)

    preview.drawing.wrapped = noted
    yield from shown()
    preview.drawing.wrapped = wrapped
    saw(said=said)


def steps():
    yield from opened()
    preferences = bpy.context.preferences.addons[NAME].preferences
    preferences.gpu_memory = MEGABYTES
    sessions().close_if_device_changed()
    window, offscreen = sessions().SESSIONS.window, sessions().SESSIONS.offscreen
    for device in ("OPENGL", "BLENDER"):
        preferences.device = device
        yield from shown()
        before = held(window)
        film(device, 1, FRAMES)
        budget, most, found = part("blender.rendering.render_settings").memory(), 0, {}
        while rendering():
            most = max(most, budget.used)
            with suppress(ValueError, RuntimeError):  # the film's thread takes its renderer out for a moment
                # As in `held`; what is drawn after it has that freed.
                if offscreen._renderers and held(offscreen)[1]:
                    found |= {"job": held(offscreen), "freed": held(window)}
            yield 0.05
        kind = type(offscreen._compositor.result().device).__name__  # the one that has rendered, and no other
        found |= {"device": kind, "limit": budget.limit, "before": before}
        yield from shown()
        most = max(most, budget.used)
        saw(**found, after=held(window), kept=held(offscreen), most=most)
    preferences.gpu_memory = MEGABYTES // 4
    sessions().close_if_device_changed()
    yield from told_in_the_preview()
