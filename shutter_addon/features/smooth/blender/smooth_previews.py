"""Make pictures with moments between frames ("smooth") for previews, after plain ones, so that drawing never waits.

A preview first shows the exposure of the footage's frames alone, the plain picture. Meanwhile a thread makes the
moments between them by optical flow, and the smooth picture is composed in slices of time from those that are ready.
Then it replaces the plain one. A moving playhead or a new stroke ends this.
"""

from __future__ import annotations

import time
from concurrent.futures import Future, wait
from dataclasses import dataclass, field, replace

from ....blender.data import preview_areas
from ....blender.data.snapshot import Snapshot
from ....blender.devices import main_thread
from ....blender.rendering.effect_source import FAULTS, Detail, SourceKey, find_steps, known_steps, steps_key
from ....blender.rendering.session import RenderContext
from ....compute.request import Request
from ....core import stopping, threads
from ....core.stopping import Slices, StoppedError

_WAIT = 0.1  # seconds between two looks at whether moments are ready
_UNSEEN = 5.0  # seconds without a request after which a picture is dropped


@dataclass
class _Coming:
    """A picture with moments between frames (smooth) that is being made for a preview.

    Attributes:
        key: Key of the picture without moments (plain), and effect_source.steps_key.
        asked: What was last asked for: context, snapshot, timeline frame and detail.
        steps: Finds on a thread how many moments there are from frame to frame; None: not begun.
        since: When it was last asked for (time.monotonic).
        is_asked: Whether it was asked for since advance_smooth was last called.
        is_seen: Whether the plain picture was drawn.
        is_over: Whether nothing is left to do.
        is_alone: Whether the device has no room for both pictures, so that only this one is shown.
        made: Key of the composed request; None: not composed.
        fault: Why there is no picture; None: no error.
        slices: Slices of time in which it is composed.
    """

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
        """Return the request for the picture with moments between frames, if that can be made without waiting.

        Returns:
            None if it is not known yet how many moments there are, or if its renderer is not open.
        """
        render, snapshot, frame, detail = self.asked
        if known_steps(snapshot) is None or render.session.open_renderer(SourceKey.of(snapshot, detail)) is None:
            return None
        return render.request(snapshot, frame, detail)

    def plain(self) -> Request:
        render, snapshot, frame, detail = self.asked
        return render.request(snapshot, frame, replace(detail, smooth=False))

    def lacks(self, request: Request) -> bool:
        """Tell whether frames have to be read before the picture of a request can be made."""
        return bool(self.asked[0].renderer(request).missing(request))

    def rest(self) -> None:
        """Have the thread stop computing the moments between frames."""
        if (request := self.request()) is not None:
            self.asked[0].renderer(request).source.want(())

    def advance(self, seconds: float) -> float:
        """Go on making the picture: find how many moments there are, or compose the picture for some seconds.

        Returns:
            In how many seconds to redraw the preview and go on.
        """
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


def smooth_request(render: RenderContext, snapshot: Snapshot, frame: float, detail: Detail) -> tuple[Request, bool]:
    """Return the request for the picture with moments between frames if that is ready, else for the one without.

    If the effect has moments and they are not ready, begin to make that picture.

    Returns:
        The request, and whether the picture with moments will follow later.

    Raises:
        effect_source.FAULTS: The effect cannot be shown.
    """
    steps, before = known_steps(snapshot), _coming.get(snapshot.scene)
    plain = render.request(snapshot, frame, replace(detail, smooth=False))
    if steps == 1:
        _coming.pop(snapshot.scene, None)
        return plain, False
    coming, key = before, (plain.key, steps_key(snapshot))
    asked = render, snapshot, frame, detail
    if coming is None or coming.key != key:
        found = before.steps if before and before.key[1] == key[1] else None
        coming = _coming[snapshot.scene] = _Coming(key, asked, found)
    coming.asked, coming.since, coming.is_asked = asked, time.monotonic(), True
    if (request := coming.request()) is not None:
        coming.is_over = coming.is_alone or coming.made == request.key or not coming.lacks(request)
        if coming.is_over:
            return request, False
    coming.is_over = coming.fault is not None
    if before is not None and before is not coming:
        before.rest()
    return plain, not coming.is_over


def advance_smooth(seconds: float) -> None:
    """Go on making pictures with moments between frames, for some seconds each, if previews still ask for them.

    Raises:
        effect_source.FAULTS: One cannot be made.
    """
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


def rest_smooth() -> None:
    """Stop making pictures with moments between frames, because the playhead moves or the user draws."""
    while _coming:
        _coming.popitem()[1].rest()


def forget_pictures() -> None:
    """Wait for threads and forget all unfinished pictures, when a file is loaded or the extension is disabled."""
    wait([coming.steps for coming in _coming.values() if coming.steps is not None])
    _coming.clear()
