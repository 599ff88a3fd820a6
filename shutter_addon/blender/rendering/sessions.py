"""The sessions that there are: the window's, that of renders, and that of renders for which the window waits. Whoever
wants pictures (the engine, what is drawn, a command, the feed of a film) gets a RenderContext here once, and passes it
down."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from ...core.pixels.shown_levels import Display
from ...core.stopping import never
from ..devices import available, gpu_relay
from . import outline_carrying, render_job, render_settings, smooth_previews
from .render_job import Where
from .session import RenderContext, RenderSession

_ANSWER = 5.0  # seconds that a job waits for the window to free memory


def _ask_window() -> None:
    """Has the window free what it shows, for a job: it is not drawn meanwhile, and makes it again."""
    if render_job.where() is Where.JOB:
        gpu_relay.ask(WINDOW.free, _ANSWER)


def _ask_offscreen() -> None:
    """Has renders free what they keep for the next one, unless one runs."""
    if not render_job.runs():
        OFFSCREEN.free()


# What the window itself shows is made on its main thread, on its GPU. Renders have a device apart and a thread for it:
# beside Blender's own GL context another one cannot always be current (see GLDevice). In the background Blender's GPU
# belongs to the main thread, and has none.
OFFSCREEN = RenderSession(lambda: available.choose(render_settings.wanted()), _ask_window)
WINDOW = RenderSession(lambda: ("blender", None), _ask_offscreen, outline_carrying.want)
# For a thread whose pictures the window waits for, where OFFSCREEN has them made by the window.
WAITED_FOR = RenderSession(lambda: available.choose(render_settings.wanted(), window_waits=True), lambda: None)
SESSIONS = OFFSCREEN, WINDOW, WAITED_FOR


def of_drawing() -> RenderContext:
    """For what is drawn on the main thread; without a window, what draws there is a script."""
    return RenderContext(WINDOW) if render_job.where() is Where.WINDOW else of_render()


def of_engine(say: Callable[[str], None], stopped: Callable[[], bool]) -> RenderContext:
    """For the engine: a preview where Blender draws, else a render."""
    return of_render(say, stopped) if render_job.ends_films() else RenderContext(WINDOW, say, stopped)


def of_render(
    say: Callable[[str], None] = print,
    stopped: Callable[[], bool] = never,
    *,
    levels: bool = False,
    display: Display | None = None,
) -> RenderContext:
    """For a render: on a device apart from the window's, which need not be current. NoDeviceError: there is none."""
    return RenderContext(_of_render(), say, stopped, levels=levels, display=display)


def _of_render() -> RenderSession:
    """That of the render which runs on this thread."""
    if render_job.where() is not Where.WAITED_FOR:
        return OFFSCREEN
    WAITED_FOR.settle()  # for a film of which Blender does not say that it begins
    return WAITED_FOR if OFFSCREEN.device == "relayed" else OFFSCREEN


def settle() -> None:
    """Before a render, on the main thread: its device and its memory are what the user wants now."""
    if render_settings.forget_memory_if_changed():
        forget()
    WAITED_FOR.forget()  # its frames take the machine's own memory
    OFFSCREEN.settle()


def end_job() -> None:
    """Lets go of what a job of the window has begun, and of its snapshots. A script's next still may go on from the
    one before."""
    if render_job.where() is Where.JOB:
        OFFSCREEN.rest()
    OFFSCREEN.forget_requests()


def drop_removed() -> None:
    """Closes the sources of effect scenes that are gone, and frees their frames."""
    scenes = {scene.session_uid for scene in bpy.data.scenes}
    for session in SESSIONS:
        session.keep(scenes)


def forget(*_: object) -> None:
    """Closes all sources and frees the devices: when a file is loaded, and when the extension goes."""
    outline_carrying.forget()
    smooth_previews.forget()
    for session in SESSIONS:
        session.forget()
