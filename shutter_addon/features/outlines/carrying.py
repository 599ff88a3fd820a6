"""Make the mattes of frames between two drawings of an outline, by following the footage's motion ("carrying").

1. Motion. Dense optical flow from frame to frame is joined. For each pixel of a frame, it gives the matching place in
   each drawing's frame. Other ways to find that place are the flow between the two frames alone, and the motions of the
   camera and of the subject. A pixel takes another way where its colors match clearly better.
2. Votes. Each way errs by a few pixels, so all places within REACH of the matching place vote on whether the pixel lies
   inside. A vote weighs more the more alike the colors around both pixels are (non-local means: Buades et al. 2005, "A
   non-local algorithm for image denoising"; votes for labels: Coupé et al. 2011, "Patch-based segmentation using expert
   priors"). Both drawings vote. The nearer one has more weight.
3. Edges. A guided filter fits the result to the edges of the picture (He et al. 2013).
4. Soft edges. In linear light, a soft or blurred edge is a mixture of the colors on its two sides, so the matte there
   is a linear function of the colors (Levin et al. 2008, "A closed-form solution to natural image matting"). The matte
   becomes that function where the function fits.

Steps 1 and 2 use a working picture: the frame reduced to at most WORKING pixels a side. Steps 3 and 4 use the whole
picture.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from ...core import stopping
from ...core.frames.light import to_linear
from ...core.pixels.matte_grid import Box, box_around
from ...media import flow
from ...media.opencv import cv2

WORKING = 512
SLIM = 4  # pixels of a side that the working picture keeps: so many as a picture has at least that Blender renders
FARTHEST = 100  # frames that a drawing is carried at most
REACH, STEP = 6, 2  # pixels of the working picture, in which places lie that vote
ALIKE = 6.0  # units of CIE Lab, its L halved: how far colors may differ
NEAR = 6.0  # pixels of the working picture: how far votes may come from
AROUND = 0.5  # pixels: the standard deviation of what is compared around a place
# What most votes say lies inside: less than half, for what is thin has more around it than of itself
# (scripts/carried_mattes.py).
INSIDE = 0.4
EDGE = 0.4  # votes from 0 to 1 in the middle of an edge
RADIUS, SMOOTHNESS = 3, 1e-3  # of the guided filter: pixels of the working picture, and a variance of colors of 0 to 1
# Of the filters that explain the result, in their order: the wide ones find an edge that lies beside its place.
EXPLAINING, EXACT = (19, 9), 1e-6
# Shares of its variance around a pixel that colors explain: none of that is believed below, and all above.
DOUBTED, BELIEVED = 0.9, 0.97
STEEPER = 1.05  # what colors explain is never quite 0 or 1
# Where a place has moved by hardly more, in pixels of the working picture, and looks hardly more different than noise
# makes it, in units of CIE Lab, the matte keeps so much of the one before.
STILL, CHANGED, QUIET = 0.5, 4.0, 0.9

THIN, LEAST = 4, 12  # every so many pixels tell an affine motion, and so many at least
BETTER = 0.9  # share of a difference that must be left where flow between two frames alone is believed more

# Votes on what lies inside, beside the most that there can be, which tell nothing (scripts/carried_mattes.py).
UNLIKE = 0.4
AGREED = 0.6  # overlap of what two drawings make of a frame, from which on they do not contradict one another

Places = np.ndarray  # (h, w, 2) float32, x and y in pixels of the working picture


@dataclass(frozen=True)
class Drawing:
    """An outline as the user drew it at one frame.

    Attributes:
        frame: Frame of the footage.
        cover: Which share of each pixel of the working picture lies inside the outline, (h, w) float32, 0 to 1.
    """

    frame: int
    cover: np.ndarray


@dataclass(frozen=True)
class Carried:
    """A frame's matte that was made from drawings at other frames.

    Attributes:
        frame: Frame of the footage.
        matte: (H, W) uint8.
        confidence: 0 to 1. From 0.5 on, the matte usually overlaps by more than 75 % with what a person draws.
    """

    frame: int
    matte: np.ndarray
    confidence: float


# Reads a source frame as it is displayed: (H, W, 3) uint8.
Frames = Callable[[int], np.ndarray]


def working_size(width: int, height: int) -> tuple[int, int]:
    """Return the width and height of the working picture for a picture of this size, all in pixels.

    The working picture is the picture reduced so that its longer side has at most WORKING pixels. Optical flow is found
    in it. No side is reduced below SLIM pixels.
    """
    scale = min(1.0, WORKING / max(width, height))
    return max(round(width * scale), min(width, SLIM)), max(round(height * scale), min(height, SLIM))


def carried(frames: Frames, first: Drawing | None, last: Drawing | None, span: range) -> Iterator[Carried]:
    """Make the mattes of successive frames from the drawings around them, and yield them in order.

    First, all frames from drawing to drawing, or from the only drawing to the other end of the span, are read, and the
    optical flow and colors of their working pictures are held in memory. Then the span is read again, frame by frame.

    Args:
        frames: A function that reads a frame of the footage as displayed, (H, W, 3) uint8.
        first: The drawing at a frame before the span. None: there is none.
        last: The drawing at a frame after the span. None: there is none. Without any drawing, nothing is yielded.
        span: The frames whose mattes are wanted, without those of the drawings.
    """
    ends = [each for each in (first, last) if each is not None]
    if not span or not ends:
        return
    reading = range(first.frame if first else span.start, (last.frame if last else span.stop - 1) + 1)
    size = ends[0].cover.shape[::-1]
    footage, before = _Footage(), None
    joined = _joined(lambda frame: flow.resized(frames(frame), size), footage, reading, first, last)
    for frame in span:
        stopping.check()
        places = [footage.best(joined.pop((end.frame, frame)), frame, end) for end in ends]
        covers = [_at(end.cover, there) for end, there in zip(ends, places, strict=True)]
        box = box_around(np.maximum.reduce(covers), REACH)
        sides = [
            _votes(footage.colors[frame], _at(footage.colors[end.frame], there), cover, box)
            for end, there, cover in zip(ends, places, covers, strict=True)
        ]
        passed = (frame - ends[0].frame) / (ends[1].frame - ends[0].frame) if len(ends) > 1 else 0.0
        share = _mixed(sides, [1 - passed, passed][: len(ends)])
        matte = refined(frames(frame), share)
        if before is not None:
            still = stillness(footage.moved[frame], footage.colors[frame], footage.colors[frame - 1])
            matte += cv2.resize(still, matte.shape[::-1]) * (before - matte)
        before = matte
        yield Carried(frame, flow.levels(matte), _confidence(share, sides))


def drawn(picture: np.ndarray, cover: np.ndarray) -> np.ndarray:
    """Make the matte of a frame from the drawing at this very frame, fitted to the picture's edges.

    Args:
        picture: The frame, (H, W, 3) uint8.
        cover: The share of each pixel inside the drawing, (h, w) float32, as in Drawing.

    Returns:
        The matte, (H, W) uint8.
    """
    shown = lab(flow.resized(picture, cover.shape[::-1]))
    return flow.levels(refined(picture, _mixed([_votes(shown, shown, cover, box_around(cover, REACH))], [1.0])))


@dataclass(frozen=True)
class _Footage:
    """The working pictures that were read so far. All attributes have the frame of the footage as key.

    Attributes:
        colors: Their colors, (3, h, w) float32, from `lab`.
        greys: The same pictures in grey, (h, w) uint8, for optical flow.
        moved: How far the picture has moved at each pixel since the frame before, (h, w), a distance in pixels.
    """

    colors: dict[int, np.ndarray] = field(default_factory=dict)
    greys: dict[int, np.ndarray] = field(default_factory=dict)
    moved: dict[int, np.ndarray] = field(default_factory=dict)

    def add(self, frame: int, picture: np.ndarray) -> None:
        self.colors[frame], self.greys[frame] = lab(picture), cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)

    def to(self, frame: int, other: int) -> Places:
        """Find for each pixel of `frame` the matching place in the frame `other`, by optical flow."""
        grey = self.greys[frame]
        return flow.grid(*grey.shape) + flow.fine_vectors(grey, self.greys[other])

    def best(self, joined: Places, frame: int, end: Drawing) -> Places:
        """Find for each pixel of a frame the best matching place in a drawing's frame.

        Four candidates are compared by color: flow joined from frame to frame, flow directly between the two frames,
        and the affine motions of what lies outside and inside the outline. Joined flow is used unless another candidate
        leaves a difference of less than BETTER times as much.

        Args:
            joined: For each pixel of the frame, its place in the drawing's frame by joined flow.
            frame: The frame of the footage.
            end: The drawing.

        Returns:
            For each pixel of the frame, its place in the drawing's frame, (h, w, 2), x and y in pixels.
        """
        picture = self.colors[frame]
        cover = _at(end.cover, joined)
        others = [self.to(frame, end.frame), *(affine(joined, where) for where in (cover < 0.5, cover >= 0.5))]
        places, least = joined, apart(picture, _at(self.colors[end.frame], joined))
        for other in others:
            differs = apart(picture, _at(self.colors[end.frame], other))
            better = differs < np.float32(BETTER) * least
            places = np.where(better[..., None], other, places)
            least = np.where(better, differs, least)
        return places


def stillness(moved: np.ndarray, colors: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Return how much of the last frame's matte to mix into this frame's matte, so that mattes do not flicker.

    Where nothing moves and colors stay, any difference between the two mattes is noise.

    Args:
        moved: How far each pixel has moved since the frame before, (h, w), in pixels.
        colors: The frame's colors, (3, h, w), from `lab`.
        before: The colors of the frame before.

    Returns:
        The share at each pixel, (h, w): 0 where something moves or changes, up to QUIET where all is still.
    """
    still = np.clip(1.5 - moved / np.float32(STILL), 0, 1)
    differ = apart(colors, before)
    noise = float(np.median(differ[still > 0])) if still.any() else 0.0
    return QUIET * still * np.exp(-np.square(differ / np.float32(CHANGED + 2 * noise)))


