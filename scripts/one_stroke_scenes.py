"""Rendered scenes in which a subject's true mask and motion are known; for scripts/one_stroke.py.

Each is seen straight from above: a painted board moves over a ground, in the picture by a similarity.
Lengths are in units, of which the picture is 16 wide; frames count from 1. Needs Blender as a library (bpy).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, radians, sin
from pathlib import Path

import bpy
import numpy as np

from gallery import scenes

COUNT = 40
WIDE = 16.0
COVER = 10.6  # how wide the bar is: the board lies below it altogether for five frames
OUTLINE = [  # of the board, counter-clockwise
    (r * cos(a), r * sin(a))
    for i in range(72)
    for a in [i * pi / 36]
    for r in [2.1 * (1 + 0.16 * cos(3 * a) + 0.07 * sin(5 * a))]
]
STROKE = [(-0.75, -0.55), (0.75, -0.55)]  # on the board, in its own units


def still(_frame: float) -> tuple[float, float, float]:
    return 0.0, 0.0, 1.0


@dataclass(frozen=True)
class Scene:
    """board: x, y, turn in radians and scale at a frame; camera: x, y and zoom; cover: x of a bar over the board.

    ground, paint: colors; blur: how much of a frame's time the shutter is open; masked: whether masks are rendered."""

    name: str
    board: Callable[[float], tuple[float, float, float, float]]
    camera: Callable[[float], tuple[float, float, float]] = still
    cover: Callable[[float], float] | None = None
    ground: tuple[str, str] = ("#33503d", "#8fa06a")
    paint: tuple[str, str, str] = ("#d8803f", "#f0b878", "#8c3f22")
    blur: float = 0.0
    masked: bool = False
    start: int = COUNT // 2  # the frame at which the stroke is drawn


def across(frame: float, speed: float = 1.0) -> tuple[float, float, float, float]:
    """From left to right, turning, and a little nearer."""
    t = speed * (frame - COUNT / 2) / COUNT
    return 7 * t, 1.2 * sin(3 * t), radians(40) * t, 1 + 0.25 * t


def shaken(frame: float) -> tuple[float, float, float]:
    return 0.3 * sin(2.3 * frame) + 0.2 * sin(0.9 * frame), 0.25 * cos(1.7 * frame), 1.0


def away(frame: float) -> tuple[float, float, float, float]:
    """Out of the picture at the right, for frames 26 to 34 altogether, and nearly all the way back."""
    t = (frame - 10) / 20
    return 11.5 * sin(pi * min(max(t, 0), 2) / 2) ** 2, 0.4 * t, radians(8) * t, 1.0


SCENES = [
    Scene("moving", across, masked=True),
    Scene("similar", across, ground=("#8d6a48", "#a98660"), paint=("#a5825c", "#b8956c", "#84623f"), masked=True),
    Scene("blurred", lambda frame: across(frame, 1.6), blur=0.8, masked=True),
    Scene("shaken", lambda _frame: (0, 0, 0, 1), shaken),
    Scene("zoomed", lambda _frame: (0.5, 0.3, 0, 1), lambda frame: (0.02 * frame, 0, 1.5 ** ((frame - 20) / 20))),
    Scene("turned", lambda frame: (0, 0, radians(6) * (frame - 20), 1)),
    Scene("covered", lambda frame: across(frame, 0.6), cover=lambda frame: 1.4 * (frame - 28)),
    Scene("away", away, start=8),
]


def render(scene: Scene, folder: Path, size=(640, 360), count: int = COUNT, samples: int = 4) -> None:
    """Writes footage/0001.png … and, where nothing covers the board, mask/0001.png …: how much of a pixel the board
    covers, as encoded grey. What is there already stays."""
    scenes.SIZE = size
    _build(scene, count, samples)
    scenes.render_frames(folder / "footage", count)
    if scene.masked:
        _build(scene, count, samples, mask=True)
        scenes.render_frames(folder / "mask", count)


