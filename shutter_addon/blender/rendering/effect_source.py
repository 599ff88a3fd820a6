"""What a renderer reads for an effect: its source, in-between frames included, in some detail."""

from __future__ import annotations

import traceback
from dataclasses import dataclass

from ...core import told
from ...core.frames.frame_source import FrameSource
from ...core.messages import EffectError, of_file
from ...core.model.clip import Clip
from ...devices.device import NoDeviceError
from ...media import MediaError
from ...media.cuts import ShotSource
from ...media.inbetween import InbetweenSource
from ...media.prefetch import PrefetchSource
from ...media.reduced import smaller
from ..data import inbetween_settings
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
    proxy: what frames are read from, where it fits; in-between frames and those beside them have none"""

    divisor: int = 1
    proxy: Proxy | None = None


FULL = Detail()  # what renders are composed in


@dataclass(frozen=True)
class SourceKey:
    """What a renderer reads, in plain data: equal where it reads the same frames for the same effect.

    scene: session_uid of the effect's scene; spec, inbetween, built: Snapshot's source, inbetween and built"""

    scene: int
    spec: SourceSpec
    inbetween: inbetween_settings.Settings | None
    built: tuple
    detail: Detail = FULL

    @staticmethod
    def of(snapshot: Snapshot, detail: Detail = FULL) -> SourceKey:
        return SourceKey(
            scene=snapshot.scene,
            spec=snapshot.source,
            inbetween=snapshot.inbetween,
            built=snapshot.built,
            detail=detail,
        )

    def open(self, *, planes: bool = False) -> ShotSource:
        """The source; planes: see PrefetchSource. EffectError, MediaError: there is none."""
        divisor = self.detail.divisor
        if self.inbetween is None:
            return ShotSource(PrefetchSource(self.spec.open(divisor, self.detail.proxy), planes=planes))
        medium = self.spec.open()
        try:
            source = InbetweenSource(medium, *self.inbetween)
            return ShotSource(PrefetchSource(smaller(source, divisor)), self.inbetween.factor)
        except FAULTS:
            medium.close()
            raise


def open_source(snapshot: Snapshot) -> ShotSource:
    """An effect's source in full. EffectError, MediaError: there is none."""
    return SourceKey.of(snapshot).open()


def clip_of(snapshot: Snapshot, source: FrameSource) -> Clip:
    """An effect's source as plain facts, with what tells when it is shown."""
    return Clip.of(source, snapshot.effect.time or snapshot.timing)
