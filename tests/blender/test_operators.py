"""What the user can do: every operator works, is one step of undo, and says why it cannot be used where it cannot."""

import json

import numpy as np
import pytest
import support
from support import call, recipe, sequencer

from shutter_addon import blender
from shutter_addon.blender.data import annotations, consistency, fcurves, selection
from shutter_addon.blender.editing import bar_edits, region_edits
from shutter_addon.blender.interface import operators
from shutter_addon.core.model import limits, shutters
from shutter_addon.core.recipes import recipe_file


def effect_now(bpy):
    """After an undo, what was found before is gone."""
    return bpy.context.scene.virtual_shutter.effects[0]


def state(bpy):
    """All that operators change."""
    edit = bpy.context.scene
    curves = fcurves.curves_under(edit, "virtual_shutter")
    keys = {(c.data_path, c.array_index): [tuple(k.co) for k in c.keyframe_points] for c in curves}
    effects = [
        (
            effect.window,
            [(s.name, [b.weight for b in s.bars]) for s in effect.shutters],
            [(r.name, r.shutter, r.layer, tuple(r.location)) for r in effect.regions],
            [(y.info, len(y.frames)) for y in effect.scene.annotation.layers],
        )
        for effect in edit.virtual_shutter.effects
    ]
    return [(s.name, s.channel) for s in edit.sequence_editor.strips], effects, keys


@pytest.fixture
def does(bpy):
    """Calls an operator, and takes it back for a while; gives the effect."""

    def check(name, **settings):
        support.does(bpy, state, name, **settings)
        return effect_now(bpy)

    return check


@pytest.fixture
def preview(bpy, effect):
    """A sequencer with a picture, as the Video Editing workspace has one; its space."""
    with sequencer(bpy) as area:
        area.spaces.active.view_type = "SEQUENCER_PREVIEW"
        yield area.spaces.active


def tool(bpy):
    found = bpy.context.workspace.tools.from_space_sequencer("SEQUENCER_PREVIEW")
    return found and found.idname


# Each does what it says


def test_add_effect(bpy, edit, effect, does):
    strip = edit.sequence_editor.active_strip
    edit.sequence_editor.strips.remove(strip)
    bpy.context.view_layer.update()
    edit.sequence_editor.active_strip = edit.sequence_editor.strips[0]
    effect = does("add_effect")
    assert [shutter.name for shutter in effect.shutters] == ["Long", "Sharp"]
    edit = bpy.context.scene
    assert edit.sequence_editor.active_strip.scene == effect.scene
    assert [strip.name for strip in edit.sequence_editor.strips if strip.select] == ["Shutter"]


def test_add_effect_says_what_is_wrong_with_the_footage(bpy, edit, tmp_path):
    edit.sequence_editor.active_strip = edit.sequence_editor.strips.new_image("i", str(tmp_path / "none.png"), 1, 1)
    with pytest.raises(RuntimeError, match=r"none\.png: no such file"):
        call(bpy, "add_effect")
    assert [*map(len, (edit.sequence_editor.strips, edit.virtual_shutter.effects, bpy.data.scenes))] == [1, 0, 1]


def test_shutters_come_go_and_move(bpy, effect, does):
    def order():
        return [shutter.name for shutter in effect_now(bpy).shutters]

    does("shutter_add")
    assert order() == ["Long", "Sharp", "Shutter"]
    does("shutter_move", direction="UP")
    assert order() == ["Long", "Shutter", "Sharp"]
    does("shutter_duplicate")
    assert order() == ["Long", "Shutter", "Shutter.001", "Sharp"]
    does("shutter_move", direction="DOWN")
    assert order() == ["Long", "Shutter", "Sharp", "Shutter.001"]
    does("shutter_remove")
    assert order() == ["Long", "Shutter", "Sharp"]
    assert effect_now(bpy).active_shutter == 2
    # At the end of the list there is nowhere to go.
    assert call(bpy, "shutter_move", direction="DOWN") == {"CANCELLED"}
    assert order() == ["Long", "Shutter", "Sharp"]
    assert effect_now(bpy).active_shutter == 2


