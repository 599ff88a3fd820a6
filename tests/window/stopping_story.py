"""A film renders in a window of its own, which shows the frame that was made; Esc amid a picture, which takes
hundreds of passes, ends it between two of them."""

import os
import threading

import bpy
from driver import film, key, part, render_ended, rendering, saw, shot, until, xdotool
from given_edit import opened

TICK = 0.01


class Passes:
    def __init__(self):
        self.all, self.whole, self.begun = 0, [], None
        devices = [part("blender.devices.main_thread").RelayedDevice]
        if not os.environ.get("SHUTTER_HIDDEN"):
            devices.append(part("compute.devices.gl").GLDevice)
        for device in devices:
            device.run = self._counted(device.run)
        renderer = part("compute.renderer").Renderer
        renderer.picture = self._noted(renderer.picture)

    def _counted(self, run):
        def counted(*arguments, **bound):
            run(*arguments, **bound)
            self.all += 1

        return counted

    def _noted(self, picture):
        def noted(*arguments):
            self.begun = self.all
            found = picture(*arguments)
            self.whole.append(self.all - self.begun)
            return found

        return noted

    def is_amid(self):
        """Whether a picture that is begun has most of its passes before it."""
        return len(self.whole) > 3 and self.whole[-1] / 20 < self.all - self.begun < self.whole[-1] / 3


def steps():
    yield from opened()
    passes = Passes()
    bpy.context.preferences.view.render_display_type = "WINDOW"
    film("film", 1, 60)
    yield from until(lambda: len(passes.whole) > 3, "frames are made", 120)
    yield from until(lambda: len(bpy.context.window_manager.windows) == 2, "the render has its window")
    window = bpy.context.window_manager.windows[1]
    xdotool("mousemove", window.x + window.width // 2, 500)
    yield 0.5
    shot("render_window")
    assert rendering()
    yield from until(passes.is_amid, "a picture is begun", 60, wait=TICK)
    whole = len(passes.whole)
    key("Escape")
    yield from until(lambda: not rendering(), "Esc ends the render", 60, wait=TICK)
    ended = passes.all
    last = threading.Thread(target=part("blender.rendering.sessions").SESSIONS.offscreen.run, args=(lambda: None,))
    last.start()
    yield from until(lambda: not last.is_alive(), "the render's device is free", 60, wait=TICK)
    saw(after=passes.all - ended, whole=passes.whole[0], finished_after=len(passes.whole) - whole)
    # what comes next is right
    film("after", 3, 4)
    yield from render_ended()
