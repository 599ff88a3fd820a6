"""Compare pictures with layers, and without, with the truth.

    python scripts/layer_truth.py [--output DIR] [--json FILE] [--size 320x180] [--samples 32]

Blender renders a subject and its background apart. The footage is one over the other, as 8-bit sRGB; the truth is each
exposed by its own shutter, and laid over one another in linear light. The subject's matte is its alpha (16 bits), what
Cryptomatte says, or comes from one stroke that moves as it does. The last scene is one_stroke.py's moving one, tracked.
PSNR is measured in the ring, where the subject is in any exposed frame and eight pixels around; "not exposed" is what
only a frame within reach shows. Elsewhere, all bits equal those without the layer. Needs Blender as a library (bpy).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from math import cos, pi, sin
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from comparing import ROOT, psnr, write_rows

from gallery import stills
from gallery.matte_contents import with_contents
from shutter_addon.compute.renderer import Renderer, open_compositor
from shutter_addon.compute.request import Request
from shutter_addon.core.frames import light
from shutter_addon.core.frames.frame_source import FrameSource
from shutter_addon.core.model.clip import Clip
from shutter_addon.core.model.effect import Effect
from shutter_addon.core.model.state_at import state_at
from shutter_addon.core.pixels import layering
from shutter_addon.core.recipes import recipe_file
from shutter_addon.media import open_source
from shutter_addon.media.matte_values import MatteValues
from shutter_addon.media.opening import MatteFile

COUNT, WINDOW, SHOWN = 33, 13, 16  # frames of the footage, of an exposure, and the shown one, from 0
WIDE = 16.0  # units of the scene in the picture's width
RING = 8
# What its matte comes from, and whether that is a layer.
WAYS = {
    "without the switch": ("true", False),
    "layer, true matte": ("true", True),
    "layer, Cryptomatte": ("cryptomatte", True),
    "layer, one stroke": ("stroke", True),
}
STROKE = np.array([(-1.1, 0.0), (1.1, 0.0)])  # through the subject, in its own units


@dataclass(frozen=True)
class Scene:
    """name; pan: how far the camera moves in a frame, speed: the subject in the picture, in units
    edge: pixels over which the renderer filters; hair: whether the outline has spikes
    slow: the subject hardly moves, and uncovers what is behind it after the window's end
    crossed: another one crosses it, behind it"""

    name: str
    pan: float = 0.0
    speed: float = 0.25
    edge: float = 1.5
    hair: bool = False
    slow: bool = False
    crossed: bool = False

    @property
    def subjects(self) -> list[str]:
        """The farthest first."""
        return ["other", "subject"] if self.crossed else ["subject"]

    def place(self, subject: str, frame: int) -> tuple[float, float]:
        """Where a subject is in the picture."""
        apart = frame - SHOWN
        if subject == "other":
            return 1.5 - 0.3 * apart, 0.2 * apart
        if self.slow:
            return (0.3 * (apart - WINDOW // 2) if apart > WINDOW // 2 else 0.0), 0.0
        return self.speed * apart, 0.5 * sin(apart / 4)


SCENES = (
    Scene("still camera, hard edges"),
    Scene("still camera, soft edges", edge=6.0),
    Scene("still camera, hair", hair=True),
    Scene("panning camera, hard edges", pan=0.12),
    Scene("panning camera, soft edges", pan=0.12, edge=6.0),
    Scene("panning camera, hair", pan=0.12, hair=True),
    Scene("still camera, seen once", slow=True),
    Scene("still camera, two that cross", crossed=True),
)


@dataclass(frozen=True)
class Case:
    """What is measured of a scene.

    parts: frames (count, H, W, 4) float of "ground" and of each subject, scene-linear and premultiplied
    subjects: the farthest first
    regions: gives them as regions of a recipe, by what their matte comes from and whether they are layers
    cryptomatte: files by subject; camera: its keys"""

    name: str
    parts: dict[str, np.ndarray]
    subjects: list[str]
    regions: Callable[[str, bool], list[dict]]
    cryptomatte: dict[str, MatteFile] = field(default_factory=dict)
    camera: list[dict] = field(default_factory=list)


class Memory(FrameSource):
    """Frames (count, H, W, 4) uint8 in memory."""

    def __init__(self, frames: np.ndarray):
        self.frames, self.dtype, self.transfer, self.alpha = frames, frames.dtype, "srgb", "opaque"
        self.count, self.height, self.width = frames.shape[:3]

    def read(self, index: int) -> np.ndarray:
        return self.frames[index]


class MemoryMatte:
    """Values (count, H, W) in memory, as a file of mattes."""

    fps = None

    def __init__(self, values: np.ndarray):
        self.values = values
        self.count, self.height, self.width = values.shape

    def open(self) -> MemoryMatte:
        return self

    def read(self, index: int) -> np.ndarray:
        return self.values[min(max(index, 0), self.count - 1)].astype(np.float32)

    def close(self) -> None:
        pass


def render(scene: Scene, folder: Path, size: tuple[int, int], samples: int) -> Case:
    """A scene, rendered once into the folder."""
    from gallery import scenes

    for part in ("ground", *scene.subjects):
        _begin(scenes, scene, [part], size, samples)
        scenes.render_frames(folder / part, COUNT, "OPEN_EXR", mode="RGBA", depth="32")
    for subject in scene.subjects:
        _begin(scenes, scene, ["ground", *scene.subjects], size, samples)
        scenes.write_matte(folder / f"cryptomatte {subject}", subject, subject)
        scenes.render_frames(folder / f"beside {subject}", COUNT, "OPEN_EXR")
    return Case(
        name=scene.name,
        parts={part: _read(folder / part) for part in ("ground", *scene.subjects)},
        subjects=scene.subjects,
        regions=lambda matte, layer: [_region(scene, size, subject, matte, layer) for subject in scene.subjects],
        cryptomatte={s: MatteFile(folder / f"cryptomatte {s}" / "0001.exr", f"{s}.V") for s in scene.subjects},
        camera=camera(scene),
    )


def tracked_board(folder: Path) -> Case:
    """The moving scene of one_stroke.py, with the stroke that the command tracks."""
    import one_stroke
    import one_stroke_scenes

    scene = one_stroke_scenes.SCENES[0]
    one_stroke_scenes.render_apart(scene, folder)
    parts = {"ground": _read(folder / "ground"), "board": _read(folder / "board")}
    _, footage = mattes(["board"], parts)
    (folder / "footage").mkdir(exist_ok=True)
    for number, picture in enumerate(footage, start=1):
        stills.save(codes(picture) / 255, folder / "footage" / f"{number:04}.png")
    (stroke,) = json.loads(recipe_file.dump(one_stroke.tracked(scene, folder)["thinned"]))["regions"]
    common = {"name": "board", "shutter": "Subject"}

    def regions(matte: str, layer: bool) -> list[dict]:
        if matte == "stroke":
            return [stroke | common | {"layer": layer}]
        return [common | {"kind": "matte", "path": "board", "layer": layer}]

    return Case(f"one stroke, {scene.name}", parts, ["board"], regions)


def _read(folder: Path) -> np.ndarray:
    with open_source(folder / "0001.exr") as source:
        return np.stack([source.read(index) for index in range(source.count)]).astype(np.float64)


def _begin(scenes: Any, scene: Scene, parts: list[str], size: tuple[int, int], samples: int) -> None:
    made = scenes.begin("#000000", 0.0, samples)
    made.render.resolution_x, made.render.resolution_y = size
    made.cycles.use_denoising, made.cycles.filter_width = False, scene.edge
    made.render.film_transparent = True
    scenes.camera((0, 0, 10), (0, 0, 0), 50)
    made.camera.data.type, made.camera.data.ortho_scale = "ORTHO", WIDE
    for part in parts:
        (_ground if part == "ground" else _subject)(scenes, scene, part)


def _ground(scenes: Any, scene: Scene, part: str) -> None:
    corners = [(-30, -30, 0), (30, -30, 0), (30, 30, 0), (-30, 30, 0)]
    ground = scenes.mesh(corners, [range(4)], (0, 0, 0), _textured("#20406a", "#e8d9a0", 3))
    ground.name = part
    scenes.animate(ground, COUNT, location=lambda frame: (-scene.pan * (frame - 1 - SHOWN), 0, 0))


def _subject(scenes: Any, scene: Scene, part: str) -> None:
    points = [(*point, 0.0) for point in _outline(scene.hair)]
    dark, high = ("#c03020", 2) if part == "subject" else ("#208040", 1)
    board = scenes.mesh(points, [range(len(points))], (0, 0, high), _textured(dark, "#f0f0e0", 5))
    board.name = part
    scenes.animate(board, COUNT, location=lambda frame: (*scene.place(part, frame - 1), high))


def _outline(hair: bool) -> list[tuple[float, float]]:
    points = []
    for i in range(360):
        angle = i * pi / 180
        reach = 1.9 * (1 + 0.12 * cos(3 * angle)) + (0.5 if hair and i % 6 < 2 else 0.0)
        points.append((reach * cos(angle), 1.1 * reach * sin(angle)))
    return points


def _textured(dark: str, bright: str, scale: float):
    """A material that shines by a pattern, and so has no shadow, and throws none."""
    import bpy

    from gallery import scenes

    material = scenes.glow(dark, 1.0)
    tree = material.node_tree
    noise, ramp, place = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexNoise", "ValToRGB", "TexCoord"))
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = scale, 4.0
    for element, color, position in zip(ramp.color_ramp.elements, (dark, bright), (0.4, 0.6), strict=True):
        element.color, element.position = scenes.linear(color), position
    emission = next(node for node in tree.nodes if isinstance(node, bpy.types.ShaderNodeEmission))
    tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], emission.inputs["Color"])
    return material


def measure(case: Case, folder: Path) -> list[dict]:
    """A row for each way to take its picture, with the pictures in the folder."""
    seen, footage = mattes(case.subjects, case.parts)
    frames = np.rint(255 * light.to_encoded(np.concatenate([footage, np.ones_like(footage[..., :1])], -1).clip(0, 1)))
    source = Memory(frames.astype(np.uint8))
    true = {subject: MemoryMatte(np.rint(values * 65535) / 65535) for subject, values in seen.items()}
    files = {"true": true, "cryptomatte": case.cryptomatte, "stroke": {}}
    covered = 1 - np.prod([1 - values for values in seen.values()], axis=0)
    ring = near((covered[window()] > 0).any(axis=0), RING)
    still, long = np.eye(WINDOW)[WINDOW // 2], np.ones(WINDOW)
    rows = []
    for kind, own, rest in (("sharp subject", still, long), ("clean trail", long, still)):
        truth = exposed([case.parts[subject] for subject in case.subjects], case.parts["ground"], own, rest)
        clear, strips = covered[window()][rest > 0].min(axis=0) < 1 - layering.CLEAR, [truth]
        for way, (matte, layer) in WAYS.items():
            if matte == "cryptomatte" and not case.cryptomatte:
                continue
            picture = shown(source, made(case, (own, rest), matte, layer), files[matte])
            strips.append(picture)
            row = {"scene": case.name, "picture": kind, "way": way, "ring": decibels(picture, truth, ring & clear)}
            hidden = ring & ~clear
            row["plate"] = decibels(picture, truth, hidden) if hidden.sum() > 50 else None
            if way == "layer, true matte":
                without = shown(source, parsed(shutters=[{"name": "Rest", "bars": list(rest)}]), {})
                row["same bits elsewhere"] = bool(np.array_equal(picture[~ring], without[~ring]))
            rows.append(row)
        sheet = np.concatenate([codes(strip) for strip in strips], axis=1)
        stills.save(sheet / 255, folder / f"{case.name}, {kind}.png")
    return rows


def mattes(subjects: list[str], parts: dict[str, np.ndarray]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """How much (count, H, W) of each subject is seen, and the footage (count, H, W, 3): each over those before."""
    footage, seen = parts["ground"][..., :3], {}
    for subject in subjects:
        alpha = parts[subject][..., 3].clip(0, 1)
        seen = {other: values * (1 - alpha) for other, values in seen.items()} | {subject: alpha}
        footage = parts[subject][..., :3] + (1 - alpha[..., None]) * footage
    return seen, footage


def window() -> slice:
    return slice(SHOWN - WINDOW // 2, SHOWN + WINDOW // 2 + 1)


def exposed(subjects: list[np.ndarray], ground: np.ndarray, own: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """The truth (H, W, 3), scene-linear: all exposed apart, one over the other."""
    picture = np.einsum("k,khwc->hwc", rest / rest.sum(), ground[window()])[..., :3]
    for subject in subjects:
        front = np.einsum("k,khwc->hwc", own / own.sum(), subject[window()])
        picture = front[..., :3] + (1 - front[..., 3:]) * picture
    return picture


def made(case: Case, bars: tuple, matte: str, layer: bool) -> Effect:
    """The recipe of a picture. bars: of the subjects, and of all else; matte, layer: see WAYS"""
    own, rest = bars
    return parsed(
        shutters=[{"name": "Rest", "bars": list(rest)}, {"name": "Subject", "bars": list(own)}],
        regions=case.regions(matte, layer),
        border=True,
        edge_aware=1.0 if matte == "stroke" else 0.0,
        camera=case.camera,
    )


def parsed(**data) -> Effect:
    return recipe_file.parse(json.dumps({"version": 1, "window": WINDOW, "position": "center"} | data))


def _region(scene: Scene, size: tuple[int, int], subject: str, matte: str, layer: bool) -> dict:
    """A subject by a matte, or by a stroke that moves as it does."""
    common = {"name": subject, "shutter": "Subject", "layer": layer}
    if matte != "stroke":
        return common | {"kind": "matte", "path": subject}
    size_of = np.array([WIDE, WIDE * size[1] / size[0]])
    keys = [{"frame": k + 1, "location": list(scene.place(subject, k) / size_of)} for k in range(COUNT)]
    stroke = (0.5 + STROKE / size_of).tolist()
    return common | {"kind": "line", "width": 0.08, "strokes": [stroke], "keys": keys}


def camera(scene: Scene) -> list[dict]:
    """The keys of a camera that pans: where what it sees lies."""
    if not scene.pan:
        return []
    return [{"frame": frame + 1, "location": [-scene.pan * (frame - SHOWN) / WIDE, 0]} for frame in range(COUNT)]


def shown(source: Memory, given: Effect, files: dict) -> np.ndarray:
    """The picture (H, W, 3), scene-linear, of the shown frame. files: of mattes, by subject"""
    effect = with_contents(given.for_picture(source.width / source.height), lambda region: files[region.content.path])
    clip = Clip(width=source.width, height=source.height, count=source.count)
    renderer = Renderer(open_compositor(), source, MatteValues(source.width, source.height))
    try:
        return renderer.picture(Request(*state_at(effect, clip, SHOWN + 1.0)))[..., :3].copy()
    finally:
        renderer.close()


def near(mask: np.ndarray, reach: int) -> np.ndarray:
    """A mask (H, W) and all within so many pixels of it, along rows and columns."""
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1))) > 0


def codes(picture: np.ndarray) -> np.ndarray:
    """8-bit sRGB codes, not rounded."""
    return 255 * light.to_encoded(picture.astype(np.float64).clip(0, 1))


def decibels(picture: np.ndarray, truth: np.ndarray, where: np.ndarray) -> float:
    return psnr(np.rint(codes(picture))[where], codes(truth)[where])


HEAD = """| scene | picture | way | ring, dB | not exposed, dB | same bits elsewhere |
|---|---|---|--:|--:|---|"""


def line(row: dict) -> str:
    plate = "" if row["plate"] is None else f"{row['plate']:.1f}"
    same = {None: "", True: "yes", False: "NO"}[row.get("same bits elsewhere")]
    return f"| {row['scene']} | {row['picture']} | {row['way']} | {row['ring']:.1f} | {plate} | {same} |"


def main() -> None:
    parser = argparse.ArgumentParser("layer_truth", description="Layers beside the truth.")
    parser.add_argument("--output", type=Path, default=ROOT / "out" / "layer_truth", metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    parser.add_argument("--size", default="320x180", help="of the pictures")
    parser.add_argument("--samples", type=int, default=32, help="of each pixel")
    arguments = parser.parse_args()
    size, rows = tuple(map(int, arguments.size.split("x"))), []
    print(HEAD)
    for number in range(len(SCENES) + 1):
        folder = arguments.output / str(number)
        is_tracked = number == len(SCENES)
        case = tracked_board(folder) if is_tracked else render(SCENES[number], folder, size, arguments.samples)
        found = measure(case, arguments.output)
        print(*map(line, found), sep="\n", flush=True)
        rows += found
    write_rows(arguments.json, rows)


if __name__ == "__main__":
    main()
