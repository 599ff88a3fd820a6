"""A render as it goes: which film it is, what went wrong in it, and how it ends early.

Blender writes a frame whose engine failed without it, so a picture that is missing has to end the whole render. Then
Blender finishes an open movie, up to the frame before, and calls `render_cancel`.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from enum import Enum
from functools import partial
from itertools import chain
from types import FrameType
from typing import TypeVar

import bpy
from bpy.types import Scene

from ...core import threads, told
from ...core.messages import sentence, signed
from ..data.property_copy import for_a_while
from ..data.strips import ENGINE
from ..devices import main_thread

T = TypeVar("T")
BAD_INPUT = 2
_PATIENCE = 0.1  # seconds between two looks at whether a render has ended
_LONG = 10.0  # seconds


def say(text: str) -> None:
    """Says something on stderr."""
    with suppress(OSError, AttributeError):  # nobody reads it, or there is no stderr
        print(signed(text), file=sys.stderr, flush=True)


class Where(Enum):
    """Where Blender calls the extension: without a window; on the main thread of one; on the thread of a job, while the
    window goes on; or likewise, while it waits for every picture (View ▸ Render Sequencer Animation), so that this
    thread may read Blender's data by itself, and must not wait for the main one."""

    BACKGROUND = "background"
    WINDOW = "window"
    JOB = "job"
    WAITED_FOR = "waited for"


@dataclass
class _Job:
    """The render that runs, or ran last.

    film: session_uid of the scene whose render runs, None: none does; neither of those that its Scene strips show, nor
    of what a preview shows
    begun: whether its first frame has; stopping: whether it is to end with the frame that is made
    failure: the sentence that ends it; tell: what is done with that in the background
    cancelling: whether the small render runs whose error ends it
    waited_for: whether the window waits for every picture that its thread makes, see Where"""

    film: int | None = None
    begun: bool = False
    stopping: bool = False
    failure: str | None = None
    tell: Callable[[str], None] = say
    cancelling: bool = False
    waited_for: bool = False


_job = _Job()
_spent: list[tuple[str, str]] = []  # names of the scenes and cameras of small renders, see _cancel


def begin(scene: Scene) -> bool:
    """A render begins. True: that of a film or a picture; not of a scene in one, nor of a preview."""
    is_effect = scene.render.engine == ENGINE
    if _job.film is not None and (_job.begun or is_effect):
        return False
    # Render Sequencer Animation says of no film that it begins, only of each effect in it.
    is_job = where() in (Where.JOB, Where.WAITED_FOR)
    _job.waited_for = is_effect and is_job and "RENDER_OT_opengl" in operators_running()
    if is_effect and where() is Where.WINDOW:
        return False  # a preview
    _job.film, _job.begun, _job.failure, _job.stopping = scene.session_uid, False, None, False
    return True


def runs() -> bool:
    """Whether a film, or a single picture of it, is rendered."""
    return _job.film is not None


def film() -> int | None:
    """session_uid of the scene whose render runs."""
    return _job.film


def is_film(scene: Scene) -> bool:
    """Whether this scene's frames are what is rendered; called before each of them."""
    if scene.session_uid != _job.film:
        return False
    _job.begun = True
    return True


def end(scene: Scene, alone: bool) -> None:
    """A render has ended. alone: no Python waits for it, Blender itself renders, and would go on or end with exit code
    1."""
    if scene.session_uid == _job.film:
        _job.film = None
        if bpy.app.background:
            _remove_spent()
        else:  # what Blender keeps belongs to its main thread
            main_thread.soon(lambda: bpy.app.timers.register(_remove_spent_then))
        if _job.failure is not None and alone and bpy.app.background:
            leave(BAD_INPUT)


def ends_films() -> bool:
    """Whether what fails here and now is a film: in the background, in a job of the window, or in a script there. Else
    it is a preview, on the main thread."""
    if where() is not Where.WINDOW:
        return True
    return _job.film is not None and not bpy.app.is_job_running("RENDER")


def script_waits(call_frame: FrameType | None) -> bool:
    """Whether a script waits for what Blender does now. call_frame: that (inspect.currentframe) of the function of ours
    that Blender has called. Blender tells nobody of scripts that render, not even of `render.opengl`."""
    return call_frame is not None and call_frame.f_back is not None


def where() -> Where:
    """Where we are called."""
    if bpy.app.background:
        return Where.BACKGROUND
    if threading.current_thread() is threading.main_thread():
        return Where.WINDOW
    return Where.WAITED_FOR if _job.waited_for else Where.JOB


def operators_running() -> set[str]:
    """The names of the operators of all windows that wait for events; where the main thread is, or waits."""
    windows = bpy.context.window_manager.windows
    return {operator.bl_idname for window in windows for operator in window.modal_operators}


def telling(to: Callable[[str], None]) -> AbstractContextManager[None]:
    """Inside, the sentence that ends a render in the background goes there in place of stderr."""
    return for_a_while([(_job, "tell", to)])


