"""Scenes in which a subject's true alpha is known, in every frame: a figure that walks, with a cape or hair, blurred,
noisy, soft, behind posts, before a camera that moves. For scripts/carried_mattes.py.

A figure of flat, painted parts is drawn FINE times as large, in linear light, the farthest part first. Lengths are
pixels of the picture, y down.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, pi, radians, sin
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from shutter_addon.core.frames.light import to_encoded

WIDTH, HEIGHT, COUNT = 640, 360, 41
FINE = 3
SHUTTER = 5  # moments of an exposure that is open for a while


@dataclass(frozen=True)
class Scene:
    """speed: pixels a frame; pan: of the camera; swing: degrees of the limbs; cape, hair: whether it has them
    exposure: share of a frame that the shutter is open; noise: levels; soft: pixels by which the figure is out of
    focus; posts: whether it walks behind some"""

    name: str
    speed: float = 3.0
    pan: float = 0.0
    swing: float = 28.0
    cape: bool = False
    hair: bool = False
    exposure: float = 0.0
    noise: float = 0.0
    soft: float = 0.0
    posts: bool = False


SCENES = (
    Scene("walking"),
    Scene("moving camera", speed=0.5, pan=4.0),
    Scene("cloth", cape=True),
    Scene("hair", hair=True),
    Scene("blurred", speed=6.0, swing=40.0, exposure=0.6),
    Scene("noisy", noise=10.0),
    Scene("soft", soft=3.0),
    Scene("occluded", posts=True),
)

# Two colors of linear light, between which a sheet is mottled.
COLORS = {
    "ground": ((0.16, 0.20, 0.13), (0.34, 0.33, 0.24)),
    "skin": ((0.45, 0.27, 0.19), (0.55, 0.36, 0.26)),
    "jacket": ((0.20, 0.10, 0.08), (0.42, 0.2, 0.14)),
    "trousers": ((0.06, 0.06, 0.06), (0.2, 0.2, 0.24)),
    "cape": ((0.3, 0.28, 0.12), (0.5, 0.45, 0.2)),
    "hair": ((0.1, 0.06, 0.03), (0.2, 0.12, 0.06)),
    "post": ((0.2, 0.22, 0.26), (0.4, 0.42, 0.45)),
}
POSTS, POST = (200, 330, 460), 34  # where they begin, and how wide they are


def frames(scene: Scene) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pictures (HEIGHT, WIDTH, 3) uint8 and the subject's alpha (HEIGHT, WIDTH) float32, frame by frame."""
    random = np.random.default_rng(7)
    paints = {name: _texture(seed, colors) for seed, (name, colors) in enumerate(COLORS.items())}
    moments = np.linspace(0, scene.exposure, SHUTTER) if scene.exposure else [0.0]
    for frame in range(COUNT):
        exposed = [_moment(scene, paints, frame + moment) for moment in moments]
        light, alpha = (np.mean(each, axis=0, dtype=np.float32) for each in zip(*exposed, strict=True))
        codes = 255 * to_encoded(light) + scene.noise * random.standard_normal(light.shape)
        yield np.rint(np.clip(codes, 0, 255)).astype(np.uint8), alpha


