"""Measure how well outlines are carried, beside flow alone, on footage with masks of all frames.

python scripts/carried_mattes.py [FIRST_FRAME FIRST_MASK]

FIRST_FRAME and FIRST_MASK are the first images of sequences; the subject is white. Without them, the scenes are those
of outline_scenes.py. Outlines have POINTS points for each part of the subject. It prints the mean intersection over
union of the frames between drawings, how many levels of 255 a matte is off near the edge, and seconds a frame.
"""

import sys
import time
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import outline_scenes

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from shutter_addon.core.model import outlines, scribbles
from shutter_addon.features.outlines import carrying
from shutter_addon.media import flow, open_source
from shutter_addon.media.opening import MatteFile

POINTS = 48
APART = (5, 10, 20)
BAND = 4
FINE = 4  # contours are followed in masks so many times as large, along the edges of their pixels


def outline(mask: np.ndarray) -> list[np.ndarray]:
    """Curves (POINTS, 2) in fractions of the picture around the parts of a mask (H, W) of bools."""
    large = cv2.resize(mask.astype(np.uint8), None, fx=FINE, fy=FINE, interpolation=cv2.INTER_NEAREST)
    contours, _ = cv2.findContours(large, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    size = np.array(large.shape[::-1])
    return [
        closed((contour[:, 0] + 0.5) / size * (1, -1) + (0, 1))
        for contour in contours
        if len(contour) > 3 * FINE * FINE  # a spot of a few pixels nobody draws
    ]


def closed(points: np.ndarray) -> np.ndarray:
    """POINTS points at equal lengths along a closed curve."""
    return scribbles.resample(np.concatenate([points, points[:1]]), POINTS + 1)[:-1]


def overlap(matte: np.ndarray, mask: np.ndarray) -> float:
    inside = matte > 0.5
    return np.count_nonzero(inside & mask) / max(np.count_nonzero(inside | mask), 1)


def by_flow(frames: list, first: carrying.Drawing, last: carrying.Drawing) -> dict[int, np.ndarray]:
    """Drawings warped from frame to frame by DIS, as OpenCV has it for medium quality, and mixed by time."""
    grey = {k: cv2.cvtColor(frames[k], cv2.COLOR_RGB2GRAY) for k in range(first.frame, last.frame + 1)}
    dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    height, width = grey[first.frame].shape
    grid = np.dstack(np.meshgrid(np.arange(width), np.arange(height))).astype(np.float32)
    sides = []
    for end, step in ((first, 1), (last, -1)):
        matte, warped = cv2.resize(end.cover, (width, height)), {}
        for k in range(end.frame + step, (last if step == 1 else first).frame, step):
            matte = cv2.remap(matte, grid + dis.calc(grey[k], grey[k - step], None), None, cv2.INTER_LINEAR)
            warped[k] = matte
        sides.append(warped)
    share = {k: (k - first.frame) / (last.frame - first.frame) for k in sides[0]}
    return {k: (1 - share[k]) * sides[0][k] + share[k] * sides[1][k] for k in share}


def off(matte: np.ndarray, alpha: np.ndarray) -> float:
    """Mean levels of 255 that a matte is off beside the subject's edge."""
    inside = (alpha > 0.5).astype(np.uint8)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * BAND + 1, 2 * BAND + 1))
    return 255 * np.abs(matte - alpha)[cv2.dilate(inside, disc) > cv2.erode(inside, disc)].mean()


def measured(frames: list, alphas: list, apart: int) -> tuple[float, float, float, float]:
    """Mean overlaps of flow alone and of what is carried, how many levels this is off, and the seconds of a frame."""
    masks = [alpha > 0.5 for alpha in alphas]
    size = carrying.working_size(*frames[0].shape[1::-1])
    drawn = [carrying.Drawing(k, outlines.coverage(outline(masks[k]), *size)) for k in range(0, len(frames), apart)]
    alone, found, levels, seconds = [], [], [], 0.0
    for first, last in pairwise(drawn):
        alone += [overlap(matte, masks[k]) for k, matte in by_flow(frames, first, last).items()]
        start = time.perf_counter()
        mattes = list(carrying.carried(frames.__getitem__, first, last, range(first.frame + 1, last.frame)))
        seconds += time.perf_counter() - start
        found += [overlap(each.matte / 255, masks[each.frame]) for each in mattes]
        levels += [off(each.matte / 255, alphas[each.frame]) for each in mattes]
    return np.mean(alone), np.mean(found), np.mean(levels), seconds / len(found)


def tell(name: str, frames: list, alphas: list, apart: int) -> None:
    alone, found, levels, seconds = measured(frames, alphas, apart)
    print(
        f"{name}, every {apart} frames: flow alone {alone:.3f}, carried {found:.3f}; {levels:.1f} of 255 off; "
        f"{seconds:.2f} s a frame",
        flush=True,
    )


def of_scenes() -> None:
    for scene in outline_scenes.SCENES:
        tell(scene.name, *map(list, zip(*outline_scenes.frames(scene), strict=True)), apart=10)


def of_footage(first_frame: str, first_mask: str) -> None:
    with open_source(first_frame) as source, MatteFile(Path(first_mask)).open() as matte:
        frames = [flow.displayed(source.read(k), source.transfer, source.alpha) for k in range(source.count)]
        alphas = [(matte.read(k) > 0).astype(np.float32) for k in range(source.count)]
    height, width = alphas[0].shape
    drawings = [overlap(outlines.coverage(outline(a > 0.5), width, height), a > 0.5) for a in alphas]
    print(f"the drawings themselves: {np.mean(drawings):.3f}")
    for apart in APART:
        tell("footage", frames, alphas, apart)


def main() -> int:
    if len(sys.argv) not in (1, 3):
        print(__doc__, file=sys.stderr)
        return 2
    if len(sys.argv) == 3:
        of_footage(*sys.argv[1:])
    else:
        of_scenes()
    return 0


if __name__ == "__main__":
    sys.exit(main())
