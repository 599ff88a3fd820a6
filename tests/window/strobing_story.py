"""Footage with too few frames for its exposure: the note in the preview, its button, which makes the streak smooth and
has the note go, and undo. Run inside Blender, by test_window.py."""

from functools import partial

import bpy
import driver
import full_quality_story as look
import numpy as np
import story

COUNT, SIZE, SPEED = 10, (180, 320), 7
BUTTON = "shutter.smooth_streaks"


def frame(number):
    """Thin lines over a texture, SPEED pixels further in every frame."""
    import cv2

    noise = np.random.default_rng(4).integers(0, 256, (48, 96, 3), dtype=np.uint8)
    texture = cv2.resize(noise, None, fx=8, fy=8, interpolation=cv2.INTER_CUBIC) // 4
    for line in range(20, texture.shape[1], 70):
        texture[:, line : line + 3] = 255
    return texture[: SIZE[0], number * SPEED : number * SPEED + SIZE[1]].copy()


def opened():
    yield from story.pictures_opened([frame(number) for number in range(COUNT)], 3)
    bpy.ops.ed.undo_push(message="Start")
    story.all_viewed()
    yield 1.0


def label():
    return look.label(BUTTON)


def note():
    """How far it goes from one frame of the exposure to the next, in pixels."""
    strobing = driver.part("blender.rendering.strobing")
    return strobing.last(story.effect())


def smooth():
    return story.effect().inbetween


def bar_counts():
    return [len(shutter.bars) for shutter in story.effect().shutters]


shown = partial(story.seen, label=label, smooth=smooth, bars=bar_counts)


def clicked():
    region = story.preview()
    driver.move(region, *look.button(BUTTON))
    yield 0.5
    driver.xdotool("click", 1)
    yield 0.5


def steps():
    yield from opened()
    yield from driver.until(note, "the note says it", 30)
    yield from shown("1_steps")
    yield from clicked()
    yield from driver.until(lambda: story.effect().inbetween != "1", "the exposure is smooth")
    yield from driver.until(lambda: label() is None, "the note goes", 20)
    yield from shown("2_smooth")
    driver.move(story.preview(), 300, 300)
    yield 0.3
    driver.key("ctrl+z")
    yield from driver.until(lambda: story.effect().inbetween == "1", "it is undone")
    yield from driver.until(label, "the note is back", 20)
    yield from shown("3_undone")
    driver.key("ctrl+shift+z")
    yield from driver.until(lambda: story.effect().inbetween != "1", "it is redone")
    yield from shown("4_redone")
