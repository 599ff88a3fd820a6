"""The render engine of effect scenes: Blender's sequencer calls it for every frame it needs of an effect strip."""

import os
import sys
import traceback

import bpy
import numpy as np

from ..core.messages import signed
from . import pictures
from .strips import ENGINE


class VirtualShutterEngine(bpy.types.RenderEngine):
    bl_idname = ENGINE
    bl_label = "Virtual Shutter"
    bl_use_preview = False

    def render(self, depsgraph):
        try:
            picture = pictures.picture(depsgraph.scene, depsgraph.scene.frame_current, self._say)
        except pictures.FAULTS as error:
            fail(self, str(error))
            return
        except Exception as error:  # Blender would print it, and render the frame without the effect
            traceback.print_exc()
            fail(self, f"internal error: {error!r}")
            return
        picture = pictures.resized(picture, self.resolution_x, self.resolution_y)
        result = self.begin_result(0, 0, self.resolution_x, self.resolution_y)
        # Blender's rows go up; composed pictures lie so in memory, and this copies nothing.
        result.layers[0].passes["Combined"].rect.foreach_set(np.ascontiguousarray(picture[::-1]).ravel())
        self.end_result(result)
        pictures.begin_next(depsgraph.scene, depsgraph.scene.frame_current)

    def _say(self, message: str) -> None:
        if bpy.app.background:
            print(signed(message), file=sys.stderr, flush=True)
        else:
            self.report({"WARNING"}, signed(message))


def fail(engine, sentence: str) -> None:
    """Says why there is no picture: a report in the window; without one, the process ends.

    Blender goes on after an engine's error and writes the frame without it: a farm would deliver a plain film.
    """
    if bpy.app.background:
        refuse(sentence)
    engine.report({"ERROR"}, signed(sentence))


def refuse(sentence: str) -> None:
    """Ends the process from inside a render: the sentence on stderr, exit code 2."""
    print(signed(sentence), file=sys.stderr, flush=True)
    leave(2)


def leave(code: int) -> None:
    """Ends the process from inside a render; after sys.exit Blender would complain about its memory."""
    for clean_up in before_leaving:
        clean_up()
    sys.stdout.flush()
    os._exit(code)


before_leaving = []

classes = (VirtualShutterEngine,)


def register():
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
