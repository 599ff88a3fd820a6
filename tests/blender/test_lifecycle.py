"""Effects go with their strips, and come back with them: deleted, undone, cut, pasted, copied; and for other clips."""

import numpy as np
import pytest
from support import (
    KEYED,
    MOVED,
    copy_all,
    effect_of,
    image_strip,
    in_sequencer,
    noise,
    picture_of,
    python,
    recipe,
    remembering,
    state,
    write_frames,
)

from shutter_addon.blender import handlers
from shutter_addon.blender.data import annotations, data_format, fcurves, selection, strips
from shutter_addon.blender.editing import add_effect, match_source, undelete
from shutter_addon.core.model.scribbles import mapped

LATER = recipe(4, {101: [0, 1, 0, 0], 111: [0, 0, 1, 0]})
SCRIPT = """
import bpy
from shutter_addon import blender
from shutter_addon.blender.data import strips
from shutter_addon.blender.editing import add_effect, reconcile, shutter_edits

blender.register()
edit = bpy.context.scene
source = edit.sequence_editor_create().strips.new_image("images", {path!r}, 1, 1)
strip, effect = add_effect.add_effect(edit, source)
shutter_edits.start(effect)
effect.inbetween = "1"
for i in range(6):
    edit.sequence_editor.strips.new_scene("copy", effect.scene, 5, 200 + 100 * i)
reconcile.tidy()
effects = edit.virtual_shutter.effects
print("EFFECTS", [effect.start for effect in effects], len({{effect.scene.name for effect in effects}}))
"""


def test_many_copies_at_once(tmp_path):
    """Blender moves the items of a collection that grows; what is freed is filled here, so that no one reads on."""
    first = write_frames(tmp_path / "in", np.zeros((1, 24, 40, 3), dtype=np.uint8))
    done = python("-c", SCRIPT.format(path=str(first)), MALLOC_PERTURB_="165")
    assert "EFFECTS [1.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0] 7" in done.stdout, (done.returncode, done.stderr)


pytestmark = pytest.mark.usefixtures("no_exception")


@pytest.fixture
def clip(edit, tmp_path):
    """Adds a clip of noise of its own, from a frame on, in a channel; height and width."""
    edit.render.resolution_x = edit.render.resolution_y = 32

    def add(start=1, channel=1, size=(32, 32), scene=None, channels=3):
        frames = noise(20, *size, channels, seed=start + channel)
        (scene or edit).sequence_editor_create()
        first = write_frames(tmp_path / f"in {start} {channel} {size[0]}", frames)
        return image_strip(scene or edit, first, start, channel, f"clip {start}")

    return add


@pytest.fixture
def add(bpy, edit, clip):
    """A clip with a keyed effect; its strip."""

    def made(start=1, data=KEYED):
        strip, _effect = effect_of(edit, clip(start), data)
        update(bpy)
        return strip

    return made


def update(bpy):
    bpy.context.view_layer.update()


def its_effect(strip):
    return strips.effect_of(strip.id_data, strip.scene)


def source_of(strip):
    return strips.nearest_source(strip.id_data, its_effect(strip), strip)


def shown(edit):
    """The effect strips, from left to right."""
    return sorted(strips.effect_strips(edit), key=lambda strip: strip.left_handle)


def cut(edit, frame, kind="SOFT", only=None):
    """All strips at a frame, or those of a type alone."""
    for each in list(edit.sequence_editor.strips):
        if strips.is_at(each, frame - 1) and strips.is_at(each, frame) and only in (None, each.type):
            each.split(frame, kind, ignore_connections=True)


def unlike(edit, render, before):
    """Frames that are not as they were before."""
    after = render(edit, list(before))
    return [frame for frame in before if not np.array_equal(after[frame], before[frame])]


def census(bpy):
    """How many there are of all that an effect needs."""
    return {name: len(getattr(bpy.data, name)) for name in ("scenes", "cameras", "objects", "annotations", "actions")}


def curves(edit):
    return {
        (curve.data_path, curve.array_index): [tuple(key.co) for key in curve.keyframe_points]
        for curve in fcurves.curves_under(edit, "")
    }


