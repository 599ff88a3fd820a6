"""Effects go with their strips, and come back with them: deleted, undone, cut and pasted, copied."""

import numpy as np
import pytest
from support import (
    KEYED,
    effect_of,
    image_strip,
    in_sequencer,
    noise,
    picture_of,
    recipe,
    remembering,
    state,
    write_frames,
)

from shutter_addon.blender import handlers
from shutter_addon.blender.data import fcurves
from shutter_addon.blender.editing import add_effect, undelete

LATER = recipe(4, {101: [0, 1, 0, 0], 111: [0, 0, 1, 0]})


pytestmark = pytest.mark.usefixtures("no_exception")


@pytest.fixture
def images(tmp_path):
    frames = noise(30, 32, 32, 4)
    frames[..., 3] |= 128
    return write_frames(tmp_path / "in", frames)


@pytest.fixture
def add(edit, images):
    """Puts an image strip with an effect at a frame of the edit."""
    edit.render.resolution_x = edit.render.resolution_y = 32

    def add(start=1, data=KEYED):
        source = image_strip(edit, images, start)
        strip, _effect = effect_of(edit, source, data)
        return strip

    return add


def update(bpy):
    bpy.context.view_layer.update()


def census(bpy):
    """How many there are of all that an effect needs."""
    return {name: len(getattr(bpy.data, name)) for name in ("scenes", "cameras", "objects", "annotations", "actions")}


def curves(edit):
    return {
        (curve.data_path, curve.array_index): [tuple(key.co) for key in curve.keyframe_points]
        for curve in fcurves.curves_under(edit, "")
    }


def scene_strips(edit):
    return [strip for strip in edit.sequence_editor.strips_all if strip.type == "SCENE"]


def test_a_deleted_strip_takes_its_effect_along(bpy, edit, add, render):
    first, second = add(1), add(101, LATER)
    third = add(201)
    shown = render(edit, [205])[205]
    paths = {path for path, _ in curves(edit)}
    edit.sequence_editor.strips.remove(second)
    update(bpy)
    assert [effect.start for effect in edit.virtual_shutter.effects] == [1, 201]
    assert census(bpy) == {"scenes": 3, "cameras": 2, "objects": 2, "annotations": 2, "actions": 1}
    assert {path for path, _ in curves(edit)} == {
        p.replace("effects[2]", "effects[1]") for p in paths if "effects[1]" not in p
    }
    assert np.array_equal(render(edit, [205])[205], shown)
    edit.sequence_editor.strips.remove(first)
    edit.sequence_editor.strips.remove(third)
    update(bpy)
    assert not edit.virtual_shutter.effects
    assert not curves(edit)
    assert census(bpy) == {"scenes": 1, "cameras": 0, "objects": 0, "annotations": 0, "actions": 1}


def test_a_source_that_was_muted_shows_again(bpy, edit, add):
    """One that the user has muted does not."""
    strip = add()
    source = edit.sequence_editor.strips["images"]
    assert source.mute
    right = strip.split(11, "SOFT")  # and the source, which is connected
    right_source = next(s for s in edit.sequence_editor.strips if s.type == "IMAGE" and s != source)
    edit.sequence_editor.strips.remove(right)
    update(bpy)
    assert (source.mute, right_source.mute) == (True, False)
    edit.sequence_editor.strips.remove(strip)
    update(bpy)
    assert not source.mute
    source.mute = True  # by the user
    strip, _ = add_effect.add_effect(edit, source)
    edit.sequence_editor.strips.remove(strip)
    update(bpy)
    assert source.mute


