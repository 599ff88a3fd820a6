"""Compare moments between frames with frames that were left out, beside other ways.

    python scripts/inbetween_quality.py [--films A.mp4,B.avi] [--frames 121] [--scenes A,B] [--size 480x270]
                                        [--parts films,scenes] [--json FILE] [--docs]

films: every second frame is dropped and rebuilt. scenes: of gallery footage at 240 fps, every eighth frame is kept; and
    a box shutter over four kept frames is compared with the same over all 32.
Ways: "flow" is shutter_addon.media.flow's, "blend" mixes both neighbors in linear light, "repeat" shows the earlier
one, "minterpolate" is `ffmpeg -vf minterpolate=mi_mode=mci` from PATH. Rendering needs Blender as a library (bpy).
"""

from __future__ import annotations

import argparse
import importlib
import subprocess
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from comparing import ROOT, codes, listed, psnr, read_codes, rendered, similarity, write_rows

from gallery import stills
from shutter_addon.core.frames import light
from shutter_addon.core.frames.frame_source import as_rgba
from shutter_addon.media import MediaError, flow, open_source

FILMS = [ROOT / "assets" / name for name in ("bigbuckbunny.mp4", "pedestrians.avi")]
FACTOR = 8  # 240 fps from 30
BOX = 4  # kept frames that the box exposes
SHOWN, ARM = 100, np.s_[30:620, 60:700]  # of the picture for the manual: a frame of the demo's film, from 1, and a part


def linear(picture: np.ndarray) -> np.ndarray:
    return light.to_linear(picture.astype(np.float32) / 255)


def by_flow(kept, factor):
    opaque = [np.dstack([frame, np.full(frame.shape[:2], 255, np.uint8)]) for frame in kept]
    pairs = (flow.Between(*pair) for pair in pairwise(opaque))  # of which one is kept
    return [[as_rgba(pair.moment(0, k, factor))[..., :3] for k in range(1, factor)] for pair in pairs]


def blend(kept, factor):
    def mixed(first, second):
        first, second = linear(first), linear(second)
        return [codes(first + np.float32(k / factor) * (second - first)) for k in range(1, factor)]

    return [mixed(*pair) for pair in pairwise(kept)]


def repeat(kept, factor):
    return [[first] * (factor - 1) for first in kept[:-1]]


def minterpolate(kept, factor):
    # It ends a few frames early: the last is given again.
    made = through_ffmpeg([*kept, kept[-1], kept[-1]], factor)
    for index, frame in enumerate(kept):
        if psnr(made[index * factor], frame) < 40:
            sys.exit(f"minterpolate: its frame {index * factor} is not the frame {index} that it was given")
    return [list(made[i * factor + 1 : (i + 1) * factor]) for i in range(len(kept) - 1)]


WAYS = {"flow": by_flow, "blend": blend, "repeat": repeat, "minterpolate": minterpolate}


def through_ffmpeg(kept, factor):
    """What minterpolate makes of frames."""
    height, width = kept[0].shape[:2]
    raw = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height}".split()
    command = ["ffmpeg", "-v", "error", *raw, "-r", "10"]
    options = ["-vf", f"minterpolate=fps={10 * factor}:mi_mode=mci"]
    with tempfile.TemporaryDirectory() as folder:
        given, made = Path(folder, "given"), Path(folder, "made")
        np.stack(kept).tofile(given)
        if subprocess.run([*command, "-i", given, *options, *raw, made], check=False).returncode:
            sys.exit("minterpolate: ffmpeg failed")
        return np.fromfile(made, np.uint8).reshape(-1, height, width, 3)


def compare(name, truth, factor) -> tuple[list[dict], dict]:
    """A row for each way to rebuild the frames of `truth` between every factor-th; and what each way has rebuilt."""
    kept = truth[::factor]
    rows, rebuilt = [], {}
    for way, make in WAYS.items():
        start = time.perf_counter()
        rebuilt[way] = make(kept, factor)
        seconds = (time.perf_counter() - start) / sum(map(len, rebuilt[way]))
        rows.append({"footage": name, "way": way, "factor": factor, "seconds": seconds})
    places = [(gap, k) for gap in range(len(kept) - 1) for k in range(1, factor)]
    for row in rows:
        pairs = [(rebuilt[row["way"]][gap][k - 1], truth[gap * factor + k]) for gap, k in places]
        noise, alike = [psnr(*pair) for pair in pairs], [similarity(*pair) for pair in pairs]
        row |= {"frames": len(pairs), "psnr": float(np.mean(noise)), "worst psnr": min(noise)}
        row |= {"ssim": float(np.mean(alike)), "worst ssim": min(alike)}
        numbers = "{psnr:.2f} | {worst psnr:.2f} | {ssim:.4f} | {worst ssim:.4f} | {seconds:.2f}".format(**row)
        print(f"| {row['footage']} | {row['way']} | {numbers} |", flush=True)
    return rows, rebuilt