@pytest.mark.parametrize("kind", ["SOFT", "HARD"])
@pytest.mark.parametrize(("only", "effects", "sources"), [(None, 3, 3), ("SCENE", 3, 1), ("IMAGE", 1, 1)])
def test_each_part_of_a_cut_strip_has_its_own_effect(bpy, edit, add, render, kind, only, effects, sources):
    strip = add()
    before = render(edit, [1, 7, 8, 9, 14, 15, 20])
    for frame in (8, 15):
        cut(edit, frame, kind, only)
        update(bpy)
    if (kind, only) != ("HARD", "IMAGE"):  # which leaves the effect's source another content
        assert unlike(edit, render, before) == []
    parts, own = shown(edit), edit.virtual_shutter.effects
    assert parts[0] == strip  # and has the effect that was there
    assert its_effect(strip) == own[0]
    assert len(parts) == len(own) == effects
    assert len({effect.scene for effect in own}) == len({effect.scene.annotation for effect in own}) == effects
    assert len({effect.source for effect in own}) == len({source_of(part).name for part in parts}) == sources
    if effects > 1:
        last = its_effect(parts[-1])
        last.window, last.shutters[0].name = 24, "Other"
        drawing = last.scene.annotation.layers[0].frames[0]
        drawing.strokes.remove(drawing.strokes[0])
        assert [(effect.window, effect.shutters[0].name) for effect in own] == [(4, "S0")] * 2 + [(24, "Other")]
        assert unlike(edit, render, {frame: before[frame] for frame in (1, 7, 8, 14)}) == []


def test_parts_in_a_meta_strip_and_its_copies(bpy, edit, add):
    strip = add()
    meta = edit.sequence_editor.strips.new_meta("meta", 5, 1)
    meta.right_handle = 21
    for each in (source_of(strip), strip):
        each.move_to_meta(meta)
    for each in list(meta.strips):
        each.split(8, "SOFT", ignore_connections=True)
    update(bpy)
    selection.choose(edit, meta)
    in_sequencer(bpy, bpy.ops.sequencer.duplicate)
    parts = strips.effect_strips(edit)
    assert len({part.scene for part in parts}) == len({source_of(part).name for part in parts}) == 4
    assert all(source_of(part).parent_meta() == part.parent_meta() for part in parts)


def test_a_cut_is_undone_and_done_again(bpy, edit, add, render):
    """The effect of the right half is made after the step of the cut."""
    add()
    before = render(edit, [5, 15])
    bpy.ops.ed.undo_push(message="before")
    for frame in (8, 15):
        cut(edit, frame)
        bpy.ops.ed.undo_push(message="cut")
        update(bpy)
    for step, count in (("undo", 2), ("undo", 1), ("redo", 2), ("redo", 3), ("undo", 2), ("undo", 1), ("redo", 2)):
        getattr(bpy.ops.ed, step)()
        update(bpy)
        edit = bpy.context.scene
        assert len({part.scene for part in shown(edit)}) == len(edit.virtual_shutter.effects) == count
        assert (len(bpy.data.scenes), len(bpy.data.annotations)) == (count + 1, count)
        assert unlike(edit, render, before) == []


def test_a_file_of_before_in_which_parts_share_gives_each_its_own(bpy, edit, add, render, tmp_path, monkeypatch):
    add()
    before = render(edit, [5, 15])
    monkeypatch.setattr(data_format, "is_file_newer", lambda: True)  # nothing follows
    cut(edit, 8)
    assert len({part.scene for part in shown(edit)}) == 1
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "before.blend"))
    monkeypatch.undo()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "before.blend"))
    edit = bpy.context.scene
    assert len({part.scene for part in shown(edit)}) == len(edit.virtual_shutter.effects) == 2
    assert unlike(edit, render, before) == []


def test_a_duplicated_pair_shows_its_own_clip_wherever_that_is(bpy, edit, add):
    strip = add()
    source = source_of(strip)
    for each in edit.sequence_editor.strips:
        each.select = True
    in_sequencer(bpy, bpy.ops.sequencer.duplicate)
    copy = next(each for each in shown(edit) if each != strip)
    own = source_of(copy)
    assert own != source
    own.content_start += 200  # far from its effect
    assert (source_of(copy), source_of(strip)) == (own, source)