@pytest.mark.parametrize("late", [True, False])
def test_undo_brings_an_effect_back_and_redo_removes_it_again(bpy, edit, add, render, late):
    """late: in a window, the handler comes after the undo push."""
    add(1), add(101, LATER)
    before = render(edit, [5, 105])
    known, everything = curves(edit), census(bpy)
    bpy.ops.ed.undo_push(message="add")
    if late:
        bpy.app.handlers.depsgraph_update_post.remove(handlers.HANDLERS["depsgraph_update_post"])
    edit.sequence_editor.strips.remove(scene_strips(edit)[0])
    bpy.ops.ed.undo_push(message="delete")
    if late:
        bpy.app.handlers.depsgraph_update_post.append(handlers.HANDLERS["depsgraph_update_post"])
    handlers.HANDLERS["depsgraph_update_post"]()
    assert len(edit.virtual_shutter.effects) == 1
    for _ in range(2):
        bpy.ops.ed.undo()
        edit = bpy.context.scene
        assert curves(edit) == known
        assert census(bpy) == everything
        after = render(edit, [5, 105])
        assert all(np.array_equal(after[frame], before[frame]) for frame in before)
        bpy.ops.ed.redo()
        edit = bpy.context.scene
        update(bpy)
        assert [effect.start for effect in edit.virtual_shutter.effects] == [101]
        assert census(bpy) == {"scenes": 2, "cameras": 1, "objects": 1, "annotations": 1, "actions": 1}


@pytest.mark.parametrize("cut", [True, False])
def test_pasted_strips_have_their_effect(bpy, edit, add, images, render, cut):
    """Blender's clipboard does not hold the scenes that strips show."""
    add()
    clip = bpy.data.movieclips.load(str(images))
    region = edit.virtual_shutter.effects[0].regions[0]
    region.follow_clip, region.strip = clip, "deleted with it"
    before = render(edit, [1, 5, 9, 20])
    assert not np.array_equal(before[1], before[20])
    for s in edit.sequence_editor.strips:
        s.select = True
    in_sequencer(bpy, bpy.ops.sequencer.copy)
    if cut:
        in_sequencer(bpy, bpy.ops.sequencer.delete)
        assert not edit.virtual_shutter.effects
    for start in (101, 201):
        edit.frame_set(start)
        in_sequencer(bpy, bpy.ops.sequencer.paste)
    shown = render(edit, [frame + 100 for frame in before] + [frame + 200 for frame in before])
    assert [effect.start for effect in edit.virtual_shutter.effects] == ([101, 201] if cut else [1, 101, 201])
    for region, *_ in (effect.regions for effect in edit.virtual_shutter.effects):
        assert (region.follow_clip, region.strip) == (clip, "deleted with it")
    for frame, picture in before.items():
        assert np.array_equal(shown[frame + 100], picture)
        assert np.array_equal(shown[frame + 200], picture)
    identities = [strip.scene.virtual_shutter.identity for strip in scene_strips(edit)]
    assert len(set(identities)) == len(identities)


def test_a_cut_strip_pasted_into_another_edit(bpy, edit, add, render):
    add()
    before = render(edit, [5])[5]
    other = edit.copy()
    update(bpy)
    for s in list(other.sequence_editor.strips):
        other.sequence_editor.strips.remove(s)
    update(bpy)
    assert not other.virtual_shutter.effects
    assert curves(edit)
    assert np.array_equal(render(edit, [5])[5], before)
    for s in edit.sequence_editor.strips:
        s.select = True
    in_sequencer(bpy, bpy.ops.sequencer.copy)
    bpy.context.window.scene = other
    other.frame_set(1)
    in_sequencer(bpy, bpy.ops.sequencer.paste)
    assert np.array_equal(render(other, [5])[5], before)
    assert other.virtual_shutter.effects[0].scene != edit.virtual_shutter.effects[0].scene


def test_a_region_follows_its_layer(bpy, edit, add):
    strip = add()
    effect = edit.virtual_shutter.effects[0]
    layer = strip.scene.annotation.layers[0]
    strip.scene.annotation.layers.new("Another")
    update(bpy)
    layer.info = "Renamed"
    update(bpy)
    assert effect.regions[0].layer == "Renamed"
    assert len(state(edit, effect, strip, 5).shapes[0].strokes) == 1
    strip.scene.annotation.layers.remove(layer)
    update(bpy)
    assert effect.regions[0].layer == "Renamed"
    assert state(edit, effect, strip, 5).shapes[0].strokes == ()


def test_linked_scenes_stay(bpy, edit, add, tmp_path):
    add()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.scenes = ["Shutter images"]
    update(bpy)
    assert "Shutter images" in bpy.data.scenes


