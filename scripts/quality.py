"""Compare pictures whose blocks of pixels share a shutter with pictures at full resolution.

    python scripts/quality.py [FILM …] [--aggregate 2] [--bars preset,random] [--windows 16] [--frames 12] [--json FILE]

Scribbles and shutters are those of scripts/benchmark.py. Composes on a GPU where there is one. Needs no Blender.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from pathlib import Path

import numpy as np
from benchmark import BARS, bars, shapes
from comparing import ROOT, codes, listed, similarity, write_rows

from shutter_addon.compute.renderer import Renderer, open_compositor
from shutter_addon.compute.request import Request
from shutter_addon.core.model.frame_state import FrameState, Options
from shutter_addon.media import MediaError, open_source

FILMS = [ROOT / "assets" / name for name in ("bigbuckbunny.mp4", "pedestrians.avi")]


def similarities(compositor, film, kind: str, count: int, window: int, block: int, frames: int) -> list[float]:
    """Of pictures spread over the film: whose blocks share a shutter beside full resolution."""
    source = open_source(film)
    # Full resolution, then blocks.
    renderers = [Renderer(compositor, source) for _ in range(2)]
    moments = [FrameState(Options(window, aggregate=b), bars(kind, count, window), shapes(count)) for b in (1, block)]
    result = []
    for index in np.linspace(0, source.count - window, frames).astype(int).tolist():
        asked = [Request(index, moment) for moment in moments]
        pictures = [renderer.picture(each) for renderer, each in zip(renderers, asked, strict=True)]
        result.append(similarity(*(codes(picture[..., :3]) for picture in pictures)))
    for renderer in renderers:
        renderer.close()
    return result


def run(args) -> list[dict]:
    compositor = open_compositor(args.device)
    rows = []
    for film, kind, window in itertools.product(args.films, args.bars, args.windows):
        values = similarities(compositor, film, kind, args.shutters, window, args.aggregate, args.frames)
        common = {"film": film.name, "bars": kind, "shutters": args.shutters, "window": window}
        rows.append(common | {"aggregate": args.aggregate, "mean": float(np.mean(values)), "worst": min(values)})
        print("| {film} | {bars} | {shutters} | {window} | {mean:.5f} | {worst:.5f} |".format(**rows[-1]), flush=True)
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("films", type=Path, nargs="*", default=FILMS)
    add("--json", type=Path, help="where the rows are written")
    add("--aggregate", type=int, choices=(2, 4), default=2)
    add("--bars", type=listed(str), default="preset,random", help=f"of {', '.join((*BARS, 'random'))}")
    add("--windows", type=listed(int), default="16")
    add("--shutters", type=int, choices=range(2, 9), default=4)
    add("--frames", type=int, default=12, help="pictures of each film")
    add("--device", choices=("gpu", "cpu"), default="gpu")
    args = parser.parse_args()
    print("| film | bars | shutters | window | mean | worst |\n|---|---|---|---|---|---|")
    try:
        rows = run(args)
    except MediaError as error:
        print(f"quality: {error}", file=sys.stderr)
        return 2
    write_rows(args.json, rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
