"""What is above the fold of the Shutter tab, in Blender's own layout, at both scales of the interface and in both
languages: every place that is seen is pointed at. Run inside Blender, by test_window.py."""

import bpy
import driver
import numpy as np
import story

LAST = "bpy.ops.shutter.outline_it()"  # the last row of what edits a region that is drawn
SHUTTER = 74  # the row with the region's shutter is so much higher, in units of the interface
NOTES = 52, 45  # the button of the notes, from the right and from above
# Both languages and both scales are seen, though not each with each: it takes a minute each.
LAYOUTS = ("en_US", 1.0), ("de_DE", 1.5)
COUNT, SIZE, SPEED = 10, (180, 320), 7  # of footage with too few frames for its exposure


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


def note():
    """How far it goes from one frame of the exposure to the next, in pixels."""
    return driver.part("features.smooth.blender.strobing").last(story.effect())


def pointed_at():
    """The operator of the button under the pointer, as Blender copies it; None: there is none."""
    manager = bpy.context.window_manager
    window, area = manager.windows[0], driver.area_of("SEQUENCE_EDITOR", "PREVIEW")
    manager.clipboard = ""
    with bpy.context.temp_override(window=window, area=area, region=story.sidebar()):
        if bpy.ops.ui.copy_python_command_button.poll():
            bpy.ops.ui.copy_python_command_button()
    return manager.clipboard or None


def buttons():
    """The operators of all buttons that are seen in the tab, and how far down; generator: yield from it."""
    found, sidebar = {}, story.sidebar()
    unit = bpy.context.preferences.system.ui_scale
    for down in range(int(10 * unit), sidebar.height, int(14 * unit)):
        for across in (0.15, 0.5):
            driver.move(sidebar, sidebar.width * across, sidebar.height - down)
            yield 0.06
            if (button := pointed_at()) and button not in found:
                found[button] = down
    return found


def drawn():
    with driver.override("PREVIEW"):
        bpy.ops.shutter.draw("INVOKE_DEFAULT", True)
    yield 0.5
    region = story.preview()
    w, h = region.width, region.height
    yield from driver.drag(region, [(w * x, h * 0.6) for x in (0.4, 0.45, 0.5)])
    assert len(story.effect().regions) == 1
    driver.pen_left()
    yield


def steps():
    yield from opened()
    story.effect().edge_aware = 0.0  # or Draw would set it, which takes a software renderer long
    yield from drawn()
    source = driver.edit().sequence_editor.strips_all["Film"]
    source.transform.rotation, source.crop.max_x, source.color_saturation, source.use_flip_x = 0.01, 2, 0.9, True
    for language, scale in LAYOUTS:
        bpy.context.preferences.view.language = language
        bpy.context.preferences.view.ui_scale = scale
        yield 1.0
        yield from seen(f"{language}_{scale}")


def seen(name):
    yield from driver.until(note, "the note says that there are too few frames", 30)
    found = yield from buttons()
    sidebar, unit = story.sidebar(), bpy.context.preferences.system.ui_scale
    if LAST in found:
        yield from shutter_chosen(sidebar, found[LAST] - round(SHUTTER * unit))
    driver.move(story.preview(), 100, story.preview().height + 12)
    yield 1.0
    yield from driver.shot_when_shown(f"{name}_tab")
    right, down = (round(unit * place) for place in NOTES)
    driver.click(sidebar, sidebar.width - right, sidebar.height - down)
    yield 1.0
    driver.shot(name)
    left, top = driver.screen(sidebar, sidebar.width - right, sidebar.height - down)
    driver.saw(step=name, crop=[round(left - 190 * unit), round(top + 30 * unit), round(340 * unit), round(90 * unit)])
    driver.saw(buttons=found, scale=unit)
    driver.key("Escape")
    driver.move(story.preview(), 100, story.preview().height + 12)
    yield 1.0


def shutter_chosen(sidebar, down):
    """The active region's, by the menu in the row of its type."""
    assert down < sidebar.height, "it is below the fold"
    driver.move(sidebar, sidebar.width * 0.3, sidebar.height - down)
    yield 0.5
    driver.xdotool("click", 1)
    yield 1.0
    driver.shot("menu")
    driver.key("l")
    yield from driver.until(lambda: story.effect().regions[0].shutter == "Long", "the region has another shutter")
    story.effect().regions[0].shutter = "Sharp"
    story.effect().active_shutter = 1