def test_the_picker_gives_an_effect_to_another_clip(bpy, edit, add, clip, render):
    strip = add(data=recipe(4, [1, 0, 0, 0]))
    old, other = source_of(strip), clip(1, 6, size=(24, 40))
    right = other.split(8, "SOFT")
    other.mute = right.mute = True
    assert match_source.shown(its_effect(strip)).source == old.name
    for source in (other, right):
        selection.choose(edit, strip)
        assert bpy.ops.shutter.source(strip=source.name) == {"FINISHED"}
        update(bpy)
        assert source_of(strip) == source
        assert set(strip.connections) == {source}
    edit.sequence_editor.strips.remove(old)
    assert (strip.scene.render.resolution_x, strip.scene.render.resolution_y) == (40, 24)
    with_effect = render(edit, [10])[10]
    strip.mute, right.mute = True, False
    assert np.abs(with_effect - render(edit, [10])[10]).max() <= 1


@pytest.mark.parametrize("where", ["clip", "effect", "scene"])
def test_an_effect_is_pasted_onto_another_clip(bpy, edit, add, clip, where):
    """Keys count from the strip's first frame; drawings lie on the picture as they did."""
    strip = add()
    strip.left_handle = 4
    update(bpy)
    noted = its_effect(strip).regions[0].drawn.add()
    drawing = its_effect(strip).scene.annotation.layers[0].frames[0]
    noted.frame = drawing.frame_number - its_effect(strip).start
    undelete.forget_copy()
    with pytest.raises(RuntimeError, match="Copy an effect first"):
        bpy.ops.shutter.effect_paste()
    selection.choose(edit, strip)
    assert bpy.ops.shutter.effect_copy() == {"FINISHED"}
    its_effect(strip).window = 2  # what was copied is as it was
    scene = bpy.data.scenes.new("Other") if where == "scene" else edit
    bpy.context.window.scene = scene
    goal = add(101, recipe(8, [1] * 8)) if where == "effect" else clip(101, size=(32, 64), scene=scene)
    if where == "effect":
        bpy.data.annotations.remove(its_effect(goal).scene.annotation)  # it comes again
    selection.choose(scene, goal)
    bpy.ops.ed.undo_push(message="before")
    before = [len(effect.shutters) for effect in scene.virtual_shutter.effects]
    assert bpy.ops.shutter.effect_paste("EXEC_DEFAULT", True) == {"FINISHED"}
    update(bpy)
    pasted = shown(scene)[-1]
    effect = its_effect(pasted)
    assert [shutter.name for shutter in effect.shutters] == ["S0", "S1"]
    assert (effect.window, pasted.left_handle, source_of(pasted).name) == (4, 101, "clip 101")
    curves = fcurves.curves_under(scene, f"{effect.path_from_id()}.regions[0].location")
    assert {frame for curve in curves for frame in fcurves.points_of(curve)[:, 0].tolist()} == {98, 106}
    ((drawing,),) = [list(layer.frames) for layer in effect.scene.annotation.layers]
    assert drawing.frame_number == 98 == effect.start + effect.regions[0].drawn[0].frame
    to_picture = np.linalg.inv(annotations.picture_to_image(pasted, annotations.picture_size(effect)))
    assert np.abs(mapped(to_picture, annotations.strokes_of(drawing)[0]) - MOVED["strokes"][0]).max() < 1e-5
    name = scene.name
    bpy.ops.ed.undo()
    update(bpy)
    assert [len(effect.shutters) for effect in bpy.data.scenes[name].virtual_shutter.effects] == before


@pytest.mark.parametrize("name", ["Shutter", "Shutter.002"])
def test_an_original_stays_what_it_is_whatever_it_is_called(bpy, edit, add, name):
    """Blender gives a copy the first free number behind the name: it may come before that of the original."""
    strip = add()
    scene, annotation, identity = strip.scene, strip.scene.annotation, strip.scene.virtual_shutter.identity
    scene.name = name
    cut(edit, 8)
    copied = scene.copy()  # by the user, for a strip
    edit.sequence_editor.strips.new_scene("copied", copied, 5, 100)
    update(bpy)
    assert (strip.scene, scene.annotation, scene.virtual_shutter.identity) == (scene, annotation, identity)
    effects = list(edit.virtual_shutter.effects)
    assert len({effect.identity for effect in effects}) == len({e.scene.annotation for e in effects}) == 3
    assert all(e.scene.annotation.virtual_shutter_made == e.identity for e in effects)


def test_an_effect_scene_whose_sequencer_shows_itself(bpy, edit, add):
    """Blender lets nobody change what such a strip shows."""
    effect_scene = add().scene
    shown_in = effect_scene.sequence_editor_create().strips.new_scene("itself", effect_scene, 1, 1)
    update(bpy)
    assert shown_in.scene == effect_scene
    assert len(edit.virtual_shutter.effects) == 1