def films(args) -> list[dict]:
    rows = []
    for film in args.films:
        with open_source(film) as source:
            truth = [source.read(index)[..., :3] for index in range(min(args.frames, source.count))]
        rows += compare(film.name, truth, 2)[0]
    return rows


def footage(name, size) -> list[np.ndarray]:
    """The gallery's, at 240 fps; None: in the gallery's size."""
    from gallery import scenes

    scenes.SIZE = size or scenes.SIZE
    folder = ROOT / "out" / "gallery" / name / ("footage" if size is None else f"footage {size[0]}")
    first = importlib.import_module(f"gallery.{name}").ITEM.footage(folder)
    with open_source(first) as source:
        return [source.read(index)[..., :3] for index in range(source.count)]


def scenes(args) -> list[dict]:
    return [row for name in args.scenes for row in scene(name, args)]


def scene(name, args) -> list[dict]:
    truth = footage(name, args.size)[args.start * FACTOR : (args.start + BOX) * FACTOR + 1]
    rows, rebuilt = compare(name, truth, FACTOR)
    kept = truth[::FACTOR]
    exposed = [exposure(truth[:-1])]
    for way in ("30 fps", "flow", "blend"):
        frames = kept[:-1]
        if way != "30 fps":
            frames = [frame for first, rest in zip(kept, rebuilt[way], strict=False) for frame in (first, *rest)]
        picture = exposure(frames)
        row = {"footage": name, "box": way, "frames": len(frames)}
        rows.append(row | {"psnr": psnr(picture, exposed[0]), "ssim": similarity(picture, exposed[0])})
        print("| {footage}, box | {box} | {psnr:.2f} | | {ssim:.4f} | | |".format(**rows[-1]), flush=True)
        exposed.append(picture)
    return rows


def exposure(frames) -> np.ndarray:
    """A 360° shutter over all of the frames."""
    total = 0
    for frame in frames:
        total = total + linear(frame).astype(np.float64)
    return codes((total / len(frames)).astype(np.float32))


def picture(path: Path) -> None:
    """A long exposure of the demo's film, without Smooth and with it, beside its first frame."""
    box = {"version": 2, "window": BOX * 2, "shutters": [{"name": "Box", "bars": [1] * BOX * 2}]}
    panels = [stills.Panel(read_codes(FILMS[0], SHOWN - 1)[ARM] / np.float32(255), "One frame")]
    with tempfile.TemporaryDirectory() as folder:
        for smooth, words in ((1, f"{BOX * 2} frames"), (FACTOR, f"{BOX * 2} frames, Smooth")):
            files = rendered(FILMS[0], box | {"inbetween": smooth}, [SHOWN], Path(folder, str(smooth)), "png")
            panels.append(stills.Panel(read_codes(*files)[ARM] / np.float32(255), words))
    stills.save(stills.sheet(stills.row(*panels)), path)


PARTS = {"films": films, "scenes": scenes}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--parts", type=listed(str), default=list(PARTS), help=",".join(PARTS))
    add("--films", type=listed(Path), default=FILMS, help="separated by commas")
    add("--frames", type=int, default=121, help="of each film, from the first on")
    add("--scenes", type=listed(str), default="rolling_shutter,pendulum", help="of gallery/ (%(default)s)")
    add("--size", type=lambda text: tuple(map(int, text.split("x"))), help="of the scenes' frames, WIDTHxHEIGHT")
    add("--start", type=int, default=1, help="first frame at 30 fps (%(default)s)")
    add("--docs", action="store_true", help="renew the manual's picture, docs/smooth.jpg, and measure nothing")
    add("--json", type=Path, help="where the rows are written")
    args = parser.parse_args()
    if args.docs:
        picture(ROOT / "docs" / "smooth.jpg")
        return 0
    try:
        rows = [row for part in args.parts for row in PARTS[part](args)]
    except MediaError as error:
        print(f"inbetween_quality: {error}", file=sys.stderr)
        return 2
    write_rows(args.json, rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
