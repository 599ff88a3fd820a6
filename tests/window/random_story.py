"""Random operators of an editor in a hurry: nothing of an effect that is gone stays, and pictures stay right."""

import os
import random

import addon_utils
import bpy
import driver
import gpu_guard
from driver import NAME, OUT, area_of, edit, enable, film, override, part, pen_left, quit_blender, windows
from given_edit import opened

FILE, LIBRARY = str(OUT / "edit.blend"), str(OUT / "library.blend")
ENGINE, LAST = "VIRTUAL_SHUTTER", 30
random_ = random.Random(int(os.environ["SHUTTER_SEED"]))
_number = 0  # of pictures


def strips(kind=None):
    if "Edit" not in bpy.data.scenes or edit().sequence_editor is None:
        return []
    return [strip for strip in edit().sequence_editor.strips if kind in (None, strip.type)]


def chosen(kind=None):
    """A random strip, as the active and only selected one; None: there is none."""
    if not (found := strips(kind)):
        return None
    strip = random_.choice(found)
    for other in strips():
        other.select = other == strip
    edit().sequence_editor.active_strip = strip
    return strip


def sequencer(name, **options):
    operator = getattr(bpy.ops.sequencer, name)
    with override("SEQUENCER"):
        if operator.poll():
            operator("EXEC_DEFAULT", True, **options)


# What an editor does. Generators wait for Blender.


def effect_added():
    if chosen("IMAGE"):
        with override("SEQUENCER"):
            if bpy.ops.shutter.add_effect.poll():
                bpy.ops.shutter.add_effect("EXEC_DEFAULT", True)
        with override("PREVIEW"):
            if bpy.ops.shutter.recipe_import.poll():
                bpy.ops.shutter.recipe_import("EXEC_DEFAULT", True, filepath=os.environ["SHUTTER_RECIPE"])


def deleted():
    if chosen("SCENE"):
        sequencer("delete")


def source_deleted():
    if len(strips("IMAGE")) > 1 and chosen("IMAGE"):
        sequencer("delete")


def removed():
    """By a script: Blender tells of it later."""
    if strips("SCENE"):
        edit().sequence_editor.strips.remove(random_.choice(strips("SCENE")))


def scene_removed():
    if found := [strip.scene for strip in strips("SCENE") if strip.scene]:
        bpy.data.scenes.remove(random_.choice(found))
        bpy.ops.ed.undo_push()


def undone():
    with override("SEQUENCER"):
        if bpy.ops.ed.undo.poll():
            bpy.ops.ed.undo()


def redone():
    with override("SEQUENCER"):
        if bpy.ops.ed.redo.poll():
            bpy.ops.ed.redo()


def split():
    edit().frame_set(random_.randint(2, LAST))
    for strip in strips():
        strip.select = True
    sequencer("split", frame=edit().frame_current)


def moved():
    if strip := chosen("IMAGE"):
        for other in strips():
            other.select = other == strip or other in list(strip.connections)
        with override("SEQUENCER"):
            bpy.ops.transform.seq_slide("EXEC_DEFAULT", True, value=(random_.randint(-5, 5), random_.randint(0, 2)))


def copied():
    chosen()
    sequencer("copy")


def pasted():
    edit().frame_set(random_.randint(1, 3 * LAST))
    sequencer("paste")


def duplicated():
    if chosen():
        sequencer("duplicate")


def scrubbed():
    edit().frame_set(random_.randint(1, LAST))


def view_changed():
    bpy.context.window_manager.virtual_shutter.view = random_.choice(("RESULT", "SPLIT", "SCRIBBLES", "COEFFICIENTS"))


def drawn():
    """The pen for the annotation that the preview shows, or for a new region's, and back."""
    with override("PREVIEW"):
        if bpy.ops.shutter.draw.poll():
            bpy.ops.shutter.draw("EXEC_DEFAULT", True, new=random_.random() < 0.5)
    pen_left()


def saved():
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / "now.blend"))


def file_opened():
    now = OUT / "now.blend"
    bpy.ops.wm.open_mainfile(filepath=str(now) if now.exists() and random_.random() < 0.5 else FILE)


def new_file():
    bpy.ops.wm.read_homefile(app_template="Video_Editing")
    if random_.random() < 0.5:
        yield
    if not addon_utils.check(NAME)[1]:
        enable()
    file_opened()


def appended():
    with bpy.data.libraries.load(LIBRARY) as (there, here):
        here.scenes = [name for name in there.scenes if name == "Edit"]
    bpy.ops.ed.undo_push()
    if random_.random() < 0.5:  # and the appended edit is removed
        for scene in [scene for scene in bpy.data.scenes if scene.name.startswith("Edit.")]:
            bpy.data.scenes.remove(scene)


def disabled():
    addon_utils.disable(NAME)
    if random_.random() < 0.5:
        yield
    enable()


def window_closed():
    bpy.ops.wm.window_new()
    yield 0.3
    with bpy.context.temp_override(window=windows()[-1]):
        bpy.ops.wm.window_close()
    # Here Blender's GPU is not current. Operators that push undo end Blender by themselves.
    if random_.random() < 0.7:
        random_.choice((file_opened, removed, still_rendered, lambda: addon_utils.disable(NAME)))()
        if not addon_utils.check(NAME)[1]:
            enable()


def film_rendered():
    first = random_.randint(1, LAST)
    film("film", first, first + 2)
    if random_.random() < 0.3:
        yield
        undone()
    yield from driver.render_ended()


