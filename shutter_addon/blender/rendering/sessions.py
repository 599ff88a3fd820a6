"""The sessions: one for the window, one for renders, and one for renders that the window waits for.

The engine, the draw handler, commands and the feed of a film get a RenderContext here once, and pass it on.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import bpy

from ... import features
from ...core.pixels.shown_levels import Display
from ..devices import available, main_thread
from . import render_job, render_settings
from .render_job import Where
from .session import RenderContext, RenderSession, Say

_ANSWER = 5.0  # seconds that a job waits for the window to free memory


class _Sessions(NamedTuple):
    """The sessions.

    Attributes:
        offscreen: Of renders.
        window: Of previews.
        waited_for: Of a thread that the window waits for, where `offscreen` would need the window's GPU.
    """

    offscreen: RenderSession
    window: RenderSession
    waited_for: RenderSession


def _ask_window() -> None:
    """In a render job, free the memory of Blender's window. It is not drawn until it loads its frames again."""
    if render_job.where() is Where.JOB:
        main_thread.ask(SESSIONS.window.free, _ANSWER)


def _ask_offscreen() -> None:
    """Free what renders keep for the next one, unless one runs."""
    if not render_job.runs():
        SESSIONS.offscreen.free()


# The window's pictures are made on its main thread and GPU. Renders have another device with a thread, because another
# GL context cannot always be current beside Blender's (see GLDevice). In the background, Blender's GPU belongs to the
# main thread.
SESSIONS = _Sessions(
    offscreen=RenderSession(lambda: available.choose(render_settings.wanted()), _ask_window),
    window=RenderSession(lambda: ("blender", None), _ask_offscreen, partial(features.call, "want_matte")),
    waited_for=RenderSession(lambda: available.choose(render_settings.wanted(), window_waits=True), lambda: None),
)


def of_drawing() -> RenderContext:
    """Return the context of what is drawn on the main thread; without a window, a script draws."""
    return RenderContext(SESSIONS.window) if render_job.where() is Where.WINDOW else of_render()


def of_engine(say: Say) -> RenderContext:
    """Return the context of the engine: a preview where Blender draws, else a render."""
    return of_render(say) if render_job.ends_films() else RenderContext(SESSIONS.window, say)


def of_render(say: Say = print, *, levels: bool = False, display: Display | None = None) -> RenderContext:
    """Return the context of a render, on a device that needs no window. NoDeviceError: there is none."""
    session = SESSIONS.offscreen
    if render_job.where() is Where.WAITED_FOR:
        SESSIONS.waited_for.close_if_device_changed()  # no handler runs when such a film begins
        session = SESSIONS.waited_for if SESSIONS.offscreen.device == "relayed" else SESSIONS.offscreen
    return RenderContext(session, say, levels=levels, display=display)


def close_if_device_changed() -> None:
    """Use the device and memory that the user wants now, before a render, on the main thread."""
    if render_settings.forget_memory_if_changed():
        forget()
    SESSIONS.waited_for.forget()  # its frames take main memory
    SESSIONS.offscreen.close_if_device_changed()


def end_job() -> None:
    """Drop what a window's job has begun, and snapshots. A script's next still may go on from the last one."""
    if render_job.where() is Where.JOB:
        SESSIONS.offscreen.rest()
    SESSIONS.offscreen.requests.clear()


def drop_removed() -> None:
    """Close the sources of effect scenes that are gone, and free their frames."""
    scenes = {scene.session_uid for scene in bpy.data.scenes}
    for session in SESSIONS:
        session.keep(scenes)


def forget(*_: object) -> None:
    """Close all sources and free the devices, when a file is loaded or the extension is disabled."""
    features.call("forget_pictures")
    for session in SESSIONS:
        session.forget()
