"""A panning shot of footage from a camera that stood still: the exposure follows a scooter, and its street streaks.

The stroke was drawn at frame 18; the recipe has the keys that Track made of it:
`shutter track footage/0001.png --recipe R.json --region scooter --frame 18 --output panning.json`
The truth is the same scene, exposed by Cycles itself for as long, through a camera that pans with the scooter.
"""

from __future__ import annotations

from math import atan2, cos, pi, sin
from pathlib import Path

import numpy as np

from shutter_addon.media import open_source

from . import stills
from .item import Item
from .stills import Panel

SIZE = 640, 360
COUNT = 36
FRAME, WINDOW = 18, 25  # what is shown, and how many frames its exposure has
DISTANCE, HEIGHT = 14.0, 1.02  # of the camera, in metres
WHEEL = 0.24
NAME = "scooter"
STROKE = [[0.36, 0.52], [0.44, 0.56], [0.43, 0.46], [0.42, 0.34], [0.58, 0.42]]  # parcels, jacket, seat, tail, shield


def footage(folder: Path) -> Path:
    """240 frames a second: the scooter moves by more than three pixels a frame."""
    from . import scenes

    _begin(scenes, samples=4)
    return scenes.render_frames(folder, COUNT)


def truth(folder: Path, samples: int = 64) -> Path:
    """The picture of a camera that pans with the scooter, open for the whole window around the shown frame, at which it
    stands as the still one does."""
    from . import scenes

    scene = _begin(scenes, samples, motion_blur=float(WINDOW))
    scene.render.motion_blur_position = "CENTER"
    start = scene.camera.rotation_euler.copy()
    scenes.animate(scene.camera, COUNT, rotation_euler=lambda frame: (*start[:2], start[2] - bearing(frame)))
    for thing in scene.objects:
        thing.cycles.motion_steps = 5
    return scenes.render_frames(folder, FRAME, first=FRAME)


def mask(folder: Path) -> Path:
    """What the scooter and its rider cover of the shown frame, white on black."""
    from . import scenes

    scene = _begin(scenes, samples=16)
    scene.cycles.use_denoising = False
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    scene.view_layers[0].material_override = scenes.glow("#ffffff", 1.0)
    for thing in scene.objects:
        thing.hide_render = thing.type == "LIGHT" or not _is_part(thing)
    return scenes.render_frames(folder, FRAME, first=FRAME)


def drawn() -> dict:
    """A recipe: one stroke on the scooter at the shown frame, not tracked, and a shutter that follows it; no layer."""
    shutter = {"name": "Panning", "color": [0.9, 0.62, 0.0], "bars": [1.0] * WINDOW, "follow": NAME}
    stroke = {"name": NAME, "shutter": "Panning", "kind": "line", "width": 0.02, "strokes": [STROKE]}
    return {"version": 1, "window": WINDOW, "position": "center", "shutters": [shutter], "regions": [stroke]}


def place(frame: float) -> float:
    """Where the scooter is, in metres to the right; it speeds up a little."""
    time = frame - FRAME
    return 0.031 * time + 0.00012 * time * time


def bearing(frame: float) -> float:
    """In what direction the camera sees the scooter, in radians to the right."""
    return atan2(place(frame), DISTANCE)


def _begin(scenes, samples: int, motion_blur: float = 0.0):
    scene = scenes.begin("#c4d4e6", 0.75, samples=samples, motion_blur=motion_blur)
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scenes.camera((0, -DISTANCE, HEIGHT), (0, 0, HEIGHT), 85)
    scenes.lamp("SUN", 3.0, (-5, -8, 9), color="#fff0d4", size=0.05)
    _street(scenes)
    _scooter(scenes)
    return scene


def _is_part(thing) -> bool:
    return thing.name.startswith("Scooter") or (thing.parent is not None and _is_part(thing.parent))


