"""In-between frames of an effect: how far they are built, the build in a thread of its own, and their removal."""

from __future__ import annotations

import threading
import time
from concurrent.futures import Future, wait
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

from bpy.types import PropertyGroup, Scene, Strip

from ...core import threads
from ...core.frames.frame_source import FrameSource
from ...core.memo import Kept
from ...core.messages import EffectError
from ...core.model.shutters import ShutterError
from ...media import MediaError, inbetween, inbetween_cache
from ..data import inbetween_settings, snapshot, source_media, strips
from . import strobing

_FRESH = 1.0  # seconds that files are not asked again, as panels are drawn often
_KEPT = 16


class Look(NamedTuple):
    """What a panel shows of an effect's in-between frames.

    state: how far they are built
    size: bytes that the source's take, of all factors and methods
    estimate: bytes that they will take about; None while that is being found out, 0 if it cannot be"""

    state: inbetween_cache.State
    size: int
    estimate: int | None


# By source_media.media_key: the medium, its file not open; bytes for a factor of 2.
_media: Kept[tuple, tuple[FrameSource, Future[int]]] = Kept()
_looks: Kept[tuple, tuple[inbetween_cache.State, int]] = Kept()  # how far a source's are built, and bytes


@dataclass
class _Builds:
    """running: the build that runs; left: of the last one, what it was in the middle of when it was stopped, which it
    still ends"""

    running: Build | None = None
    left: tuple[Future, ...] = ()


_builds = _Builds()


def look(scene: Scene, effect: PropertyGroup, strip: Strip) -> Look:
    """How things are, or were a second ago. MediaError, EffectError: there is no source, or no place for frames."""
    settings = inbetween_settings.settings(effect)
    spec = source_media.spec(strips.source_of(scene, effect, strip))
    medium, doubled = _known(spec)

    def find() -> tuple[inbetween_cache.State, int]:
        return inbetween_cache.state(medium, *settings), inbetween_cache.size(settings.folder, medium)

    state, size = _looks.ask((spec.key, *settings, time.monotonic() // _FRESH), find, _KEPT)
    return Look(state, size, doubled.result() * (settings.factor - 1) if doubled.done() else None)


def _known(spec: source_media.SourceSpec) -> tuple[FrameSource, Future[int]]:
    """A source's medium, and the bytes that its in-between frames take for a factor of 2."""

    def find() -> tuple[FrameSource, Future[int]]:
        medium = spec.open()
        medium.close()
        return medium, threads.start(_estimated, medium)

    return _media.ask(spec.key, find, _KEPT)


def _estimated(medium: FrameSource) -> int:
    with medium, suppress(MediaError, OSError):  # a build says what is wrong
        return inbetween.estimate(medium)
    return 0


class Build:
    """In-between frames of an effect that are being built, by a thread that touches no bpy.

    scene: session_uid of the effect's scene; done, total: pairs of neighbouring source frames; settings: what it builds
    future: how far it came, an inbetween_cache.State; or MediaError"""

    def __init__(self, scene: Scene, effect: PropertyGroup, strip: Strip, factor: int | None = None) -> None:
        """factor: builds what the strip needs with it, in place of all of the source with its own. EffectError,
        MediaError: it cannot begin."""
        self.settings = inbetween_settings.settings(effect)
        medium, pairs = source_media.open_media(strips.source_of(scene, effect, strip)), None
        if factor is not None:
            self.settings = self.settings._replace(factor=factor)
            pairs = _needed(scene, effect, strip, medium, self.settings)
        self.scene = effect.scene.session_uid
        self.done, self.total = 0, medium.count - 1 if pairs is None else len(pairs)
        self._stopped = threading.Event()
        self.future = threads.start(self._build, _builds.left, medium, pairs)

    def _build(self, before: tuple[Future, ...], medium: FrameSource, pairs: list[int] | None) -> inbetween_cache.State:
        wait(before)
        with medium:
            return inbetween.build(
                medium, *self.settings, update=self._update, cancelled=self._stopped.is_set, pairs=pairs
            )

    def _update(self, done: int, _total: int) -> None:
        self.done = done

    def result(self) -> inbetween_cache.State:
        """How far it came, or has come where it was stopped. MediaError: why it could not go on."""
        if self.future.done():
            return self.future.result()
        return inbetween_cache.State("partial", self.done, self.total)

    def stop(self) -> None:
        """Has it end soon, with the step that is under way; what is finished is kept."""
        self._stopped.set()


def _needed(
    scene: Scene, effect: PropertyGroup, strip: Strip, medium: FrameSource, settings: inbetween_settings.Settings
) -> list[int]:
    frames = range(strip.left_handle, strip.right_handle)
    try:
        return strobing.pairs(snapshot.take(scene, effect, strip, frames), medium, settings.factor)
    except ShutterError as error:
        raise EffectError(str(error)) from None
    finally:
        medium.close()  # it opens again as it is read


def running() -> Build | None:
    """The build that runs: one at a time, as it uses the whole machine."""
    return _builds.running


def start(scene: Scene, effect: PropertyGroup, strip: Strip, factor: int | None = None) -> Build:
    """Begins a build; factor: see Build. EffectError, MediaError: it cannot begin."""
    _builds.running = Build(scene, effect, strip, factor)
    inbetween_settings.built.is_held = True
    return _builds.running


def ended() -> None:
    """What the build that was stopped, or has run to its end, has built counts from now on."""
    if _builds.running is not None:
        _builds.left, _builds.running = (_builds.running.future,), None
    inbetween_settings.built.is_held = False
    _looks.clear()


def purge(effect: PropertyGroup, source: Strip) -> tuple[int, list[tuple]]:
    """Removes the in-between frames of an effect's source strip, of every factor and method; the bytes that they took,
    and the folders where other files stay, with their number. EffectError, MediaError, OSError: it cannot be done."""
    wait(_builds.left)
    folder, (medium, _) = inbetween_settings.folder(effect), _known(source_media.spec(source))
    left = []
    freed = inbetween_cache.purge(folder, medium, lambda *place: left.append(place))
    with suppress(OSError):  # other sources' are left there, or it never was
        folder.rmdir()
    _looks.clear()
    return freed, left


def stop() -> None:
    """Ends the build that runs, if any, and forgets what is known: when a file is loaded, and when the extension
    goes."""
    if _builds.running is not None:
        _builds.running.stop()
        ended()
    wait(_builds.left)
    wait([doubled for _medium, doubled in _media.values()])
    _media.clear()
    _looks.clear()
    inbetween_cache.forget()