def test_preset(bpy, effect, does):
    effect = does("preset", preset="GAUSSIAN")
    assert consistency.bars(effect.shutters[1]) == pytest.approx(shutters.preset_bars("GAUSSIAN", 8), abs=1e-6)
    assert bar_edits.key_state(effect, 1) == [""] * 8
    bpy.context.scene.tool_settings.use_keyframe_insert_auto = True
    effect = does("preset", preset="TRAIL")
    assert bar_edits.key_state(effect, 1) == ["keyed"] * 8


def test_bars_are_keyed_unkeyed_and_typed(bpy, effect, does, capfd):
    effect = does("bars_key")
    assert bar_edits.key_state(effect, 1) == ["keyed"] * 8
    effect = does("bars_unkey")
    assert bar_edits.key_state(effect, 1) == [""] * 8
    assert call(bpy, "bars_unkey") == {"CANCELLED"}
    assert "No bar has a keyframe at the current frame" in capfd.readouterr().out
    effect = does("bar_set", bar=3, weight=0.25)
    assert consistency.bars(effect.shutters[1]).tolist() == [1, 0, 0.25, 0, 0, 0, 0, 0]
    with pytest.raises(RuntimeError, match="The shutter has 8 bars"):
        call(bpy, "bar_set", bar=9, weight=0.5)


def test_without_a_preview_a_drawn_region_is_one_step_of_undo(bpy, effect, does, capfd):
    """With one, Blender crashes in the background where an operator that chooses a tool makes a step."""
    effect = does("draw")
    assert [(region.name, region.kind) for region in effect.regions] == [("Sharp", "LINE")]
    for name in ("draw", "erase"):
        capfd.readouterr()
        assert call(bpy, name) == {"FINISHED"}
        assert "Open a sequencer with a preview" in capfd.readouterr().out


def test_draw_makes_a_region_and_takes_up_the_pen_for_the_active_one(bpy, effect, preview):
    assert bpy.ops.shutter.draw() == {"FINISHED"}
    assert [(region.name, region.kind) for region in effect.regions] == [("Sharp", "LINE")]
    assert preview.annotation == effect.scene.annotation
    assert preview.annotation.layers.active_note == "Sharp"
    assert preview.preview_overlay.show_annotation
    assert tool(bpy) == "builtin.annotate"
    assert bpy.ops.shutter.draw() == {"FINISHED"}
    assert len(effect.regions) == 1, "one more stroke of the same region"
    assert bpy.ops.shutter.draw(new=True, kind="LASSO") == {"FINISHED"}
    kinds = [(region.name, region.kind) for region in effect.regions]
    assert kinds == [("Sharp", "LASSO")], "nothing is drawn in it yet"
    layer = annotations.layer_of(effect, effect.regions[0])
    annotations.add_stroke(layer.frames.new(1), np.array([[0.0, 0.0], [9.0, 5.0]]))
    assert bpy.ops.shutter.draw(new=True, kind="OUTLINE") == {"FINISHED"}
    assert [(region.name, region.kind) for region in effect.regions] == [("Sharp", "LASSO"), ("Sharp.001", "OUTLINE")]
    assert preview.annotation.layers.active_note == "Sharp.001"
    effect.active_region = 0
    bpy.ops.shutter.draw()
    assert preview.annotation.layers.active_note == "Sharp"
    effect.scene.annotation.layers.remove(layer)
    bpy.ops.shutter.draw()
    assert preview.annotation.layers.active_note == effect.regions[0].layer
    assert annotations.layer_of(effect, effect.regions[0]) is not None
    assert bpy.ops.shutter.erase() == {"FINISHED"}
    assert tool(bpy) == "builtin.annotate_eraser"


def test_region_assign(bpy, effect, does):
    region_edits.add_region(effect, effect.shutters[1])
    effect = does("region_assign", shutter="0")
    region = selection.active_region(effect)
    assert (region.shutter, effect.active_shutter) == ("Long", 0)
    assert annotations.layer_of(effect, region).color == effect.shutters[0].color


