"""Open the footage of an effect for a renderer, with interpolated moments between frames, at a preview's size.

With *Smooth*, moments are computed between the frames of the footage. A source then counts several steps from one frame
of the footage to the next.
"""

from __future__ import annotations

import traceback
from dataclasses import dataclass, field, replace
from pathlib import Path

from ... import features
from ...compute.devices.device import NoDeviceError
from ...core import recent_errors
from ...core.caches import RecentValues
from ...core.frames.frame_source import FrameSource
from ...core.messages import EffectError, of_file
from ...core.model.clip import Clip
from ...core.model.frame_state import Options
from ...media import MediaError
from ...media.cuts import ShotSource
from ...media.derived import VECTORS, StoredVectors
from ...media.prefetch import PrefetchSource
from ..data.snapshot import Snapshot
from ..data.source_media import Proxy, SourceSpec

FAULTS = (EffectError, MediaError, NoDeviceError, MemoryError)


def in_words(error: BaseException) -> str:
    """Return a sentence for the user about an error that ended a picture. Log an unexpected error for *Copy Report*."""
    if isinstance(error, FAULTS):
        return str(error) or "not enough memory"
    if isinstance(error, KeyboardInterrupt):
        return "the render was stopped"
    if isinstance(error, OSError) and error.filename:
        return of_file(error)
    recent_errors.exception(error)
    traceback.print_exception(error)
    return f"internal error: {error!r}"


@dataclass(frozen=True)
class Detail:
    """How detailed a picture is; previews may have less detail than renders.

    Attributes:
        divisor: How many times smaller than the source the picture is in width and height (media.open_source).
        proxy: The proxy that frames are read from, if it fits the footage; None: the footage.
        smooth: Whether frames computed between filmed ones are exposed, too, if the effect wants that.
    """

    divisor: int = 1
    proxy: Proxy | None = None
    smooth: bool = True


_steps: RecentValues[tuple, int] = RecentValues()  # steps from a filmed frame to the next, by steps_key
_KEPT = 64

FULL = Detail()  # of renders


@dataclass(frozen=True)
class SourceKey:
    """What a renderer reads, as plain data: equal keys read the same frames for the same effect.

    Attributes:
        scene: session_uid of the effect scene.
        spec: The footage.
        steps: Frames from a filmed frame to the next: 1, or n with n − 1 computed in between.
        skip_repeats: Whether computed frames replace filmed ones that repeat the frame before. False if `steps` is 1.
        detail: The wanted detail. Its `smooth` is True if the effect is known to have no computed frames, whatever was
            wanted, so that the key is the same.
        folder: Folder of the .blend file, which has the folder VECTORS of stored optical flow vectors; None: none are
            stored or read.
    """

    scene: int
    spec: SourceSpec
    steps: int
    skip_repeats: bool = False
    detail: Detail = FULL
    folder: Path | None = field(default=None, compare=False)

    @staticmethod
    def of(snapshot: Snapshot, detail: Detail = FULL) -> SourceKey:
        """Return the key of what a renderer reads for an effect's pictures in this detail.

        Raises:
            EffectError, MediaError: The footage cannot be read to find the steps.
        """
        steps = find_steps(snapshot) if detail.smooth else 1
        if known_steps(snapshot) == 1:
            detail = replace(detail, smooth=True)
        skips = steps > 1 and _options(snapshot).skip_repeats
        return SourceKey(snapshot.scene, snapshot.source, steps, skips, detail, snapshot.folder)

    @property
    def place(self) -> tuple[int, bool]:
        """Key under which a session keeps the renderer: (effect scene's session_uid, has moments between frames)."""
        return self.scene, self.steps > 1

    def open(self, *, planes: bool = False, keeps: bool = False) -> ShotSource:
        """Open the footage.

        Args:
            planes: Whether frames may come as planes of luma and chroma (PrefetchSource) if `steps` is 1; else they
                may anyway.
            keeps: Whether to store newly computed optical flow vectors; stored ones are read in any case.

        Raises:
            EffectError, MediaError: The footage cannot be read.
        """
        medium = self.spec.open(self.detail.divisor, self.detail.proxy)
        if self.steps == 1:
            return ShotSource(PrefetchSource(medium, planes=planes))
        try:
            vectors = None if self.folder is None else StoredVectors(self.folder / VECTORS, keeps)
            smooth = features.needed("SmoothSource")(medium, self.steps, vectors, skip_repeats=self.skip_repeats)
            return ShotSource(PrefetchSource(smooth, planes=True), self.steps)
        except FAULTS:
            medium.close()
            raise


def known_steps(snapshot: Snapshot) -> int | None:
    """Return the result of find_steps if it is known already; None: find_steps would have to open the footage."""
    key = steps_key(snapshot)
    return 1 if key[1] == 1 else _steps.get(key)


def find_steps(snapshot: Snapshot) -> int:
    """Return how many steps lead from a filmed frame to the next: 1, or n if n − 1 frames are computed in between.

    With *Smooth* on Automatic, a call compares frames, which takes long, unless the result is cached (by steps_key).

    Raises:
        EffectError, MediaError: The footage cannot be read.
    """
    key = steps_key(snapshot)
    _source, smooth, window, skip_repeats = key

    def find() -> int:
        with snapshot.source.open() as medium:
            return steps_of(medium, smooth, window, skip_repeats=skip_repeats)

    return 1 if smooth == 1 else _steps.ask(key, find, _KEPT)


def steps_of(medium: FrameSource, smooth: int | str, window: int, *, skip_repeats: bool) -> int:
    """Return how many steps lead from a filmed frame to the next; 1 if the feature `smooth` is not installed.

    The number may be less than wanted, so that the window does not get too long.

    Args:
        medium: The footage.
        smooth: The effect's option *Smooth*: a number of steps, or "auto": as many as the motion needs.
        window: Length of the effect's window in filmed frames.
        skip_repeats: Whether frames that repeat the one before are replaced by computed ones.
    """
    for steps_for in features.each("steps_for"):
        return int(steps_for(medium, smooth, window, skip_repeats=skip_repeats))
    return 1


def steps_key(snapshot: Snapshot) -> tuple:
    """Return a key of all that an effect's number of steps depends on: footage, *Smooth*, window, *Skip Repeats*."""
    options = _options(snapshot)
    return snapshot.source.key, options.step, options.window, options.skip_repeats


def _options(snapshot: Snapshot) -> Options:
    """Return an effect's options at its first frame. Those that this module uses are the same at all frames."""
    return snapshot.effect.options.at(min(snapshot.frames))


def open_source(snapshot: Snapshot) -> ShotSource:
    """Open an effect's footage in full detail, with interpolated moments between frames if the effect wants them.

    Raises:
        EffectError, MediaError: It cannot be read.
    """
    return SourceKey.of(snapshot).open()


def clip_of(snapshot: Snapshot, source: FrameSource) -> Clip:
    """Return the size, length and timing of an effect's footage as plain data.

    The timing is the effect's *Custom Time* if that is on, otherwise the source strip's.

    Args:
        snapshot: The effect.
        source: The opened footage.
    """
    return Clip.of(source, snapshot.effect.time or snapshot.timing)
