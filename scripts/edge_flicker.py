"""Measure how much coefficients along edges change between frames where the footage stands still.

    .venv/bin/python scripts/edge_flicker.py [--films …] [--frames 24] [--noise 0,8] [--aggregate 2] [--json OUT]

One stroke per film lies still, and the border is the other shutter. A pixel stands still where 15 × 15 pixels around it
change by no more than a level of 255 on average. Changes are in 255ths. "steadied" is as it renders, with the frames
beside the shown one; "alone" is without them. --noise adds noise after the footage was judged.
"""

import argparse
from itertools import pairwise
from pathlib import Path
from unittest import mock

import cv2
import numpy as np
from comparing import ROOT, listed, write_rows

from shutter_addon.compute import guide
from shutter_addon.compute.renderer import Renderer, open_compositor
from shutter_addon.compute.request import Request
from shutter_addon.core.frames.frame_source import SourceWrapper
from shutter_addon.core.model.frame_state import FrameState, Options
from shutter_addon.core.model.scribbles import Shape
from shutter_addon.media import open_source

# Film, its first frame here, and a stroke inside something that its picture shows.
FILMS = (
    (ROOT / "assets" / "pedestrians.avi", 20, [(0.30, 0.55), (0.33, 0.2)]),
    (ROOT / "assets" / "bigbuckbunny.mp4", 90, [(0.36, 0.6), (0.36, 0.3)]),
)
STILL, AROUND = 1.0, 15


class Noisy(SourceWrapper):
    """A source with noise of so many levels, the same whenever a frame is read."""

    def __init__(self, source, levels: float):
        super().__init__(source)
        self._levels = levels

    def read(self, index: int) -> np.ndarray:
        frame = self._source.read(index)
        if not self._levels:
            return frame
        noisy = frame[..., :3] + np.random.default_rng(index).normal(0, self._levels, (*frame.shape[:2], 3))
        return np.dstack([np.rint(noisy).clip(0, 255).astype(np.uint8), frame[..., 3:]])


def still(first: np.ndarray, second: np.ndarray, block: int) -> np.ndarray:
    """Which blocks of pixels stand still between two frames (H, W, 4)."""
    change = cv2.blur(cv2.absdiff(first, second).max(axis=-1).astype(np.float32), (AROUND, AROUND))
    return change[block // 2 :: block, block // 2 :: block] <= STILL


def changes(compositor, film: Path, first: int, stroke, args, noise: float) -> dict[str, float]:
    """What pixels that stand still change by; and what share of all they are."""
    shape = Shape(1, "line", 0.012, (np.array(stroke),))
    options = Options(1, border=True, aggregate=args.aggregate, edge_aware=1.0, stop_at_cuts=False)
    moment, numbers = FrameState(options, np.ones((2, 1)), (shape,)), range(first, first + args.frames)
    with open_source(film) as source:
        frames = [source.read(index) for index in numbers]
        renderer = Renderer(compositor, Noisy(source, noise))
        coefficients = [renderer.coefficients(Request(index, moment))[1] for index in numbers]
    found, share = [], []
    for (before, after), (old, new) in zip(pairwise(frames), pairwise(coefficients), strict=True):
        here = still(before, after, args.aggregate)
        found.append(255 * np.abs(new - old)[: here.shape[0], : here.shape[1]][here])
        share.append(here.mean())
    every = np.concatenate(found)
    return {
        "still": float(np.mean(share)),
        "mean": float(np.mean([part.mean() for part in found])),
        "worst frame": max(float(part.mean()) for part in found),
        "99 %": float(np.quantile(every, 0.99)),
    }


def run(args) -> list[dict]:
    compositor, rows = open_compositor(args.device), []
    for film, first, stroke in (entry for entry in FILMS if entry[0].name in args.films):
        for noise in args.noise:
            for way, beside in (("steadied", guide.BESIDE), ("alone", 0)):
                with mock.patch.object(guide, "BESIDE", beside):
                    found = changes(compositor, film, first, stroke, args, noise)
                rows.append({"film": film.name, "noise": noise, "guide": way} | found)
                numbers = " | ".join(f"{found[name]:.3f}" for name in ("mean", "worst frame", "99 %"))
                print(f"| {film.name} | {noise:g} | {way} | {found['still']:.0%} | {numbers} |", flush=True)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [film.name for film, *_ in FILMS]
    parser.add_argument("--films", nargs="+", choices=names, default=names)
    parser.add_argument("--frames", type=int, default=24)
    parser.add_argument("--noise", type=listed(float), default="0,8")
    parser.add_argument("--aggregate", type=int, choices=(1, 2, 4), default=2)
    parser.add_argument("--device", choices=("gpu", "cpu"), default="gpu")
    parser.add_argument("--json", type=Path, help="where the rows are written")
    args = parser.parse_args()
    print("| film | noise | guide | still | mean | worst frame | 99 % |\n|---|---|---|---|---|---|---|")
    rows = run(args)
    write_rows(args.json, rows)


if __name__ == "__main__":
    main()