def test_regions_are_keyed_move_and_go(bpy, effect, does):
    for _ in range(2):
        region_edits.add_region(effect, effect.shutters[1])
    effect = does("region_key")
    assert len(state(bpy)[2]) == 4
    effect = does("region_move", direction="UP")
    assert [region.name for region in effect.regions] == ["Sharp.001", "Sharp"]
    effect = does("region_remove")
    assert [region.name for region in effect.regions] == ["Sharp"]
    assert state(bpy)[2] == {}


# Recipes

REGION = {"shutter": "S1", "name": "Face", "kind": "lasso", "strokes": [[[0.25, 0.25], [0.75, 0.25], [0.5, 0.75]]]}
RECIPE = recipe(3, [1, 1, 0.5], {1: [1, 0, 0], 9: [0, 0, 1]}, regions=[REGION], light="encoded")


def test_a_recipe_is_imported_and_exported_the_same(bpy, effect, does, tmp_path):
    (tmp_path / "in.json").write_text(json.dumps(RECIPE))
    effect = does("recipe_import", filepath=str(tmp_path / "in.json"))
    assert effect.light == "ENCODED"
    assert call(bpy, "recipe_export", filepath=str(tmp_path / "out.json")) == {"FINISHED"}
    first, second = (recipe_file.load(tmp_path / f"{name}.json") for name in ("in", "out"))
    assert recipe_file.dump(first) == recipe_file.dump(second)
    assert sorted(path.name for path in tmp_path.glob("*.json*")) == ["in.json", "out.json"]


@pytest.mark.parametrize("name", ["recipe_import", "recipe_export"])
def test_a_recipe_that_cannot_be_read_or_written_is_told_and_changes_nothing(bpy, effect, tmp_path, name):
    """The sentences on what is in a recipe are core's (tests/core/test_recipe.py)."""
    (tmp_path / "file").write_bytes(b"\xff\xfe\x00")
    before = state(bpy)
    paths = {"none/r.json": "No such file or directory", "": "Is a directory", "file/r.json": "Not a directory"}
    paths |= {"file": "not a text file"} if name == "recipe_import" else {}
    told = {str(tmp_path / path): f"{tmp_path / path}: {sentence}" for path, sentence in paths.items()}
    for path, sentence in (told | {"": "Choose a file"}).items():
        with pytest.raises(RuntimeError, match=f"^Error: {sentence}[^\n]*\n$"):
            call(bpy, name, filepath=path)
    assert state(bpy) == before
    assert not (tmp_path / "none").exists()


# Where nothing can be done

NO_SOURCE = "The active strip is not a movie, image or clip strip"
SELECT = "Select a Shutter strip or its source strip"
NO_SHUTTER = "The effect has no shutter: add one"
NO_REGION = "The shutter has no region: draw one"
LINKED = "The edit is linked from another file"
ANY_EFFECT = ("smooth_streaks", "shutter_add", "recipe_import", "recipe_export")  # need nothing in it
ALIKE = {"match_source": "The Shutter strip matches its source"}
UNSEEN = "Move the playhead onto the Shutter strip"
OF_REGION = "erase", "region_assign", "region_remove", "region_move", "region_key", "sharp_subject", "clean_trail"
REGION_NEEDED = dict.fromkeys(OF_REGION, NO_REGION)
REGION_UNSEEN = REGION_NEEDED | {"erase": UNSEEN}


def nothing(bpy, edit, effect, tmp_path):
    edit.sequence_editor.active_strip = None
    edit.frame_set(50)  # past the effect


def not_seen(bpy, edit, effect, tmp_path):
    edit.frame_set(50)


def no_sequencer(bpy, edit, effect, tmp_path):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def plain(bpy, edit, effect, tmp_path):
    first = edit.sequence_editor.strips[0]
    edit.sequence_editor.active_strip = edit.sequence_editor.strips.new_image("i", first.directory, 5, 1)


def color(bpy, edit, effect, tmp_path):
    edit.sequence_editor.active_strip = edit.sequence_editor.strips.new_effect("c", "COLOR", 5, 1, length=9)


