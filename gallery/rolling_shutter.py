"""Figure 11: a rolling shutter that flips midway; the skew of a car that drives past is reversed."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path

from . import stills
from .item import Item
from .stills import Panel

COUNT = 100
SPEED = 0.042
RADIUS = 0.42


def footage(folder: Path) -> Path:
    from . import scenes

    scenes.begin("#a9cdea", 0.8, samples=2)
    scenes.camera((0, -24, 1.75), (0, 0, 1.75), 36 * 24 / 9.6)
    scenes.lamp("SUN", 3.2, (-6, -9, 10), color="#fff1d6", size=0.03)
    street(scenes)
    car(scenes)
    return scenes.render_frames(folder, COUNT)


def street(scenes) -> None:
    colors = "#2f3437", "#f3ead8", "#587a94", "#7a4a35"
    dark, cream, glass, door = (scenes.paint(color, 0.5) for color in colors)
    scenes.box((60, 40, 0.2), (0, -18, -0.1), scenes.paint("#5a5c61", 0.9))
    scenes.box((60, 2.6, 0.24), (0, 3.2, 0), scenes.paint("#b9b2a6", 0.9))
    for i, color in enumerate(("#d98e73", "#e8c170", "#7fa69a", "#c9b8d8", "#d98e73", "#e8c170")):
        x = (i - 2.5) * 2.6
        scenes.box((2.56, 2, 7), (x, 5.6, 3.5), scenes.paint(color, 0.9))
        for floor in (2.1, 4.0):
            for side in (-0.6, 0.6):
                scenes.box((0.72, 0.1, 1.15), (x + side, 4.58, floor), cream)
                scenes.box((0.56, 0.1, 0.99), (x + side, 4.55, floor), glass)
        scenes.box((0.7, 0.1, 1.5), (x - 0.6, 4.58, 0.75), cream)
        scenes.box((0.54, 0.1, 1.42), (x - 0.6, 4.55, 0.71), door)
    for x in (-3.9, 0.0, 3.9):
        scenes.tube((x, 2.3, 0), (x, 2.3, 4.6), 0.06, dark)
        scenes.tube((x, 2.3, 0), (x, 2.3, 0.5), 0.11, dark)


def car(scenes) -> None:
    """A microbus that drives to the right, its wheels turning."""
    red, cream, glass = scenes.paint("#c8352b", 0.3), scenes.paint("#f5ecd7", 0.3), scenes.paint("#22323d", 0.15)
    dark, chrome = scenes.paint("#26282b", 0.8), scenes.paint("#d5d8da", 0.2, 1.0)
    car = scenes.empty()
    low = [(-2.2, 0.4), (2.15, 0.4), (2.25, 0.6), (2.25, 1.1), (2.18, 1.32), (-2.2, 1.32)]
    scenes.plate(low, 1.7, (0, 0, 0), red, 0.08, car)
    high = [(-2.2, 1.3), (2.18, 1.3), (1.98, 2.3), (1.75, 2.45), (-2.0, 2.45), (-2.18, 2.3)]
    scenes.plate(high, 1.62, (0, 0, 0), cream, 0.08, car)
    for x in (-1.66, -0.72, 0.22):
        scenes.box((0.8, 0.1, 0.66), (x, -0.8, 1.83), glass, 0.06, car)
    front = [(0.76, 1.5), (1.86, 1.5), (1.74, 2.16), (0.76, 2.16)]
    scenes.plate(front, 0.1, (0, -0.8, 0), glass, 0.03, car)
    for x in (-0.25, 0.69, 1.9):
        scenes.box((0.025, 0.06, 1.7 if x < 1 else 0.8), (x, -0.84, 1.35 if x < 1 else 0.95), dark, parent=car)
    scenes.box((4.4, 0.05, 0.06), (0, -0.87, 1.32), chrome, 0.02, car)
    scenes.box((0.22, 0.06, 0.05), (0.92, -0.88, 1.1), chrome, 0.02, car)
    for x in (-2.25, 2.25):
        scenes.box((0.14, 1.75, 0.16), (x, 0, 0.52), chrome, 0.05, car)
    scenes.ball((0.08, 0.16, 0.16), (2.24, -0.55, 0.95), scenes.paint("#fff6d8", 0.2), car)
    for x in (-1.4, 1.4):
        hub = scenes.empty((x, -0.7, RADIUS), car)
        scenes.tube((0, 0.15, 0), (0, -0.15, 0), RADIUS, dark, parent=hub)
        scenes.tube((0, 0, 0), (0, -0.18, 0), 0.27, chrome, parent=hub)
        for i in range(5):
            scenes.ball(0.055, (0.17 * cos(i * 0.4 * pi), -0.18, 0.17 * sin(i * 0.4 * pi)), dark, hub)
        scenes.animate(hub, COUNT, rotation_euler=lambda frame: (0, SPEED / RADIUS * frame, 0))
    scenes.animate(car, COUNT, location=lambda frame: (SPEED * (frame - COUNT / 2), 0, 0))


def still(shot):
    before, after = 7, 30
    return stills.sheet(
        stills.row(
            Panel(_with_bars(shot, before), "Before: the upper edge comes first"),
            Panel(_with_bars(shot, after), "After: the lower edge comes first"),
        ),
        stills.row(
            Panel(shot.source(COUNT // 2), "A single frame"),
            Panel(shot.scribbles(before), "Scribbles: the upper and the lower edge"),
            Panel(shot.coefficients(before), "How much of each shutter"),
        ),
    )


def _with_bars(shot, frame: int):
    """The result, and the two shutters at their edges."""
    top, bottom = (stills.graph(*shot.bars(frame, name), 220, 84, name) for name in ("Top", "Bottom"))
    return stills.inset(stills.inset(shot.result(frame), top, "top left"), bottom, "bottom left")


ITEM = Item(
    name="rolling_shutter",
    figure=11,
    title="a rolling shutter that flips midway",
    footage=footage,
    recipes=("rolling_shutter.json",),
    frames=(1, COUNT - 63),
    still=still,
)
