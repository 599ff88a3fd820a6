"""Footage with too few frames for its exposure: the note, its button, which makes the streak smooth and has the note
go, and undo. Run inside Blender, by test_window.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import os
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]
sys.path.append(os.environ["SHUTTER_PACKAGES"])

import bpy
import driver
import numpy as np
import story
from support import write_frames

COUNT, SIZE, SPEED = 10, (360, 640), 7
FILM = driver.OUT / "film"


def frame(number):
    """Thin lines over a texture, SPEED pixels further in every frame."""
    import cv2

    noise = np.random.default_rng(4).integers(0, 256, (48, 96, 3), dtype=np.uint8)
    texture = cv2.resize(noise, None, fx=8, fy=8, interpolation=cv2.INTER_CUBIC) // 4
    for line in range(20, texture.shape[1], 70):
        texture[:, line : line + 3] = 255
    return texture[: SIZE[0], number * SPEED : number * SPEED + SIZE[1]].copy()


def opened():
    yield from story.opened()
    first = write_frames(FILM, [frame(number) for number in range(COUNT)])
    yield from story.pictures_added(first, SIZE)
    story.edit().frame_set(3)
    story.effect().inbetween = "1"
    bpy.ops.ed.undo_push(message="Start")
    with driver.override("PREVIEW"):
        bpy.ops.sequencer.view_all_preview()
    yield 1.0


def note():
    """How far it goes from one frame of the exposure to the next, in pixels."""
    strobing = sys.modules["bl_ext.user_default.virtual_shutter.shutter_addon.blender.rendering.strobing"]
    return strobing.last(story.effect())


def shown(name):
    region = story.preview()
    driver.move(region, region.width / 2, region.height + 12)
    yield 1.0
    yield from driver.shot_when_shown(name)
    driver.saw(step=name, crop=story.crop(), note=note(), smooth=story.effect().inbetween, bars=bar_counts())


def bar_counts():
    return [len(shutter.bars) for shutter in story.effect().shutters]


def clicked():
    with driver.override("PREVIEW"):
        bpy.ops.shutter.smooth_streaks("EXEC_DEFAULT", True)
    yield 0.5


def told():
    yield from opened()
    yield from driver.until(note, "the note says it", 30)
    yield from shown("1_steps")
    yield from clicked()
    yield from driver.until(lambda: story.effect().inbetween != "1", "the exposure is smooth")
    yield from driver.until(lambda: note() is None, "the note goes", 20)
    yield from shown("2_smooth")
    driver.move(story.preview(), 300, 300)
    yield 0.3
    driver.key("ctrl+z")
    yield from driver.until(lambda: story.effect().inbetween == "1", "it is undone")
    yield from driver.until(note, "the note is back", 20)
    yield from shown("3_undone")
    driver.key("ctrl+shift+z")
    yield from driver.until(lambda: story.effect().inbetween != "1", "it is redone")
    yield from shown("4_redone")


if __name__ == "__main__":
    driver.play(told)
