"""A handheld long exposure: houses stand still as on a tripod, and the lights of cars trail.

The recipe has the keys that the command made, from a recipe without:
`shutter track footage/0001.exr --recipe R.json --camera --frame 16 --all-keys --output handheld.json`
The truth is the mean of the same frames through a camera that stands as the shaken one does at the shown frame.
"""

from __future__ import annotations

from math import atan2, cos, hypot, sin
from pathlib import Path

import numpy as np

from shutter_addon.core.frames import light
from shutter_addon.media import open_source

from . import stills
from .item import Item
from .stills import Panel

COUNT = 32
FRAME = 16  # that is shown: its window is all of them
OPEN = 0.25  # of a frame's time
EYE, TARGET = (0, -40, 2.6), (0, 0, 2.9)
LENS = 85  # of the camera, in mm of a 36 mm wide sensor
SPEED = 0.16  # of the cars, in metres a frame


def footage(folder: Path) -> Path:
    """Half-float EXR, so that lamps leave bright trails. The camera shakes: it turns about its center, and a long lens
    makes that a shift and a turn of the picture."""
    return _render(folder, _shake)


def steady(folder: Path) -> Path:
    """The same by a camera that stands as the other does in the middle of the shown frame."""
    return _render(folder, lambda _frame: (0.0, 0.0, 0.0))


def exposed(first: Path) -> np.ndarray:
    with open_source(first) as source:
        return np.mean([source.read(index)[..., :3].astype(np.float32) for index in range(source.count)], axis=0)


def seen(frame: float, places: np.ndarray, size) -> np.ndarray:
    """Where what is at places of the shown frame, complex in pixels, lies at another one: as the camera turns, the rays
    through the middle of its exposure."""
    focus, middle = LENS / 36 * size[0], complex(*np.subtract(size, 1)) / 2
    away = places - middle
    rays = np.stack([away.real, -away.imag, np.full(len(away), -focus)])  # right, up, behind
    right, up, behind = _turned(_shake(frame + OPEN / 2)).T @ _turned((0, 0, 0)) @ rays
    return middle - focus * (right - 1j * up) / behind


def _turned(angles) -> np.ndarray:
    """How the camera lies in the scene (3, 3), turned by tilt, roll and pan."""
    level = atan2(hypot(*np.subtract(TARGET, EYE)[:2]), EYE[2] - TARGET[2])
    (a, b), (c, d), (e, f) = ((cos(angle), sin(angle)) for angle in np.add(angles, (level, 0, 0)))
    tilt = np.array([[1, 0, 0], [0, a, -b], [0, b, a]])
    roll = np.array([[c, 0, d], [0, 1, 0], [-d, 0, c]])
    pan = np.array([[e, -f, 0], [f, e, 0], [0, 0, 1]])
    return pan @ roll @ tilt


def held() -> dict:
    """The recipe of one shutter that follows the camera: what Tripod sets up, before it tracks."""
    shutter = {"name": "Tripod", "color": [0.9, 0.62, 0.0], "bars": [1.0] * COUNT, "follow": "camera"}
    return {"version": 1, "window": COUNT, "position": "center", "shutters": [shutter]}


