"""An object of a 3D scene gets a shutter of its own, by the matte that Blender renders beside its picture.

One plane of a fairground's ride is sharp, and all others trail. It is a layer, and leaves no trail of its own. Its
matte is Cryptomatte's, motion blur and all: how much of a pixel it covers.
"""

from __future__ import annotations

from math import cos, pi, radians, sin
from pathlib import Path

from . import stills
from .item import Item
from .stills import Panel

COUNT = 36
FRAME, WINDOW = 18, 28  # what is shown in the still, and how many frames the others' exposure has
RADIUS, HEIGHT = 4.0, 2.3  # of the planes' way, in metres
SPEED = 0.7  # of the ride, in degrees a frame
NAME = "Red Plane"
CROP = slice(20, 402), slice(52, 716)
PLANES = {NAME: "#d8322a", "Gold": "#f0b429", "Teal": "#1f9e93", "Violet": "#7a55b8", "Blue": "#2f6fd0"}


def footage(folder: Path) -> Path:
    """The pictures, and beside them a folder of their mattes."""
    from . import scenes

    _begin(scenes)
    scenes.write_matte(folder / "matte", NAME, NAME)
    return scenes.render_frames(folder, COUNT)


def _begin(scenes) -> None:
    scene = scenes.begin("#7f9fd6", 0.75, samples=8, motion_blur=0.5)
    scene.render.resolution_x, scene.render.resolution_y = (side * 4 // 5 for side in scenes.SIZE)
    scenes.camera((0, -15.5, 2.2), (0, 0, 2.8), 50)
    scenes.lamp("SUN", 3.0, (-7, -9, 8), color="#ffe3b5", size=0.05)
    _fair(scenes)
    _tower(scenes)
    for k, (name, color) in enumerate(PLANES.items()):
        _plane(scenes, name, color, 72 * k)


def _turning(scenes, thing, start: float) -> None:
    """Turns it with the ride, from degrees on at the still's frame."""
    scenes.animate(thing, COUNT, rotation_euler=lambda frame: (0, 0, radians(start + SPEED * (frame - FRAME))))


def _fair(scenes) -> None:
    scenes.box((80, 80, 0.2), (0, 10, -0.1), scenes.paint("#6f9a4c", 0.95))
    scenes.tube((0, 0, -0.05), (0, 0, 0.12), 5.6, scenes.paint("#b9a887", 0.9))
    trunk, leaves = scenes.paint("#4f3a28", 0.9), scenes.paint("#41703c", 0.95)
    for x, y, size in ((-9.5, 13, 1.9), (-3.4, 17, 2.2), (4.2, 16, 1.9), (11, 14, 2.3)):
        scenes.tube((x, y, 0), (x, y, 2), 0.2, trunk)
        for part in range(3):
            scenes.ball(size * (1 - 0.22 * part), (x + 0.4 * part, y, 2.6 + 1.1 * part), leaves)
    for x, color in ((-6.4, "#c9473c"), (7.0, "#2f8f84")):
        _tent(scenes, x, color)
    for k in range(26):
        x, color = -10 + 0.8 * k, tuple(PLANES.values())[k % 5]
        sag = 0.045 * ((k % 9) - 4) ** 2
        pennant = [(x, 5.1 + sag), (x + 0.5, 5.1 + sag), (x + 0.25, 4.5 + sag)]
        scenes.plate(pennant, 0.02, (0, 7, 0), scenes.paint(color))


def _tent(scenes, x: float, color: str) -> None:
    colors = scenes.paint(color, 0.9), scenes.paint("#f4ecda", 0.9)
    count, y = 20, 8.0
    ring = [(2.2 * cos(2 * pi * k / count), 2.2 * sin(2 * pi * k / count)) for k in range(count + 1)]
    for k in range(count):
        (a, b), (c, d) = ring[k], ring[k + 1]
        wall = [(a, b, 0), (c, d, 0), (c, d, 2.2), (a, b, 2.2)]
        roof = [(1.12 * a, 1.12 * b, 2.1), (1.12 * c, 1.12 * d, 2.1), (0, 0, 4.0)]
        scenes.mesh([*wall, *roof], [range(4), range(4, 7)], (x, y, 0), colors[k % 2])


def _tower(scenes) -> None:
    """What the planes hang on: a striped pole with bulbs, and arms that turn."""
    blue, cream = scenes.paint("#3f6fa8", 0.5), scenes.paint("#f4ecda", 0.5)
    gold, bulb = scenes.paint("#e0b04a", 0.3, 0.7), scenes.glow("#fff0c0", 2.2)
    for k in range(9):
        scenes.tube((0, 0, 0.5 * k), (0, 0, 0.5 * k + 0.5), 0.55, (blue, cream)[k % 2])
    scenes.ball(0.42, (0, 0, 5.75), gold)
    ride = scenes.empty((0, 0, 0))
    _turning(scenes, ride, 0)
    scenes.tube((0, 0, 4.4), (0, 0, 5.5), 1.5, blue, 0.12, ride)
    for k in range(20):
        turn = 2 * pi * k / 20
        scenes.ball(0.09, (1.55 * cos(turn), 1.55 * sin(turn), 4.42), bulb, ride)
    for k in range(5):
        turn = radians(72 * k - 90)
        scenes.tube((0, 0, 4.2), (RADIUS * cos(turn), RADIUS * sin(turn), HEIGHT + 0.42), 0.055, gold, parent=ride)


def _plane(scenes, name: str, color: str, start: float) -> None:
    """Its root, of that name, stands on the ride's axis and hangs on nothing."""
    paint, cream, dark = scenes.paint(color, 0.3), scenes.paint("#f7f1e1", 0.4), scenes.paint("#22262b", 0.6)
    root = scenes.empty()
    root.name = name
    _turning(scenes, root, start)
    plane = scenes.empty((0, -RADIUS, HEIGHT), root)
    plane.rotation_euler = radians(14), 0, 0
    scenes.ball((1.02, 0.33, 0.34), (0, 0, 0), paint, plane)
    scenes.tube((0.78, 0, 0.0), (1.03, 0, 0.0), 0.215, cream, 0.13, plane)
    scenes.box((0.56, 2.0, 0.06), (0.12, 0, -0.12), cream, 0.03, plane)
    for y in (-0.98, -0.72, 0.72, 0.98):
        scenes.box((0.57, 0.12, 0.065), (0.12, y, -0.12), paint, 0.03, plane)
    scenes.box((0.3, 0.9, 0.05), (-0.9, 0, 0.08), cream, 0.02, plane)
    scenes.plate([(-1.1, 0.02), (-0.68, 0.1), (-0.92, 0.56), (-1.14, 0.56)], 0.06, (0, 0, 0), paint, 0.02, plane)
    scenes.plate([(-1.12, 0.3), (-0.78, 0.3), (-0.84, 0.42), (-1.13, 0.42)], 0.07, (0, 0, 0), cream, 0.01, plane)
    scenes.box((0.05, 0.09, 0.86), (1.07, 0, 0), dark, 0.02, plane)
    scenes.ball(0.085, (1.07, 0, 0), paint, plane)
    scenes.ball((0.13, 0.13, 0.15), (-0.08, 0, 0.44), scenes.paint("#d9a27c", 0.6), plane)
    scenes.ball((0.145, 0.145, 0.1), (-0.09, 0, 0.52), dark, plane)
    shield = [(-0.02, 0.28), (0.3, 0.26), (0.16, 0.46), (0.06, 0.46)]
    scenes.plate(shield, 0.3, (0, 0, 0), scenes.paint("#a8c8d8", 0.15), 0.02, plane)
    for x in (0.42, -0.5):
        scenes.tube((x, -0.16, -0.42), (x, 0.16, -0.42), 0.12, dark, parent=plane)
    number = f"{1 + list(PLANES).index(name)}"
    scenes.tube((-0.42, -0.32, 0.02), (-0.42, -0.345, 0.02), 0.19, cream, parent=plane)
    scenes.text(number, 0.3, (-0.42, -0.355, 0.02), dark, plane)


def still(shot, plain):
    return stills.sheet(
        stills.row(
            Panel(shot.result(FRAME)[CROP], f"One frame for the red plane, a layer; {WINDOW} for all else"),
            Panel(plain.result(FRAME)[CROP], "The same, if it is no layer"),
        ),
        stills.row(
            Panel(shot.source(FRAME)[CROP], "A frame as Blender renders it"),
            Panel(plain.coefficients(FRAME)[CROP], "The matte beside it, by Cryptomatte"),
        ),
    )


ITEM = Item(
    name="object_matte",
    title="one object of a 3D scene is sharp, by its Cryptomatte",
    footage=footage,
    recipes=("object_matte.json", "object_matte-plain.json"),
    frames=(WINDOW // 2, COUNT - WINDOW // 2),
    still=still,
)