def _street(scenes) -> None:
    grey, stone, dark, line = (scenes.paint(color, 0.9) for color in ("#55585d", "#a9a294", "#2c3136", "#d8d4c8"))
    scenes.box((60, 40, 0.2), (0, -17, -0.1), grey)
    scenes.box((60, 2.0, 0.3), (0, 2.6, 0), stone)
    for i in range(-5, 6):
        scenes.box((0.02, 0.05, 0.16), (0.9 * i, 1.59, 0.08), dark)
    for i in range(-2, 3):
        scenes.box((0.9, 0.12, 0.01), (1.8 * i, -1.3, 0.0), line)
    walls = "#c8795c", "#e2c58a", "#6f9a94", "#b9a3c9", "#d9d0bf"
    words = "CAFÉ", "LIVRES", "PAIN", "VÉLOS", "FLEURS"
    for i in range(-2, 3):
        x, wall = 1.9 * i, scenes.paint(walls[i % 5], 0.9)
        scenes.box((1.88, 1, 6), (x, 4.2, 3), wall)
        _shop(scenes, x, words[i % 5], walls[(i + 2) % 5])
    for i in range(-3, 3):
        scenes.tube((1.9 * i + 0.95, 2.2, 0), (1.9 * i + 0.95, 2.2, 0.75), 0.05, dark)


def _shop(scenes, x: float, words: str, color: str) -> None:
    cream, glass, sign = scenes.paint("#cdbfa6", 0.6), scenes.paint("#5d7a87", 0.3), scenes.paint(color, 0.6)
    scenes.box((1.05, 0.1, 1.15), (x - 0.32, 3.68, 1.05), cream)
    scenes.box((0.93, 0.1, 1.03), (x - 0.32, 3.65, 1.05), glass)
    scenes.box((0.5, 0.1, 1.6), (x + 0.6, 3.68, 0.9), sign)
    scenes.box((0.34, 0.1, 0.6), (x + 0.6, 3.65, 1.25), glass)
    scenes.box((1.7, 0.12, 0.36), (x, 3.67, 1.98), sign)
    scenes.text(words, 0.3, (x, 3.59, 1.98), cream)
    for i, shade in enumerate(("#e9573f", "#f5d04c", "#fbfbf4", "#3f7fd0")):  # posters in the window
        scenes.box((0.17, 0.02, 0.26), (x - 0.66 + 0.23 * i, 3.59, 0.74 + 0.07 * (i % 2)), scenes.paint(shade, 0.9))


def _scooter(scenes) -> None:
    mint, cream = scenes.paint("#2f9d8f", 0.35), scenes.paint("#f4ecd9", 0.4)
    dark, chrome = scenes.paint("#202327", 0.7), scenes.paint("#c9cdd0", 0.3, 0.6)
    root = scenes.empty()
    root.name = "Scooter"
    scenes.animate(root, COUNT, location=lambda frame: (place(frame), 0, 0))
    tail = [(-0.86, 0.42), (-0.76, 0.66), (-0.5, 0.74), (-0.16, 0.68), (-0.06, 0.34), (-0.18, 0.2), (-0.7, 0.24)]
    scenes.plate(tail, 0.34, (0, 0, 0), mint, 0.07, root)
    scenes.plate([(-0.2, 0.2), (0.42, 0.2), (0.46, 0.28), (-0.2, 0.28)], 0.36, (0, 0, 0), cream, 0.03, root)
    front = [(0.4, 0.22), (0.52, 0.3), (0.66, 0.62), (0.6, 0.96), (0.5, 0.98), (0.52, 0.64)]
    scenes.plate(front, 0.36, (0, 0, 0), mint, 0.03, root)
    scenes.plate([(-0.66, 0.74), (-0.1, 0.7), (-0.12, 0.8), (-0.64, 0.84)], 0.28, (0, 0, 0), dark, 0.04, root)
    scenes.ball((0.06, 0.09, 0.09), (0.66, 0, 0.92), scenes.paint("#fff3c4", 0.2), root)
    scenes.tube((0.54, -0.28, 1.04), (0.54, 0.28, 1.04), 0.022, dark, parent=root)
    _checks(scenes, root, (-0.72, -0.18, 0.36), (10, 2), cream)
    scenes.text("VITE!", 0.16, (-0.46, -0.19, 0.56), cream, root)
    _checks(scenes, root, (0.44, -0.19, 0.4), (3, 8), cream)
    _parcels(scenes, root)
    for x in (-0.6, 0.68):
        _wheel(scenes, root, x, dark, chrome)
    _rider(scenes, root, dark)


def _parcels(scenes, root) -> None:
    scenes.box((0.5, 0.46, 0.46), (-0.86, 0, 1.06), scenes.paint("#f3c623", 0.6), 0.03, root)
    ink = scenes.paint("#23262b", 0.8)
    scenes.text("POST", 0.16, (-0.86, -0.24, 1.14), ink, root)
    scenes.text("24 · 7", 0.1, (-0.86, -0.24, 0.98), ink, root)
    _checks(scenes, root, (-1.1, -0.235, 0.84), (11, 2), ink)
    _checks(scenes, root, (-1.1, -0.235, 1.22), (11, 1), ink)


