"""What a renderer reads for an effect: its source, with the moments between its frames, in some detail."""

from __future__ import annotations

import traceback
from dataclasses import dataclass, field
from pathlib import Path

from ...core import told
from ...core.frames.frame_source import FrameSource
from ...core.memo import Kept
from ...core.messages import EffectError, of_file
from ...core.model.clip import Clip
from ...devices.device import NoDeviceError
from ...media import MediaError
from ...media.cuts import ShotSource
from ...media.prefetch import PrefetchSource
from ...media.smooth import SmoothSource, steps_for
from ...media.stored_vectors import FOLDER, StoredVectors
from ..data.snapshot import Snapshot
from ..data.source_media import SourceSpec
from ..data.strip_proxies import Proxy

FAULTS = (EffectError, MediaError, NoDeviceError, MemoryError)


def in_words(error: BaseException) -> str:
    """A sentence for whatever a picture failed by; what nobody expected is kept for a report."""
    if isinstance(error, FAULTS):
        return str(error) or "not enough memory"
    if isinstance(error, KeyboardInterrupt):
        return "the render was stopped"
    if isinstance(error, OSError) and error.filename:
        return of_file(error)
    told.exception(error)
    traceback.print_exception(error)
    return f"internal error: {error!r}"


@dataclass(frozen=True)
class Detail:
    """In how much detail a preview is composed.

    divisor: how many times smaller than the source's the picture is each way (media.open_source)
    proxy: what frames are read from, where it fits
    smooth: whether moments between frames are exposed as well"""

    divisor: int = 1
    proxy: Proxy | None = None
    smooth: bool = True


_steps: Kept[tuple, int] = Kept()  # moments that effects have for a filmed frame, by what they are found of
_KEPT = 64

FULL = Detail()  # what renders are composed in


@dataclass(frozen=True)
class SourceKey:
    """What a renderer reads, in plain data: equal where it reads the same frames for the same effect.

    scene: session_uid of the effect's scene; spec: Snapshot's source
    smooth, window: as Options has them of the effect: step and window
    folder: where vectors are kept; None: nowhere"""

    scene: int
    spec: SourceSpec
    smooth: int | str
    window: int
    detail: Detail = FULL
    folder: Path | None = field(default=None, compare=False)

    @staticmethod
    def of(snapshot: Snapshot, detail: Detail = FULL) -> SourceKey:
        options = snapshot.effect.options.at(min(snapshot.frames))  # neither has keys
        smooth = options.step if detail.smooth else 1
        window = options.window if smooth != 1 else 0
        return SourceKey(
            scene=snapshot.scene,
            spec=snapshot.source,
            smooth=smooth,
            window=window,
            detail=detail,
            folder=snapshot.folder,
        )

    def open(self, *, planes: bool = False, keeps: bool = False) -> ShotSource:
        """The source. EffectError, MediaError: there is none.

        planes: see PrefetchSource; keeps: whether vectors are written to the folder"""
        medium = self.spec.open(self.detail.divisor, self.detail.proxy)
        if self.smooth == 1:
            return ShotSource(PrefetchSource(medium, planes=planes))
        try:
            steps = _steps.ask((self.spec.key, self.smooth, self.window), lambda: self._steps(medium), _KEPT)
            if steps == 1:
                return ShotSource(PrefetchSource(medium, planes=planes))
            vectors = None if self.folder is None else StoredVectors(self.folder / FOLDER, keeps)
            return ShotSource(PrefetchSource(SmoothSource(medium, steps, vectors), planes=True), steps)
        except FAULTS:
            medium.close()
            raise

    def _steps(self, medium: FrameSource) -> int:
        return steps_for(medium, self.smooth, self.window)


def open_source(snapshot: Snapshot) -> ShotSource:
    """An effect's source in full. EffectError, MediaError: there is none."""
    return SourceKey.of(snapshot).open()


def clip_of(snapshot: Snapshot, source: FrameSource) -> Clip:
    """An effect's source as plain facts, with what tells when it is shown."""
    return Clip.of(source, snapshot.effect.time or snapshot.timing)
