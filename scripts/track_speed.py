"""Measure how quickly a region is tracked, beside decoding the same frames, in turns in one run.

    .venv/bin/python scripts/track_speed.py [FOOTAGE] [--size 1920x1080] [--rounds 3] [--json FILE]

FOOTAGE is scaled to that size first. "decode" reads every frame; "track" reads and tracks them, as the command does;
"track alone" tracks pictures that were read before. Figures are medians, of all threads. Needs no bpy.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

import av
import numpy as np
from comparing import ROOT, write_rows

from shutter_addon.core.model.effect import Drawings, Moves, Region
from shutter_addon.features.tracking import tracking
from shutter_addon.media import PrefetchSource, open_source
from shutter_addon.media.cuts import ShotSource
from shutter_addon.media.footage import AHEAD, KEPT, Footage

REGIONS = {"line": [[0.5, 0.4], [0.5, 0.6]], "lasso": [[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]]}


def scaled(footage: Path, size: tuple[int, int], folder: Path) -> Path:
    """The footage's pictures in that size, as H.264."""
    path = folder / "scaled.mp4"
    with av.open(str(footage)) as source, av.open(str(path), "w") as out:
        given = source.streams.video[0]
        stream = out.add_stream("libx264", rate=given.guessed_rate)
        stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
        for frame in source.decode(given):
            out.mux(stream.encode(frame.reformat(*size, format="yuv420p")))
        out.mux(stream.encode())
    return path


def region(kind: str, aspect: float) -> Region:
    drawings = Drawings(kind, (0.0,), ([np.array(REGIONS[kind])],), ("linear",), aspect)
    return Region(Moves(), kind=kind, shutter=0, drawings=drawings)


def decode(path: Path, _kind: str) -> dict:
    """Seconds, those of all threads, and frames."""
    with PrefetchSource(open_source(path)) as source, timed(source.count) as taken:
        for index in range(source.count):
            source.want(range(index, min(index + AHEAD, source.count)))
            source.read(index)
    return taken


def track(path: Path, kind: str) -> dict:
    with ShotSource(PrefetchSource(open_source(path))) as source:
        return _followed(Footage(source, lambda frame: frame), source, kind)


def track_alone(path: Path, kind: str) -> dict:
    with open_source(path) as source:
        footage = Footage(source, lambda frame: frame)
        for index in range(source.count):
            footage.picture(index)
        return _followed(footage, source, kind)


def _followed(footage, source, kind: str) -> dict:
    frames = range(min(source.count, KEPT))
    with timed(len(frames)) as taken:
        track = tracking.RegionTrack(region(kind, source.width / source.height))
        found = list(track.follow(footage, 0, frames))
    if len(found) < len(frames) or found[-1].fault:
        raise SystemExit(f"{kind}: lost at frame {found[-1].frame}")
    return taken


@contextmanager
def timed(frames: int):
    """Gives a dictionary with the frames per second of the block, and the milliseconds of CPU time per frame."""
    taken, begun, cpu = {"frames": frames}, time.perf_counter(), time.process_time()
    yield taken
    taken["fps"] = frames / (time.perf_counter() - begun)
    taken["cpu_ms"] = 1000 * (time.process_time() - cpu) / frames


WAYS = {"decode": decode, "track": track, "track alone": track_alone}


def measure(path: Path, rounds: int) -> list[dict]:
    taken: dict = {}
    for _ in range(rounds):
        for kind in REGIONS:
            for name, way in WAYS.items():
                taken.setdefault((kind, name), []).append(way(path, kind))
    return [
        {"pass": "track", "region": kind, "way": way, "frames": runs[0]["frames"]}
        | {name: statistics.median(run[name] for run in runs) for name in ("fps", "cpu_ms")}
        for (kind, way), runs in taken.items()
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("footage", type=Path, nargs="?", default=ROOT / "assets" / "bigbuckbunny.mp4")
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        width, height = (int(number) for number in arguments.size.split("x"))
        rows = measure(scaled(arguments.footage, (width, height), Path(folder)), arguments.rounds)
    for row in rows:
        row |= {"width": width, "height": height}
        numbers = f"{row['frames']:4} frames {row['fps']:7.1f} fps {row['cpu_ms']:6.1f} ms of CPU a frame"
        print(f"{row['region']:6} {row['way']:12} {numbers}")
    write_rows(arguments.json, rows)


if __name__ == "__main__":
    main()