def _checks(scenes, root, corner, counts, material) -> None:
    """Every other one of columns and rows of squares, from a lower left corner on, facing the camera."""
    side, (x, y, z), (columns, rows) = 0.044, corner, counts
    places = [(x + i * side, z + j * side) for i in range(columns) for j in range(rows) if (i + j) % 2]
    points = [(a + side * u, 0, b + side * v) for a, b in places for u, v in ((0, 0), (1, 0), (1, 1), (0, 1))]
    faces = [range(4 * k, 4 * k + 4) for k in range(len(places))]
    scenes.mesh(points, faces, (0, y, 0), material, root)


def _wheel(scenes, root, x: float, dark, chrome) -> None:
    hub = scenes.empty((x, 0, WHEEL), root)
    scenes.tube((0, 0.06, 0), (0, -0.06, 0), WHEEL, dark, parent=hub)
    scenes.tube((0, 0, 0), (0, -0.075, 0), 0.14, chrome, parent=hub)
    for i in range(5):
        scenes.ball(0.03, (0.09 * cos(0.4 * i * pi), -0.075, 0.09 * sin(0.4 * i * pi)), dark, hub)
    scenes.animate(hub, COUNT, rotation_euler=lambda frame: (0, place(frame) / WHEEL, 0))
    guard = [(x - 0.27, 0.3), (x - 0.16, 0.52), (x + 0.1, 0.54), (x + 0.27, 0.34), (x + 0.1, 0.44)]
    scenes.plate(guard, 0.18, (0, 0, 0), scenes.paint("#2f9d8f", 0.35), 0.02, root)


def _rider(scenes, root, dark) -> None:
    jacket, trousers = scenes.paint("#c9372c", 0.8), scenes.paint("#31456b", 0.9)
    skin, white = scenes.paint("#c98f6b", 0.6), scenes.paint("#f7f5ef", 0.4)
    legs = [((-0.38, y, 0.9), (0.06, y, 0.86), 0.11, 0.085) for y in (-0.12, 0.12)]
    legs += [((0.06, y, 0.86), (0.12, y, 0.36), 0.08, 0.06) for y in (-0.12, 0.12)]
    scenes.limbs(legs, trousers, 0.02, root)
    body = [((-0.38, 0, 0.92), (-0.28, 0, 1.38), 0.15, 0.17)]
    body += [((-0.26, y, 1.42), (-0.02, 1.3 * y, 1.16), 0.075, 0.06) for y in (-0.18, 0.18)]
    body += [((-0.02, 1.3 * y, 1.16), (0.46, 1.2 * y, 1.08), 0.058, 0.045) for y in (-0.18, 0.18)]
    scenes.limbs(body, jacket, 0.02, root)
    scenes.ball((0.12, 0.12, 0.14), (-0.2, 0, 1.68), skin, root)
    scenes.ball((0.165, 0.16, 0.14), (-0.23, 0, 1.76), white, root)
    scenes.box((0.34, 0.02, 0.03), (-0.23, -0.155, 1.74), scenes.paint("#c9372c", 0.5), 0.005, root)
    for y in (-0.14, 0.14):
        scenes.ball((0.13, 0.06, 0.055), (0.18, y, 0.31), dark, root)
    for i in range(4):
        scenes.box((0.04, 0.03, 0.34), (-0.45 + 0.075 * i, -0.16, 1.17), white, parent=root)


def still(shot):
    with open_source(truth(shot.footage.parents[1] / "truth")) as source:
        panned = source.read(0)[..., :3] / np.float32(255)
    count = f"{WINDOW} frames"
    return stills.sheet(
        stills.row(
            Panel(shot.scribbles(FRAME, dim=1.0), "The camera stands still; one stroke, tracked"),
            Panel(shot.everywhere(FRAME, "Panning"), f"{count}, averaged"),
        ),
        stills.row(
            Panel(shot.result(FRAME), f"{count} that follow the stroke"), Panel(panned, "The truth: a camera that pans")
        ),
    )


ITEM = Item(
    name="panning",
    title="a panning shot of footage from a camera that stood still",
    footage=footage,
    recipes=("panning.json",),
    frames=(WINDOW // 2 + 1, COUNT - WINDOW // 2),
    still=still,
)
