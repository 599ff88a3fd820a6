"""How well subjects are followed from one stroke, beside masks of all frames.

python scripts/subject_mattes.py FIRST_FRAME FIRST_MASK    the images of two sequences; the subject of a mask is white
python scripts/subject_mattes.py MOVIE FRAME X Y X Y       one stroke, in fractions of the picture, y up

It prints the intersection over union (IoU) and the confidence of each frame, then their means, how many frames below
0.75 have less than half of it and above 0.88 more, and the processor's seconds of a frame. Without masks it prints the
confidence alone.
"""

import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from carried_mattes import overlap

from shutter_addon.media import open_source
from shutter_addon.media.opening import MatteFile
from shutter_addon.media.subject import MODEL
from shutter_addon.media.subject_mattes import Subject, SubjectMattes


def stroke_in(mask: np.ndarray) -> np.ndarray:
    """Return a stroke down the middle of a mask (H, W) of bools."""
    rows = np.flatnonzero(mask.any(axis=1))
    chosen = np.percentile(rows, [25, 35, 45, 55]).astype(int)
    points = [(np.median(np.flatnonzero(mask[row])) + 0.5, row + 0.5) for row in chosen]
    return np.array(points) / mask.shape[::-1] * (1, -1) + (0, 1)


def measure(path: str, frame: int, stroke: np.ndarray, masks: list[np.ndarray]) -> None:
    """Follow a subject through a source and print what comes out."""
    found = []
    with tempfile.TemporaryDirectory() as folder, open_source(path) as source:
        mattes = SubjectMattes(source, (), Path(folder), Subject({frame: [stroke]}, {}), MODEL)
        start = time.process_time()
        for index in range(source.count):
            matte, sure = mattes.read(index), mattes.confidence(index)
            found.append((overlap(matte, masks[index]) if masks else np.nan, sure))
            print(f"{index}: IoU {found[-1][0]:.3f}, confidence {sure:.2f}", flush=True)
        seconds = (time.process_time() - start) / source.count
    ious, sures = np.array(found).T
    bad, good = sures[ious < 0.75] < 0.5, sures[ious > 0.88] > 0.5
    print(f"mean {ious.mean():.4f}, least {ious.min():.3f}, confidence {sures.mean():.2f}, {seconds:.2f} s a frame")
    print(f"told: {bad.sum()} of {len(bad)} bad frames, {good.sum()} of {len(good)} good ones")


def main() -> int:
    if len(sys.argv) == 3:
        with closing(MatteFile(Path(sys.argv[2])).open()) as matte:
            masks = [matte.read(index) > 0 for index in range(matte.count)]
        measure(sys.argv[1], 0, stroke_in(masks[0]), masks)
    elif len(sys.argv) > 5:
        points = np.array(sys.argv[3:], float).reshape(-1, 2)
        measure(sys.argv[1], int(sys.argv[2]), points, [])
    else:
        print(__doc__, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
