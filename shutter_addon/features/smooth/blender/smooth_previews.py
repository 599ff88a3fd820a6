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
    """A picture with moments between frames (smooth) that is being made while a preview shows a plain one.

    Attributes:
        key: Identifies the picture: the key of the request for the plain one (without moments), and
            effect_source.steps_key.
        asked: What the preview asked for last: context, snapshot, timeline frame and detail.
        steps: Future of effect_source.find_steps, which finds on a thread how many moments the effect needs; None: not
            begun.
        since: When the preview last asked for the picture (time.monotonic).
        is_asked: Whether the preview has asked for it since advance_smooth was last called.
        is_seen: Whether the preview had a chance to show the plain picture first.
        is_over: Whether nothing is left to do: the preview can draw the picture itself, or it cannot be made.
        is_alone: Whether the device has no room for the frames of both pictures, so that only the smooth one is drawn.
        made: Key of the request whose picture is ready; None: none is.
        fault: The error because of which the picture cannot be made; None: no error.
        slices: The time slices in which the picture is composed, piece by piece.
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
        """Return the request for the picture with moments between frames, if nothing has to be waited for.

        Returns:
            None: It is not known yet how many moments there are, or no renderer is open yet for the footage with
            moments.
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
        """Do the next piece of work on the picture: find how many moments there are, or compose it for a slice of time.

        The first call does nothing, so that the preview can show the plain picture first.

        Args:
            seconds: How long composing takes in a slice, at least; half of it in the first one. Slices grow, so that
                all work ends.

        Returns:
            In how many seconds to redraw the preview, which then asks for the picture again; 0: at once.

        Raises:
            FAULTS: The picture cannot be made.
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
    """Return the request for the picture that a preview can show now: with moments between frames, or the plain one.

    If the effect has moments and that picture is not ready, the plain one is shown first, and advance_smooth makes the
    other.

    Returns:
        The request, and whether the picture with moments is still to come, so that the preview has to be drawn again.

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
    """Go on making the pictures with moments between frames that previews have asked for since the last call.

    This works on each picture for a slice of time, and has previews drawn again, which ask for it again. A picture that
    no preview has asked for during _UNSEEN seconds is dropped.

    Args:
        seconds: How long to compose each picture, roughly.

    Raises:
        effect_source.FAULTS: A picture cannot be made.
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
    """Wait for threads that find how many moments effects need, and forget all pictures, before devices are freed."""
    wait([coming.steps for coming in _coming.values() if coming.steps is not None])
    _coming.clear()
