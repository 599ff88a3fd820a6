"""The effect's state at one frame, from which a picture is composed."""

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
        by_luminance: Lightest and darkest only: choose a pixel's frame by luminance, not per channel.
        threshold: Lightest and darkest only: luminance of linear light from which a frame leaves a trail (up to which,
            for the darkest). None: every frame does.
        softness: Range of luminance around the threshold over which trails fade in.
    """

    mode: Mode = "average"
    by_luminance: bool = False
    threshold: float | None = None
    softness: float = 0.0


AVERAGE = Combine()
EXTREMES = "lightest", "darkest"  # the modes that have a threshold


@dataclass(frozen=True)
class Options:
    """How a window of frames becomes a picture.

    Attributes:
        window: L, its length in filmed frames. In a FrameState, the number of bars, `step` per filmed frame.
        edge_aware: 0 to 1, how strongly diffusion stops at edges of the shown frame (core/pixels/conductances.py).
        step: Moments per filmed frame. "auto", which only an effect's options have, chooses by the footage.
        slid: Frames by which the window is moved from its position (core/model/windows.py).
        backward: Whether the source plays in reverse. A filmed frame is then the last of its moments.
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
        """The index of the shown frame in the window."""
        return self.before + (self.step - 1 if self.backward else 0)

    @property
    def reach(self) -> int:
        """The larger number of filmed frames in the window on one side of the shown frame."""
        before = self.before // self.step
        return max(before, self.filmed - 1 - before)


