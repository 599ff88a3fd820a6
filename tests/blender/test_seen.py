"""What is edited is the effect that is seen; and no preview keeps an annotation of an effect that is gone."""

import numpy as np
import pytest
from support import sequencer, started, write_frames, write_tone

from shutter_addon.blender.data import selection
from shutter_addon.blender.editing import add_effect, reconcile, shown_annotations, undelete

pytestmark = pytest.mark.usefixtures("no_exception")


def seen(edit):
    found = selection.seen(edit)
    return found and found[2]


def active(bpy):
    found = selection.active(bpy.context)
    return found and found[2]


def another(bpy, edit, tmp_path, channel=5, start=1):
    """A second effect, on a source of its own, from a channel and a frame on."""
    first = write_frames(tmp_path / f"in{channel}", np.zeros((1, 24, 40, 3), dtype=np.uint8))
    source = edit.sequence_editor.strips.new_image("other", str(first), channel, start)
    source.right_handle = start + 40
    strip, _effect = started(edit, source)
    return strip


def strip_of(edit, effect):
    return next(s for s in edit.sequence_editor.strips_all if s.type == "SCENE" and s.scene == effect.scene)


def source_of(edit, effect):
    return next(s for s in edit.sequence_editor.strips_all if s.virtual_shutter_source == effect.source)


def test_after_a_cut_the_half_that_is_selected_is_edited_else_that_under_the_playhead(bpy, edit, effect, tmp_path):
    left = strip_of(edit, effect)
    right = left.split(21, "SOFT")  # and the source, which is connected
    bpy.context.view_layer.update()
    own = {left: left, right: right, source_of(edit, effect): left, None: None}
    for chosen, wanted in own.items():
        selection.choose(edit, chosen)
        for frame, half in ((20, left), (21, right)):
            edit.frame_set(frame)
            assert seen(edit) == half
            assert active(bpy) == (wanted or half)
            assert (selection.in_picture(bpy.context) is not None) == (active(bpy) == half)
    selection.choose(edit, left)
    left.select = False
    assert active(bpy) == right
    write_tone(tmp_path / "a.wav")
    edit.sequence_editor.active_strip = sound = edit.sequence_editor.strips.new_sound("", str(tmp_path / "a.wav"), 9, 1)
    add_effect.connect(edit, [left, source_of(edit, effect), sound])
    assert selection.active_strip(bpy.context) == source_of(edit, effect)


def test_of_effects_on_top_of_each_other_the_active_one_is_edited(bpy, edit, effect, tmp_path):
    low, high = strip_of(edit, effect), another(bpy, edit, tmp_path)
    for chosen, expected in ((low, low), (high, high), (source_of(edit, effect), low), (None, high)):
        edit.sequence_editor.active_strip = chosen
        assert seen(edit) == active(bpy) == expected
    edit.sequence_editor.active_strip = edit.sequence_editor.strips.new_effect("title", "TEXT", 9, 1, length=40)
    assert active(bpy) is None
    assert selection.in_picture(bpy.context) is None
    assert seen(edit) == high


def test_what_is_muted_is_not_edited(bpy, edit, effect, tmp_path):
    low, high = strip_of(edit, effect), another(bpy, edit, tmp_path)
    edit.sequence_editor.active_strip = high
    high.mute, high.select = True, False
    assert seen(edit) == active(bpy) == low
    high.select = True
    assert active(bpy) == high
    assert selection.in_picture(bpy.context) is None
    edit.sequence_editor.channels[low.channel].mute = True
    assert seen(edit) is None
    assert active(bpy) == high
    assert selection.why_unseen(edit, high) == selection.why_unseen(edit, low) == "Unmute the Shutter strip"


def test_an_effect_in_a_closed_meta_strip_is_not_edited_in_the_picture(bpy, edit, effect):
    meta = edit.sequence_editor.strips.new_meta("meta", 7, 1)
    meta.right_handle = 41
    strip = strip_of(edit, effect)
    strip.move_to_meta(meta)
    edit.sequence_editor.active_strip = strip
    assert seen(edit) is None
    assert selection.why_unseen(edit, strip) == "Open the meta strip that the Shutter strip is in"
    edit.sequence_editor.display_stack(meta)
    assert seen(edit) == strip


