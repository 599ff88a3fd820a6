"""How well small strokes are tracked on footage of people and animals, beside places that were labelled by eye.

python scripts/track_labels.py FOLDER

FOLDER: where the clips of track_labels.json are, NAME.mp4 each; that has the places of some points, in pixels, by frame
from 0 on, or null where it is hidden. A cross is drawn over each point at its first frame. It prints how far the track
is off, in pixels of 640: the mean and the worst; plain optical flow (DIS), joined from frame to frame; and how sure the
tracker says that it is. The places were found with this tracker's help, looked at one by one and mended: small errors
favour it.
"""

import json
import sys
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from shutter_addon.core.model import scribbles
from shutter_addon.core.model.motions import Placement
from shutter_addon.media import flow, open_source, tracking
from shutter_addon.media.cuts import ShotSource
from shutter_addon.media.footage import Footage

LABELS = Path(__file__).with_suffix(".json")
CROSS, WIDTH = 10, 0.02  # pixels of an arm; heights of the picture
RIGHT, WRONG, SURE = 2, 5, 0.5


class Cross:
    """A stroke that is drawn over a point, in fractions of the picture."""

    def __init__(self, point, size):
        (x, y), (width, height) = point, size
        ends = [[(x - CROSS, y), (x + CROSS, y)], [(x, y - CROSS), (x, y + CROSS)]]
        self.middle = np.array([x / width, 1 - y / height])
        self.strokes = tuple(np.array(each) / size * (1, -1) + (0, 1) for each in ends)

    def placement(self, _frame):
        return Placement()

    def centre(self, _frame):
        return self.middle

    def at(self, _frame):
        return scribbles.Shape(shutter=0, kind="line", width=WIDTH, strokes=self.strokes)


def by_flow(pictures: list, point) -> list[np.ndarray]:
    """Where plain flow has a point, frame by frame."""
    places = [np.array(point, np.float64)]
    for first, second in pairwise(pictures):
        vectors = flow.fine_vectors(first, second)
        x, y = places[-1]
        here = np.float32([[[x, y]]])
        places.append(places[-1] + cv2.remap(vectors, here, None, cv2.INTER_LINEAR)[0, 0])
    return places


def measured(source, points: list[dict]) -> list[tuple[float, float, float]]:
    """Of each label: how far the track is off and flow, in pixels of 640, NaN where it is hidden or was not tracked;
    and how sure the track is, 0 where there is none."""
    size, rows = (source.width, source.height), []
    unit = 640 / max(size)
    last = max(int(frame) for point in points for frame in point)
    grey = [flow.luma(source.read(k), source.transfer, source.alpha) for k in range(last + 1)]
    for point in points:
        start, *labels = ((int(frame), place) for frame, place in point.items())
        cross = Cross(start[1], size)
        steps = tracking.RegionTrack(cross).follow(Footage(source, int), start[0], range(last + 1))
        found = {step.frame: step for step in steps if not step.fault}
        flowed = by_flow(grey, start[1])
        for frame, place in labels:
            step, hidden = found.get(frame), (np.nan, np.nan)
            x, y = hidden if step is None else cross.middle + step.placement.location
            ways = np.array([(x * size[0], (1 - y) * size[1]), flowed[frame]]) - (place or hidden)
            rows.append((*np.hypot(*ways.T) * unit, step.confidence if step else 0.0))
    return rows


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    labels, every = json.loads(LABELS.read_text()), []
    for name, points in labels.items():
        with closing(ShotSource(open_source(Path(sys.argv[1]) / f"{name}.mp4"))) as source:
            rows = np.array(measured(source, points))
        every.append(rows)
        tell(name, rows)
    tell("all", np.concatenate(every))
    return 0


def tell(name: str, rows: np.ndarray) -> None:
    apart, flowed, sure = rows.T
    hidden, lost = np.isnan(flowed), np.isnan(apart) & ~np.isnan(flowed)
    right, wrong = apart < RIGHT, (apart > WRONG) | hidden
    print(
        f"{name}: {np.count_nonzero(~hidden)} places, {np.count_nonzero(lost)} not tracked; off by "
        f"{np.nanmean(apart):.1f}, {np.nanmax(apart):.1f} at most (flow: {np.nanmean(flowed):.1f}, "
        f"{np.nanmax(flowed):.1f}); surer than {SURE:.0%}: {np.count_nonzero(sure[right] >= SURE)} of "
        f"{np.count_nonzero(right)} within {RIGHT} pixels, {np.count_nonzero(sure[wrong] >= SURE)} of "
        f"{np.count_nonzero(wrong)} off by more than {WRONG} or hidden",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main())
