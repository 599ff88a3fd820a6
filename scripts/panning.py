"""How close a panning shot made of a still camera's footage comes to what a camera that pans takes.

    python scripts/panning.py [--output DIR] [--json FILE]

The scene is gallery/panning.py's, rendered by Blender, once: the footage, and one picture that Cycles itself exposes
for as long, through a camera that pans with the scooter and stands at the shown frame as the still one does. A stroke
is drawn on the scooter at that frame, and tracked by `shutter track`; the exposure that follows it is made by `shutter
render`. Pictures are compared as 8-bit sRGB.

SSIM (Wang et al. 2004) is the mean over the pixels that the scooter and its rider cover, and over the whole picture;
detail is the mean gradient over those pixels, as a share of the still frame's. Needs Blender as a library (bpy).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from quality import similarity

from gallery import panning as scene
from shutter_addon.core.model.effect import Effect
from shutter_addon.core.recipes import recipe_file
from shutter_addon.media import open_source

ROOT = Path(__file__).resolve().parents[1]


def main() -> int:
    parser = argparse.ArgumentParser("panning", description="A panning shot beside the truth.")
    parser.add_argument("--output", type=Path, default=ROOT / "out" / "gallery" / "panning", metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    arguments = parser.parse_args()
    rows = measure(arguments.output.resolve())
    print("| picture | SSIM, subject | SSIM, all | detail |\n|---|---|---|---|")
    for row in rows:
        print("| {picture} | {subject:.4f} | {all:.4f} | {detail:.3f} |".format(**row))
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


def measure(folder: Path, samples: int = 64) -> list[dict]:
    """A row for each picture. samples: of the truth, for each pixel."""
    footage = scene.footage(folder / "footage")
    truth = codes(scene.truth(folder / "truth", samples))
    covered = codes(scene.mask(folder / "mask"))[..., 0] >= 188  # half of the light
    still = codes(footage, scene.FRAME - 1)
    following = tracked(footage, folder)
    pictures = {
        "a single frame": still,
        "plain exposure": exposed(footage, unfollowing(following), scene.FRAME, folder / "plain"),
        "panning shot": exposed(footage, following, scene.FRAME, folder / "following"),
        "Cycles, panning": truth,
    }
    return [
        {
            "picture": name,
            "subject": similarity(picture, truth, covered),
            "all": similarity(picture, truth),
            "detail": gradient(picture)[covered].mean() / gradient(still)[covered].mean(),
        }
        for name, picture in pictures.items()
    ]


def tracked(footage: Path, folder: Path) -> Effect:
    """The stroke's effect with the keys that the command writes."""
    (folder / "drawn.json").write_text(json.dumps(scene.drawn()), encoding="utf-8")
    options = ["--recipe", folder / "drawn.json", "--region", scene.NAME, "--frame", scene.FRAME]
    run("track", footage, *options, "--output", folder / "tracked.json")
    return recipe_file.load(folder / "tracked.json")


def unfollowing(effect: Effect) -> Effect:
    """The effect with shutters that follow nothing."""
    return replace(effect, shutters=tuple(replace(shutter, follow=None) for shutter in effect.shutters))


def exposed(footage: Path, effect: Effect, frame: int, folder: Path) -> np.ndarray:
    """The picture of an effect at a frame, by the command."""
    folder.mkdir(exist_ok=True)
    (folder / "recipe.json").write_text(recipe_file.dump(effect), encoding="utf-8")
    run("render", footage, "--recipe", folder / "recipe.json", "--output", folder, "--frames", frame)
    return codes(folder / f"{frame:04}.png")


def run(*arguments) -> None:
    command = [sys.executable, "-m", "shutter_addon", *map(str, arguments)]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)


def codes(first: Path, index: int = 0) -> np.ndarray:
    """A picture (H, W, 3) uint8 of a sequence, 8 or 16 bits deep."""
    with open_source(first) as source:
        picture = source.read(index)[..., :3]
    return np.rint(picture * (255 / np.iinfo(picture.dtype).max)).astype(np.uint8)


def gradient(picture: np.ndarray) -> np.ndarray:
    """How steep a picture's grey is at its pixels (H, W), in levels a pixel."""
    return np.hypot(*np.gradient(picture.mean(axis=2)))


if __name__ == "__main__":
    sys.exit(main())
