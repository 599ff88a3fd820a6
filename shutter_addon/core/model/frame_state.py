"""The state of an effect at one frame, as plain data: all that a picture needs besides the footage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from . import limits, scribbles, shutters
from .choices import AGGREGATES, CONTEXT, EDGES, EXPOSURES, INTERPOLATIONS, LIGHTS, POSITIONS, SMOOTH
from .fields import MISSING, Labelled
from .mattes import Matte

Interpolation = Literal["displacement", "value"]
Light = Literal["linear", "encoded"]
Exposure = Literal["normalized", "weighted"]
Edges = Literal["hold", "mirror", "shorten", "slide"]
Position = Literal["start", "center", "end"]
Mode = Literal["average", "lightest", "darkest", "median"]


@dataclass(frozen=True)
class Combine:
    """How the frames that a shutter exposes become one picture (core/pixels/compositor.py).

    Attributes:
        mode: The average, lightest, darkest or median of the frames.
        by_luminance: For lightest and darkest: choose a pixel's frame by luminance, not for each color channel.
        threshold: A pixel of a frame leaves a trail only if its luminance in linear light is above this for lightest,
            or below this for darkest; white is 1. The shown frame always counts. None: every frame does.
        softness: The range of luminance around the threshold in which trails fade in.
    """

    mode: Mode = "average"
    by_luminance: bool = False
    threshold: float | None = None
    softness: float = 0.0


AVERAGE = Combine()
EXTREMES = "lightest", "darkest"  # the modes that have a threshold


@dataclass(frozen=True)
class Options:
    """The options of an effect at a frame: which frames around the shown one count, and how they become a picture.

    Attributes:
        window: The length L of the window (the frames that can be exposed) in filmed frames. In a FrameState it counts
            moments, `step` per filmed frame.
        edge_aware: 0 to 1, how strictly scribbles stop at edges of the shown frame (core/pixels/conductances.py).
        step: Moments per filmed frame. "auto", which only an effect's options have, chooses by the footage.
        slid: Frames by which the window was moved onward, to lie inside the shot (core/model/windows.py).
        backward: Whether the footage plays backward. A filmed frame is then the last of its moments.
    """

    window: int = Labelled("Frames", "Number of source frames that a shutter can expose").fixed(
        default=8, absent=MISSING, least=1, most=shutters.MAX_WINDOW, context=CONTEXT
    )
    position: Position = Labelled("Position", "Position of the exposed frames relative to the shown frame").choice(
        POSITIONS, default="start", keyed=True
    )
    interpolation: Interpolation = Labelled(
        "Interpolation", "How shutters blend, in the picture and between keyframes"
    ).choice(INTERPOLATIONS, default="displacement", keyed=True)
    light: Light = Labelled("Light", "How exposed frames are summed").choice(LIGHTS, default="linear", keyed=True)
    exposure: Exposure = Labelled("Exposure", "Brightness of shutters that are open for different times").choice(
        EXPOSURES, default="normalized", keyed=True, context=CONTEXT
    )
    edges: Edges = Labelled("Clip Ends", "How exposures continue beyond the ends of the clip or the shot").choice(
        EDGES, default="hold", keyed=True, context=CONTEXT
    )
    aggregate: int = Labelled("Matte Resolution", "Pixels that share a shutter (larger blocks are quicker)").choice(
        AGGREGATES, default=1, keyed=True
    )
    border: bool = Labelled(
        "Keep Edges Default", "Give the picture's edge to the default shutter, so that strokes act only nearby"
    ).switch(keyed=True)
    stop_at_cuts: bool = Labelled(
        "Stop at Cuts", "End exposures at cuts of the source, like at the clip's ends"
    ).switch(default=True, keyed=True)
    edge_aware: float = 0.0
    plate_reach: int = Labelled(
        "Background Search",
        "Frames on each side that are searched for the background of layers, where no exposed frame shows it",
    ).fixed(default=48, most=limits.MAX_PLATE_REACH, soft_most=120)
    decontaminate: bool = Labelled(
        "Clean Edges", "Separate the colors of layers and their background in the mixed pixels at edges"
    ).switch(default=True, keyed=True)
    step: int = Labelled(
        "Smooth", "Also expose pictures between two frames whose bars are open, which optical flow makes"
    ).choice(SMOOTH, default=1, blender="inbetween", recipe="inbetween")
    skip_repeats: bool = Labelled(
        "Skip Repeated Frames",
        "With Smooth, replace repeated frames by moments between their neighbors, as in 24 fps played at 30",
    ).switch(default=True)
    slid: int = 0
    backward: bool = False

    @property
    def filmed(self) -> int:
        """The number of filmed frames in the window."""
        return -(-self.window // self.step)

    @property
    def before(self) -> int:
        """The number of moments in the window before the shown filmed frame, which is `step` moments long."""
        center, end = (self.filmed - 1) // 2 * self.step, max(self.window - self.step, 0)
        return {"start": 0, "center": center, "end": end}[self.position] - self.slid

    @property
    def shown(self) -> int:
        """The index of the shown frame in the window, in moments."""
        return self.before + (self.step - 1 if self.backward else 0)

    @property
    def reach(self) -> int:
        """The largest distance of a filmed frame in the window from the shown one, in filmed frames."""
        before = self.before // self.step
        return max(before, self.filmed - 1 - before)


@dataclass(frozen=True)
class Following:
    """Where exposures look in other source frames, as they follow a motion: one motion for each shutter and frame.

    A point z of the shown picture lies at turn · z + shift in another frame. motions.Similarity has the coordinates.

    Attributes:
        first: The source frame of the first row.
        turns, shifts: complex128 (S, N): a row for each source frame from `first` on, a column for each shutter. 1 and
            0 for shutters that follow nothing.
    """

    first: int
    turns: np.ndarray
    shifts: np.ndarray

    def at(self, frames: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Return turns and shifts (L, N) for source frames (L,). A frame without a row has those of the nearest row."""
        rows = np.clip(np.asarray(frames) - self.first, 0, len(self.turns) - 1)
        return self.turns[rows], self.shifts[rows]

    def between(self, start: int, end: int) -> tuple[complex, complex]:
        """Return the turn and shift of the first shutter's motion from one source frame to another.

        They are rounded, so that they do not depend on which frame is shown. Otherwise a point halfway between two
        pixels could go to either.
        """
        (before, after), (from_, to) = (values[:, 0] for values in self.at([start, end]))
        turn = after / before
        return tuple(complex(np.round(v * 2**32) / 2**32) for v in (turn, to - turn * from_))  # type: ignore[return-value]

    @property
    def key(self) -> tuple:
        """A hashable value that is equal for equal motions."""
        return self.first, self.turns.tobytes(), self.shifts.tobytes()

    def moving(self) -> np.ndarray:
        """Return the indices of shutters that follow a motion other than standing still."""
        return np.flatnonzero((self.turns != 1).any(axis=0) | self.shifts.any(axis=0))

    def of(self, chosen: slice | Sequence[int]) -> Following | None:
        """Return the motions of the chosen shutters (by index), or None if none of them moves."""
        part = Following(self.first, self.turns[:, chosen], self.shifts[:, chosen])
        return part if part.moving().size else None


