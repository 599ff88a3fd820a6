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
        mode: Each pixel is the "average", "lightest", "darkest" or "median" of its values in the frames.
        by_luminance: For "lightest" and "darkest": take all colors of a pixel from the frame with the highest or lowest
            luminance, instead of comparing each color channel by itself.
        threshold: A luminance in linear light; white is 1. A frame's pixel counts only if it is brighter ("lightest")
            or darker ("darkest"). The shown frame's pixels always count. None: all pixels count.
        softness: The width of the range of luminance, centered on the threshold, in which pixels count in part.
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
        window: The length of the window (the frames around the shown one that can be exposed): in filmed frames, and
            once state_at.py has completed a FrameState, in moments: `step` per filmed frame.
        position: Whether the shown frame is the window's first ("start"), middle ("center") or last ("end") frame.
        interpolation: How two shutters are mixed in a pixel, or two keys in time: "displacement" moves the exposure in
            time; "value" cross-fades.
        light: Whether frames are summed in "linear" light, or as "encoded" (sRGB) values, whatever the footage has.
        exposure: "normalized": all shutters give the same brightness; "weighted": see FrameState.gains.
        edges: What is exposed beyond the ends of the clip or shot: "hold", "mirror", "shorten" or "slide"
            (windows.source_frames).
        aggregate: The side, in pixels, of the square blocks of pixels that share a shutter; 1: each pixel has its own.
        border: Whether the pixels along the picture's edge get the default shutter, so that scribbles act only nearby.
        stop_at_cuts: Whether exposures end at cuts in the footage, as at the ends of the clip.
        edge_aware: 0 to 1, how strictly scribbles stop at edges of the shown frame (core/pixels/conductances.py).
        plate_reach: Filmed frames on each side that are searched for the background behind layers.
        decontaminate: Whether the colors of layers and background are separated where an edge mixes them in a pixel.
        step: Moments per filmed frame, which are the filmed frame and those computed between it and the next one; 1: no
            frames are computed. "auto": as many as the motion in the footage needs; state_at.py replaces it by their
            number.
        skip_repeats: Whether frames that repeat the one before are replaced by computed ones, if `step` is not 1.
        slid: By how many moments the window was moved to lie inside the shot, for `edges` "slide"; positive: onward in
            the direction in which the footage plays.
        backward: Whether the footage plays backward. Then a filmed frame is the last of its moments in the window, not
            the first.
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

    What is at a point z of the shown picture is looked up at turn · z + shift in another frame. Points are complex
    numbers x + iy in pixels, y down (motions.Similarity).

    Attributes:
        first: The number of the source frame of row 0, counting moments.
        turns, shifts: complex128 (S, N): a row for each of S successive source frames, a column for each of N shutters.
            Shutters that follow nothing have turn 1 and shift 0.
    """

    first: int
    turns: np.ndarray
    shifts: np.ndarray

    def at(self, frames: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Return turns and shifts (L, N) for source frames (L,). A frame without a row has those of the nearest row."""
        rows = np.clip(np.asarray(frames) - self.first, 0, len(self.turns) - 1)
        return self.turns[rows], self.shifts[rows]

    def between(self, start: int, end: int) -> tuple[complex, complex]:
        """Return the motion of the first shutter (column 0) from one source frame to another.

        Args:
            start, end: The numbers of the source frames. One without a row has the motion of the nearest row.

        Returns:
            The turn and the shift: a point z in `start` lies at turn · z + shift in `end`. They are rounded to 2⁻³², so
            that rounding errors, which depend on the shown frame, do not move a point to another pixel.
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
    """The n visible layers: regions that are exposed by themselves in front of the rest (core/pixels/layering.py).

    They are in order, the farthest first. A drawn layer (effect.Region) has strokes, from which its matte is diffused.
    Any other layer has a matte of its own.

    Attributes:
        shutters: For each layer the index of its shutter.
        opacities: For each layer its opacity, above 0, at most 1.
        first: The source frame to which the first items of `scribbles` and `mattes` belong.
        scribbles: For each source frame from `first` on, a state with the strokes of that frame. Diffusing it gives the
            mattes of the drawn layers. In it, shutter 1 + i stands for layer i, and shutter 0 for what belongs to no
            layer. None: there are no drawn layers, or the frame lies outside the window and is computed (Smooth). Only
            filmed frames are used outside the window, to find the background.
        mattes: For each source frame from `first` on, a tuple with the matte of each layer, or None for a drawn layer.
        camera: The camera's motion between source frames, as a Following whose only column is the camera. None: it is
            unknown or still.
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
        options: The effect's options at this frame.
        bars: (N, L) float64: how much each of the L places of the window contributes, for each of N shutters. Shutter 0
            is the default.
        shapes: The scribbles of regions that are no layers, where they lie at this frame, later ones on top.
        reference: The sum of a shutter's bars that gives full brightness if Options.exposure is "weighted". None: the
            sum of shutter 0's bars.
        following: The motions that exposures follow; None if none of them moves.
        mattes: The mattes of regions that are no layers. They are laid over the scribbles, later ones on top.
        layers: Regions that are exposed by themselves in front of the rest; None if there are none.
        combines: For each shutter how it combines its frames. Empty: all average them.
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
        """The factors (N,) by which the pictures of the shutters are made brighter or darker.

        If Options.exposure is "weighted", the factor of a shutter that averages is the sum of its bars / `reference`.
        All other factors are 1. They apply to linear light, as an aperture does; encoded values are decoded first.
        """
        exposures = self.bars.sum(axis=1)
        gains = np.ones_like(exposures)
        if self.options.exposure == "weighted":
            averaging = list(self.groups.get(AVERAGE, ()))
            gains[averaging] = exposures[averaging] / (self.reference or exposures[0])
        return gains

    @cached_property
    def open_span(self) -> tuple[int, int]:
        """The used part of the window: the index of the first frame that any shutter exposes, and one past the last.

        If a shutter has a threshold, which needs the shown frame, the span includes that frame, exposed or not.
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
        """Return a state that has only the chosen shutters, in the given order, and no scribbles, mattes and layers.

        Its Options.edge_aware is 0. Its `reference` stays that of this state, so that brightness does not change.

        Args:
            chosen: The indices of the shutters.
        """
        return FrameState(
            options=replace(self.options, edge_aware=0.0),
            bars=self.bars[list(chosen)],
            reference=self.reference or float(self.bars[0].sum()),
            following=self.following and self.following.of(chosen),
            combines=tuple(self.combines[index] for index in chosen) if self.combines else (),
        )
