"""An effect without a mouse, by Blender's search and numbers; the pointer stays over the preview."""

import bpy
import driver
import story


def found(words, condition):
    """Blender's search runs what it finds first."""
    with driver.override("PREVIEW"):
        bpy.ops.wm.search_menu("INVOKE_DEFAULT")
    yield 0.8
    driver.text(words)
    yield 0.8
    driver.shot(words.replace(" ", "_"))
    driver.key("Return")
    yield from driver.until(condition, f'"{words}" is found and done')


def typed(*words):
    """Into the fields of a dialog, whose first one is being edited, one after the other; Return closes it."""
    yield 0.6
    for k, number in enumerate(words):
        if k:
            driver.key("Tab")
            yield 0.2
        driver.key("ctrl+a")
        driver.text(number)
        yield 0.2
    driver.shot(f"typed_{words[-1]}")
    driver.key("Return")
    yield 0.3
    driver.key("Return")


def steps():
    yield from story.opened(320, 180)
    yield from story.movie_added()
    driver.edit().sequence_editor.active_strip = driver.edit().sequence_editor.strips[0]
    region = story.preview()
    driver.move(region, region.width / 2, region.height / 2)
    yield 0.5
    yield from found("add shutter strip", lambda: len(driver.edit().virtual_shutter.effects))
    yield 0.5
    yield from found("set bar weight", lambda: True)
    yield from typed("0.25", "3")
    yield from driver.until(lambda: story.effect().shutters[1].bars[2].weight == 0.25, "the bar is set")