@dataclass(frozen=True)
class Layers:
    """Regions that are exposed by themselves in front of the rest (core/pixels/layering.py), and their mattes.

    There are n layers, the farthest first. A drawn layer consists of strokes, any other has a matte.

    Attributes:
        shutters: The index of each layer's shutter, (n,).
        opacities: 0 to 1, (n,).
        first: The first source frame for which mattes are known.
        scribbles: A state for each source frame from `first` on, whose diffusion gives the mattes of drawn layers: its
            coefficient 1 + i is the matte of layer i, coefficient 0 is what belongs to no layer. None without drawn
            layers.
        mattes: For each of these frames the mattes (n,) of the layers; None for a drawn layer.
        camera: The camera's motion, as that of one shutter; None if it is unknown or still.
    """

    shutters: tuple[int, ...]
    opacities: tuple[float, ...]
    first: int
    scribbles: tuple[FrameState | None, ...]
    mattes: tuple[tuple[Matte | None, ...], ...]
    camera: Following | None = None

    @property
    def frames(self) -> range:
        """The source frames for which mattes are known."""
        return range(self.first, self.first + len(self.mattes))

    def key_at(self, frame: int) -> tuple:
        """Return a hashable value that is equal if all layers have equal mattes in a source frame."""
        place = frame - self.first
        drawn = self.scribbles[place]
        return self.opacities, self.mattes[place], drawn and drawn.key

    @cached_property
    def key(self) -> tuple:
        """A hashable value that is equal for layers that give the same picture of the same frames."""
        camera = self.camera and self.camera.key
        return self.shutters, self.first, camera, tuple(map(self.key_at, self.frames))


