"""Compare exposures that follow with a camera that moves, or stands still, so itself.

    python scripts/following_truth.py [panning] [handheld] [--output DIR] [--json FILE]

panning: gallery/panning.py's scene by a still camera, and one picture that Cycles exposes as long through a camera that
    pans with the scooter. A stroke on the scooter is tracked by `shutter track`. SSIM is over the pixels of scooter and
    rider; detail is the mean gradient over these, as a share of the still frame's.
handheld: gallery/handheld.py's scene by a camera that shakes, and by one that stands; the truth is the mean of the
    latter in linear light. SSIM is over the pixels that every frame has seen.

Needs Blender as a library (bpy).
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from comparing import ROOT, codes, read, read_codes, rendered, run, similarity, write_rows

from gallery import handheld as tripod_scene
from gallery import panning as pan_scene
from shutter_addon.core.model import motions
from shutter_addon.core.model.effect import Effect
from shutter_addon.core.recipes import recipe_file


def panning(folder: Path, samples: int = 64) -> list[dict]:
    """A row for each picture. samples: of the truth, for each pixel."""
    scene = pan_scene
    footage = scene.footage(folder / "footage")
    truth = read_codes(scene.truth(folder / "truth", samples))
    covered = read_codes(scene.mask(folder / "mask"))[..., 0] >= 188  # half of the light
    still = read_codes(footage, scene.FRAME - 1)
    following = tracked(footage, scene.drawn(), folder, "--region", scene.NAME, "--frame", scene.FRAME)
    pictures = {"a single frame": still} | exposed(footage, following, scene.FRAME, folder)
    return [
        {"picture": name, "part": similarity(picture, truth, covered), "all": similarity(picture, truth)}
        | {"detail": gradient(picture)[covered].mean() / gradient(still)[covered].mean()}
        for name, picture in (pictures | {"the truth": truth}).items()
    ]


def handheld(folder: Path) -> list[dict]:
    """A row for each picture, and one of the track: the share of the pixels that every frame has seen; and how far a
    corner of the picture is from where the scene's camera has it, in pixels, at the worst frame."""
    scene = tripod_scene
    footage, steady = scene.footage(folder / "footage"), scene.steady(folder / "steady")
    following = tracked(footage, scene.held(), folder, "--camera", "--frame", scene.FRAME, "--all-keys")
    truth = codes(scene.exposed(steady))
    size = truth.shape[1::-1]
    seen = seen_by_all(following, size)
    single = codes(read(footage, scene.FRAME - 1).astype(np.float32))
    pictures = {"a single frame": single} | exposed(footage, following, scene.FRAME, folder)
    rows = [
        {"picture": name, "part": similarity(picture, truth, seen), "all": similarity(picture, truth)}
        for name, picture in pictures.items()
    ]
    return [*rows, {"seen": float(seen.mean()), "off": off(following, size)}]


SCENES = {"panning": panning, "handheld": handheld}


def tracked(footage: Path, effect: dict, folder: Path, *options: object) -> Effect:
    """The effect with the keys that the command writes."""
    (folder / "drawn.json").write_text(json.dumps(effect), encoding="utf-8")
    run("track", footage, "--recipe", folder / "drawn.json", *options, "--output", folder / "tracked.json")
    return recipe_file.load(folder / "tracked.json")


def exposed(footage: Path, effect: Effect, frame: int, folder: Path) -> dict[str, np.ndarray]:
    """The picture of an effect at a frame, and that of its shutters when they follow nothing."""
    still = replace(effect, shutters=tuple(replace(shutter, follow=None) for shutter in effect.shutters))
    ways = {"plain exposure": still, "following": effect}
    return {name: read_codes(*rendered(footage, each, [frame], folder / name, "png")) for name, each in ways.items()}


def gradient(picture: np.ndarray) -> np.ndarray:
    """How steep a picture's grey is at its pixels (H, W), in levels a pixel."""
    return np.hypot(*np.gradient(picture.mean(axis=2)))


def motion(effect: Effect, frame: int, size) -> motions.Similarity:
    """From the shown frame of the hand-held scene to another one, as the keys have it."""
    camera = effect.for_picture(size[0] / size[1]).camera
    ends, centre = (camera.placement(tripod_scene.FRAME), camera.placement(frame)), camera.centre(frame)
    return motions.motion_between(*ends, centre, centre, size)


def seen_by_all(effect: Effect, size) -> np.ndarray:
    """The pixels (h, w) bool of the shown frame that lie in every frame of its window."""
    y, x = np.mgrid[: size[1], : size[0]]
    places = [motion(effect, frame, size)(x + 1j * y) for frame in range(1, tripod_scene.COUNT + 1)]
    width, height = np.subtract(size, 1)
    inside = [(p.real >= 0) & (p.real <= width) & (p.imag >= 0) & (p.imag <= height) for p in places]
    return np.all(inside, axis=0)


def off(effect: Effect, size) -> float:
    corners = np.array([0, size[0] - 1, 1j * (size[1] - 1), complex(size[0] - 1, size[1] - 1)])
    apart = [
        np.abs(motion(effect, frame, size)(corners) - tripod_scene.seen(frame, corners, size)).max()
        for frame in range(1, tripod_scene.COUNT + 1)
    ]
    return float(max(apart))


def main() -> None:
    parser = argparse.ArgumentParser("following_truth", description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=", ".join(SCENES))
    parser.add_argument("--output", type=Path, default=ROOT / "out" / "gallery", metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    arguments = parser.parse_args()
    found = {}
    for name in arguments.scenes or SCENES:
        found[name] = SCENES[name](arguments.output.resolve() / name)
        print(f"{name}:")
        for row in found[name]:
            print("  " + ", ".join(f"{key} {value}" for key, value in row.items()), flush=True)
    write_rows(arguments.json, found)


if __name__ == "__main__":
    main()