def linked(bpy, edit, effect, tmp_path):
    name, path = edit.name, str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.scenes = [name]
    linked = next(s for s in bpy.data.scenes if s.library and s.sequence_editor)
    bpy.data.window_managers[0].windows[0].workspace.sequencer_scene = linked


def no_shutter(bpy, edit, effect, tmp_path):
    effect.shutters.clear()


def no_region(bpy, edit, effect, tmp_path):
    pass


MAKES_EFFECT = ("add_effect", "draw")  # draw, where there is none yet
# What gives an effect to others, and the report: test_copies, test_export and test_error_report have these.
APART = {"source", "effect_copy", "effect_paste", "recipe_import", "recipe_export", "copy_report"}
# Situation: why an operator cannot be used there, and for some of them another reason; None: it can be used.
SITUATIONS = {
    nothing: (SELECT, dict.fromkeys(MAKES_EFFECT, "Select a movie, image or clip strip")),
    no_sequencer: (SELECT, dict.fromkeys(MAKES_EFFECT, "Select a movie, image or clip strip")),
    color: (SELECT, dict.fromkeys(MAKES_EFFECT, NO_SOURCE)),
    plain: (SELECT, dict.fromkeys(MAKES_EFFECT)),
    not_seen: (None, {"add_effect": NO_SOURCE, "draw": UNSEEN, **ALIKE, **REGION_UNSEEN}),
    linked: (LINKED, {}),
    no_shutter: (NO_SHUTTER, {"add_effect": NO_SOURCE, **dict.fromkeys(ANY_EFFECT), **ALIKE, **REGION_NEEDED}),
    no_region: (None, {"add_effect": NO_SOURCE, **ALIKE, **REGION_NEEDED}),
}


@pytest.mark.parametrize("situation", SITUATIONS, ids=lambda situation: situation.__name__)
def test_what_cannot_be_used_says_why(bpy, edit, effect, tmp_path, situation):
    effect.inbetween = "1"
    situation(bpy, edit, effect, tmp_path)
    usual, others = SITUATIONS[situation]
    with bpy.context.temp_override(window=bpy.data.window_managers[0].windows[0]):
        names = {cls.bl_idname.removeprefix("shutter.") for cls in blender.classes_of(operators)} | {"smooth_streaks"}
        for name in sorted(names - APART):
            operator = getattr(bpy.ops.shutter, name)
            sentence = others.get(name, usual)
            assert operator.poll() == (sentence is None), name
            if sentence:
                with pytest.raises(RuntimeError, match=sentence):
                    operator()


def test_as_few_and_as_many_shutters_as_a_picture_has(bpy, effect):
    assert call(bpy, "shutter_remove") == {"FINISHED"}
    with pytest.raises(RuntimeError, match="The last shutter of an effect cannot be removed"):
        call(bpy, "shutter_remove")
    for name in ("shutter_add", *["shutter_duplicate"] * (limits.MAX_SHUTTERS - 2)):
        assert call(bpy, name) == {"FINISHED"}
    for name in ("shutter_add", "shutter_duplicate"):
        with pytest.raises(RuntimeError, match=f"An effect can have at most {limits.MAX_SHUTTERS} shutters"):
            call(bpy, name)
    assert len(effect.shutters) == limits.MAX_SHUTTERS


def test_no_more_regions_than_a_picture_has(bpy, effect, preview):
    for number in range(limits.MAX_REGIONS):
        region = effect.regions.add()
        region.name, region.shutter = str(number), effect.shutters[0].name
    # The second shutter has none: whatever is drawn would be a new one.
    for shutter, is_new in ((1, False), (1, True), (0, True)):
        effect.active_shutter = shutter
        with pytest.raises(RuntimeError, match=f"An effect can have at most {limits.MAX_REGIONS} regions"):
            call(bpy, "draw", new=is_new)
    assert bpy.ops.shutter.draw() == {"FINISHED"}
    assert len(effect.regions) == limits.MAX_REGIONS
