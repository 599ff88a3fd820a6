"""How well outlines are carried: of footage with masks of all frames, what is carried from outlines of some of them,
and what flow alone makes of these, beside the masks of the others.

python scripts/carried_mattes.py FIRST_FRAME FIRST_MASK

FIRST_FRAME: the first image of a sequence; FIRST_MASK: likewise, its subject white. It prints the mean intersection
over union of the drawings themselves, and by how many frames these are apart, of the frames between, with the seconds
that one takes. Outlines have POINTS points for each part of the subject.
"""

import sys
import time
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from shutter_addon.core.model import outlines, scribbles
from shutter_addon.media import carrying, flow, open_source
from shutter_addon.media.matte_files import MatteFile

POINTS = 48
APART = (5, 10, 20)
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


def measured(frames: list, masks: list, apart: int) -> tuple[float, float, float]:
    """Mean overlaps of flow alone and of what is carried, and the seconds that a frame takes."""
    size = carrying.working_size(*frames[0].shape[1::-1])
    drawn = [carrying.Drawing(k, outlines.coverage(outline(masks[k]), *size)) for k in range(0, len(frames), apart)]
    alone, found, seconds = [], [], 0.0
    for first, last in pairwise(drawn):
        alone += [overlap(matte, masks[k]) for k, matte in by_flow(frames, first, last).items()]
        start = time.perf_counter()
        mattes = list(carrying.carried(frames.__getitem__, first, last, range(first.frame + 1, last.frame)))
        seconds += time.perf_counter() - start
        found += [overlap(each.matte / 255, masks[each.frame]) for each in mattes]
    return np.mean(alone), np.mean(found), seconds / len(found)


def main() -> int:
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    with open_source(sys.argv[1]) as source, MatteFile(Path(sys.argv[2])).open() as matte:
        frames = [flow.displayed(source.read(k), source.transfer, source.alpha) for k in range(source.count)]
        masks = [matte.read(k) > 0 for k in range(source.count)]
    height, width = masks[0].shape
    drawings = [overlap(outlines.coverage(outline(mask), width, height), mask) for mask in masks]
    print(f"the drawings themselves: {np.mean(drawings):.3f}")
    for apart in APART:
        alone, found, seconds = measured(frames, masks, apart)
        print(f"every {apart} frames: flow alone {alone:.3f}, carried {found:.3f}, {seconds:.2f} s a frame")
    return 0


if __name__ == "__main__":
    sys.exit(main())
