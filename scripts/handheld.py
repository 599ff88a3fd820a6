"""How close a long exposure that was held in the hand comes to one on a tripod, when it follows the camera.

    python scripts/handheld.py [--output DIR] [--json FILE]

The scene is gallery/handheld.py's, rendered by Blender, once: the footage of a camera that shakes, and the same frames
through one that stands as the first does in the middle of the shown frame. The truth is the mean of these in linear
light. The camera is tracked by `shutter track --camera`, and the exposure that follows it made by `shutter render`.
Pictures are compared as 8-bit sRGB, by their SSIM (Wang et al. 2004): over the pixels that every frame has seen, by the
tracked motion; and over the whole picture, at whose borders the frames that do not reach there go on as their last
pixels. Needs Blender as a library (bpy).
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from panning import exposed, run, unfollowing
from quality import similarity

from gallery import handheld as scene
from shutter_addon.core.frames import light
from shutter_addon.core.model import motions
from shutter_addon.core.model.effect import Effect
from shutter_addon.core.recipes import recipe_file
from shutter_addon.media import open_source

ROOT = Path(__file__).resolve().parents[1]


def main() -> int:
    parser = argparse.ArgumentParser("handheld", description="A long exposure held in the hand, beside a tripod's.")
    parser.add_argument("--output", type=Path, default=ROOT / "out" / "gallery" / "handheld", metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    arguments = parser.parse_args()
    found = measure(arguments.output.resolve())
    print("| picture | SSIM, seen by every frame | SSIM, all |\n|---|---|---|")
    for row in found["rows"]:
        print("| {picture} | {seen:.4f} | {all:.4f} |".format(**row))
    print("Seen by every frame: {seen:.1%} of the picture; tracked within {off:.2f} pixels".format(**found))
    if arguments.json:
        arguments.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 0


def measure(folder: Path) -> dict:
    """rows: of each picture its similarity; seen: the share of the pixels that every frame has seen; off: how far a
    corner of the picture is from where the scene's camera has it, in pixels, at the worst frame."""
    footage, steady = scene.footage(folder / "footage"), scene.steady(folder / "steady")
    following = tracked(footage, folder)
    truth = encoded(scene.exposed(steady))
    with open_source(footage) as source:
        single = source.read(scene.FRAME - 1)[..., :3].astype(np.float32)
    size = truth.shape[1::-1]
    seen = seen_by_all(following, size)
    pictures = {
        "a single frame": encoded(single),
        "plain exposure": exposed(footage, unfollowing(following), scene.FRAME, folder / "plain"),
        "following the camera": exposed(footage, following, scene.FRAME, folder / "following"),
    }
    rows = [
        {"picture": name, "seen": similarity(picture, truth, seen), "all": similarity(picture, truth)}
        for name, picture in pictures.items()
    ]
    return {"rows": rows, "seen": float(seen.mean()), "off": off(following, size)}


def encoded(picture: np.ndarray) -> np.ndarray:
    """A scene-linear picture as 8-bit sRGB."""
    return np.rint(255 * np.clip(light.to_encoded(picture), 0, 1)).astype(np.uint8)


def tracked(footage: Path, folder: Path) -> Effect:
    """The effect with the keys that the command writes."""
    (folder / "held.json").write_text(json.dumps(scene.held()), encoding="utf-8")
    options = ["--recipe", folder / "held.json", "--camera", "--frame", scene.FRAME, "--all-keys"]
    run("track", footage, *options, "--output", folder / "tracked.json")
    return recipe_file.load(folder / "tracked.json")


def motion(effect: Effect, frame: int, size) -> motions.Similarity:
    """From the shown frame to another one, as the keys have it."""
    camera = effect.for_picture(size[0] / size[1]).camera
    ends, centre = (camera.placement(scene.FRAME), camera.placement(frame)), camera.centre(frame)
    return motions.motion_between(*ends, centre, centre, size)


def seen_by_all(effect: Effect, size) -> np.ndarray:
    """The pixels (h, w) bool of the shown frame that lie in every frame of its window."""
    y, x = np.mgrid[: size[1], : size[0]]
    places = [motion(effect, frame, size)(x + 1j * y) for frame in range(1, scene.COUNT + 1)]
    width, height = np.subtract(size, 1)
    inside = [(p.real >= 0) & (p.real <= width) & (p.imag >= 0) & (p.imag <= height) for p in places]
    return np.all(inside, axis=0)


def off(effect: Effect, size) -> float:
    corners = np.array([0, size[0] - 1, 1j * (size[1] - 1), complex(size[0] - 1, size[1] - 1)])
    frames = range(1, scene.COUNT + 1)
    return max(
        float(np.abs(motion(effect, frame, size)(corners) - scene.seen(frame, corners, size)).max()) for frame in frames
    )


if __name__ == "__main__":
    sys.exit(main())