def still_shown():
    """F12, in a window of its own, which is closed."""
    bpy.context.preferences.view.render_display_type = "WINDOW"
    with bpy.context.temp_override(window=windows()[0], scene=edit()):
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield from driver.until(lambda: not driver.rendering(), "the picture is rendered", 60)
    bpy.context.preferences.view.render_display_type = "NONE"
    for window in list(windows())[1:]:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.window_close()


def still_rendered():
    """A picture, noted with the source frame that it has to show."""
    global _number
    expected = expectation()
    if expected is None:
        return
    _number += 1
    edit().render.filepath = str(OUT / f"still{_number:03d}.png")
    bpy.ops.render.render(write_still=True, scene="Edit")
    if (failure := part("blender.rendering.render_job").job.failure) is not None:
        print(f"refused: {failure}", flush=True)
    driver.saw(still=f"still{_number:03d}.png", shows=expected)


def expectation():
    """(0-based source frame, whether through the effect) of what the edit shows now; None: another picture, or one that
    is not known here."""
    frame = edit().frame_current
    seen = [strip for strip in strips() if strip.left_handle <= frame < strip.right_handle and not strip.mute]
    if not seen or any(lacks_source(strip) for strip in seen):  # which ends the render
        return None
    top = max(seen, key=lambda strip: strip.channel)
    below = [strip for strip in seen if strip.type == "IMAGE" and strip.channel < top.channel]
    own = [strip for strip in below if strip.virtual_shutter_source and strip.virtual_shutter_source == source_of(top)]
    source = top if top.type == "IMAGE" else own[0] if len(own) == 1 else None
    is_cut = source is not None and source.content_start != int(source.content_start)
    effects = [each for each in edit().virtual_shutter.effects if top.type == "SCENE" and each.scene == top.scene]
    if source is None or is_cut or any(len(each.regions) != 1 or each.window != 6 for each in effects):
        return None  # the effect is another than the recipe's
    return int(frame - source.content_start), top.type == "SCENE"


def source_of(strip):
    """The identity of the source of the effect that a strip shows."""
    effects = edit().virtual_shutter.effects if strip.type == "SCENE" else ()
    return next((each.source for each in effects if each.scene == strip.scene), None)


def lacks_source(strip):
    """Whether a strip shows an effect whose scene or source is not there, or not at this frame."""
    if strip.type == "SCENE" and strip.scene is None:
        return True
    if strip.type != "SCENE" or (source := source_of(strip)) is None:
        return False
    frame = edit().frame_current
    sources = [each for each in strips("IMAGE") if each.virtual_shutter_source == source]
    return not any(each.left_handle <= frame < each.right_handle for each in sources)


WORK = (
    *(effect_added, effect_added, deleted, deleted, source_deleted, removed, scene_removed, undone, undone, undone),
    *(redone, redone, split, moved, copied, pasted, duplicated, scrubbed, scrubbed, view_changed, drawn, saved),
    *(file_opened, new_file, appended, disabled, window_closed, film_rendered, still_shown, still_rendered),
    still_rendered,
)


# What has to hold after each


def check(did):
    """Nothing of an effect that is gone is left."""
    edits = [scene for scene in bpy.data.scenes if scene.render.engine != ENGINE]
    strips_ = [strip for scene in edits if scene.sequence_editor for strip in scene.sequence_editor.strips_all]
    shown = {strip.scene for strip in strips_ if strip.type == "SCENE"}
    orphans = [scene.name for scene in bpy.data.scenes if scene.render.engine == ENGINE and scene not in shown]
    assert not orphans, f"after {did}: scenes that no strip shows: {orphans}"
    kept = {scene.annotation for scene in shown if scene} | {bpy.data.annotations.get("Mine")}
    stray = [each.name for each in bpy.data.annotations if each not in kept and each.users]
    assert not stray, f"after {did}: annotations of no effect: {stray}"
    effects = [effect.scene for scene in edits for effect in scene.virtual_shutter.effects]
    assert set(effects) <= shown, f"after {did}: effects that no strip shows"
    assert "Mine" in bpy.data.annotations, f"after {did}: the editor's own annotation is gone"


def begun():
    # Where Blender's clipboard is: else that of other Blenders.
    bpy.context.preferences.filepaths.temporary_directory = str(OUT)
    yield from opened()
    edit().frame_end = LAST
    edit().sequence_editor.use_cache_raw = edit().sequence_editor.use_cache_final = True
    area_of("SEQUENCE_EDITOR", "SEQUENCER").spaces.active.timeline_overlay.thumbnail_display_style = "NO_THUMBNAILS"
    mine = bpy.data.annotations.new("Mine")
    mine.use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=LIBRARY, copy=True)
    bpy.ops.wm.save_as_mainfile(filepath=FILE)
    bpy.ops.wm.open_mainfile(filepath=FILE)  # with nothing to undo
    yield 0.5
    copied()  # so that there is something to paste


def steps():
    yield from begun()
    gpu_guard.on()
    did = []
    for number in range(int(os.environ["SHUTTER_STEPS"])):
        work = random_.choice(WORK)
        did = [*did[-11:], f"{number} {work.__name__}"]
        print(did[-1], flush=True)
        yield from work() or ()
        yield 0.15
        yield 0.05
        check(did)
        if "Edit" not in bpy.data.scenes or len(strips()) > 16:
            bpy.ops.wm.open_mainfile(filepath=FILE)
            yield 0.3
    yield from quit_blender()