@dataclass(frozen=True)
class Following:
    """The motion from the shown picture to the source's frames, for each shutter: z → turn · z + shift.

    See motions.Similarity for coordinates.

    Attributes:
        first: The source frame of the first row.
        turns, shifts: (S, N) complex128, a row per source frame. 1 and 0 for shutters that follow no motion.
    """

    first: int
    turns: np.ndarray
    shifts: np.ndarray

    def at(self, frames: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Return turns and shifts (L, N) at source frames (L,), clamped to the known frames."""
        rows = np.clip(np.asarray(frames) - self.first, 0, len(self.turns) - 1)
        return self.turns[rows], self.shifts[rows]

    def between(self, start: int, end: int) -> tuple[complex, complex]:
        """Return turn and shift of the first shutter from one source frame to another.

        They are rounded, so that they do not depend on the shown picture: ties between pixels would reveal it.
        """
        (before, after), (from_, to) = (values[:, 0] for values in self.at([start, end]))
        turn = after / before
        return tuple(complex(np.round(v * 2**32) / 2**32) for v in (turn, to - turn * from_))  # type: ignore[return-value]

    @property
    def key(self) -> tuple:
        """A hashable that is equal for equal motions."""
        return self.first, self.turns.tobytes(), self.shifts.tobytes()

    def moving(self) -> np.ndarray:
        """Return the indices of shutters that follow a motion."""
        return np.flatnonzero((self.turns != 1).any(axis=0) | self.shifts.any(axis=0))

    def of(self, chosen: slice | Sequence[int]) -> Following | None:
        """Return the motions of some shutters, or None if none of them moves."""
        part = Following(self.first, self.turns[:, chosen], self.shifts[:, chosen])
        return part if part.moving().size else None


@dataclass(frozen=True)
class Layers:
    """Regions that are exposed separately (core/pixels/layering.py), the farthest first, with mattes per source frame.

    Attributes:
        shutters: (n,) indices.
        opacities: (n,) 0 to 1.
        first: The first source frame with mattes.
        scribbles: A state per source frame. Its coefficient 1 + i is the matte of drawn layer i; coefficient 0 belongs
            to no layer. None where no layer is drawn.
        mattes: Per source frame the mattes (n,) of layers; None for a drawn layer.
        camera: The camera's motion, as of one shutter; None if unknown or still.
    """

    shutters: tuple[int, ...]
    opacities: tuple[float, ...]
    first: int
    scribbles: tuple[FrameState | None, ...]
    mattes: tuple[tuple[Matte | None, ...], ...]
    camera: Following | None = None

    @property
    def frames(self) -> range:
        """The source frames with known mattes."""
        return range(self.first, self.first + len(self.mattes))

    def key_at(self, frame: int) -> tuple:
        """Return a hashable that is equal for equal mattes in a source frame."""
        place = frame - self.first
        drawn = self.scribbles[place]
        return self.opacities, self.mattes[place], drawn and drawn.key

    @cached_property
    def key(self) -> tuple:
        """A hashable that is equal for layers that give the same picture of the same frames."""
        camera = self.camera and self.camera.key
        return self.shutters, self.first, camera, tuple(map(self.key_at, self.frames))


@dataclass(frozen=True)
class FrameState:
    """The effect at one frame.

    Attributes:
        bars: (N, L) float64, the weight of each frame of the window for each shutter; shutter 0 is the default.
        shapes: Scribbles as they lie at this frame, later ones on top.
        reference: The exposure (sum of bars) of full brightness if `exposure` is "weighted"; None: the default's.
        following: The motion that exposures follow, or None.
        mattes: Laid over the scribbles' coefficients, later ones on top.
        layers: Regions in front of the rest, or None.
        combines: How each shutter combines its frames; empty: all average.
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
        """The brightness (N,) of each shutter: 1, or exposure / reference for averages if `exposure` is "weighted".

        It scales linear light, as an aperture would. Encoded values are decoded first.
        """
        exposures = self.bars.sum(axis=1)
        gains = np.ones_like(exposures)
        if self.options.exposure == "weighted":
            averaging = list(self.groups.get(AVERAGE, ()))
            gains[averaging] = exposures[averaging] / (self.reference or exposures[0])
        return gains

    @cached_property
    def open_span(self) -> tuple[int, int]:
        """`shutters.open_span` of the bars, including the shown frame if a threshold needs it."""
        first, last = shutters.open_span(self.bars)
        if any(combine.threshold is not None for combine in self.combines):
            return min(first, self.options.shown), max(last, self.options.shown + 1)
        return first, last

    @cached_property
    def groups(self) -> dict[Combine, tuple[int, ...]]:
        """The shutters by how they combine frames; those of a group are displaced together."""
        groups: dict[Combine, tuple[int, ...]] = {}
        for index, combine in enumerate(self.combines or (AVERAGE,) * len(self.bars)):
            groups[combine] = (*groups.get(combine, ()), index)
        return groups

    @property
    def averages(self) -> bool:
        """Whether all shutters average."""
        return set(self.groups) == {AVERAGE}

    @cached_property
    def key(self) -> tuple:
        """A hashable that is equal for states that give the same picture of the same frames."""
        bars = self.bars.shape, self.bars.tobytes()
        following = self.following and self.following.key
        layers = self.layers and self.layers.key
        return self.options, *bars, self.reference, following, self.mattes, layers, self.combines, self.shapes_key

    @cached_property
    def shapes_key(self) -> tuple:
        """A hashable that is equal for equal shapes."""
        return tuple(
            (s.shutter, s.kind, s.width, s.opacity, *(stroke.tobytes() for stroke in s.strokes)) for s in self.shapes
        )

    def in_blocks(self, aggregate: int) -> FrameState:
        """Return the state with another block size, also for drawn layers."""
        if aggregate == self.options.aggregate:
            return self
        layers = self.layers and replace(
            self.layers, scribbles=tuple(state and state.in_blocks(aggregate) for state in self.layers.scribbles)
        )
        return replace(self, options=replace(self.options, aggregate=aggregate), layers=layers)

    def of(self, chosen: Sequence[int]) -> FrameState:
        """Return a state of some shutters, without scribbles and mattes."""
        return FrameState(
            options=replace(self.options, edge_aware=0.0),
            bars=self.bars[list(chosen)],
            reference=self.reference or float(self.bars[0].sum()),
            following=self.following and self.following.of(chosen),
            combines=tuple(self.combines[index] for index in chosen) if self.combines else (),
        )
