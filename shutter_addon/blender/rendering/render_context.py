"""For whom pictures are made: built once at each door (the engine, what is drawn, a command, the feed of a film), and
passed down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...compute.renderer import Renderer
from ...compute.request import Request
from ...core.pixels.shown_levels import Display
from ...core.stopping import never
from ..data.snapshot import Snapshot
from . import render_job, render_settings, sessions
from .effect_source import Detail
from .render_job import Where
from .render_settings import RenderSettings
from .session import RenderSession


@dataclass(frozen=True)
class RenderContext:
    """What pictures are made with, whatever they show.

    session: whose device makes them
    settings: what a command has set for them
    say: called with a sentence when the device is a lesser one, or something cannot be done
    stopped: whether they are not wanted any longer
    levels: they are of 8-bit display code values (Request.levels)
    display: what shows them, whose levels are wanted (Request.display)"""

    session: RenderSession
    settings: RenderSettings
    say: Callable[[str], None] = print
    stopped: Callable[[], bool] = never
    levels: bool = False
    display: Display | None = None

    def request(self, snapshot: Snapshot, frame: float, detail: Detail | None = None) -> Request:
        """See RenderSession.request."""
        return self.session.request(snapshot, frame, self, detail)

    def renderer(self, request: Request) -> Renderer:
        """See RenderSession.renderer."""
        return self.session.renderer(request.source, self.say, self.stopped)


def of_drawing() -> RenderContext:
    """For what is drawn on the main thread; without a window, what draws there is a script."""
    if render_job.where() is Where.WINDOW:
        return RenderContext(session=sessions.WINDOW, settings=render_settings.settings())
    return of_render()


def of_engine(say: Callable[[str], None], stopped: Callable[[], bool]) -> RenderContext:
    """For the engine: a preview where Blender draws, else a render."""
    if not render_job.ends_films():
        return RenderContext(session=sessions.WINDOW, settings=render_settings.settings(), say=say, stopped=stopped)
    return of_render(say, stopped)


def of_render(
    say: Callable[[str], None] = print,
    stopped: Callable[[], bool] = never,
    *,
    levels: bool = False,
    display: Display | None = None,
) -> RenderContext:
    """For a render: on a device apart from the window's, which need not be current. NoDeviceError: there is none."""
    session, settings = sessions.of_render(), render_settings.settings()
    return RenderContext(session, settings, say, stopped, levels=levels, display=display)