def _texture(seed: int, colors) -> np.ndarray:
    """A mottled sheet (h, w, 3) of linear light between two colors, twice as large as the picture."""
    random, size = np.random.default_rng(seed), (HEIGHT * FINE, 2 * WIDTH * FINE)
    mottled = sum(
        weight * cv2.resize(random.random((size[0] // step + 2, size[1] // step + 2), np.float32), size[::-1])
        for step, weight in ((60, 0.4), (18, 0.35), (6, 0.25))
    )
    share = np.clip((mottled - 0.25) / 0.5, 0, 1)[..., None]
    return (np.array(colors[0], np.float32) * (1 - share) + np.array(colors[1], np.float32) * share).astype(np.float32)


def _moment(scene: Scene, paints: dict, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Linear light and alpha at a moment."""
    left = scene.pan * time
    ground = _warped(paints["ground"], np.eye(2), (-left * FINE, 0), (0, 0), (HEIGHT * FINE, WIDTH * FINE))
    color, alpha = np.zeros_like(ground), np.zeros((*ground.shape[:2], 1), np.float32)
    for points, paint, place in _parts(scene, time):
        _paint(color, alpha, points * FINE, paints[paint], place)
    if scene.soft:
        color, alpha = (cv2.GaussianBlur(each, (0, 0), scene.soft * FINE) for each in (color, alpha))
    light = color + (1 - alpha.reshape(*alpha.shape[:2], 1)) * ground
    for x in POSTS if scene.posts else ():
        columns = slice(int((x - left) * FINE), int((x - left + POST) * FINE))
        light[:, columns], alpha[:, columns] = paints["post"][:, : POST * FINE], 0
    return tuple(cv2.resize(each, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA) for each in (light, alpha))


def _paint(color: np.ndarray, alpha: np.ndarray, points: np.ndarray, sheet: np.ndarray, place) -> None:
    """Lays a polygon over what is there; place: where its texture's middle lies, and how that is turned."""
    limit = np.array(color.shape[1::-1])
    low, high = np.clip(np.floor(points.min(axis=0)) - 1, 0, limit), np.clip(np.ceil(points.max(axis=0)) + 2, 0, limit)
    if (low >= high).any():
        return
    (x, y), (right, bottom) = low.astype(int), high.astype(int)
    cover = np.zeros((bottom - y, right - x), np.uint8)
    cv2.fillPoly(cover, [np.rint((points - low) * 16).astype(np.int32)], 255, cv2.LINE_AA, 4)
    share = (cover / np.float32(255))[..., None]
    (middle, turn), box = place, (slice(y, bottom), slice(x, right))
    linear = np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
    shift = np.array(middle) * FINE - linear @ (np.array(sheet.shape[1::-1]) / 2)
    color[box] += share * (_warped(sheet, linear, shift, low, cover.shape) - color[box])
    alpha[box] += share * (1 - alpha[box])


def _warped(sheet: np.ndarray, linear, shift, low, size: tuple[int, int]) -> np.ndarray:
    """A box (size) at `low` of a sheet that is turned and moved."""
    matrix = np.float32([[*row, to - start] for row, to, start in zip(linear, shift, low, strict=True)])
    return cv2.warpAffine(sheet, matrix, size[::-1], borderMode=cv2.BORDER_REFLECT)


def _parts(scene: Scene, time: float) -> Iterator[tuple[np.ndarray, str, tuple]]:
    """Polygons (n, 2), what they are painted with, and where and how that lies: the farthest first."""
    x = WIDTH / 2 + scene.speed * (time - COUNT / 2)
    y = 150 + 3 * sin(4 * pi * time / 27)
    swing = radians(scene.swing) * sin(2 * pi * time / 27 + 0.6)
    hip, neck = (x, y + 40), (x + 2, y - 38)
    if scene.cape:
        yield _cape(neck, time), "cape", (neck, 0.1 * sin(time / 3))
    yield from _limb((x + 2, y - 30), -0.9 * swing, 38, 10, "jacket", "skin", 0.5 * max(-swing, 0))
    yield from _limb(hip, swing, 46, 14, "trousers", "trousers", -0.8 * max(swing, 0))
    if scene.hair:
        for points in _hair((x + 4, y - 62), time):
            yield points, "hair", ((x, y), 0.0)
    yield _ellipse((x + 4, y - 60), 15, 19), "skin", ((x, y - 60), 0.0)
    yield _capsule((x, y - 30), (x, y + 38), 20, 16), "jacket", ((x, y), 0.0)
    yield from _limb(hip, -swing, 46, 14, "trousers", "trousers", -0.8 * max(-swing, 0))
    yield from _limb((x + 2, y - 30), 0.9 * swing, 38, 10, "jacket", "skin", 0.5 * max(swing, 0))


def _limb(root, angle: float, length: float, width: float, upper: str, lower: str, bend: float):
    joint = root[0] + length * sin(angle), root[1] + length * cos(angle)
    end = joint[0] + length * sin(angle + bend), joint[1] + length * cos(angle + bend)
    yield _capsule(joint, end, 0.8 * width, 0.6 * width), lower, (joint, -angle - bend)
    yield _capsule(root, joint, width, 0.8 * width), upper, (root, -angle)


def _capsule(first, last, wide: float, narrow: float) -> np.ndarray:
    ends = np.array([first, last], np.float64)
    angle = np.arctan2(*(ends[1] - ends[0])[::-1])
    turn = np.linspace(pi / 2, 3 * pi / 2, 12)
    around = [
        end + radius * np.stack([np.cos(turn + angle + more), np.sin(turn + angle + more)], axis=1)
        for end, radius, more in ((ends[0], wide, 0.0), (ends[1], narrow, pi))
    ]
    return np.concatenate(around)


def _ellipse(centre, a: float, b: float) -> np.ndarray:
    turn = np.linspace(0, 2 * pi, 40, endpoint=False)
    return np.array(centre) + np.stack([a * np.cos(turn), b * np.sin(turn)], axis=1)


def _cape(neck, time: float) -> np.ndarray:
    """Hangs from the neck, blown backward in waves."""
    down = np.linspace(0, 1, 24)[:, None]
    wave = 10 * down * np.sin(2 * pi * (1.4 * down - time / 9))
    front = np.array(neck) + np.concatenate([-6 - 8 * down + 0.5 * wave, 118 * down], axis=1)
    back = np.array(neck) + np.concatenate([-12 - 62 * down + wave, 108 * down + 0.4 * wave], axis=1)
    return np.concatenate([front, back[::-1]])


def _hair(head, time: float) -> Iterator[np.ndarray]:
    for i in range(26):
        angle = radians(170 + 7 * i) + 0.12 * sin(time / 2 + i)
        length = 30 + 8 * sin(2.4 * i)
        side, along = np.array([-sin(angle), cos(angle)]), np.array([cos(angle), sin(angle)])
        root = np.array(head) + 12 * along
        tip = root + length * along + (5 * sin(time / 2.5 + 0.7 * i), 6)
        yield np.array([root - 2.5 * side, root + 2.5 * side, tip])
