"""How close moments between frames come to frames that were left out, beside other ways, measured in one run.

    python scripts/inbetween_quality.py [--films A.mp4,B.avi] [--frames 121] [--scenes A,B] [--parts films,scenes]
                                        [--table FILE] [--json FILE] [--picture FILE]

films: every second frame is dropped and rebuilt. PSNR and SSIM are of 8-bit pictures.
scenes: of footage of the gallery, rendered at 240 fps, every eighth frame is kept, the others are rebuilt; and a box
    shutter over four of the kept frames is compared with the same over all 32.

Ways: "flow" is shutter_addon.media.flow's, "blend" mixes both neighbours in linear light, "repeat" shows the earlier
one, "minterpolate" is `ffmpeg -vf minterpolate=mi_mode=mci`, taken from PATH. Its frames are matched by those that it
was given and returns. Footage that is not there yet is rendered, which needs Blender as a library (bpy).
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

import cv2
import numpy as np
from comparing import ROOT, codes, listed, psnr, similarity, write_rows

from shutter_addon.core.frames import light
from shutter_addon.core.frames.planes import as_rgba
from shutter_addon.media import MediaError, flow, open_source

FILMS = [ROOT / "assets" / name for name in ("bigbuckbunny.mp4", "pedestrians.avi")]
FACTOR = 8  # 240 fps from 30
BOX = 4  # kept frames that the box exposes


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
        print(line(row), flush=True)
    return rows, rebuilt


def line(row) -> str:
    numbers = "{psnr:.2f} | {worst psnr:.2f} | {ssim:.4f} | {worst ssim:.4f} | {seconds:.2f}".format(**row)
    return f"| {row['footage']} | {row['way']} | {numbers} |"


def films(args) -> list[dict]:
    rows = []
    for film in args.films:
        with open_source(film) as source:
            truth = [source.read(index)[..., :3] for index in range(min(args.frames, source.count))]
        rows += compare(film.name, truth, 2)[0]
    return rows


def footage(name) -> list[np.ndarray]:
    """The gallery's, at 240 fps."""
    first = importlib.import_module(f"gallery.{name}").ITEM.footage(ROOT / "out" / "gallery" / name / "footage")
    with open_source(first) as source:
        return [source.read(index)[..., :3] for index in range(source.count)]


def scenes(args) -> list[dict]:
    return [row for name in args.scenes for row in scene(name, args)]


def scene(name, args) -> list[dict]:
    truth = footage(name)[args.start * FACTOR : (args.start + BOX) * FACTOR + 1]
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
    if args.picture and name == args.scenes[0]:
        few, many = f"{BOX} frames at 30 fps", f"30 fps, {FACTOR}x moments"
        save(args.picture, [(exposed[1], few), (exposed[2], many), (exposed[0], "240 fps")])
    return rows


def exposure(frames) -> np.ndarray:
    """A 360° shutter over all of the frames."""
    total = 0
    for frame in frames:
        total = total + linear(frame).astype(np.float64)
    return codes((total / len(frames)).astype(np.float32))


def save(path, labelled) -> None:
    """The pictures side by side, each with its words below."""
    columns = []
    for picture, words in labelled:
        shown = cv2.resize(picture, (640, 640 * picture.shape[0] // picture.shape[1]), interpolation=cv2.INTER_AREA)
        shown = cv2.copyMakeBorder(shown, 0, 40, 0, 8, cv2.BORDER_CONSTANT, value=(24, 24, 24))
        place = (8, shown.shape[0] - 13)
        cv2.putText(shown, words, place, cv2.FONT_HERSHEY_SIMPLEX, 0.7, (230, 230, 230), 1, cv2.LINE_AA)
        columns.append(shown)
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), np.hstack(columns)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])


PARTS = {"films": films, "scenes": scenes}


def parse(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--parts", type=listed(str), default=list(PARTS), help=",".join(PARTS))
    add("--films", type=listed(Path), default=FILMS, help="separated by commas")
    add("--frames", type=int, default=121, help="of each film, from the first on")
    add("--scenes", type=listed(str), default="rolling_shutter,pendulum", help="of gallery/ (%(default)s)")
    add("--start", type=int, default=1, help="first frame at 30 fps (%(default)s)")
    add("--picture", type=Path, help="where the first scene's box shutters are written, side by side")
    add("--json", type=Path, help="where the rows are written")
    add("--table", type=Path, help="where the films' and scenes' table is written, as Markdown")
    return parser.parse_args(arguments)


def main(arguments=None) -> int:
    args = parse(arguments)
    try:
        rows = [row for part in args.parts for row in PARTS[part](args)]
    except MediaError as error:
        print(f"inbetween_quality: {error}", file=sys.stderr)
        return 2
    write_rows(args.json, rows)
    if args.table:
        head = "| footage | way | PSNR | worst | SSIM | worst | s/frame |\n|---|---|---|---|---|---|---|\n"
        args.table.write_text(head + "".join(line(row) + "\n" for row in rows if "way" in row), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