@pytest.fixture
def previews(bpy, edit, effect):
    """A preview that has the effect's annotation, and one behind another editor that has it as well."""
    screen = bpy.data.window_managers[0].windows[0].screen
    with sequencer(bpy) as area:
        area.spaces.active.view_type = "PREVIEW"
        hidden = screen.areas[1]
        hidden.type = "SEQUENCE_EDITOR"
        found = [area.spaces.active, hidden.spaces.active]
        for space in found:
            shown_annotations.give(space, effect.scene.annotation)
        hidden.type = "CONSOLE"
        yield [area.spaces.active, next(s for s in hidden.spaces if s.type == "SEQUENCE_EDITOR")]


def by_strip(bpy, edit, effect):
    edit.sequence_editor.strips.remove(strip_of(edit, effect))


def by_scene(bpy, edit, effect):
    bpy.data.scenes.remove(effect.scene)


def by_edit(bpy, edit, effect):
    bpy.context.window.workspace.sequencer_scene = bpy.context.window.scene = bpy.data.scenes.new("Other")
    bpy.data.scenes.remove(edit)


@pytest.mark.parametrize("delete", [by_strip, by_scene, by_edit])
def test_no_preview_keeps_what_a_deleted_effect_had(bpy, edit, effect, previews, delete, tmp_path):
    delete(bpy, edit, effect)
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)  # in the same step, before Blender updates anything
    assert [space.annotation for space in previews] == [None, None]
    assert not bpy.data.annotations
    assert not bpy.data.cameras
    with bpy.data.libraries.load(path) as (found, _):
        assert (len(found.scenes), found.annotations, found.cameras, found.objects) == (1, [], [], [])


def test_annotations_of_the_user_stay(bpy, edit, effect, previews, tmp_path):
    """Those that are shown in place of an effect's, copies, and those that are used elsewhere."""
    drawn, copied = bpy.data.annotations.new("Shutter of mine"), effect.scene.annotation.copy()
    previews[0].annotation, previews[1].annotation = drawn, copied
    reconcile.update()
    other = bpy.data.scenes.new("Other")
    other.annotation = used = effect.scene.annotation
    by_strip(bpy, edit, effect)
    reconcile.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert [space.annotation for space in previews] == [drawn, copied]
    assert other.annotation == used
    assert len(bpy.data.annotations) == 3


def test_of_a_removed_scene_that_a_strip_brings_back_one_annotation_is_left(bpy, edit, effect, previews):
    """The strip stays, and gets its effect again, which was kept when it was deleted before."""
    scene, strip = effect.scene, strip_of(edit, effect)
    undelete.keep(effect)
    previews[0].annotation = scene.annotation
    bpy.data.scenes.remove(scene)
    assert strip.scene is None
    reconcile.update()
    assert strip.scene is not None
    assert [strip.scene.annotation] == list(bpy.data.annotations)
    assert [strip.scene.camera.data] == list(bpy.data.cameras)


def test_previews_follow_what_is_seen(bpy, edit, effect, previews, tmp_path):
    other = another(bpy, edit, tmp_path, start=101)
    own = effect.scene.annotation  # it may have moved in memory
    for frame, expected in ((110, other.scene.annotation), (20, own), (70, None), (20, own)):
        edit.frame_set(frame)
        shown_annotations.follow()
        assert previews[0].annotation == expected, frame
        is_laid = previews[0].preview_overlay.show_annotation
        assert is_laid == (expected is None), "our draw handler shows it where it is, Blender where it was drawn"
    previews[0].annotation = None  # by the user
    shown_annotations.follow()
    assert previews[0].annotation is None
    previews[0].annotation = drawn = bpy.data.annotations.new("Notes")
    shown_annotations.give(previews[0], own)
    assert drawn.use_fake_user, "the annotation that the preview had is kept"


def test_undo_shows_the_scribbles_again(bpy, edit, effect, previews):
    bpy.ops.ed.undo_push(message="before")
    by_strip(bpy, edit, effect)
    reconcile.update()
    bpy.ops.ed.undo_push(message="deleted")
    bpy.ops.ed.undo()
    edit = bpy.context.scene
    assert previews[0].annotation == edit.virtual_shutter.effects[0].scene.annotation is not None


@pytest.mark.parametrize("has_effect", [False, True])
def test_a_drawing_of_the_user_survives_an_autosave(bpy, edit, request, tmp_path, has_effect):
    """Nothing is marked before it, and the file is not of an older version for that."""
    if has_effect:
        request.getfixturevalue("effect")
    with sequencer(bpy) as area:
        area.spaces.active.annotation = bpy.data.annotations.new("Shutter of mine")
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "autosave.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "autosave.blend"))
    assert "Shutter of mine" in bpy.data.annotations
