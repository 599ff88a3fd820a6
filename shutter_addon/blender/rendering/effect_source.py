"""What a renderer reads for an effect: its source, with the moments between its frames, in some detail."""

from __future__ import annotations

import traceback
from dataclasses import dataclass, field, replace
from pathlib import Path

from ...core import told
from ...core.frames.frame_source import FrameSource
from ...core.memo import Kept
from ...core.messages import EffectError, of_file
from ...core.model.clip import Clip
from ...core.model.frame_state import Options
from ...devices.device import NoDeviceError
from ...media import MediaError
from ...media.cuts import ShotSource
from ...media.derived import VECTORS, StoredVectors
from ...media.prefetch import PrefetchSource
from ...media.smooth import SmoothSource, steps_for
from ..data.snapshot import Snapshot
from ..data.source_media import Proxy, SourceSpec

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

    scene: session_uid of the effect's scene; spec: Snapshot's source; steps: moments from a filmed frame to the next
    skip_repeats: as Options has it of the effect, where there are steps
    detail: smooth where nothing more than filmed frames is to be had
    folder: where vectors are kept; None: nowhere"""

    scene: int
    spec: SourceSpec
    steps: int
    skip_repeats: bool = False
    detail: Detail = FULL
    folder: Path | None = field(default=None, compare=False)

    @staticmethod
    def of(snapshot: Snapshot, detail: Detail = FULL) -> SourceKey:
        """EffectError, MediaError: how many steps there are cannot be told."""
        steps = find_steps(snapshot) if detail.smooth else 1
        if known_steps(snapshot) == 1:
            detail = replace(detail, smooth=True)
        return SourceKey(
            scene=snapshot.scene,
            spec=snapshot.source,
            steps=steps,
            skip_repeats=steps > 1 and _options(snapshot).skip_repeats,
            detail=detail,
            folder=snapshot.folder,
        )

    @property
    def place(self) -> tuple[int, bool]:
        """Of its renderer: its effect has one for plain pictures, and one for smooth ones."""
        return self.scene, self.steps > 1

    def is_beside(self, other: SourceKey) -> bool:
        """Whether one is plain while the other, of the same footage in the same detail, is smooth."""
        is_smooth = self.detail.smooth, other.detail.smooth
        same = self.spec == other.spec and replace(self.detail, smooth=is_smooth[1]) == other.detail
        return same and is_smooth[0] != is_smooth[1]

    def open(self, *, planes: bool = False, keeps: bool = False) -> ShotSource:
        """The source. EffectError, MediaError: there is none.

        planes: see PrefetchSource; keeps: whether vectors are written to the folder"""
        medium = self.spec.open(self.detail.divisor, self.detail.proxy)
        if self.steps == 1:
            return ShotSource(PrefetchSource(medium, planes=planes))
        try:
            vectors = None if self.folder is None else StoredVectors(self.folder / VECTORS, keeps)
            smooth = SmoothSource(medium, self.steps, vectors, skip_repeats=self.skip_repeats)
            return ShotSource(PrefetchSource(smooth, planes=True), self.steps)
        except FAULTS:
            medium.close()
            raise


def known_steps(snapshot: Snapshot) -> int | None:
    """How many moments an effect has from a filmed frame to the next; None: `find_steps` has not found it yet."""
    key = steps_key(snapshot)
    return 1 if key[1] == 1 else _steps.get(key)


def find_steps(snapshot: Snapshot) -> int:
    """As known_steps. It may have to compare frames. EffectError, MediaError: they cannot be read."""
    key = steps_key(snapshot)
    _source, smooth, window, skip_repeats = key

    def find() -> int:
        with snapshot.source.open() as medium:
            return steps_for(medium, smooth, window, skip_repeats=skip_repeats)

    return 1 if smooth == 1 else _steps.ask(key, find, _KEPT)


def steps_key(snapshot: Snapshot) -> tuple:
    """What the steps are found of."""
    options = _options(snapshot)
    return snapshot.source.key, options.step, options.window, options.skip_repeats


def _options(snapshot: Snapshot) -> Options:
    """An effect's options, of which those that decide about steps have no keys."""
    return snapshot.effect.options.at(min(snapshot.frames))


def open_source(snapshot: Snapshot) -> ShotSource:
    """An effect's source in full. EffectError, MediaError: there is none."""
    return SourceKey.of(snapshot).open()


def clip_of(snapshot: Snapshot, source: FrameSource) -> Clip:
    """An effect's source as plain facts, with what tells when it is shown."""
    return Clip.of(source, snapshot.effect.time or snapshot.timing)
