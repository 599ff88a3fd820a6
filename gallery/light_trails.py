"""Figure 12: light trails of a burning pole over 120 frames, half a second; who spins it stays sharp."""

from __future__ import annotations

from math import cos, pi, radians, sin
from pathlib import Path

from . import stills
from .item import Item

COUNT = 140
CHEST = 1.38


def footage(folder: Path) -> Path:
    """Half-float EXR: the flames are a hundred times as bright as white, so that their trails are bright still."""
    from . import scenes

    scenes.begin("#12224a", 0.35, samples=2, motion_blur=1.0)
    scenes.camera((0, -9, 1.3), (0, 0, 1.45), 60)
    scenes.lamp("AREA", 180, (4, 4, 5), (0, 0, 1.2), color="#86a8ff", size=2)
    _night(scenes)
    _dancer(scenes)
    return scenes.render_frames(folder, COUNT, "OPEN_EXR")


def _night(scenes) -> None:
    """Ground, the lights of a town far away, and trees before them."""
    scenes.box((80, 80, 0.2), (0, 30, -0.1), scenes.paint("#6b5f52", 0.95))
    amber, white = scenes.glow("#ffb066", 0.8), scenes.glow("#dfe8ff", 0.6)
    for i in range(90):
        place = (i * 7.31) % 36 - 18, 24, 0.9 + 1.3 * ((i * i * 0.37) % 1) ** 2
        scenes.ball(0.03 + 0.015 * (i % 3), place, (amber, amber, white)[i % 3])
    leaves = scenes.paint("#16241f", 0.9)
    for i, x in enumerate((-8.5, -6.6, -5.3, 4.9, 6.4, 8.8)):
        for part in range(3):
            foot = 0.5 + 0.8 * part
            scenes.tube((x, 11, foot), (x, 11, foot + 1.5), 1.0 - 0.22 * part - 0.1 * (i % 3), leaves, 0.02)


def _dancer(scenes) -> None:
    """Stands with legs apart, both hands at the middle of the pole, and sways."""
    root = scenes.empty()
    scenes.animate(root, COUNT, rotation_euler=_sway)
    skin, shirt, trousers = scenes.paint("#c98f6b", 0.6), scenes.paint("#8c2634", 0.8), scenes.paint("#34465f", 0.9)
    sides = -1, 1
    legs = [((s * 0.1, 0, 0.9), (s * 0.2, -0.08, 0.48), 0.105, 0.075) for s in sides]
    legs += [((s * 0.2, -0.08, 0.48), (s * 0.25, 0.04, 0.1), 0.075, 0.055) for s in sides]
    scenes.limbs([*legs, ((-0.07, 0, 0.93), (0.07, 0, 0.93), 0.12, 0.12)], trousers, 0.02, root)
    arms = [((s * 0.18, 0, 1.44), (s * 0.34, -0.12, 1.2), 0.075, 0.06) for s in sides]
    chest = [((0, 0, 0.98), (0, 0, 1.32), 0.12, 0.15), ((-0.14, 0, 1.43), (0.14, 0, 1.43), 0.085, 0.085)]
    scenes.limbs([*chest, *arms], shirt, 0.02, root)
    hands = [(s * 0.06, -0.38, CHEST - s * 0.05) for s in sides]
    arms = [((s * 0.34, -0.12, 1.2), hand, 0.05, 0.04) for s, hand in zip(sides, hands, strict=True)]
    fists = [(hand, (0, -0.42, CHEST), 0.05, 0.05) for hand in hands]
    head = [((0, 0, 1.45), (0, -0.02, 1.62), 0.05, 0.05), ((0, -0.03, 1.68), (0, -0.02, 1.75), 0.08, 0.1)]
    scenes.limbs([*arms, *fists, *head], skin, 0.02, root)
    scenes.ball((0.112, 0.115, 0.09), (0, 0.02, 1.79), scenes.paint("#1a1412", 0.7), root)
    for side in sides:
        scenes.ball((0.06, 0.13, 0.05), (side * 0.26, 0, 0.04), scenes.paint("#141414", 0.6), root)
    _pole(scenes, root)


def _pole(scenes, root) -> None:
    """A pole with a flame at each end, which turns in a plane that itself leans and turns."""
    pole = scenes.empty((0, -0.45, CHEST), root)
    scenes.tube((-1.15, 0, 0), (1.15, 0, 0), 0.018, scenes.paint("#4a4038", 0.5), parent=pole)
    flame = scenes.glow("#ff8a33", 260)
    for side in (-1, 1):
        for i, radius in enumerate((0.045, 0.055, 0.035)):
            scenes.ball(radius, (side * (1.12 + 0.05 * i), 0, 0), flame, pole)
        scenes.lamp("POINT", 60, (side * 1.2, -0.1, 0), color="#ff8a3c", size=0.1, parent=pole)
    scenes.animate(pole, COUNT, rotation_euler=_turn)


def _sway(frame: float):
    turn = 2 * pi * frame / 120
    return 0, radians(4) * sin(turn), radians(12) * cos(turn)


def _turn(frame: float):
    lean = 2 * pi * frame / 140
    return radians(25) * sin(lean), 2 * pi * frame / 53, radians(52) * sin(lean + 0.6)


def still(shot):
    frame, side, large = 70, 494, 1090
    small = (shot.source(frame), "A single frame"), (shot.scribbles(frame), "Scribbles: flames long, the rest sharp")
    column = stills.below(*(stills.labelled(stills.scaled(picture, side), words) for picture, words in small))
    result = stills.inset(stills.scaled(shot.result(frame), large), stills.scaled(shot.coefficients(frame), 250))
    return stills.sheet(stills.beside(column, stills.labelled(result, "120 frames of fire, the dancer sharp")))


ITEM = Item(
    name="light_trails",
    figure=12,
    title="light trails over 120 frames",
    footage=footage,
    recipes=("light_trails.json",),
    frames=(60, COUNT - 60),
    still=still,
)
