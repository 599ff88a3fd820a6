"""Figure 9: two hands at a piano; a long exposure calms the left one, the right one stays sharp."""

from __future__ import annotations

from itertools import pairwise
from math import cos, pi, radians, sin
from pathlib import Path

from . import stills
from .item import Item
from .stills import Panel

COUNT = 44
FINGERS = (
    ((-0.30, 0.30, 0.34), (-0.88, 0.80, 0.32), (-1.12, 1.38, 0.12)),
    ((-0.52, 1.15, 0.50), (-0.74, 1.80, 0.52), (-0.80, 2.25, 0.10)),
    ((-0.18, 1.28, 0.54), (-0.25, 2.00, 0.56), (-0.28, 2.50, 0.10)),
    ((0.18, 1.22, 0.50), (0.26, 1.90, 0.54), (0.30, 2.38, 0.10)),
    ((0.48, 1.05, 0.44), (0.72, 1.58, 0.46), (0.82, 1.98, 0.10)),
)


def footage(folder: Path) -> Path:
    from . import scenes

    scenes.begin("#b9c4d8", 0.35, samples=3)
    scenes.camera((0, -3.2, 9.5), (0, 0.9, 0), 33)
    scenes.lamp("AREA", 900, (-4, 2.5, 6), size=2.5, color="#ffe9d0")
    _piano(scenes)
    right, left = _hand(scenes), _hand(scenes)
    left.scale.x = -1
    scenes.animate(right, COUNT, location=right_place, rotation_euler=right_turn)
    scenes.animate(left, COUNT, location=left_place, rotation_euler=left_turn)
    return scenes.render_frames(folder, COUNT)


def right_place(frame: float):
    """A melody: small quick hops from key to key."""
    turn = 2 * pi * frame / 20
    return 2.35 + 0.5 * sin(turn), -1.45 + 0.08 * sin(2 * turn), 0.12 + 0.12 * cos(2 * turn)


def right_turn(frame: float):
    return radians(4) * sin(2 * pi * frame / 10), radians(14) * sin(2 * pi * frame / 10), radians(4)


def left_place(frame: float):
    turn = 2 * pi * frame / 48
    return -2.3 + 0.8 * sin(turn), -1.45, 0.15 - 0.15 * cos(2 * turn)


def left_turn(frame: float):
    return radians(5) * cos(2 * pi * frame / 24), radians(8) * cos(2 * pi * frame / 48), radians(-4)


def _hand(scenes):
    """A right hand with its arm, the wrist at the origin, its fingers towards +y."""
    root = scenes.empty()
    bones = [((0, 0, 0.4), finger[0], 0.34, 0.27) for finger in FINGERS]
    bones += [
        (*bone, radius, radius - 0.03) for f in FINGERS for bone, radius in zip(pairwise(f), (0.2, 0.17), strict=True)
    ]
    bones += [((0, 0, 0.4), (0.1, -1.2, 0.45), 0.32, 0.36)]
    scenes.limbs(bones, scenes.paint("#dfa07c", 0.5), 0.035, root)
    scenes.tube((0.07, -0.75, 0.43), (0.09, -1.0, 0.44), 0.43, scenes.paint("#f2f2ee"), 0.44, root)
    scenes.tube((0.09, -0.95, 0.44), (0.4, -4.5, 0.5), 0.47, scenes.paint("#27324a", 0.9), 0.62, root)
    return root


def _piano(scenes) -> None:
    ivory, ebony = scenes.paint("#f3efe4", 0.3), scenes.paint("#17171a", 0.3)
    lacquer = scenes.paint("#1a0f0c", 0.25)
    for i in range(-12, 13):
        scenes.box((0.485, 3.2, 0.3), (i * 0.5, 0.9, -0.15), ivory, 0.03)
        if i % 7 not in (2, 6):
            scenes.box((0.27, 1.95, 0.3), (i * 0.5 + 0.25, 1.55, 0.1), ebony, 0.04)
    scenes.box((14, 1.6, 0.4), (0, -1.75, -0.35), lacquer, 0.05)
    scenes.box((14, 0.25, 0.1), (0, 2.55, 0.1), scenes.paint("#8c1c2c", 0.95))
    scenes.box((14, 0.4, 2.4), (0, 2.9, 1.2), lacquer, 0.05)
    scenes.box((14, 8, 0.1), (0, -3, -1.0), scenes.paint("#5b3a28"))


def still(shot):
    frame = 19
    return stills.sheet(
        stills.row(
            Panel(shot.source(frame), "A single frame"),
            Panel(shot.scribbles(frame, 0.7), "Scribbles: long on the left, sharp on the right"),
        ),
        stills.row(
            Panel(shot.coefficients(frame), "How much of each shutter"),
            Panel(shot.result(frame), "The left hand is calm, the right one sharp"),
        ),
    )


ITEM = Item(
    name="hands",
    figure=9,
    title="one hand calm, one sharp",
    footage=footage,
    recipes=("hands.json",),
    frames=(6, COUNT - 6),
    still=still,
)
