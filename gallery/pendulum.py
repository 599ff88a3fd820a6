"""Figure 1: the writing on a pendulum is sharp, all around it runs together in a long exposure."""

from __future__ import annotations

from itertools import product
from math import cos, pi, radians, sin
from pathlib import Path

from . import stills
from .item import Item

COUNT = 72
PIVOT = 4.2
LENGTH = 4.6


def angle(frame: float) -> float:
    """Of the pendulum, in radians, positive to the right. It hangs straight in the middle of the footage."""
    return radians(25) * sin((frame - COUNT / 2) * radians(2))


def footage(folder: Path) -> Path:
    from . import scenes

    scenes.begin("#8fa6c4", 0.35)
    scenes.camera((0, -9.6 * 85 / 36, 0), (0, 0, 0), 85)
    scenes.lamp("AREA", 1500, (-5, -7, 7), size=3, color="#fff0dc")
    scenes.box((14, 0.1, 9), (0, 1.5, 0), scenes.paint("#1d3a4f"))
    _pinwheels(scenes)
    _pendulum(scenes)
    return scenes.render_frames(folder, COUNT)


def _pinwheels(scenes) -> None:
    cream, brass = scenes.paint("#f4ead6"), scenes.paint("#d9a441", 0.3, 1.0)
    paints = [scenes.paint(color) for color in ("#e4572e", "#f3a712", "#2a9d8f", "#c9386a")]
    for column, row in product(range(8), range(4)):
        hub = scenes.ball(0.08, ((column - 3.5) * 1.36, 0.8, (row - 1.5) * 1.36), brass)
        wheel = scenes.mesh(*_blades(8), (0, 0.3, 0), paints[(column + 2 * row) % 4], hub)
        wheel.data.materials.append(cream)
        wheel.data.polygons.foreach_set("material_index", [i // 2 % 2 for i in range(16)])
        speed = radians((5, -6, 7, -5.5)[(3 * column + row) % 4])
        scenes.animate(hub, COUNT, rotation_euler=lambda frame, speed=speed: (0, speed * frame, 0))


def _blades(count: int):
    """Points and triangles of curled blades, two each: the outer corners are bent towards the camera."""
    points, faces = [], []
    for i in range(count):
        turn = i * 2 * pi / count
        corners = (0.0, 0.02, -0.1), (turn, 0.6, 0.0), (turn + 0.5, 0.62, -0.1), (turn + 0.8, 0.42, -0.25)
        points += [(radius * cos(angle), y, radius * sin(angle)) for angle, radius, y in corners]
        faces += [(4 * i, 4 * i + 1, 4 * i + 2), (4 * i, 4 * i + 2, 4 * i + 3)]
    return points, faces


def _pendulum(scenes) -> None:
    brass, dark = scenes.paint("#d9a441", 0.35, 1.0), scenes.paint("#14181c", 0.5)
    pivot = scenes.empty((0, 0, PIVOT))
    middle = (0, 0, -LENGTH)
    scenes.tube((0, 0, 0), middle, 0.06, brass, parent=pivot)
    scenes.tube((0, -0.15, -LENGTH), (0, 0.15, -LENGTH), 1.3, brass, parent=pivot)
    scenes.tube((0, -0.19, -LENGTH), (0, 0.15, -LENGTH), 1.16, scenes.paint("#fbf6ea", 0.4), parent=pivot)
    scenes.text("1/240", 0.85, (0, -0.2, 0.14 - LENGTH), dark, parent=pivot)
    scenes.text("SECOND", 0.32, (0, -0.2, -0.5 - LENGTH), dark, parent=pivot)
    scenes.animate(pivot, COUNT, rotation_euler=lambda frame: (0, -angle(frame), 0))


def still(shot):
    frame, side, middle = 40, 366, 836
    scribbles = stills.scaled(shot.scribbles(frame), side)
    for name, corner in (("Long", "bottom left"), ("Sharp", "bottom right")):
        scribbles = stills.inset(scribbles, stills.graph(*shot.bars(frame, name), 120, 58, name, 17), corner, 8)

    def small(picture, words):
        return stills.labelled(stills.scaled(picture, side), words)

    left = (shot.source(frame), "A single frame"), (shot.everywhere(frame, "Long"), "24 frames, averaged")
    right = (scribbles, "Scribbles and shutters"), (shot.coefficients(frame), "How much of each")
    result = stills.labelled(stills.scaled(shot.result(frame), middle), "Long around, sharp on the pendulum")
    columns = [stills.below(*(small(*each) for each in column)) for column in (left, right)]
    return stills.sheet(stills.beside(columns[0], result, columns[1]))


ITEM = Item(
    name="pendulum",
    figure=1,
    title="the writing on a pendulum is sharp, all around it is blurred",
    footage=footage,
    recipes=("pendulum.json",),
    frames=(12, 60),
    still=still,
)
