"""A pole that a rolling shutter has skewed: Find Readout and Rolling Shutter Repair from the menu, and undo. Run inside
Blender, by test_window.py."""

import bpy
import driver
import numpy as np
import story

REPAIR, FIND = 9, 10  # the entries in the menu of regions
MENU = 210  # where that is below four shutters, in pixels below the sidebar's upper edge
FIELD = 210, 78  # of the readout in the panel of the last operation, to the right of where that opens, and below
ADJUSTED = 30
COUNT, SIZE, READOUT = 16, (360, 640), 0.6
SHOWN = 10  # the pole is fastest here


def frame(number):
    """A red pole and grey ones before a wall, each row at its own moment; at half of SIZE."""
    y, x = (np.arange(SIZE[0]) + 0.5)[:, None], np.arange(SIZE[1])[None]
    moved = 60 * np.sin((number + READOUT * (y / SIZE[0] - 0.5)) / 3)
    wall = 150 + 40 * np.sin((x - moved) / 17) + 0.1 * y
    picture = np.repeat(wall[..., None], 3, axis=2)
    for left, wide, color in ((110, 12, 60), (210, 16, 40), (300, 14, 50), (420, 20, (190, 10, 10)), (510, 12, 70)):
        covered = np.clip(np.minimum(x + 1, left + wide + moved) - np.maximum(x, left + moved), 0, 1)[..., None]
        picture = picture * (1 - covered) + np.array(color) * covered
    halves = picture.reshape(SIZE[0] // 2, 2, SIZE[1] // 2, 2, 3).mean(axis=(1, 3))
    return np.rint(halves).clip(0, 255).astype(np.uint8)


def opened():
    yield from story.pictures_opened([frame(number) for number in range(COUNT)], SHOWN)
    yield from driver.edge_moved(driver.area_of("SEQUENCE_EDITOR", "SEQUENCER"), 0, -296)
    for bar in story.effect().shutters[0].bars[1:]:  # a still frame
        bar.weight = 0.0
    bpy.ops.ed.undo_push(message="Start")
    story.all_viewed()
    yield 1.0


def readout():
    """In per cent, by the ramp; 0: there is none."""
    repair = driver.part("features.rolling_shutter.blender.rolling_shutter_repair")
    known = repair.of(story.effect())
    return known and round(100 * known.readout, 1)


def shown(name):
    facts = {"readout": readout, "smooth": lambda: story.effect().inbetween}
    yield from story.seen(name, regions=lambda: len(story.effect().regions), **facts)


def adjusted():
    """In the panel of the last operation, which opens at the pointer."""
    region = story.preview()
    driver.move(region, 60, 600)
    yield 0.5
    with driver.override("PREVIEW"):
        bpy.ops.screen.redo_last("INVOKE_DEFAULT")
    yield 1.0
    driver.shot("last_operation")
    driver.click(region, 60 + FIELD[0], 600 - FIELD[1], repeat=2)
    yield 0.5
    driver.key("ctrl+a")
    driver.text("30")
    driver.key("Return")
    yield from driver.until(lambda: readout() == ADJUSTED, "the readout is another")
    driver.key("Escape")
    yield 0.5


def steps():
    yield from opened()
    yield from shown("1_skewed")
    yield from story.chosen_beside_draw(FIND)
    yield from driver.until(readout, "the menu finds the readout", 60)
    yield from shown("2_found")
    yield from story.chosen_beside_draw(REPAIR, MENU)
    yield 1.0
    yield from shown("3_again")
    yield from adjusted()
    yield from shown("4_adjusted")
    for times in (1, 2):  # the second repair, the first repair
        driver.move(story.preview(), 300, 300)
        driver.key("ctrl+z")
        yield 1.5
        driver.saw(undone=times, readout=readout())
    yield from driver.until(lambda: not readout(), "it is undone")
    yield from shown("5_undone")
