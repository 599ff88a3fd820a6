"""Compare a virtual shutter over sub-frames with the exposure that Cycles computes itself.

    python scripts/truth.py [--output DIR] [--json FILE] [--size 640x360] [--samples 1024] [--docs]

Cycles exposes one frame of a moving scene with a shutter curve, or with its rolling shutter. The same scene is rendered
as 64 sharp sub-frames, which `shutter render` exposes by a recipe with the same curve. Cycles' picture is the mean of
two with different seeds; "noise" compares these two, and "wrong" has a recipe that closes the shutter after half of its
time. DIR gets truth.png. Needs Blender as a library (bpy). docs/quality.md explains the rest.
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from comparing import ROOT, codes, labelled, measured, parser_of, read, rendered, similarity

from gallery import stills

SUBFRAMES = 64
# How open the shutter is at the points of Cycles' curve: at its begin, middle and end, straight in between.
CURVES = {"box": (1, 1, 1), "triangle": (0, 1, 0), "rolling": (1, 1, 1)}
POINTS = (0, 0.5, 1)
# How long Cycles' rolling shutter exposes a row, as a part of the shutter's time; a whole number of sub-frames.
ROW = 1 / 8
SEEDS = (0, 1, 2)  # of the sub-frames, and of Cycles' two
AMPLIFIED = 32


def stage(width: int, height: int) -> bpy.types.Scene:
    """A scene that moves from frame 0 to 1, seen flat: x from −8 to 8, y up, 0 in the middle.

    Surfaces emit and reflect nothing, so that samples differ only in place and time.
    """
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = width, height
    render.image_settings.file_format, render.image_settings.color_mode = "OPEN_EXR", "RGB"
    render.image_settings.color_depth = "32"
    render.motion_blur_position, render.motion_blur_shutter = "START", 1
    cycles.max_bounces = 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.data.type, scene.camera.data.ortho_scale, scene.camera.location.z = "ORTHO", 16, 10
    scene.collection.objects.link(scene.camera)

    rectangle = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    place(scene, "Floor", [rectangle * 9], [(0.16, 0.2, 0.26), (0.22, 0.26, 0.3)])
    posts = [rectangle * (0.25, 3.9) + (x, 0) for x in (-1.4, 0, 1.4)]
    place(scene, "Posts", posts, [(0.8, 0.3, 0.06), (0.75, 0.6, 0.4)], x="1.6 * frame - 5.6", z="1")
    place(scene, "Card", [rectangle * 1.1], [(0.1, 0.45, 0.15), (0.7, 0.8, 0.3)], x="-1", y="1.8 - 1.5 * frame", z="2")
    blade = np.array([(0, -0.1), (3, -0.5), (3, 0.5), (0, 0.1)])
    blades = [blade @ [[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]] for a in np.radians([20, 140, 260])]
    place(scene, "Propeller", blades, [(0.65, 0.08, 0.1), (0.9, 0.7, 0.7)], x="4.2", y="1", z="3", turn="0.55 * frame")
    disc = np.array([(np.cos(a), np.sin(a)) for a in np.linspace(0, 2 * np.pi, 48, endpoint=False)])
    place(scene, "Lamp", [disc * 0.16], [(1.6, 1.4, 1)] * 2, x="1.2 + 1.7 * frame", y="0.5 * frame - 3.6", z="4")
    return scene


def place(scene, name: str, faces, colours, x="0", y="0", z="0", turn="0") -> None:
    """Adds flat faces, checked in two colors; place and turn (radians) are expressions of the frame."""
    mesh = bpy.data.meshes.new(name)
    ends = np.cumsum([len(face) for face in faces])
    indices = [range(end - len(face), end) for end, face in zip(ends, faces, strict=True)]
    mesh.from_pydata([(*corner, 0) for face in faces for corner in face], [], indices)
    mesh.materials.append(emission(name, colours))
    thing = bpy.data.objects.new(name, mesh)
    thing.cycles.motion_steps = 5
    paths = [("location", 0, x), ("location", 1, y), ("location", 2, z), ("rotation_euler", 2, turn)]
    for path, axis, expression in paths:
        thing.driver_add(path, axis).driver.expression = expression
    scene.collection.objects.link(thing)


def emission(name: str, colours) -> bpy.types.Material:
    """Light in a checker of two colors, scene-linear."""
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    kinds = ("ShaderNodeTexCoord", "ShaderNodeTexChecker", "ShaderNodeEmission", "ShaderNodeOutputMaterial")
    where, checker, emitter, out = (tree.nodes.new(kind) for kind in kinds)
    checker.inputs["Scale"].default_value = 2
    for number, colour in enumerate(colours, 1):
        checker.inputs[f"Color{number}"].default_value = (*colour, 1)
    tree.links.new(where.outputs["Object"], checker.inputs["Vector"])
    tree.links.new(checker.outputs["Color"], emitter.inputs["Color"])
    tree.links.new(emitter.outputs["Emission"], out.inputs["Surface"])
    material.cycles.emission_sampling = "NONE"
    return material


def subframes(scene, samples: int, folder: Path) -> Path:
    """Renders the sub-frames, scene-linear, and returns the first file.

    Each is the instant in the middle of its 64th: that is the mean time of what a bar stands for. They share one
    sequence of samples, each the next part of it: with seeds of their own, few samples leave ten times the error.
    """
    cycles, part = scene.cycles, samples // SUBFRAMES
    scene.render.use_motion_blur = False
    cycles.use_sample_subset, cycles.sample_subset_length = True, part
    for index in range(SUBFRAMES):
        cycles.sample_offset = index * part
        render(scene, folder / f"{index + 1:04d}.exr", part * SUBFRAMES, time=(index + 0.5) / SUBFRAMES)
    cycles.use_sample_subset = False
    return folder / "0001.exr"


def expose(scene, case: str, samples: int, folder: Path) -> list[np.ndarray]:
    """Two pictures (H, W, 3) by Cycles of a case, from frame 0 to 1, with half of the samples each; scene-linear."""
    curve = scene.render.motion_blur_shutter_curve
    for point, *position in zip(curve.curves[0].points, POINTS, CURVES[case], strict=True):
        point.location, point.handle_type = position, "VECTOR"
    curve.update()
    scene.render.use_motion_blur = True
    scene.cycles.rolling_shutter_type = "TOP" if case == "rolling" else "NONE"
    scene.cycles.rolling_shutter_duration = ROW
    return [read(render(scene, folder / f"{case}-{seed}.exr", samples // 2, seed=seed)) for seed in SEEDS[1:]]


def render(scene, file: Path, samples: int, frame: int = 0, time: float = 0, seed: int = SEEDS[0]) -> Path:
    scene.cycles.seed, scene.cycles.samples = seed, samples
    scene.frame_set(frame, subframe=time)
    bpy.ops.render.render()
    bpy.data.images["Render Result"].save_render(str(file), scene=scene)
    return file


def recipe(case: str) -> dict:
    """The recipe of a case; its bars are the curve in the middle of each sub-frame.

    A row of the rolling shutter is exposed for a part of the window: at the top the first, at the bottom the last, and
    displacement moves it in between (paper Figure 11).
    """
    middles = (np.arange(SUBFRAMES) + 0.5) / SUBFRAMES
    bars, regions = {"Shutter": np.interp(middles, POINTS, CURVES[case])}, []
    if case == "rolling":
        bars = {"Top": middles < ROW, "Bottom": middles > 1 - ROW}
        lines = {"Top": [[0, 1], [1, 1]], "Bottom": [[0, 0], [1, 0]]}
        # The thinnest line covers one row of pixels.
        regions = [{"shutter": name, "kind": "line", "width": 0, "strokes": [line]} for name, line in lines.items()]
    shutters = [{"name": name, "bars": values.astype(float).tolist()} for name, values in bars.items()]
    return {"version": 1, "window": SUBFRAMES, "shutters": shutters, "regions": regions}


def closed_early(effect: dict) -> dict:
    """The recipe with all its bars in the first half of the window."""
    shutters = [s | {"bars": s["bars"][::2] + [0.0] * (SUBFRAMES // 2)} for s in effect["shutters"]]
    return effect | {"shutters": shutters}


def composed(first: Path, effect: dict, folder: Path) -> np.ndarray:
    """The picture (H, W, 3), scene-linear, that the command makes of the sub-frames."""
    return read(*rendered(first, effect, [1], folder))


def compare(picture: np.ndarray, other: np.ndarray) -> dict:
    difference = apart(picture, other)
    largest, mean = int(difference.max()), float(difference.mean())
    return {"similarity": similarity(picture, other), "largest": largest, "mean": mean}


def apart(picture: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.abs(picture.astype(int) - other)


def measure(args, folder: Path) -> tuple[list[dict], np.ndarray]:
    """A row for each case and what it is compared with, printed as they come; and the pictures side by side."""
    scene = stage(*args.size)
    first = subframes(scene, args.samples, folder)
    rows, strips = [], []
    for case in CURVES:
        halves = expose(scene, case, args.samples, folder)
        ours = composed(first, recipe(case), folder / case)
        wrong = composed(first, closed_early(recipe(case)), folder / f"{case}-wrong")
        truth, one, other, ours, wrong = (codes(picture) for picture in (sum(halves) / 2, *halves, ours, wrong))
        for name, pair in (("ours", (truth, ours)), ("noise", (one, other)), ("wrong", (truth, wrong))):
            rows.append({"case": case, "picture": name} | compare(*pair))
            print("| {case} | {picture} | {similarity:.5f} | {largest} | {mean:.3f} |".format(**rows[-1]), flush=True)
        texts = f"{case}: Cycles", "virtual shutter", f"difference × {AMPLIFIED}", f"noise × {AMPLIFIED}"
        strips.append(labelled((truth, ours, amplified(truth, ours), amplified(one, other)), texts))
    return rows, stills.sheet(*strips)


def amplified(picture: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.clip(apart(picture, other) * AMPLIFIED, 0, 255).astype(np.uint8)


def main() -> None:
    parser = parser_of(__doc__, "truth", (640, 360), 1024)
    parser.add_argument("--docs", action="store_true", help="renew the picture of docs/quality.md, docs/truth.jpg")
    args = parser.parse_args()
    if args.samples < 1 or args.samples % SUBFRAMES:
        parser.error(f"--samples: {args.samples} is not a multiple of {SUBFRAMES}: each sub-frame has as many")
    head = "| case | compared with Cycles | SSIM | largest | mean |\n|---|---|---|---|---|"
    sheet = measured("truth", parser, args, head, measure)
    if args.docs:
        stills.save(stills.scaled(sheet, sheet.shape[1] // 2), ROOT / "docs" / "truth.jpg")


if __name__ == "__main__":
    main()