def _render(folder: Path, turned) -> Path:
    from . import scenes

    scenes.begin("#2a3c6e", 0.8, samples=4, motion_blur=OPEN)
    render = scenes.bpy.context.scene.render
    render.resolution_x, render.resolution_y = (side * 2 // 3 for side in scenes.SIZE)
    scenes.camera(EYE, TARGET, LENS)
    scenes.lamp("SUN", 0.25, (-6, -9, 8), color="#8fa8ff", size=0.2)
    _street(scenes)
    for lane, height, start in ((-4.6, 0.0, -7.0), (-4.6, 0.0, -1.5), (-7.2, 0.05, 6.0), (-7.2, 0.05, 0.5)):
        _car(scenes, lane, height, start)
    eye = scenes.bpy.context.scene.camera
    tilt, roll, pan = eye.rotation_euler
    scenes.animate(eye, COUNT, rotation_euler=lambda frame: tuple(np.add((tilt, roll, pan), turned(frame))))
    return scenes.render_frames(folder, COUNT, "OPEN_EXR")


def _shake(frame: float) -> tuple[float, float, float]:
    """Tilt, roll and pan in radians: a hand that sways and trembles; none in the middle of the shown frame."""

    def way(time):
        tilt = 0.28 * sin(0.23 * time + 0.4) + 0.05 * sin(0.9 * time)
        roll = 0.45 * sin(0.17 * time + 1.1) + 0.08 * sin(0.8 * time + 2)
        pan = 0.42 * sin(0.19 * time - 0.7) + 0.06 * sin(1.1 * time + 1)
        return np.radians((tilt, roll, pan))

    return tuple(way(frame) - way(FRAME + OPEN / 2))


def _street(scenes) -> None:
    """Houses at dusk, some windows lit, behind a street with lamps."""
    scenes.box((80, 60, 0.2), (0, -10, -0.1), scenes.paint("#3a3d44", 0.9))
    scenes.box((60, 2.2, 0.3), (0, -2.0, 0), scenes.paint("#8d877c", 0.9))
    line, tree = scenes.paint("#cfc9b8", 0.8), scenes.paint("#24382c", 0.9)
    for i in range(-6, 7):
        scenes.box((0.8, 0.1, 0.01), (1.7 * i, -5.9, 0.01), line)
    walls = "#b5654a", "#d6b878", "#7f9a8e", "#a78fae", "#c9bfae"
    for i, (width, height) in enumerate(((3.6, 4.6), (3.0, 5.6), (4.2, 4.0), (2.8, 5.2), (4.0, 4.8))):
        _house(scenes, (-7.4, -4.0, -0.3, 3.3, 6.8)[i], width, height, walls[i], i)
    post = scenes.paint("#20242c", 0.5, 0.6)
    for x in (-5.6, 1.5, 5.1):
        scenes.tube((x, -1.6, 0), (x, -1.6, 3.4), 0.05, post)
        scenes.ball(0.17, (x, -1.6, 3.5), scenes.glow("#ffd9a0", 5))
        scenes.lamp("POINT", 120, (x, -1.9, 3.4), color="#ffcf95", size=0.3)
    for x, size in ((-2.2, 0.7), (5.9, 0.9)):
        scenes.tube((x, -1.2, 0), (x, -1.2, 1.6), 0.09, post)
        for part in range(3):
            scenes.ball(size * (1 - 0.2 * part), (x + 0.1 * part, -1.2, 1.7 + 0.7 * part * size), tree)


def _house(scenes, x: float, width: float, height: float, color: str, number: int) -> None:
    wall, roof = scenes.paint(color, 0.9), scenes.paint(("#5a2f2a", "#39404d")[number % 2], 0.9)
    frame, door = scenes.paint("#e6dfd0", 0.7), scenes.paint(("#27496b", "#6b2b2b", "#2f5a3f")[number % 3], 0.5)
    panes = scenes.glow("#ffc978", 1.6), scenes.paint("#1c2536", 0.2), scenes.glow("#ffe6bd", 1.0)
    scenes.box((width, 5, height), (x, 2.5, height / 2), wall)
    gable = [(-width / 2 - 0.2, 0), (width / 2 + 0.2, 0), (0, 1.1 + 0.2 * (number % 2))]
    scenes.plate(gable, 5.3, (x, 2.5, height), roof)
    scenes.box((0.8, 0.1, 1.7), (x - width / 4, -0.03, 0.95), door)
    columns = max(2, round(width / 1.2))
    for floor in range(round(height / 1.5)):
        for column in range(columns):
            place = x + width * ((column + 0.5) / columns - 0.5), 0.9 + 1.35 * floor
            if floor or column:
                scenes.box((0.72, 0.08, 0.92), (place[0], -0.02, place[1] + 0.15), frame)
                pane = panes[(3 * number + 2 * column + 5 * floor) % 3]
                for side in (-0.155, 0.155):
                    scenes.box((0.28, 0.1, 0.8), (place[0] + side, -0.03, place[1] + 0.15), pane)


def _car(scenes, lane: float, height: float, start: float) -> None:
    """To the right on the far lane, to the left on the near one."""
    way = 1 if lane > -6 else -1
    car = scenes.empty((start, lane, height))
    paint, glass = scenes.paint("#22262e", 0.35), scenes.paint("#0c1018", 0.2)
    scenes.box((2.4, 1.1, 0.42), (0, 0, 0.42), paint, 0.08, car)
    scenes.box((1.3, 1.0, 0.4), (-0.1 * way, 0, 0.8), glass, 0.1, car)
    for side in (-0.35, 0.35):
        scenes.ball(0.085, (1.22 * way, side, 0.45), scenes.glow("#fff4d8", 30), car)
        scenes.ball(0.075, (-1.22 * way, side, 0.5), scenes.glow("#ff2a1a", 12), car)
    scenes.animate(car, COUNT, location=lambda frame: (start + way * SPEED * frame, lane, height))


def still(shot):
    truth = np.clip(light.to_encoded(exposed(steady(shot.footage.parents[1] / "steady"))), 0, 1)
    plain = np.clip(light.to_encoded(exposed(shot.footage)), 0, 1)
    return stills.sheet(
        stills.row(Panel(shot.source(FRAME), "One handheld frame"), Panel(plain, f"{COUNT} frames, averaged")),
        stills.row(Panel(shot.result(FRAME), "The same with Stabilize Exposure"), Panel(truth, "On a tripod")),
    )


ITEM = Item(
    name="handheld",
    title="a handheld long exposure, as if on a tripod",
    footage=footage,
    recipes=("handheld.json",),
    frames=(FRAME, FRAME),
    still=still,
)