def render_apart(scene: Scene, folder: Path, size=(640, 360), count: int = COUNT, samples: int = 16) -> None:
    """Writes the board, and the ground with the board's shadow: board/0001.exr …, ground/0001.exr …, scene-linear and
    premultiplied. What is there already stays."""
    scenes.SIZE = size
    for part in ("board", "ground"):
        _build(scene, count, samples)
        bpy.context.scene.render.film_transparent = True
        for thing in bpy.data.objects:
            thing.hide_render = thing.type != "CAMERA" and (_is_board(thing) != (part == "board"))
        scenes.render_frames(folder / part, count, "OPEN_EXR", mode="RGBA")


def _is_board(thing) -> bool:
    return thing.parent is not None and not thing.name.startswith("Shadow")


def place(scene: Scene, frame: float, size) -> tuple[float, float, float, float]:
    """Where the board's center lies in the picture: x, y in fractions, y up; its turn in radians; and its scale, with
    which a unit is 1/16 of the width where it is 1."""
    frame += scene.blur / 2  # in the middle of the exposure
    (x, y, turn, scale), (left, up, zoom) = scene.board(frame), scene.camera(frame)
    wide = WIDE / zoom
    return (x - left) / wide + 0.5, (y - up) / (wide * size[1] / size[0]) + 0.5, turn, scale * zoom


def seen(scene: Scene, frame: float, size) -> float:
    """How much of the board is in the picture and not covered, 0 to 1."""
    rings = np.sqrt(np.linspace(0.02, 1, 40))[:, None, None]
    points = on_picture((rings * np.array(OUTLINE)).reshape(-1, 2), place(scene, frame, size), size)
    is_seen = ((points >= 0) & (points <= 1)).all(axis=1)
    if scene.cover:
        left, _, zoom = scene.camera(frame)
        x = (points[:, 0] - 0.5) * WIDE / zoom + left
        is_seen &= np.abs(x - scene.cover(frame)) > COVER / 2
    return float(is_seen.mean())


def on_picture(points, where, size) -> np.ndarray:
    """Points (n, 2) of the board in fractions of the picture, y up; where: an entry of `place`."""
    x, y, turn, scale = where
    rotation = np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
    return np.asarray(points) @ rotation.T * scale / WIDE * (1, size[0] / size[1]) + (x, y)


def _build(scene: Scene, count: int, samples: int, mask: bool = False) -> None:
    """Builds it: all emits light and nothing reflects it, which needs few samples.

    mask: the board shines white, all else is black"""
    scenes.begin("#000000", samples=samples, motion_blur=scene.blur)
    cycles = bpy.context.scene.cycles
    cycles.use_denoising, cycles.max_bounces = False, 0
    dark, white = (scenes.glow(color, 1.0) for color in ("#000000", "#ffffff"))
    _camera(scene, count)
    _sheet((32, 32, 0), dark if mask else _mottled(*scene.ground, 0.25, 2048))
    board = scenes.empty()
    if mask:
        _board(board, white, [white, white])
    else:
        _shadow(board)
        _board(board, _mottled(*scene.paint[:2], 0.1), [scenes.glow(color, 1.0) for color in scene.paint[1:]])

    scenes.animate(board, count, location=lambda key: (*scene.board(key)[:2], 0.0))
    scenes.animate(board, count, rotation_euler=lambda key: (0, 0, scene.board(key)[2]))
    scenes.animate(board, count, scale=lambda key: (scene.board(key)[3],) * 3)
    if scene.cover:
        bar = _sheet((COVER, 14, 1), dark if mask else _mottled("#6b7f9e", "#3d4a63", 0.2))
        scenes.animate(bar, count, location=lambda key: (scene.cover(key), 0, 1))
    for thing in bpy.data.objects:
        _straighten(thing)


def _sheet(size, material, parent=None):
    """A flat rectangle of a width and a height, at a height above the ground."""
    (x, y), z = np.divide(size[:2], 2), size[2]
    return scenes.mesh([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)], [range(4)], (0, 0, z), material, parent)