def test_effect_and_source_are_connected_as_the_source_was(edit, add, images):
    source = edit.sequence_editor.strips.new_image("images", str(images), 1, 1)
    friend = edit.sequence_editor.strips.new_image("friend", str(images), 2, 1)
    add_effect.connect(edit, [source, friend])
    source.select, friend.select = True, False
    strip, _ = add_effect.add_effect(edit, source)
    assert {s.name for s in strip.connections} == {"images", "friend"}
    assert {s.name for s in friend.connections} == {"images", "Shutter"}
    assert (source.select, friend.select) == (True, False)
    assert edit.render.sequencer_gl_preview == "RENDERED"


@pytest.mark.parametrize("link", [True, False])
def test_a_linked_or_appended_edit_renders_the_same(bpy, edit, add, render, tmp_path, link):
    path, edit.name = str(tmp_path / "library.blend"), "Film"
    add(1), add(101, LATER)
    pictures = render(edit, [5, 105])
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(path, link=link) as (_, wanted):
        wanted.scenes = ["Film"]
    film = bpy.data.scenes["Film"]
    update(bpy)
    assert [effect.start for effect in film.virtual_shutter.effects] == [1, 101]
    assert len(curves(film)) > 8
    bpy.context.window.scene = film
    shown = render(edit_that_shows(bpy, film) if link else film, list(pictures))
    for frame, picture in pictures.items():
        assert np.array_equal(shown[frame], picture)
    assert all(scene.library is not None for scene in bpy.data.scenes if scene.virtual_shutter.identity) == link


def edit_that_shows(bpy, film):
    """A linked scene's settings cannot be changed, not even its current frame: a Scene strip shows its sequence."""
    edit = bpy.data.scenes.new("Local")
    edit.render.resolution_x, edit.render.resolution_y = film.render.resolution_x, film.render.resolution_y
    edit.render.dither_intensity = 0
    edit.view_settings.view_transform = "Standard"
    strip = edit.sequence_editor_create().strips.new_scene("film", film, 1, film.frame_start)
    strip.scene_input = "SEQUENCER"
    bpy.context.window.scene = edit
    return edit


def test_nothing_is_remembered_of_what_is_gone(bpy, edit, add):
    effects = [add(start).scene for start in (1, 101)]
    update(bpy)
    stays, goes = ((scene.annotation.session_uid, scene.session_uid) for scene in effects)
    picture_of(effects[1], 5)
    assert "invalidation" in remembering(goes[1])
    edit.sequence_editor.strips.remove(scene_strips(edit)[-1])
    update(bpy)
    assert "invalidation" in remembering(stays[1])
    annotation, scene = map(remembering, goes)
    assert not annotation
    assert scene <= {"invalidation"}  # a number for each scene of the session
    del effects[:]
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert [remembering(uid) for uid in stays] == [set(), set()]


def test_only_the_last_effects_that_were_removed_are_kept(edit, add):
    scene, effect = add().scene, edit.virtual_shutter.effects[0]
    for number in (*range(64), 0, *range(64, 127)):
        scene.virtual_shutter.identity = f"identity {number}"
        undelete.keep(effect)
    found = {number: undelete.restore(edit, f"identity {number}") for number in range(128)}
    kept = {number: scene for number, scene in found.items() if scene is not None}
    assert list(kept) == [0, *range(64, 127)]
    assert all(scene.virtual_shutter.identity == f"identity {number}" for number, scene in kept.items())


def test_an_effect_stays_what_it_is_while_another_edit_gets_a_copy(bpy, edit, add):
    """Undo takes an edit for unchanged that the last step did not change: a new scene in it would be gone then."""
    strip = add()
    scene, identity = strip.scene, strip.scene.virtual_shutter.identity
    other = bpy.data.scenes.new("A first one")
    pasted = other.sequence_editor_create().strips.new_scene("Pasted", scene, 1, 1)
    update(bpy)
    assert (strip.scene, scene.virtual_shutter.identity) == (scene, identity)
    assert pasted.scene != scene
