"""Compare sped-up footage with *Length: Timeline* with a camera whose scene runs as much faster.

    python scripts/timeline_truth.py [--output DIR] [--json FILE] [--size 320x180] [--samples 256] [--frames 1,3,5]

Cycles renders the scene of scripts/truth.py as sharp footage that moves by up to four pixels a frame. A recipe speeds
it up, eight times and along a ramp from 1 to 8, and exposes it by a shutter of 180° whose length is the timeline's. The
truth is Cycles' motion blur of half a frame, of the same scene whose clock runs as fast.

"not smooth" is without *Smooth* at 8×, "bars" with *Exposure Length: Frames*. A white rod runs over black along the
bottom; the length of its streak is that of an evenly lit one with the same second moment of light. Needs Blender as a
library (bpy).
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from comparing import codes, labelled, listed, measured, parser_of, read, rendered
from truth import compare, place, render, stage

from gallery import stills

# Frames of truth.py's scene that a frame of the footage lasts, and the timeline's frames that it is sped up over.
MOMENT, TIMELINE = 1 / 16, 6
WINDOW = 8  # filmed frames
ROD_WAY = 0.2  # a frame of the footage, of a picture 16 wide
FIRST = -7.2  # where the rod begins


def position(case: str, frame: float) -> float:
    """Which frame of the footage, from 0, a frame of the timeline begins with, from 0."""
    return 8 * frame if case == "eight times" else frame + 3.5 * frame**2 / TIMELINE


CASES = {"eight times": "8*frame", "ramp": f"(frame+{3.5 / TIMELINE}*frame*frame)"}


def filmed(size: tuple[int, int], clock: str = "frame", shutter: float = 0.0) -> bpy.types.Scene:
    """The scene, whose frame of the footage is what `clock` says of Blender's. shutter: how long it is open"""
    scene = stage(*size)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = shutter > 0, shutter or 1
    rectangle = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    place(scene, "Night", [rectangle * (9, 0.6) + (0, -3.9)], [(0, 0, 0)] * 2, z="5")
    place(scene, "Rod", [rectangle * (0.15, 1)], [(0.9, 0.9, 0.9)] * 2, x=f"{FIRST}+{ROD_WAY / MOMENT}*frame", y="-4.4",
          z="6")  # fmt: skip
    for thing in scene.objects:
        for curve in thing.animation_data.drivers if thing.animation_data else ():
            curve.driver.expression = curve.driver.expression.replace("frame", f"({MOMENT}*{clock})")
    return scene


def recipe(case: str, *, timeline: bool = True, smooth: int = 8) -> dict:
    """The recipe: time as it is keyed twice a frame of the timeline."""
    shutter = {"name": "180°", "bars": [1.0] * (WINDOW // 2) + [0.0] * (WINDOW // 2)}
    keys = [{"frame": 1 + at / 2, "value": 1 + position(case, at / 2)} for at in range(2 * TIMELINE + 1)]
    shutters = [shutter | ({"length": "timeline"} if timeline else {})]
    said = {"version": 2, "window": WINDOW, "shutters": shutters, "regions": [], "time": keys}
    return said | {"inbetween": smooth, "stop_at_cuts": False}


def exposed(folder: Path, said: dict, frames: list[int], name: str) -> list[np.ndarray]:
    """Pictures (H, W, 3), scene-linear, that the command makes of the footage at frames of the timeline, from 0."""
    return [read(file) for file in rendered(folder / "0001.exr", said, [k + 1 for k in frames], folder / name)]


def spread(picture: np.ndarray) -> float:
    """The variance of the rod's light along its row, in pixels²."""
    line = picture[round(picture.shape[0] * 0.89) : -1, :, 1].mean(axis=0)
    x = np.arange(len(line))
    middle = (line * x).sum() / line.sum()
    return float((line * (x - middle) ** 2).sum() / line.sum())


def length(picture: np.ndarray, still: np.ndarray) -> float:
    """How long the rod's streak is, in pixels, beyond the rod's own width."""
    return float(np.sqrt(max(12 * (spread(picture) - spread(still)), 0)))


def measure(args, folder: Path) -> tuple[list[dict], np.ndarray]:
    """A row for each case, frame and way, and the pictures side by side."""
    scene = filmed(args.size)
    count = 8 * (max(args.frames) + 1) + WINDOW + 1
    for index in range(count):
        render(scene, folder / f"{index + 1:04d}.exr", max(args.samples // 8, 16), index)
    still = read(folder / "0002.exr")
    ways = {"timeline": {}, "not smooth": {"smooth": 1}, "bars": {"timeline": False}}
    rows, strips = [], []
    for case, clock in CASES.items():
        scene = filmed(args.size, clock, shutter=0.5)
        truths = [render(scene, folder / f"{case}-{frame}.exr", args.samples, frame) for frame in args.frames]
        made = {way: exposed(folder, recipe(case, **said), args.frames, f"{case} {way}") for way, said in ways.items()}
        for at, (frame, truth) in enumerate(zip(args.frames, map(read, truths), strict=True)):
            speed = (position(case, frame + 0.5) - position(case, frame)) * 2
            for way, pictures in made.items():
                own, pixels = length(pictures[at], still), length(truth, still)
                row = {"case": case, "frame": frame, "speed": speed, "picture": way, "length": own, "truth": pixels}
                rows.append(row | compare(codes(truth), codes(pictures[at])))
                print(WORDS.format(**rows[-1]), flush=True)
            shown = [codes(p) for p in (truth, made["timeline"][at], made["bars"][at])]
            strips.append(labelled(shown, [f"{case}, frame {frame}: Cycles", "Length: Timeline", "Length: Bars"]))
    return rows, stills.sheet(*strips)


WORDS = "| {case} | {frame} | {speed:.2f} | {picture} | {similarity:.4f} | {mean:.2f} | {length:.2f} | {truth:.2f} |"


def main() -> None:
    parser = parser_of(__doc__, "timeline_truth", (320, 180), 256)
    parser.add_argument("--frames", type=listed(int), default=[1, 3, 5], help="of the timeline, from 0")
    args = parser.parse_args()
    if not all(0 <= frame < TIMELINE for frame in args.frames):
        parser.error(f"--frames: the timeline goes from 0 to {TIMELINE - 1}")
    head = "| case | frame | speed | picture | SSIM | mean | length | Cycles' |\n|---|---|---|---|---|---|---|---|"
    measured("timeline_truth", parser, args, head, measure)


if __name__ == "__main__":
    main()
