"""The effect's state at one frame: what a picture is composed with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from . import limits, scribbles, shutters
from .choices import AGGREGATES, CONTEXT, EDGES, EXPOSURES, INTERPOLATIONS, LIGHTS, POSITIONS, SMOOTH
from .fields import MISSING, choice, fixed, switch
from .mattes import Matte

Interpolation = Literal["displacement", "value"]
Light = Literal["linear", "encoded"]
Exposure = Literal["normalized", "weighted"]
Edges = Literal["hold", "mirror", "shorten", "slide"]
Position = Literal["start", "center", "end"]
Mode = Literal["average", "lightest", "darkest", "median"]


@dataclass(frozen=True)
class Combine:
    """How the frames that a shutter exposes become one picture.

    mode: the average of all, the lightest or the darkest of them, or their median (core.pixels.combined)

    Of the lightest and the darkest:
    by_luminance: whether a pixel's light is that of one frame; else each channel goes by itself
    threshold: luminance of linear light below which, or of the darkest above which, a frame leaves no trail beside
    what is shown; None: all leaves one
    softness: over how much luminance, around the threshold, that fades in"""

    mode: Mode = "average"
    by_luminance: bool = False
    threshold: float | None = None
    softness: float = 0.0

    @staticmethod
    def of(mode: Mode, by_luminance: bool = False, threshold: float | None = None, softness: float = 0.0) -> Combine:
        """What changes nothing of a mode is left out, so that equal ones are one."""
        if mode in ("average", "median"):
            return Combine(mode)
        return Combine(mode, by_luminance, threshold, 0.0 if threshold is None else softness)


AVERAGE = Combine()


@dataclass(frozen=True)
class Options:
    """How a window of frames becomes a picture.

    window: L, its length in filmed frames; in a FrameState that of its bars, `step` of them for each filmed frame
    edge_aware: 0 to 1, how much coefficients stop at the edges of the shown frame (core.pixels.conductances)
    step: moments from a filmed frame to the next; "auto": as the footage needs, which only an effect's options have
    slid: how many frames later the window lies than its position says (core.model.windows.slid)
    backward: whether the source plays in reverse, where the last of a filmed frame's moments is the frame itself
    """

    window: int = fixed(
        "Frames",
        "Number of source frames that a shutter can expose",
        default=8,
        absent=MISSING,
        least=1,
        most=shutters.MAX_WINDOW,
        context=CONTEXT,
    )
    position: Position = choice(
        "Position", "Where the frames that are exposed lie around the shown one", POSITIONS, default="start", keyed=True
    )
    interpolation: Interpolation = choice(
        "Interpolation",
        "How shutters blend, in the picture and between keyframes",
        INTERPOLATIONS,
        default="displacement",
        keyed=True,
    )
    light: Light = choice("Light", "How the frames that are exposed are summed", LIGHTS, default="linear", keyed=True)
    exposure: Exposure = choice(
        "Exposure",
        "How bright shutters are that are open for different times",
        EXPOSURES,
        default="normalized",
        keyed=True,
        context=CONTEXT,
    )
    edges: Edges = choice(
        "Clip Ends",
        "What an exposure gets that reaches beyond the ends of the clip, or of the shot",
        EDGES,
        default="hold",
        keyed=True,
        context=CONTEXT,
    )
    aggregate: int = choice(
        "Matte Resolution", "Pixels that share a shutter (larger blocks are quicker)", AGGREGATES, default=1, keyed=True
    )
    border: bool = switch(
        "Keep Edges Default",
        "Make the picture's edge a scribble of the default shutter, so that a stroke alone acts locally",
        keyed=True,
    )
    stop_at_cuts: bool = switch(
        "Stop at Cuts",
        "Exposures end at the source's cuts as they do at the clip's ends",
        default=True,
        keyed=True,
    )
    edge_aware: float = 0.0
    plate_reach: int = fixed(
        "Background Search",
        "Frames before and after the shown one in which what lies behind layers is looked for, "
        "where no exposed frame shows it",
        default=48,
        most=limits.MAX_PLATE_REACH,
        soft_most=120,
    )
    decontaminate: bool = switch(
        "Clean Edges",
        "Give layers, and what lies behind them, their own colors in the mixed pixels at their edges",
        default=True,
        keyed=True,
    )
    step: int = choice(
        "Smooth",
        "Expose moments between filmed frames as well, which optical flow finds: light counts between two frames "
        "whose bars are both open",
        SMOOTH,
        default=1,
        blender="inbetween",
        recipe="inbetween",
    )
    skip_repeats: bool = switch(
        "Skip Repeated Frames",
        "Where Smooth is on, show moments between their neighbors in place of frames that repeat the one before, "
        "as in 24 frames per second that play at 30",
        default=True,
    )
    slid: int = 0
    backward: bool = False

    @property
    def filmed(self) -> int:
        """How many filmed frames the window has."""
        return -(-self.window // self.step)

    @property
    def before(self) -> int:
        """How many frames of the window lie before the shown filmed frame. That one is `step` frames long."""
        center, end = (self.filmed - 1) // 2 * self.step, max(self.window - self.step, 0)
        return {"start": 0, "center": center, "end": end}[self.position] - self.slid

    @property
    def shown(self) -> int:
        """Where in the window the shown frame lies."""
        return self.before + (self.step - 1 if self.backward else 0)

    @property
    def reach(self) -> int:
        """How many filmed frames of the window lie on that side of the shown one where there are most."""
        before = self.before // self.step
        return max(before, self.filmed - 1 - before)


@dataclass(frozen=True)
class Following:
    """Where the points of the shown picture lie in the source's frames, for each shutter: z → turn · z + shift, as
    motions.Similarity counts them.

    first: the source frame of the first row
    turns, shifts: (S, N) complex128, a row for each source frame from there on; 1 and 0 for a shutter that follows
    nothing, or what does not move
    """

    first: int
    turns: np.ndarray
    shifts: np.ndarray

    def at(self, frames: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """The turns and shifts (L, N) of source frames (L,); of those that have none, such as −1, any."""
        rows = np.clip(np.asarray(frames) - self.first, 0, len(self.turns) - 1)
        return self.turns[rows], self.shifts[rows]

    def between(self, start: int, end: int) -> tuple[complex, complex]:
        """The turn and shift of the first shutter from what one source frame shows to another.

        Rounded, so that they do not depend on which picture is shown: ties between pixels would tell."""
        (before, after), (from_, to) = (values[:, 0] for values in self.at([start, end]))
        turn = after / before
        return tuple(complex(np.round(v * 2**32) / 2**32) for v in (turn, to - turn * from_))  # type: ignore[return-value]

    @property
    def key(self) -> tuple:
        """Hashable, and equal for equal motions."""
        return self.first, self.turns.tobytes(), self.shifts.tobytes()

    def moving(self) -> np.ndarray:
        """The numbers of the shutters that follow what moves."""
        return np.flatnonzero((self.turns != 1).any(axis=0) | self.shifts.any(axis=0))

    def of(self, chosen: slice | Sequence[int]) -> Following | None:
        """That of some shutters alone; None: none of them moves."""
        part = Following(self.first, self.turns[:, chosen], self.shifts[:, chosen])
        return part if part.moving().size else None


@dataclass(frozen=True)
class Layers:
    """The regions that are exposed by themselves, the first farthest (core.pixels.layering), with their mattes in the
    source's frames around the shown one.

    shutters: (n,) indices; opacities: (n,) 0 to 1
    first: the source frame that comes first
    scribbles: a state for each frame from there on: of its coefficients, 1 + i are the matte of layer i, if that is
    drawn, and 0 what is none's; None: no layer is drawn
    mattes: for each frame the mattes (n,) of layers; None: of one that is drawn
    camera: where what the camera sees moves, of one shutter; None: that is not known, or nowhere
    """

    shutters: tuple[int, ...]
    opacities: tuple[float, ...]
    first: int
    scribbles: tuple[FrameState | None, ...]
    mattes: tuple[tuple[Matte | None, ...], ...]
    camera: Following | None = None

    @property
    def frames(self) -> range:
        """The source frames in which their mattes are known."""
        return range(self.first, self.first + len(self.mattes))

    def key_at(self, frame: int) -> tuple:
        """Hashable, and equal for equal mattes in a source frame."""
        place = frame - self.first
        drawn = self.scribbles[place]
        return self.opacities, self.mattes[place], drawn and drawn.key

    @cached_property
    def key(self) -> tuple:
        """Hashable, and equal for layers that give the same picture of the same frames."""
        camera = self.camera and self.camera.key
        return self.shutters, self.first, camera, tuple(map(self.key_at, self.frames))


@dataclass(frozen=True)
class FrameState:
    """The effect at one frame.

    bars: (N, L) float64, the weight of each frame of the window for each shutter; shutter 0 is the default
    shapes: of the scribbles, where they are at this frame, the later over the earlier
    reference: the exposure (sum of bars) of full brightness where exposure is "weighted"; None: the default shutter's
    following: what exposures follow; None: nothing that moves
    mattes: laid over what the scribbles give, the later over the earlier
    layers: regions before what all these make; None: there are none
    combines: of each shutter, how what it exposes becomes one picture; none: all average
    open_for: by shutter whose trail has a length, or whose length is the timeline's, the frames from its first open
    time to its last: for who is told of it, as its bars say what is exposed
    """

    options: Options
    bars: np.ndarray
    shapes: tuple[scribbles.Shape, ...] = ()
    reference: float | None = None
    following: Following | None = None
    mattes: tuple[Matte, ...] = ()
    layers: Layers | None = None
    combines: tuple[Combine, ...] = ()
    open_for: dict[int, float] = field(default_factory=dict)

    @property
    def gains(self) -> np.ndarray:
        """Brightness (N,) of each shutter: all 1, or its exposure over the reference ("weighted"), where it averages.

        It scales linear light, as an aperture would: where encoded values are summed, it applies after decoding."""
        exposures = self.bars.sum(axis=1)
        gains = np.ones_like(exposures)
        if self.options.exposure == "weighted":
            averaging = list(self.groups.get(AVERAGE, ()))
            gains[averaging] = exposures[averaging] / (self.reference or exposures[0])
        return gains

    @cached_property
    def open_span(self) -> tuple[int, int]:
        """As shutters.open_span of the bars; with the shown frame where that is needed whatever they are."""
        first, last = shutters.open_span(self.bars)
        if any(combine.threshold is not None for combine in self.combines):
            return min(first, self.options.shown), max(last, self.options.shown + 1)
        return first, last

    @cached_property
    def groups(self) -> dict[Combine, tuple[int, ...]]:
        """The shutters that combine alike, and are displaced together."""
        groups: dict[Combine, tuple[int, ...]] = {}
        for index, combine in enumerate(self.combines or (AVERAGE,) * len(self.bars)):
            groups[combine] = (*groups.get(combine, ()), index)
        return groups

    @property
    def averages(self) -> bool:
        """Whether all shutters do."""
        return set(self.groups) == {AVERAGE}

    @cached_property
    def key(self) -> tuple:
        """Hashable, and equal for states that give the same picture of the same frames."""
        bars = self.bars.shape, self.bars.tobytes()
        following = self.following and self.following.key
        layers = self.layers and self.layers.key
        return self.options, *bars, self.reference, following, self.mattes, layers, self.combines, self.shapes_key

    @cached_property
    def shapes_key(self) -> tuple:
        """Hashable, and equal for equal shapes."""
        return tuple(
            (s.shutter, s.kind, s.width, s.opacity, *(stroke.tobytes() for stroke in s.strokes)) for s in self.shapes
        )

    def in_blocks(self, aggregate: int) -> FrameState:
        """The state with blocks of another size, those of what is drawn of layers as well."""
        if aggregate == self.options.aggregate:
            return self
        layers = self.layers
        if layers is not None:
            drawn = tuple(state and state.in_blocks(aggregate) for state in layers.scribbles)
            layers = replace(layers, scribbles=drawn)
        return replace(self, options=replace(self.options, aggregate=aggregate), layers=layers)

    def of(self, chosen: Sequence[int]) -> FrameState:
        """What composes a picture of some of its shutters alone; nothing is left to diffuse."""
        return FrameState(
            options=replace(self.options, edge_aware=0.0),
            bars=self.bars[list(chosen)],
            reference=self.reference or float(self.bars[0].sum()),
            following=self.following and self.following.of(chosen),
            combines=tuple(self.combines[index] for index in chosen) if self.combines else (),
        )
