"""The render that is running: whether there is one, on which thread, why it failed, and how to end it early.

Blender writes a frame without the effect if the engine fails, so a missing picture has to end the whole render. Blender
then finishes a movie file with the frames before, and calls `render_cancel`.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from itertools import chain
from pathlib import Path
from types import FrameType
from typing import Any, TypeVar

import bpy
import numpy as np
from bpy.types import Scene

from ...compute.devices.device import Budget
from ...core import threads
from ...core.messages import sentence, signed
from ..data.snapshot import Snapshot
from ..data.strips import ENGINE
from ..devices import main_thread

T = TypeVar("T")
BAD_INPUT = 2
_PATIENCE = 0.1  # seconds between two looks at whether a render has ended
_LONG = 10.0  # seconds that a thread waits for the window


def say(text: str) -> None:
    """Print a message on stderr, after the extension's name."""
    with suppress(OSError, AttributeError):  # stderr is closed, or missing
        print(signed(text), file=sys.stderr, flush=True)


class Where(Enum):
    """In which situation Blender calls the extension.

    BACKGROUND is without a window, WINDOW on a window's main thread. JOB is a job's thread, while the window goes on.
    WAITED_FOR is such a thread while the window waits for every picture (View ▸ Render Sequencer Animation): it reads
    Blender's data itself, and must not wait for the main thread.
    """

    BACKGROUND = "background"
    WINDOW = "window"
    JOB = "job"
    WAITED_FOR = "waited for"


@dataclass
class FilmData:
    """What is kept for the running job or film. Effects are identified by the session_uid of their effect scene.

    Attributes:
        taken: Of a job: for each effect, (timeline frames, snapshot) of each part of its cut strip, or the error that
            prevents it.
        read: Of a film in the background: the snapshot for (effect, strip name); None: read, but not kept.
        pictures: Of a job: the last picture of each effect, shown until the next is made.
        left_out: Of a job: what requirements.left_out returned: (timeline frames, reason) of strips without a picture.
        feed: Of a film in the background: the state of output.edit_feed; None: it is not used.
    """

    taken: dict[int, list[tuple[range, Snapshot]] | Exception] = field(default_factory=dict)
    read: dict[tuple[int, str], Snapshot | None] = field(default_factory=dict)
    pictures: dict[int, np.ndarray] = field(default_factory=dict)
    left_out: list[tuple[range, str]] = field(default_factory=list)
    feed: Any = None


@dataclass
class _Job:
    """The render that is running, or ran last.

    Attributes:
        film: session_uid of the scene that the user renders, not of scenes in its strips; None: nothing renders. View ▸
            Render Sequencer Animation only tells of effect scenes: one of them.
        begun: Whether its first frame has begun.
        stopping: Whether it ends after the current frame, as after Ctrl-C.
        failure: The sentence that says why it ends, or why the last one ended.
        tell: Called with that sentence.
        cancelling: Whether the small render is running whose error ends this one (_cancel).
        waited_for: Whether the window waits for every picture (Where.WAITED_FOR).
        spent: Names of scenes and cameras of small renders, which are still to be removed (_cancel).
        said: Sentences that were said (say_once).
        film_data: What is kept for the running job or film.
        device: The device by a command's option, one of available.CHOICES; None: the user's preference.
        weights: Folder for the shares of shutters in every picture, as EXR files (--weights); None: do not write them.
        gpu_memory: Megabytes of GPU memory that textures may take, by a command's option; 0: an automatic limit; None:
            the user's preference.
        budget: The megabytes that were wanted (0: automatic), and the budget made of them; None: not made yet.
    """

    film: int | None = None
    begun: bool = False
    stopping: bool = False
    failure: str | None = None
    tell: Callable[[str], None] = say
    cancelling: bool = False
    waited_for: bool = False
    spent: list[tuple[str, str]] = field(default_factory=list)
    said: set[str] = field(default_factory=set)
    film_data: FilmData = field(default_factory=FilmData)
    device: str | None = None
    weights: Path | None = None
    gpu_memory: int | None = None
    budget: tuple[int, Budget] | None = None


