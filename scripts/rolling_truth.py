"""Compare *Rolling Shutter Repair* with a camera that reads all rows at once.

    python scripts/rolling_truth.py [--output DIR] [--json FILE] [--size 320x180] [--samples 64] [--readouts 25,50,95]

Cycles films a flat scene through a camera that shakes by up to 8 pixels a frame, with its rolling shutter, and with all
rows at once. The operator's own function repairs the first with the readout that Cycles has, and `shutter render` makes
three frames. Printed are the PSNR of footage and repair, how far a red pole's middle is from straight, in pixels, and
the readout that *Find Readout* finds. Needs Blender as a library (bpy).
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from comparing import codes, labelled, listed, measured, parser_of, psnr, read, rendered
from truth import place, render, stage

from gallery import stills
from shutter_addon import blender
from shutter_addon.blender.data import selection
from shutter_addon.blender.editing import add_effect, shutter_edits
from shutter_addon.blender.output import matte_export
from shutter_addon.features.rolling_shutter import readout
from shutter_addon.features.rolling_shutter.blender import rolling_shutter_repair as rolling_shutter
from shutter_addon.media import MediaError, open_source

COUNT, SHOWN = 22, (8, 11, 15)  # frames of the footage, and those that are compared, from 0
ROW = 0.02  # of the shutter's time, that a row is exposed
POLE = -1.2  # where the red one stands


def scene_of(size: tuple[int, int]) -> bpy.types.Scene:
    """A street of flat things behind a camera that shakes, and a card that moves by itself."""
    scene = stage(*size)
    for thing in [thing for thing in scene.objects if thing.type == "MESH"]:
        bpy.data.objects.remove(thing)
    rectangle = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    place(scene, "Wall", [rectangle * 14], [(0.2, 0.25, 0.32), (0.26, 0.3, 0.34)])
    windows = [rectangle * (0.5, 0.8) + (x, y) for x in np.arange(-10.5, 11, 2.1) for y in (-2.6, 0.4, 3.2)]
    place(scene, "Windows", windows, [(0.45, 0.42, 0.3), (0.5, 0.47, 0.36)], z="1")
    lamps = [rectangle * (0.1, 6) + (x, 0) for x in (-8.2, -4.7, 2.3, 5.8, 9.3)]
    place(scene, "Lamps", lamps, [(0.02, 0.02, 0.025)] * 2, z="2")
    place(scene, "Pole", [rectangle * (0.3, 6) + (POLE, 0)], [(0.6, 0.02, 0.02)] * 2, z="3")
    card = [rectangle * (0.7, 0.5)]
    place(scene, "Card", card, [(0.1, 0.45, 0.15), (0.7, 0.8, 0.3)], x="0.15*frame+1.5", y="-2", z="4")
    scene.camera.driver_add("location", 0).driver.expression = "0.9*sin(0.45*frame)+0.25*sin(1.1*frame+1)"
    scene.render.motion_blur_position = "CENTER"
    scene.render.use_motion_blur = True
    return scene


def filmed(scene, folder: Path, frames, share: float, samples: int) -> Path:
    """Footage whose readout is a share of a frame; 0: that reads all rows at once. Its first file."""
    scene.render.motion_blur_shutter = share / (1 - ROW) if share else ROW
    scene.cycles.rolling_shutter_type = "TOP" if share else "NONE"
    scene.cycles.rolling_shutter_duration = ROW
    folder.mkdir()
    files = [render(scene, folder / f"{frame + 1:04d}.exr", samples, frame) for frame in frames]
    return files[0]


def repaired(first: Path, share: float, folder: Path) -> list[np.ndarray]:
    """The shown frames (H, W, 3), scene-linear, of the footage that was repaired."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "edit.blend"))
    edit = bpy.context.scene
    source = edit.sequence_editor_create().strips.new_image("footage", str(first), 1, 1)
    for frame in range(1, COUNT):
        source.elements.append(f"{frame + 1:04d}.exr")
    strip, effect = add_effect.add_effect(edit, source)
    shutter_edits.start(effect)
    selection.choose(edit, strip)
    rolling_shutter.repair(edit, effect, strip, share, "TOP")
    recipe = matte_export.recipe_for(edit, effect, strip, folder / "recipe.json")
    return [read(file) for file in rendered(first, recipe, [frame + 1 for frame in SHOWN], folder)]


def bent(picture: np.ndarray) -> float:
    """How far the red pole's middle is from its mean place in any row, in pixels."""
    red = np.clip(picture[..., 0] - 3 * picture[..., 1] - 0.05, 0, None)
    middles = (red * np.arange(red.shape[1])).sum(axis=1) / np.maximum(red.sum(axis=1), 1e-9)
    return float(np.abs(middles - middles.mean()).max())


def found(first: Path) -> str:
    """The readout that is found, in per cent, or why it is not."""
    with open_source(first) as source:
        try:
            return f"{100 * readout.of_source(source, range(min(source.count, readout.FRAMES))):.1f} %"
        except MediaError as error:
            return str(error)


def measure(args, folder: Path) -> tuple[list[dict], np.ndarray]:
    """A row for each readout and shown frame, printed as they come, and the pictures side by side."""
    scene = scene_of(args.size)
    filmed(scene, folder / "truth", SHOWN, 0, args.samples)
    truths = [read(folder / "truth" / f"{frame + 1:04d}.exr") for frame in SHOWN]
    footage = {
        share: filmed(scene, folder / f"{share}", range(COUNT), share / 100, args.samples) for share in args.readouts
    }
    rows, strips = [], []
    for share, first in footage.items():
        work, words = folder / f"work {share}", found(first)
        work.mkdir()
        made = repaired(first, share / 100, work)
        plain = [read(first.with_name(f"{frame + 1:04d}.exr")) for frame in SHOWN]
        for frame, truth, own, before in zip(SHOWN, truths, made, plain, strict=True):
            row = {"readout": share, "frame": frame, "found": words, "truth": bent(truth), "bent": bent(own)}
            row |= {"psnr": psnr(codes(own), codes(truth)), "unrepaired": psnr(codes(before), codes(truth))}
            rows.append(row | {"skewed": bent(before)})
            print(WORDS.format(**rows[-1]), flush=True)
        texts = f"Readout {share} %", "repaired", "all rows at once"
        strips.append(labelled([codes(p) for p in (before, own, truth)], texts))
    return rows, stills.sheet(*strips)


HEAD = """| readout | found | frame | unrepaired, dB | repaired, dB | pole, unrepaired | repaired | truth |
|---|---|---|--:|--:|--:|--:|--:|"""
WORDS = "| {readout} % | {found} | {frame} | {unrepaired:.1f} | {psnr:.1f} | {skewed:.2f} | {bent:.2f} | {truth:.2f} |"


def main() -> None:
    parser = parser_of(__doc__, "rolling_truth", (320, 180), 64)
    parser.add_argument("--readouts", type=listed(int), default=[25, 50, 95], help="per cent of a frame")
    args = parser.parse_args()
    blender.register()
    measured("rolling_truth", parser, args, HEAD, measure)


if __name__ == "__main__":
    main()