def apart(picture: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return how much the colors (3, h, w) of two pictures differ around each pixel, (h, w), in units of CIE Lab."""
    return cv2.blur(np.abs(picture - other).sum(axis=0), (5, 5))


def affine(places: Places, where: np.ndarray) -> Places:
    """Fit one affine motion to the optical flow in an area, and return the places that it gives in the whole picture.

    Args:
        places: For each pixel, its matching place in another frame, by flow: (h, w, 2), x and y in pixels.
        where: The area, (h, w) bool.

    Returns:
        Places like `places`, by the affine motion; `places` itself if the area is too small or no motion fits.
    """
    grid = flow.grid(*where.shape)
    chosen = np.flatnonzero(where[::THIN, ::THIN])
    if chosen.size < LEAST:
        return places
    here, there = (each[::THIN, ::THIN].reshape(-1, 2)[chosen] for each in (grid, places))
    matrix, _ = cv2.estimateAffine2D(here, there, method=cv2.RANSAC, ransacReprojThreshold=1.0)
    return places if matrix is None else cv2.transform(grid, matrix).astype(np.float32)


def _joined(
    small: Frames, footage: _Footage, reading: range, first: Drawing | None, last: Drawing | None
) -> dict[tuple[int, int], Places]:
    """Join optical flow from frame to frame, so that it leads from each frame to the frames of the drawings.

    This reads all frames once, and adds them to `footage`.

    Args:
        small: A function that reads a frame as working picture, (h, w, 3) uint8.
        footage: The working pictures are added here, and how far each pixel has moved.
        reading: The frames to read, including those of the drawings.
        first: The drawing at the first of these frames; None: there is none.
        last: The drawing at the last of these frames; None: there is none.

    Returns:
        By (a drawing's frame, another frame): for each pixel of the other frame, its matching place in the drawing's
        frame.
    """
    places: dict[tuple[int, int], Places] = {}
    forth: dict[int, Places] = {}
    for frame in reading:
        stopping.check()
        footage.add(frame, small(frame))
        if first and frame > reading.start:
            back = footage.to(frame, frame - 1)
            known = places.get((first.frame, frame - 1))
            places[first.frame, frame] = back if known is None else _at(known, back)
        if last and frame > reading.start:
            forth[frame - 1] = footage.to(frame - 1, frame)
        if frame > reading.start:
            way = (back if first else forth[frame - 1]) - flow.grid(*footage.greys[frame].shape)
            footage.moved[frame] = np.hypot(way[..., 0], way[..., 1])
    if last:
        there = None
        for frame in reversed(forth):
            there = forth[frame] if there is None else _at(there, forth[frame])
            places[last.frame, frame] = there
    return places


Votes = tuple[np.ndarray, np.ndarray]  # per pixel, (h, w) each: the sum of votes for "inside", and of all votes


def _votes(shown: np.ndarray, colors: np.ndarray, cover: np.ndarray, box: Box | None) -> Votes:
    """Let places around each pixel's match in a drawing's frame vote on whether the pixel lies inside the outline.

    The match is the place in the drawing's frame that shows the same. A vote weighs more the nearer its place is to
    that, and the more alike the colors around the place and the pixel are.

    Args:
        shown: The frame's colors, (3, h, w), from `lab`.
        colors: The colors of the drawing's frame, each moved to the pixel of this frame that it matches.
        cover: The drawing's cover, (h, w), moved in the same way.
        box: The rows and columns that are examined. All pixels outside count as outside the outline. None: all pixels
            do.

    Returns:
        For each pixel, the sum of the votes for "inside", and the sum of all votes, (h, w) each.
    """
    inside = np.zeros_like(cover)
    if box is None:
        return inside, np.ones_like(cover)
    rows, columns = box
    total = np.full_like(cover, 1e-6)
    here = shown[:, rows, columns]
    padded = np.pad(colors, ((0, 0), (REACH, REACH), (REACH, REACH)), "edge")
    covers = np.pad(cover, REACH, "edge")
    h, w = here.shape[1:]
    kernel = cv2.getGaussianKernel(3, AROUND, cv2.CV_32F)
    for down, right in product(range(-REACH, REACH + 1, STEP), repeat=2):
        place = (
            slice(rows.start + REACH + down, rows.start + REACH + down + h),
            slice(columns.start + REACH + right, columns.start + REACH + right + w),
        )
        apart = sum(np.square(mine - other) for mine, other in zip(here, padded[(slice(None), *place)], strict=True))
        apart = cv2.sepFilter2D(apart, -1, kernel, kernel, borderType=cv2.BORDER_REPLICATE)
        weight = np.exp(apart / np.float32(-(ALIKE**2)) - np.float32((down**2 + right**2) / NEAR**2))
        total[rows, columns] += weight
        inside[rows, columns] += weight * covers[place]
    return inside, total


def _mixed(sides: list[Votes], weights: list[float]) -> np.ndarray:
    """Join the votes from one or two drawings: return the share of votes for "inside" at each pixel, (h, w), 0 to 1.

    Args:
        sides: The votes from each drawing (`_votes`).
        weights: The weight of each drawing's votes, more for the nearer drawing. They add up to 1.
    """
    shares = np.array(weights, np.float32)
    inside, total = (np.tensordot(shares, [side[part] for side in sides], axes=1) for part in (0, 1))
    return inside / total


def _confidence(share: np.ndarray, sides: list[Votes]) -> float:
    """Return how sure a matte is, 0 to 1.

    It is surer the more the subject looks as in one of the drawings, and the more two drawings agree on the matte. An
    empty matte has confidence 1 if it is made from two drawings, 0 if from one.

    Args:
        share: The share of votes for "inside", (h, w), from `_mixed`.
        sides: The votes from each drawing (`_votes`).
    """
    inside = share > INSIDE
    if not inside.any():
        return float(len(sides) > 1)  # nothing is a matte where both agree on it
    alike = max(float(np.minimum(total[inside], 1).mean()) for _inside, total in sides)
    masks = [votes / total > INSIDE for votes, total in sides]
    both, either = (int(np.count_nonzero(way.reduce(masks))) for way in (np.logical_and, np.logical_or))
    agreed = both / either if either else 1.0
    return max(alike - UNLIKE, 0.0) / (1 - UNLIKE) * min(agreed / AGREED, 1.0)


def refined(picture: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Make a matte from votes, and fit it to the edges and colors of the picture in full size.

    Args:
        picture: The frame, (H, W, 3) uint8.
        share: The share of votes for "inside" at each pixel of the working picture, (h, w), 0 to 1. From about INSIDE
            on, a pixel counts as inside.

    Returns:
        The matte, (H, W) float32, 0 to 1, with soft edges where the picture has them.
    """
    scale = picture.shape[1] / share.shape[1]
    coarse = int(scale)
    matte = np.zeros(picture.shape[:2], np.float32)
    if (box := box_around(share, EXPLAINING[0])) is None:
        return matte
    whole = cv2.resize(share, picture.shape[1::-1], interpolation=cv2.INTER_LINEAR) if scale != 1 else share
    rows, columns = (slice(int(part.start * scale), int(np.ceil(part.stop * scale))) for part in box)
    guide, values = np.ascontiguousarray(picture[rows, columns]), np.ascontiguousarray(whole[rows, columns])
    near = round(RADIUS * scale / coarse)  # in pixels of the smaller picture, as OpenCV counts
    values = cv2.ximgproc.guidedFilter(guide, values, near, SMOOTHNESS * 255**2, scale=1 / coarse)
    values = np.clip((values - INSIDE) / EDGE + 0.5, 0, 1)
    light = cv2.LUT(guide, _LIGHT)
    for radius in EXPLAINING:
        values = _explained(light, values, round(radius * scale), coarse)
    matte[rows, columns] = values
    return matte


# Linear light, 0 to 255, of code values: OpenCV's filter takes smaller numbers for none.
_LIGHT = (255 * to_linear(np.arange(256) / 255)).astype(np.float32)


def _explained(light: np.ndarray, values: np.ndarray, radius: int, coarse: int) -> np.ndarray:
    """Make a matte's edges as soft as the picture's: replace it by a linear function of the colors where one fits.

    The function is fitted around each pixel. Where it explains the matte badly, the matte stays; in between, both are
    mixed (DOUBTED, BELIEVED).

    Args:
        light: The picture in linear light, (h, w, 3) float32, 0 to 255.
        values: The matte, (h, w), 0 to 1.
        radius: How far around each pixel the function is fitted, in pixels.
        coarse: The function is fitted in a picture that is smaller by this factor, which is quicker.

    Returns:
        The new matte, (h, w), 0 to 1.
    """
    found = cv2.ximgproc.guidedFilter(light, values, round(radius / coarse), EXACT * 255**2, scale=1 / coarse)

    def mean(each: np.ndarray) -> np.ndarray:
        return cv2.blur(each, (2 * radius + 1, 2 * radius + 1))

    varies = mean(values**2) - mean(values) ** 2
    explained = 1 - mean((values - found) ** 2) / (varies + np.float32(1e-4))
    believed = np.clip((explained - DOUBTED) / (BELIEVED - DOUBTED), 0, 1)
    return values + believed * (np.clip((found - 0.5) * STEEPER + 0.5, 0, 1) - values)


def lab(picture: np.ndarray) -> np.ndarray:
    """Return the colors of a picture (h, w, 3) uint8 in CIE Lab with L halved, (3, h, w) float32."""
    lab = cv2.cvtColor(picture.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    lab[..., 0] /= 2
    return np.ascontiguousarray(lab.transpose(2, 0, 1))


def _at(values: np.ndarray, places: Places) -> np.ndarray:
    """Look up a picture's values at fractional positions, by linear interpolation. Outside, the picture's edge repeats.

    Args:
        values: The picture: (h, w), (h, w, 2), or three planes (3, h, w).
        places: The positions, (h, w, 2), x and y in pixels, one for each pixel of the result.

    Returns:
        The values, in a shape like that of `values`.
    """
    if values.ndim == 3 and values.shape[0] == 3:
        return np.stack([_at(plane, places) for plane in values])
    return flow.look(values, places)