def test_a_deleted_strip_takes_its_effect_along(bpy, edit, add, render):
    first, second = add(1), add(101, LATER)
    third = add(201)
    before = render(edit, [205])
    paths = {path for path, _ in curves(edit)}
    edit.sequence_editor.strips.remove(second)
    update(bpy)
    assert [effect.start for effect in edit.virtual_shutter.effects] == [1, 201]
    assert census(bpy) == {"scenes": 3, "cameras": 2, "objects": 2, "annotations": 2, "actions": 1}
    assert {path for path, _ in curves(edit)} == {
        p.replace("effects[2]", "effects[1]") for p in paths if "effects[1]" not in p
    }
    assert unlike(edit, render, before) == []
    edit.sequence_editor.strips.remove(first)
    edit.sequence_editor.strips.remove(third)
    update(bpy)
    assert not edit.virtual_shutter.effects
    assert not curves(edit)
    assert census(bpy) == {"scenes": 1, "cameras": 0, "objects": 0, "annotations": 0, "actions": 1}


def test_a_see_through_source_that_was_muted_shows_again(bpy, edit, clip):
    """One that the user has muted does not."""
    source = clip(channels=4)
    strip, _effect = effect_of(edit, source, KEYED)
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
    edit.sequence_editor.strips.remove(shown(edit)[0])
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
        assert unlike(edit, render, before) == []
        bpy.ops.ed.redo()
        edit = bpy.context.scene
        update(bpy)
        assert [effect.start for effect in edit.virtual_shutter.effects] == [101]
        assert census(bpy) == {"scenes": 2, "cameras": 1, "objects": 1, "annotations": 1, "actions": 1}


@pytest.mark.parametrize("is_cut", [True, False])
def test_pasted_strips_have_their_effect(bpy, edit, add, render, is_cut):
    add()
    effect = edit.virtual_shutter.effects[0]
    clip, region = bpy.data.movieclips.load(f"{source_of(shown(edit)[0]).directory}f0001.png"), effect.regions[0]
    region.follow_clip, region.strip = clip, "deleted with it"
    before = render(edit, [1, 5, 9, 20])
    assert not np.array_equal(before[1], before[20])
    copy_all(bpy)
    if is_cut:
        in_sequencer(bpy, bpy.ops.sequencer.delete)
        assert not edit.virtual_shutter.effects
    for start in (101, 201):
        edit.frame_set(start)
        in_sequencer(bpy, bpy.ops.sequencer.paste)
    after = render(edit, [frame + 100 for frame in before] + [frame + 200 for frame in before])
    assert [effect.start for effect in edit.virtual_shutter.effects] == ([101, 201] if is_cut else [1, 101, 201])
    for region, *_ in (effect.regions for effect in edit.virtual_shutter.effects):
        assert (region.follow_clip, region.strip) == (clip, "deleted with it")
    for frame, picture in before.items():
        assert np.array_equal(after[frame + 100], picture)
        assert np.array_equal(after[frame + 200], picture)
    identities = [strip.scene.virtual_shutter.identity for strip in shown(edit)]
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
    copy_all(bpy)
    bpy.context.window.scene = other
    other.frame_set(1)
    in_sequencer(bpy, bpy.ops.sequencer.paste)
    assert np.array_equal(render(other, [5])[5], before)
    assert other.virtual_shutter.effects[0].scene != edit.virtual_shutter.effects[0].scene


def test_a_region_follows_its_layer(bpy, edit, clip):
    strip, effect = effect_of(edit, clip(), KEYED)
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
        wanted.scenes = ["Shutter clip 1"]
    update(bpy)
    assert "Shutter clip 1" in bpy.data.scenes


def test_effect_and_source_are_connected_as_the_source_was(edit, clip):
    source, friend = clip(), clip(channel=2)
    add_effect.connect(edit, [source, friend])
    source.select, friend.select = True, False
    strip, _ = add_effect.add_effect(edit, source)
    assert set(strip.connections) == {source, friend}
    assert set(friend.connections) == {source, strip}
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
    assert unlike(edit_that_shows(bpy, film) if link else film, render, pictures) == []
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
    edit.sequence_editor.strips.remove(shown(edit)[-1])
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