job = _Job()


def say_once(text: str, to: Callable[[str], None]) -> None:
    """Call `to` with a sentence for the user, unless it was said before, also in an earlier render."""
    if text not in job.said:
        job.said.add(text)
        to(text)


def begin(scene: Scene) -> bool:
    """Note that a render begins.

    Returns:
        Whether it counts as the running render (_Job.film), of a film or a picture. False: Blender renders a scene of a
        strip for such a render, or an effect scene for a preview.
    """
    is_effect = scene.render.engine == ENGINE
    if job.film is not None and (job.begun or is_effect):
        return False
    # Render Sequencer Animation calls render_init only for each effect in the film.
    is_job = where() in (Where.JOB, Where.WAITED_FOR)
    job.waited_for = is_effect and is_job and "RENDER_OT_opengl" in operators_running()
    if is_effect and where() is Where.WINDOW:
        return False  # a preview
    job.film, job.begun, job.failure, job.stopping = scene.session_uid, False, None, False
    return True


def runs() -> bool:
    """Tell whether a render of the user's is running, of a film or a single picture."""
    return job.film is not None


def is_film(scene: Scene) -> bool:
    """Tell whether this scene is the one that is rendered. To be called before each of its frames."""
    if scene.session_uid != job.film:
        return False
    job.begun = True
    return True


def end(scene: Scene, alone: bool) -> None:
    """Note that the render of a scene has ended.

    If it failed in the background and no script waits, end the process with BAD_INPUT: Blender would go on, or exit
    with 1.

    Args:
        alone: Whether no script waits for the render.
    """
    if scene.session_uid == job.film:
        job.film = None
        if bpy.app.background:
            _remove_spent()
        else:  # Blender's data belongs to the main thread
            main_thread.soon(lambda: bpy.app.timers.register(_remove_spent))
        if job.failure is not None and alone and bpy.app.background:
            leave(BAD_INPUT)


def ends_films() -> bool:
    """Tell whether an error here has to end a whole render: in the background, on a job's thread, or in a script.

    Otherwise (False), it only concerns a preview.
    """
    if where() is not Where.WINDOW:
        return True
    return job.film is not None and not bpy.app.is_job_running("RENDER")


def script_waits(call_frame: FrameType | None) -> bool:
    """Tell whether a script, through an operator, waits for what Blender does now.

    The Python call stack tells, since Blender has no API for this.

    Args:
        call_frame: inspect.currentframe() of the function that Blender has called.
    """
    return call_frame is not None and call_frame.f_back is not None


def where() -> Where:
    """Return in which situation Blender calls the extension now: in the background, in the window, or on a thread."""
    if bpy.app.background:
        return Where.BACKGROUND
    if threading.current_thread() is threading.main_thread():
        return Where.WINDOW
    return Where.WAITED_FOR if job.waited_for else Where.JOB


def operators_running() -> set[str]:
    """Return the bl_idnames of the modal operators that run in any window."""
    windows = bpy.context.window_manager.windows
    return {operator.bl_idname for window in windows for operator in window.modal_operators}


@contextmanager
def calling(handlers: list, function: Callable) -> Iterator[None]:
    """Add a function to one of the lists of bpy.app.handlers within a `with` block, and remove it afterwards."""
    handlers.append(function)
    try:
        yield
    finally:
        handlers.remove(function)


def scripts_act() -> bool:
    """Tell whether other scripts have handlers that run at rendered frames, and may change the edit there."""
    handlers, own = bpy.app.handlers, __name__.split(".blender.")[0]
    lists: list[list] = [handlers.render_pre, handlers.render_post, handlers.render_write, handlers.render_stats]
    lists += [handlers.render_init, handlers.frame_change_pre, handlers.frame_change_post]  # run for each effect
    functions = [getattr(each, "func", each) for each in chain(*lists)]  # unwraps functools.partial
    return any(not str(getattr(function, "__module__", "")).startswith(own) for function in functions)


