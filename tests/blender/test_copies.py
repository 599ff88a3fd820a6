"""Copies and parts of effect strips: each gets a scene, an effect and keys of its own. And effects for other clips."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import KEYED, MOVED, image_strip, in_sequencer, noise, recipe, write_frames

from shutter_addon.blender.data import annotations, data_format, fcurves, recipe_import, selection, strips
from shutter_addon.blender.editing import add_effect, match_source, undelete
from shutter_addon.core.model.scribbles import mapped
from shutter_addon.core.recipes import recipe_file

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
for i in range({count}):
    edit.sequence_editor.strips.new_scene("copy", effect.scene, 5, 200 + 100 * i)
reconcile.tidy()
effects = edit.virtual_shutter.effects
print("EFFECTS", [effect.start for effect in effects], len({{effect.scene.name for effect in effects}}))
"""


def test_many_copies_at_once(tmp_path):
    """Blender moves the items of a collection that grows; what is freed is filled here, so that no one reads on."""
    first = write_frames(tmp_path / "in", np.zeros((1, 24, 40, 3), dtype=np.uint8))
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(path=str(first), count=6)],
        env=os.environ | {"MALLOC_PERTURB_": "165"},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert "EFFECTS [1.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0] 7" in done.stdout, (done.returncode, done.stderr)


pytestmark = pytest.mark.usefixtures("no_exception")


@pytest.fixture
def clip(edit, tmp_path):
    """Adds a clip of noise of its own, from a frame on, in a channel; height and width."""
    edit.render.resolution_x = edit.render.resolution_y = 32

    def add(start=1, channel=1, size=(32, 32), scene=None):
        frames = noise(20, *size, 3, seed=start + channel)
        (scene or edit).sequence_editor_create()
        first = write_frames(tmp_path / f"in {start} {channel} {size[0]}", frames)
        return image_strip(scene or edit, first, start, channel, f"clip {start}")

    return add


@pytest.fixture
def add(bpy, edit, clip):
    """A clip with a keyed effect; its strip."""

    def made(start=1, data=KEYED):
        strip, effect = add_effect.add_effect(edit, clip(start))
        recipe_import.apply(edit, effect, strip, recipe_file.parse(json.dumps(data)))
        bpy.context.view_layer.update()
        return strip

    return made


def effect_of(strip):
    return strips.effect_of(strip.id_data, strip.scene)


def source_of(strip):
    return strips.nearest_source(strip.id_data, effect_of(strip), strip)


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


@pytest.mark.parametrize("kind", ["SOFT", "HARD"])
@pytest.mark.parametrize(("only", "effects", "sources"), [(None, 3, 3), ("SCENE", 3, 1), ("IMAGE", 1, 1)])
def test_each_part_of_a_cut_strip_has_its_own_effect(bpy, edit, add, render, kind, only, effects, sources):
    strip = add()
    before = render(edit, [1, 7, 8, 9, 14, 15, 20])
    for frame in (8, 15):
        cut(edit, frame, kind, only)
        bpy.context.view_layer.update()
    if (kind, only) != ("HARD", "IMAGE"):  # which leaves the effect's source another content
        assert unlike(edit, render, before) == []
    parts, own = shown(edit), edit.virtual_shutter.effects
    assert parts[0] == strip  # and has the effect that was there
    assert effect_of(strip) == own[0]
    assert len(parts) == len(own) == effects
    assert len({effect.scene for effect in own}) == len({effect.scene.annotation for effect in own}) == effects
    assert len({effect.source for effect in own}) == len({source_of(part).name for part in parts}) == sources
    if effects > 1:
        last = effect_of(parts[-1])
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
    bpy.context.view_layer.update()
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
        bpy.context.view_layer.update()
    for step, count in (("undo", 2), ("undo", 1), ("redo", 2), ("redo", 3), ("undo", 2), ("undo", 1), ("redo", 2)):
        getattr(bpy.ops.ed, step)()
        bpy.context.view_layer.update()
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
    assert match_source.shown(effect_of(strip)).source == old.name
    for source in (other, right):
        selection.choose(edit, strip)
        assert bpy.ops.shutter.source(strip=source.name) == {"FINISHED"}
        bpy.context.view_layer.update()
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
    bpy.context.view_layer.update()
    noted = effect_of(strip).regions[0].drawn.add()
    drawing = effect_of(strip).scene.annotation.layers[0].frames[0]
    noted.frame = drawing.frame_number - effect_of(strip).start
    undelete.forget_copy()
    with pytest.raises(RuntimeError, match="Copy an effect first"):
        bpy.ops.shutter.effect_paste()
    selection.choose(edit, strip)
    assert bpy.ops.shutter.effect_copy() == {"FINISHED"}
    effect_of(strip).window = 2  # what was copied is as it was
    scene = bpy.data.scenes.new("Other") if where == "scene" else edit
    bpy.context.window.scene = scene
    goal = add(101, recipe(8, [1] * 8)) if where == "effect" else clip(101, size=(32, 64), scene=scene)
    if where == "effect":
        bpy.data.annotations.remove(effect_of(goal).scene.annotation)  # it comes again
    selection.choose(scene, goal)
    bpy.ops.ed.undo_push(message="before")
    before = [len(effect.shutters) for effect in scene.virtual_shutter.effects]
    assert bpy.ops.shutter.effect_paste("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.context.view_layer.update()
    pasted = shown(scene)[-1]
    effect = effect_of(pasted)
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
    bpy.context.view_layer.update()
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
    bpy.context.view_layer.update()
    assert (strip.scene, scene.annotation, scene.virtual_shutter.identity) == (scene, annotation, identity)
    effects = list(edit.virtual_shutter.effects)
    assert len({effect.identity for effect in effects}) == len({e.scene.annotation for e in effects}) == 3
    assert all(e.scene.annotation.virtual_shutter_made == e.identity for e in effects)


def test_an_effect_scene_whose_sequencer_shows_itself(bpy, edit, add):
    """Blender lets nobody change what such a strip shows."""
    effect_scene = add().scene
    shown_in = effect_scene.sequence_editor_create().strips.new_scene("itself", effect_scene, 1, 1)
    bpy.context.view_layer.update()
    assert shown_in.scene == effect_scene
    assert len(edit.virtual_shutter.effects) == 1
