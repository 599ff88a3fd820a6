"""Figure 4: displacement against value. Six boats keep level; the top lane shows now, the bottom lane 15 frames on."""

from math import pi, radians, sin

from shutter_addon.core.model import keyframes

from . import stills
from .item import Item
from .stills import Panel

COUNT = 60
FRAME, LATER = 23, 15
SPEED = 0.2133  # units a frame; the picture is 16 wide and 9 high
LANES = [3.75 - 1.5 * i for i in range(6)]
SHIRTS = ("#e8413c", "#f4b63f", "#fdfdf8", "#39b36b", "#3f6fe0", "#8b4fc4")


def footage(folder):
    from . import scenes

    scenes.begin("#cfe3f2", strength=0.7)
    scenes.box((40, 30, 0.1), (0, 0, -0.1), scenes.paint("#1f7f92", roughness=0.5))
    buoys = [scenes.paint(color) for color in ("#f7f3e6", "#e8563f")]
    for lane in LANES[:-1]:
        for i in range(-20, 21):
            scenes.ball(0.06, (i * 0.5, lane - 0.75, 0), buoys[i % 8 == 0])
    for lane, shirt in zip(LANES, SHIRTS, strict=True):
        boat(lane, shirt)
    scenes.lamp("SUN", 3.0, (-4, 5, 6), color="#fff1dd", size=0.05)
    scenes.camera((0, 0, 80), (0, 0, 0), lens=36 * 80 / 16)
    return scenes.render_frames(folder, COUNT)


def boat(lane: float, shirt: str) -> None:
    """A sculler in a lane, rowing to the right."""
    from . import scenes

    hull = scenes.empty()
    scenes.animate(hull, COUNT, location=lambda frame: (-7 + SPEED * (frame - 1), lane, 0))
    scenes.ball((1.5, 0.05, 0.01), (-1.5, 0, -0.045), scenes.paint("#bfe0e0"), parent=hull)  # the wake
    scenes.ball((1.3, 0.14, 0.12), (0, 0, 0.05), scenes.paint("#f6f1e4", roughness=0.3), parent=hull)
    scenes.ball((0.17, 0.2, 0.14), (-0.1, 0, 0.25), scenes.paint(shirt), parent=hull)
    scenes.ball(0.11, (-0.06, 0, 0.42), scenes.paint("#7a4a32"), parent=hull)
    for side in (-1, 1):
        oar(hull, side)


def oar(hull, side: int) -> None:
    from . import scenes

    pivot = scenes.empty((0.05, side * 0.12, 0.22), parent=hull)
    scenes.animate(pivot, COUNT, rotation_euler=lambda frame: (0, 0, side * radians(35) * sin(2 * pi * frame / 60)))
    scenes.tube((0, 0, 0), (0, side * 0.5, -0.1), 0.022, scenes.paint("#e9d9b5"), parent=pivot)
    scenes.box((0.1, 0.2, 0.02), (0, side * 0.52, -0.1), scenes.paint("#f2f2ee"), parent=pivot)


def still(displaced, valued):
    first, second = (displaced.bars(FRAME, name) for name in ("Now", "Later"))
    mixed = [
        (keyframes.between_bars(first[0], second[0], 0.5, way), (first[1] + second[1]) / 2)
        for way in ("displacement", "value")
    ]
    return stills.sheet(
        stills.row(
            panel(displaced.source(FRAME), first, "Frame t, the shutter of the top lane"),
            panel(displaced.source(FRAME + LATER), second, "Frame t + 15, the shutter of the bottom lane"),
        ),
        stills.row(
            panel(displaced.result(FRAME), mixed[0], "Displacement: the lanes between show times between", "halfway"),
            panel(valued.result(FRAME), mixed[1], "Value: the lanes between show both times", "halfway"),
        ),
        caption="Scribbled are the outer lanes alone; the four between get mixtures of the two shutters",
    )


def panel(picture, shutter, words, which=""):
    return Panel(stills.inset(picture, stills.graph(*shutter, 220, 90, which, 20)), words)


ITEM = Item(
    name="displacement",
    figure=4,
    title="displacement against value",
    footage=footage,
    recipes=("displacement.json", "displacement-value.json"),
    frames=(1, COUNT - LATER),
    still=still,
)