def on_main_thread(function: Callable[[], T], ended: Callable[[], bool] | None = None) -> T | None:
    """Call a function and return its result: on Blender's main thread from a job's (Where.JOB), otherwise here.

    Args:
        function: The function. Its errors are raised to the caller.
        ended: Called to tell whether the result is no longer wanted; None: wait for _LONG seconds at most.

    Returns:
        The function's result; None: waiting ended before the call began, and the function is not called.
    """
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
    """Have a function called on the main thread, without waiting for it; on the main thread, call it at once."""
    if where() in (Where.JOB, Where.WAITED_FOR):
        main_thread.soon(function)
    else:
        function()


def stopping() -> bool:
    """Tell whether the picture being made is for a render that was stopped or has failed. False for previews."""
    return job.film is not None and ends_films() and (job.stopping or job.failure is not None)


def fail(text: str) -> None:
    """Note a sentence about why the running render has to end, and tell the user. Ignore all but the first sentence."""
    if job.failure is None:
        job.failure = text
        job.tell(text)


def cancel(ended: Callable[[], bool] | None = None) -> None:
    """End the running render, as soon as the caller returns to Blender.

    Call this while a picture is made, or from a handler before a frame. (After a frame, Blender would go on with the
    next, and crash.)

    Args:
        ended: Called on a job's thread to tell whether the window has ended the render meanwhile; None: wait for _LONG
            seconds at most.
    """
    if where() is Where.JOB:
        on_main_thread(_cancel_and_show, ended)
    elif where() is Where.WAITED_FOR:
        # This happens once this picture, which is left out, is done. Pictures until then fail, too.
        soon(_cancel_and_show)
    else:
        _cancel()


def _cancel_and_show() -> None:
    """Cancel the render, and show why in a popup, because reports of an engine in the sequencer do not arrive."""
    _cancel()
    if job.failure is not None:
        popup(sentence(job.failure), title="Virtual Shutter", icon="ERROR")


def popup(words: str, **looks: str) -> None:
    """Show a translated sentence in a popup at the pointer.

    Args:
        looks: `title` and `icon` of the popup.
    """
    manager = bpy.context.window_manager
    if window := bpy.context.window or next(iter(manager.windows), None):  # none while a file is loaded
        with bpy.context.temp_override(window=window):
            manager.popup_menu(lambda menu, _context: menu.layout.label(text=words, translate=False), **looks)


def _cancel() -> None:
    """End the running render by starting a small one with our engine, which fails.

    Blender ends renders if an engine's error reaches a render operator. Errors of pictures in the sequencer do not.
    """
    if job.cancelling:
        return
    job.cancelling = True
    scene = bpy.data.scenes.new("Cancelled")
    camera = bpy.data.objects.new("Cancelled", None)
    job.spent.append((scene.name, camera.name))
    try:
        scene.render.engine = ENGINE
        scene.render.resolution_x = scene.render.resolution_y = 4
        scene.collection.objects.link(camera)
        scene.camera = camera
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]), suppress(RuntimeError):
            bpy.ops.render.render(scene=scene.name)
    finally:
        job.cancelling = False


def _remove_spent() -> float | None:
    """Remove what _cancel has made for its small renders (scenes, camera objects), once no render runs.

    Works as a timer of Blender. During a render this would crash: Blender would also free data of other effects in the
    same frame.

    Returns:
        Seconds until Blender calls it again, if a render still runs. None: everything is removed, and the timer ends.
    """
    if bpy.app.is_job_running("RENDER"):
        return _PATIENCE
    while job.spent:
        scene, camera = job.spent.pop()
        items = (bpy.data.scenes.get(scene), bpy.data.objects.get(camera))
        bpy.data.batch_remove([item for item in items if item is not None])
    return None


def leave(code: int) -> None:
    """Exit the process at once with an exit code. After sys.exit, Blender would report memory leaks."""
    with suppress(OSError, AttributeError):
        sys.stdout.flush()
    os._exit(code)
