"""Smooth pictures of previews, which come behind plain ones: nothing that is drawn waits for optical flow.

A preview shows the plain exposure of filmed frames at once. While that is seen, a thread makes the moments between
them, and the smooth picture is composed of those that are there, in slices of time. Then it takes the plain one's
place. A frame that moves or a stroke that begins ends all of it.
"""

from __future__ import annotations

import time
from concurrent.futures import Future, wait
from dataclasses import dataclass, field, replace

from ...compute.request import Request
from ...core import stopping, threads
from ...core.stopping import Slices, StoppedError
from ..data import preview_areas
from ..data.snapshot import Snapshot
from ..devices import main_thread
from .effect_source import FAULTS, Detail, SourceKey, find_steps, known_steps, steps_key
from .session import RenderContext

_WAIT = 0.1  # seconds until it is looked again whether moments are there
_UNSEEN = 5.0  # seconds after which a picture that nobody has asked for is not wanted any longer


@dataclass
class _Coming:
    """A smooth picture that is on its way.

    key: of the plain picture, and of what its steps are found of
    asked: as what it was asked for last: the context, the snapshot, the timeline frame and the detail; since: when
    is_asked: whether it was since the last look; is_seen: whether the plain picture was drawn
    is_over: whether nothing comes any more; made: key of the request that was composed
    is_alone: whether the device has no room for both pictures
    steps: finds the steps; fault: why there is no picture; slices: of time, in which it is composed"""

    key: tuple
    asked: tuple[RenderContext, Snapshot, float, Detail]
    steps: Future[int] | None = None
    since: float = 0.0
    is_asked: bool = False
    is_seen: bool = False
    is_over: bool = False
    is_alone: bool = False
    made: tuple | None = None
    fault: BaseException | None = None
    slices: Slices = field(default_factory=Slices)

    def request(self) -> Request | None:
        """The smooth one; None: nothing was made for such requests yet."""
        render, snapshot, frame, detail = self.asked
        if known_steps(snapshot) is None or render.session.open_renderer(SourceKey.of(snapshot, detail)) is None:
            return None
        return render.request(snapshot, frame, detail)

    def plain(self) -> Request:
        render, snapshot, frame, detail = self.asked
        return render.request(snapshot, frame, replace(detail, smooth=False))

    def lacks(self, request: Request) -> bool:
        """Whether frames have to be read for a picture."""
        return bool(self.asked[0].renderer(request).missing(request))

    def rest(self) -> None:
        """Ends the thread's work."""
        if (request := self.request()) is not None:
            self.asked[0].renderer(request).source.want(())

    def advance(self, seconds: float) -> float:
        """Composes the picture for about so many seconds. Returns in how many seconds to go on."""
        render, snapshot, frame, detail = self.asked
        if not self.is_seen:
            self.is_seen = True
            return _WAIT
        if known_steps(snapshot) is None:
            self.steps = self.steps or threads.start(find_steps, snapshot)
            if not self.steps.done():
                return _WAIT
            self.steps.result()
        request, plain = render.request(snapshot, frame, detail), self.plain()
        renderer, had_plain = render.renderer(request), not self.lacks(plain)
        is_drawn = detail.divisor > 1 or renderer.source.from_proxy  # by our handler, in levels
        self.made = None
        until = self.slices.next(request.key, seconds / 2, seconds, waits=False)
        try:
            with stopping.once(until):
                renderer.draw(replace(request, levels=is_drawn))
        except StoppedError:
            self.is_alone = had_plain and self.lacks(plain)
            return 0.0 if until() else _WAIT
        self.made = request.key
        return 0.0


_coming: dict[int, _Coming] = {}  # by effect scene


def chosen(render: RenderContext, snapshot: Snapshot, frame: float, detail: Detail) -> Request:
    """The smooth picture, if nothing has to be waited for; else the plain one. One of FAULTS: there is none."""
    plain, before = render.request(snapshot, frame, replace(detail, smooth=False)), _coming.get(snapshot.scene)
    if known_steps(snapshot) == 1:
        _coming.pop(snapshot.scene, None)
        return plain
    coming, key = before, (plain.key, steps_key(snapshot))
    asked = render, snapshot, frame, detail
    if coming is None or coming.key != key:
        steps = before.steps if before and before.key[1] == key[1] else None
        coming = _coming[snapshot.scene] = _Coming(key, asked, steps)
    coming.asked, coming.since, coming.is_asked = asked, time.monotonic(), True
    if (request := coming.request()) is not None:
        coming.is_over = coming.is_alone or coming.made == request.key or not coming.lacks(request)
        if coming.is_over:
            return request
    coming.is_over = coming.fault is not None
    if before is not None and before is not coming:
        before.rest()
    return plain


def comes(scene: int) -> bool:
    """Whether a smooth picture of an effect scene, by its session_uid, is on its way."""
    return scene in _coming and not _coming[scene].is_over


def is_busy() -> bool:
    """Whether any is on its way."""
    return any(map(comes, _coming))


def advance(seconds: float) -> None:
    """Composes, for about so many seconds each, the smooth pictures whose plain ones were drawn. One of FAULTS: there
    is none."""
    for scene, coming in list(_coming.items()):
        if time.monotonic() > coming.since + _UNSEEN:
            coming.rest()
            del _coming[scene]
            continue
        was_asked, coming.is_asked = coming.is_asked, False
        if not was_asked:
            continue
        if coming.fault is not None:
            raise coming.fault
        if not coming.is_over:
            try:
                main_thread.later(preview_areas.redraw, coming.advance(seconds))
            except FAULTS as error:
                coming.fault, coming.is_over = error.with_traceback(None), True
                raise


def rest() -> None:
    """Ends all of it."""
    while _coming:
        _coming.popitem()[1].rest()


def forget() -> None:
    """Waits until nothing is found any more: when a file is loaded, and when the extension goes."""
    wait([coming.steps for coming in _coming.values() if coming.steps is not None])
    _coming.clear()