@dataclass(frozen=True)
class FrameState:
    """The effect at one frame: all that a picture depends on, besides the footage.

    Attributes:
        options: Its options at this frame, with `step` as a number.
        bars: (N, L) float64, how much each frame of the window contributes for each shutter; shutter 0 is the default.
        shapes: Scribbles where they lie at this frame, later ones on top.
        reference: The sum of bars that has full brightness if `exposure` is "weighted". None: that of shutter 0.
        following: The motions that exposures follow, or None.
        mattes: Laid over the scribbles' coefficients, later ones on top.
        layers: Regions that are exposed by themselves in front of the rest, or None.
        combines: How each shutter combines its frames. Empty: all average.
    """

    options: Options
    bars: np.ndarray
    shapes: tuple[scribbles.Shape, ...] = ()
    reference: float | None = None
    following: Following | None = None
    mattes: tuple[Matte, ...] = ()
    layers: Layers | None = None
    combines: tuple[Combine, ...] = ()

    @property
    def gains(self) -> np.ndarray:
        """The factor (N,) for the brightness of each shutter.

        It is 1 by default. If `exposure` is "weighted", it is the sum of a shutter's bars / `reference`, for
        shutters that average. Factors scale linear light, as an aperture would; encoded values are decoded first.
        """
        exposures = self.bars.sum(axis=1)
        gains = np.ones_like(exposures)
        if self.options.exposure == "weighted":
            averaging = list(self.groups.get(AVERAGE, ()))
            gains[averaging] = exposures[averaging] / (self.reference or exposures[0])
        return gains

    @cached_property
    def open_span(self) -> tuple[int, int]:
        """The index of the first frame of the window that any shutter exposes, and one past the last.

        If a shutter has a threshold, which needs the shown frame, the span includes that frame.
        """
        first, last = shutters.open_span(self.bars)
        if any(combine.threshold is not None for combine in self.combines):
            return min(first, self.options.shown), max(last, self.options.shown + 1)
        return first, last

    @cached_property
    def groups(self) -> dict[Combine, tuple[int, ...]]:
        """The shutters grouped by how they combine frames: {Combine: indices of shutters}.

        Shutters of a group are interpolated with each other. The pictures of different groups are mixed.
        """
        groups: dict[Combine, tuple[int, ...]] = {}
        for index, combine in enumerate(self.combines or (AVERAGE,) * len(self.bars)):
            groups[combine] = (*groups.get(combine, ()), index)
        return groups

    @property
    def averages(self) -> bool:
        """Whether all shutters average their frames."""
        return set(self.groups) == {AVERAGE}

    @cached_property
    def key(self) -> tuple:
        """A hashable value that is equal for states that give the same picture of the same frames."""
        bars = self.bars.shape, self.bars.tobytes()
        following = self.following and self.following.key
        layers = self.layers and self.layers.key
        return self.options, *bars, self.reference, following, self.mattes, layers, self.combines, self.shapes_key

    @cached_property
    def shapes_key(self) -> tuple:
        """A hashable value that is equal for equal scribbles."""
        return tuple(
            (s.shutter, s.kind, s.width, s.opacity, *(stroke.tobytes() for stroke in s.strokes)) for s in self.shapes
        )

    def in_blocks(self, aggregate: int) -> FrameState:
        """Return the state with another Options.aggregate (the side of the blocks of pixels that share a shutter).

        The blocks of drawn layers change as well.
        """
        if aggregate == self.options.aggregate:
            return self
        layers = self.layers and replace(
            self.layers, scribbles=tuple(state and state.in_blocks(aggregate) for state in self.layers.scribbles)
        )
        return replace(self, options=replace(self.options, aggregate=aggregate), layers=layers)

    def of(self, chosen: Sequence[int]) -> FrameState:
        """Return the state of the chosen shutters (by index) alone, without scribbles, mattes and layers.

        Its Options.edge_aware is 0.
        """
        return FrameState(
            options=replace(self.options, edge_aware=0.0),
            bars=self.bars[list(chosen)],
            reference=self.reference or float(self.bars[0].sum()),
            following=self.following and self.following.of(chosen),
            combines=tuple(self.combines[index] for index in chosen) if self.combines else (),
        )