def _board(parent, base, paints) -> None:
    scenes.mesh([(x, y, 0) for x, y in OUTLINE], [range(len(OUTLINE))], (0, 0, 0.1), base, parent)
    for i, (x, y, radius) in enumerate([(-0.9, 0.9, 0.3), (0.1, 1.25, 0.22), (1.2, 0.7, 0.34), (-1.4, -0.1, 0.2)]):
        turns = np.linspace(0, 2 * pi, 33)[:-1]
        disc = [(radius * cos(a), radius * sin(a), 0) for a in turns]
        scenes.mesh(disc, [range(32)], (x, y, 0.15), paints[i % 2], parent)
    words = scenes.text("STROKE", 0.62, (0, 0.15, 0.15), paints[1], parent)
    words.rotation_euler.x = 0
    _sheet((1.3, 0.12, 0.15), paints[0], parent).location.y = -1.25


def _shadow(parent) -> None:
    material = bpy.data.materials.new("Shadow")
    scenes.shade(material, "BsdfTransparent")
    tree = material.node_tree
    y, x = (np.mgrid[:256, :256] + 0.5 - 128) * 6 / 256
    reach = np.hypot(x, y) - 2.1 * (1 + 0.16 * np.cos(3 * np.arctan2(y, x)) + 0.07 * np.sin(5 * np.arctan2(y, x)))
    passed = 1 - 0.55 / (1 + np.exp(8 * reach))
    _textured(tree, np.repeat(passed[..., None], 3, axis=-1), "Transparent BSDF")
    sheet = _sheet((6, 6, 0.05), material, parent)
    sheet.name, sheet.location = "Shadow", (0.15, -0.15, 0.05)


def _camera(scene: Scene, count: int) -> None:
    scenes.camera((0, 0, 20), (0, 0, 0), 50)
    seen = bpy.context.scene.camera
    seen.rotation_euler = 0, 0, 0
    seen.data.type = "ORTHO"
    scenes.animate(seen, count, location=lambda key: (*scene.camera(key)[:2], 20))
    scenes.animate(seen.data, count, ortho_scale=lambda key: WIDE / scene.camera(key)[2])


def _straighten(thing) -> None:
    for owner in (thing, thing.data):
        if owner is not None and owner.animation_data and owner.animation_data.action:
            for curve in owner.animation_data.action.layers[0].strips[0].channelbags[0].fcurves:
                for key in curve.keyframe_points:
                    key.interpolation = "LINEAR"


def _mottled(first: str, second: str, amount: float, size: int = 512):
    """A glowing material between two colors, by noise; amount: of finer noise, as a share of the brightness; size: of
    its image, in pixels."""
    material = scenes.glow(first, 1.0)
    rng = np.random.default_rng(len(first) + int(first[1:], 16))
    patches, fine = (_noise(rng, size, wave) for wave in (90, 16))
    share = np.clip(0.5 + patches / 2, 0, 1)[..., None]
    ends = [np.array(scenes.linear(color)[:3]) for color in (first, second)]
    colors = ((1 - share) * ends[0] + share * ends[1]) * np.exp(amount * fine[..., None])
    _textured(material.node_tree, colors, "Emission")
    return material


def _noise(rng, size: int, wave: float) -> np.ndarray:
    """Noise (size, size) of mean 0 and deviation 1, of waves about that long, in pixels."""
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(size), np.fft.fftfreq(size)))
    band = np.exp(-0.5 * (frequency * wave - 1) ** 2 / 0.4**2) + np.exp(-0.5 * (frequency * wave - 2) ** 2) / 3
    noise = np.fft.ifft2(np.fft.fft2(rng.standard_normal((size, size))) * band).real
    return noise / noise.std()


def _textured(tree, colors: np.ndarray, shader: str) -> None:
    """Gives a shader node the scene-linear colors (height, width, 3), stretched over the mesh."""
    image = bpy.data.images.new("Texture", *colors.shape[1::-1], float_buffer=True)
    pixels = np.concatenate([colors, np.ones_like(colors[..., :1])], axis=-1)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.pack()
    texture, where = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeTexCoord")
    texture.image = image
    tree.links.new(where.outputs["Generated"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], tree.nodes[shader].inputs["Color"])
