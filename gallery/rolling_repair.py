"""Rolling Shutter Repair: a camera that is turned quickly has houses lean, which stand upright again.

The recipe is what Rolling Shutter Repair makes at 60 % with *Smooth* at 16×. The truth is a camera that reads all rows
at once.
"""

from __future__ import annotations

from math import sin
from pathlib import Path

import numpy as np

from shutter_addon.media import open_source

from . import stills
from .item import Item
from .rolling_shutter import car, street
from .stills import Panel

COUNT = 21
FRAME = 11  # that is shown, where the camera turns fastest
READOUT = 0.6  # of a frame's time
ROW = 0.02  # of the shutter's time, that a row is exposed
AWAY, WIDTH = 24, 9.6  # metres from the street, and of it that are seen


def footage(folder: Path) -> Path:
    return _render(folder, READOUT, range(1, COUNT + 1))


def at_once(folder: Path) -> Path:
    """The shown frame by a camera that reads all rows at once."""
    return _render(folder, 0, range(FRAME, FRAME + 1))


def _render(folder: Path, readout: float, frames: range) -> Path:
    from . import scenes

    scene = scenes.begin("#a9cdea", 0.8, samples=8, motion_blur=READOUT / (1 - ROW))
    scene.render.motion_blur_position = "CENTER"
    if readout:
        scene.cycles.rolling_shutter_type, scene.cycles.rolling_shutter_duration = "TOP", ROW
    else:
        scene.render.motion_blur_shutter = ROW
    scenes.camera((0, -AWAY, 1.95), (0, 0, 1.95), 36 * AWAY / WIDTH)
    scenes.lamp("SUN", 3.2, (-6, -9, 10), color="#fff1d6", size=0.03)
    street(scenes)
    car(scenes)
    eye = scene.camera
    tilt, roll, pan = eye.rotation_euler
    scenes.animate(eye, COUNT, rotation_euler=lambda frame: (tilt, roll, pan + 0.045 * sin(0.35 * (frame - FRAME))))
    return scenes.render_frames(folder, frames[-1], "PNG", frames[0])


def still(shot):
    with open_source(at_once(shot.footage.parent.with_name("at_once"))) as source:
        truth = source.read(0)[..., :3] / np.float32(255)
    return stills.sheet(
        stills.row(
            Panel(shot.source(FRAME), "A frame, as the camera turns: its rows are read one after the other"),
            Panel(shot.result(FRAME), "Repaired"),
        ),
        stills.row(
            Panel(shot.coefficients(FRAME), "Which rows are shown from earlier, and which from later"),
            Panel(truth, "A camera that reads all rows at once"),
        ),
    )


ITEM = Item(
    name="rolling_repair",
    title="what a rolling shutter has skewed stands upright again",
    footage=footage,
    recipes=("rolling_repair.json",),
    frames=(5, 17),
    still=still,
)
