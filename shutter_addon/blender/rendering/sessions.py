"""The three render sessions: for the window, for renders, and for renders that the window waits for.

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
    """The three render sessions, each with its own device and renderers.

    Attributes:
        offscreen: Makes pictures of renders. Its device may be the window's GPU, which the main thread then calls for
            it ("relayed" in available.OPEN).
        window: Makes previews in Blender's window, on Blender's own GPU.
        waited_for: Takes the place of `offscreen` for a render during which the window waits for every picture
            (Where.WAITED_FOR), if `offscreen` uses the window's GPU, which cannot be used then.
    """

    offscreen: RenderSession
    window: RenderSession
    waited_for: RenderSession


def _ask_window() -> None:
    """Have the window's previews free their GPU memory, and wait at most _ANSWER seconds for it.

    Do nothing without a window, on the main thread, or while the window waits for the picture (Where.WAITED_FOR).
    Previews load their frames again when they are drawn next.
    """
    if render_job.where() is Where.JOB:
        main_thread.ask(SESSIONS.window.free, _ANSWER)


def _ask_offscreen() -> None:
    """Free the GPU memory that finished renders keep for the next one, unless a render is running."""
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
    """Return the context for what is drawn on the main thread: previews, or a script's drawing without a window."""
    return RenderContext(SESSIONS.window) if render_job.where() is Where.WINDOW else of_render()


def of_engine(say: Say) -> RenderContext:
    """Return the context for a picture that Blender asks the engine for, of a preview or of a render."""
    return of_render(say) if render_job.ends_films() else RenderContext(SESSIONS.window, say)


def of_render(say: Say = print, *, levels: bool = False, display: Display | None = None) -> RenderContext:
    """Return the context of a render.

    Its session is `offscreen`, or `waited_for` while Blender's window waits for every picture and `offscreen` would
    need its GPU (_Sessions).

    Args:
        say, levels, display: As in RenderContext.

    Raises:
        NoDeviceError: While the window waits for every picture: the device that the user wants is missing.
    """
    session = SESSIONS.offscreen
    if render_job.where() is Where.WAITED_FOR:
        SESSIONS.waited_for.close_if_device_changed()  # no handler runs when such a film begins
        session = SESSIONS.waited_for if SESSIONS.offscreen.device == "relayed" else SESSIONS.offscreen
    return RenderContext(session, say, levels=levels, display=display)


def close_if_device_changed() -> None:
    """Close the session of renders (`offscreen`) if another device, or none, would be chosen now; always `waited_for`.

    Closes all three sessions if the limit of GPU memory was changed in the settings. Called on the main thread before a
    render.
    """
    if render_settings.forget_memory_if_changed():
        forget()
    SESSIONS.waited_for.forget()  # its frames take main memory
    SESSIONS.offscreen.close_if_device_changed()


def end_job() -> None:
    """Forget a render's requests; on a job's thread, also stop making pictures ahead. Renderers stay open."""
    if render_job.where() is Where.JOB:
        SESSIONS.offscreen.rest()
    SESSIONS.offscreen.requests.clear()


def drop_removed() -> None:
    """Close the renderers of effect scenes that do not exist any more."""
    scenes = {scene.session_uid for scene in bpy.data.scenes}
    for session in SESSIONS:
        session.keep(scenes)


def forget(*_: object) -> None:
    """Close all sessions, when a file is loaded or the extension is disabled."""
    features.call("forget_pictures")
    for session in SESSIONS:
        session.forget()
