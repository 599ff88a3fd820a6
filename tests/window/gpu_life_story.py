"""Blender's GPU is not current: a window was closed, and none has been drawn since. Whatever a script, a timer, a modal
operator or a handler does then, Blender lives, and shows the same picture afterwards."""

import os

import addon_utils
import bpy
import gpu_guard
from driver import NAME, OUT, edit, enable, override, quit_blender, rendering, saw, shot_when_shown, until, windows
from given_edit import opened

FILE = str(OUT / "edit.blend")


def effect_strip():
    return next(strip for strip in edit().sequence_editor.strips if strip.type == "SCENE")


# How Blender's GPU is lost


def second_window():
    bpy.ops.wm.window_new()
    yield from until(lambda: len(windows()) == 2, "the second window opens")
    yield 0.5
    with bpy.context.temp_override(window=windows()[-1]):
        bpy.ops.wm.window_close()


def render_window():
    bpy.context.preferences.view.render_display_type = "WINDOW"
    with bpy.context.temp_override(window=windows()[0], scene=edit()):
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield from until(lambda: len(windows()) == 2 and not rendering(), "the frame is rendered", 60)
    yield 0.5
    bpy.context.preferences.view.render_display_type = "NONE"
    with bpy.context.temp_override(window=windows()[-1]):
        bpy.ops.wm.window_close()


def no_loss():
    yield


# What is done then


def file_opened():
    bpy.ops.wm.open_mainfile(filepath=FILE)


def home_read():
    bpy.ops.wm.read_homefile(app_template="Video_Editing")


def disabled():
    addon_utils.disable(NAME)


def strip_removed():
    edit().sequence_editor.strips.remove(effect_strip())
    bpy.context.view_layer.update()
    edit().view_layers[0].update()


def strip_deleted():
    edit().sequence_editor.active_strip = effect_strip()
    for strip in edit().sequence_editor.strips:
        strip.select = strip == effect_strip()
    with override("SEQUENCER"):
        bpy.ops.ed.undo_push()  # an operator that pushes by itself ends Blender here, without any extension as well
        bpy.ops.sequencer.delete("EXEC_DEFAULT")
        bpy.ops.ed.undo_push()


def deletion_undone():
    strip_deleted()
    with override("SEQUENCER"):
        bpy.ops.ed.undo()


def scene_removed():
    bpy.data.scenes.remove(effect_strip().scene)


def source_changed():
    edit().sequence_editor.strips["Source"].use_reverse_frames = True
    edit().view_layers[0].update()


def still_rendered():
    path = OUT / "still.png"
    path.unlink(missing_ok=True)
    edit().render.filepath = str(path)
    bpy.ops.render.render(write_still=True, scene="Edit")
    assert path.exists()


def device_changed():
    """And the memory that textures may take: both sessions begin anew."""
    preferences = bpy.context.preferences.addons[NAME].preferences
    preferences.gpu_memory = 700 if preferences.gpu_memory != 700 else 800
    preferences.device = "CPU"
    still_rendered()
    preferences.device = "AUTO"


def refused_on_blenders_gpu():
    """The one render that has no other: it says so."""
    preferences = bpy.context.preferences.addons[NAME].preferences
    preferences.device = "BLENDER"
    edit().render.filepath = str(OUT / "refused.png")
    bpy.ops.render.render(write_still=True, scene="Edit")
    preferences.device = "AUTO"


def reregistered():
    disabled()
    enable()


# Who does it


def by_timer(act):
    act()
    yield


class SHUTTER_TEST_OT_act(bpy.types.Operator):
    bl_idname = "shutter_test.act"
    bl_label = "Act"

    def invoke(self, context, _event):
        context.window_manager.modal_handler_add(self)
        self._timer = context.window_manager.event_timer_add(0.05, window=context.window)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        SHUTTER_TEST_OT_act.act()
        SHUTTER_TEST_OT_act.act = None
        return {"FINISHED"}


def by_modal_operator(act):
    SHUTTER_TEST_OT_act.act = act
    with override("SEQUENCER"):
        bpy.ops.shutter_test.act("INVOKE_DEFAULT")
    yield from until(lambda: SHUTTER_TEST_OT_act.act is None, "the modal operator acts")


def by_handler(act):
    """As Blender tells of a change."""

    def changed(*_):
        bpy.app.handlers.depsgraph_update_post.remove(changed)
        act()

    bpy.app.handlers.depsgraph_update_post.append(changed)
    edit().view_settings.gamma = 1.0
    edit().update_tag()
    bpy.context.view_layer.update()
    edit().view_layers[0].update()
    yield


def again():
    """The edit as it was saved, shown by the live preview on Blender's GPU; generator: yield from it."""
    if not addon_utils.check(NAME)[1]:
        enable()
    bpy.ops.wm.open_mainfile(filepath=FILE)
    yield 0.6
    bpy.context.window_manager.virtual_shutter.view = "COEFFICIENTS"
    yield 0.6


def lost():
    return not gpu_guard.is_current()


# On each of Blender's backends: how the GPU is lost, who acts then, and what is done.
PARTS = {
    "opengl": (
        *((no_loss, by_timer, act) for act in (reregistered, still_rendered)),
        *((second_window, by_timer, act) for act in (disabled, strip_removed, source_changed, device_changed)),
        *((second_window, by_modal_operator, act) for act in (file_opened, strip_deleted, deletion_undone)),
        *((second_window, by_handler, act) for act in (scene_removed, strip_removed)),
        (second_window, by_timer, refused_on_blenders_gpu),
    ),
    "vulkan": (
        *((render_window, by_timer, act) for act in (file_opened, disabled)),
        (second_window, by_timer, home_read),
        (second_window, by_handler, strip_removed),
        (second_window, by_modal_operator, still_rendered),
    ),
}


def steps():
    yield from opened()
    bpy.utils.register_class(SHUTTER_TEST_OT_act)
    bpy.ops.wm.save_as_mainfile(filepath=FILE)
    gpu_guard.on()
    yield from again()
    yield from shot_when_shown("before")
    for loss, who, act in PARTS[os.environ["BACKEND"]]:
        yield from again()
        yield from loss()
        saw(act=act.__name__, lost=lost())
        yield from who(act)
        yield 0.3
    yield from again()
    yield from shot_when_shown("after")
    yield from loss()
    saw(act="quit", lost=lost())
    yield from quit_blender()