@contextmanager
def calling(handlers: list, function: Callable) -> Iterator[None]:
    """Inside, one of bpy.app.handlers has that function."""
    handlers.append(function)
    try:
        yield
    finally:
        handlers.remove(function)


def scripts_act() -> bool:
    """Whether Blender calls others than us at frames that it renders: they may change anything."""
    handlers, own = bpy.app.handlers, __name__.split(".blender.")[0]
    lists: list[list] = [handlers.render_pre, handlers.render_post, handlers.render_write, handlers.render_stats]
    lists += [handlers.render_init, handlers.frame_change_pre, handlers.frame_change_post]  # of effects at each frame
    functions = [getattr(each, "func", each) for each in chain(*lists)]  # of partial ones, what they call
    return any(not str(getattr(function, "__module__", "")).startswith(own) for function in functions)


def on_main_thread(function: Callable[[], T], ended: Callable[[], bool] | None = None) -> T | None:
    """What a function gives on Blender's main thread, where its data and its operators belong; None: it was not waited
    for, and is not called any more. ended: whether nobody waits for it any longer; without it, the window is not waited
    for long. Once it is called, its end is waited for."""
    if where() is not Where.JOB:
        return function()
    future: Future[T] = Future()
    deadline = time.monotonic() + _LONG
    ended = ended or (lambda: time.monotonic() > deadline)
    main_thread.soon(partial(threads.fulfil, future, function))
    while not wait([future], _PATIENCE).done:
        if ended() and future.cancel():
            return None
    return future.result()


def soon(function: Callable[[], None]) -> None:
    """Has a function called on the main thread: at once, if this is it."""
    if where() in (Where.JOB, Where.WAITED_FOR):
        main_thread.soon(function)
    else:
        function()


def stop() -> None:
    """Has the render end with the frame that is made, as at Ctrl-C."""
    _job.stopping = True


def stopping() -> bool:
    """Whether the film that this picture or frame belongs to was stopped, or has failed."""
    return _job.film is not None and ends_films() and (_job.stopping or _job.failure is not None)


def fail(text: str) -> None:
    """Says why the render that runs has to end; only the first sentence counts."""
    if _job.failure is None:
        _job.failure = text
        told.record(text)
        _job.tell(text)


def failure() -> str | None:
    """The sentence that ended the render which runs or ran last; None: none had to."""
    return _job.failure


def cancel(ended: Callable[[], bool] | None = None) -> None:
    """Ends the render that runs, as soon as this returns to Blender: from a picture, or from what comes before a frame.
    (After one Blender would go on with the next, and crash.)

    ended: whether the window has ended it meanwhile; without it, the window is not waited for long."""
    if where() is Where.JOB:
        on_main_thread(_cancel_and_show, ended)
    elif where() is Where.WAITED_FOR:
        # Until this picture is done, which is left out. What comes meanwhile fails likewise.
        soon(_cancel_and_show)
    else:
        _cancel()


def _cancel_and_show() -> None:
    """As _cancel, and says in the window what failed: reports of an engine within the sequencer reach nobody."""
    _cancel()
    if _job.failure is not None:
        text = sentence(_job.failure)
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            bpy.context.window_manager.popup_menu(
                lambda menu, _context: menu.layout.label(text=text), title="Virtual Shutter", icon="ERROR"
            )


def _cancel() -> None:
    """An engine's error that reaches an operator is all that breaks Blender's renders from Python. Errors from within
    the sequencer reach none; those of a small render beside it do."""
    if _job.cancelling:
        return
    _job.cancelling = True
    scene = bpy.data.scenes.new("Cancelled")
    camera = bpy.data.objects.new("Cancelled", None)
    _spent.append((scene.name, camera.name))
    try:
        scene.render.engine = ENGINE
        scene.render.resolution_x = scene.render.resolution_y = 4
        scene.collection.objects.link(camera)
        scene.camera = camera
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]), suppress(RuntimeError):
            bpy.ops.render.render(scene=scene.name)
    finally:
        _job.cancelling = False


def _remove_spent_then() -> float | None:
    """A timer, until the job has ended."""
    if bpy.app.is_job_running("RENDER"):
        return _PATIENCE
    _remove_spent()
    return None


def _remove_spent() -> None:
    """Removes what the small renders were of. Not before the film has ended: other effects of the same frame would be
    rendered with what Blender frees along with them, and crash."""
    while _spent:
        scene, camera = _spent.pop()
        items = (bpy.data.scenes.get(scene), bpy.data.objects.get(camera))
        bpy.data.batch_remove([item for item in items if item is not None])


def cancelling() -> bool:
    """Whether the small render runs whose error ends the other one."""
    return _job.cancelling


def leave(code: int) -> None:
    """Ends the process from inside Blender; after sys.exit it would complain about its memory."""
    with suppress(OSError, AttributeError):
        sys.stdout.flush()
    os._exit(code)
