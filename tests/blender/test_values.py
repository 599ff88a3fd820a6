"""Files with values that no effect can have: a picture or one sentence, and no trace anywhere."""

import inspect
import math
from contextlib import suppress

import numpy as np
import pytest
from support import image_strip, picture_of, sequencer, started, state, write_frames

from shutter_addon import blender
from shutter_addon.blender.data import annotations, fcurves, preview_areas, selection, snapshot
from shutter_addon.blender.editing import bar_edits, motion_keys, reconcile, region_edits
from shutter_addon.blender.interface import bar_editor, operators, panels, probe_gizmo, region_gizmo
from shutter_addon.blender.output import matte_export
from shutter_addon.blender.rendering import effect_source, invalidation, render_settings, sessions
from shutter_addon.core.model.limits import MAX_SHUTTERS
from shutter_addon.core.recipes.recipe import RecipeError

NAN, INF = math.nan, math.inf


pytestmark = pytest.mark.usefixtures("no_exception")


@pytest.fixture
def effect(bpy, edit, tmp_path):
    """An effect of two shutters, the second keyed and drawn with; its strip active."""
    frames = np.random.default_rng(0).integers(0, 256, (12, 24, 40, 3), dtype=np.uint8)
    strip, effect = started(edit, image_strip(edit, write_frames(tmp_path / "in", frames)))
    effect.window = 4
    region = region_edits.add_region(effect, effect.shutters[1], name="Face")
    draw(annotations.layer_of(effect, region), [(-9, -9), (9, 0), (3, 8)])
    for frame in (1, 9):
        edit.frame_set(frame)
        effect.shutters[1].bars[0].weight = frame / 9
        bar_edits.key_bars(effect, 1)
        motion_keys.insert(effect, 0)
    edit.keyframe_insert(f"{effect.path_from_id()}.source_time")
    selection.choose(edit, strip)
    edit.frame_set(4)
    with render_settings.using(device="cpu"):
        yield effect
    sessions.forget()


def draw(layer, points):
    annotations.add_stroke(layer.frames[0] if layer.frames else layer.frames.new(1), np.array(points))


def raw(group, name, value):
    """Writes what a file may hold, past the property's range; a frame change writes keyed ones over again."""
    unkey(group, name)
    group.bl_system_properties_get(do_create=True)[name] = value


def unkey(group, name):
    fcurves.remove_curves(group.id_data, f"{group.path_from_id()}.{name}")


def key(group, name, *points, index=0):
    """Gives a property an F-curve with these keys (frame, value)."""
    curve = fcurves.new_curve(group.id_data, f"{group.path_from_id()}.{name}", index)
    curve.keyframe_points.add(len(points))
    curve.keyframe_points.foreach_set("co", [number for point in points for number in point])


def strip_of(effect):
    return effect.id_data.sequence_editor.strips["Shutter"]


def source_of(effect):
    return effect.id_data.sequence_editor.strips["images"]


def identify_another(effect):
    """Gives the source's identity to a strip that has no frames, and to that alone."""
    source_of(effect).virtual_shutter_source = ""
    effect.id_data.sequence_editor.strips.new_meta("other", 7, 1).virtual_shutter_source = effect.source


def follow_camera(effect):
    """By a length of motion."""
    effect.shutters[0].follow, effect.shutters[0].length = "CAMERA", "MOTION"


def use_time(effect, value):
    effect.use_source_time = True
    unkey(effect, "source_time")
    effect.source_time = value


def ramp(effect, kind="RAMP", **values):
    """A new ramp or matte of the second shutter."""
    return region_edits.add_region(effect, effect.shutters[1], kind, "Ramp", **values)


def image(effect):
    """A new matte, the footage's own first frame."""
    import bpy

    source = source_of(effect)
    return ramp(effect, "MATTE", image=bpy.data.images.load(source.directory + source.elements[0].filename))


IMPOSSIBLE = {
    "window -5": (lambda e: raw(e, "window", -5), 'effect "Shutter": Frames is -5, not 1 to 256'),
    "window 1e9": (lambda e: raw(e, "window", 10**9), 'effect "Shutter": Frames is 1e'),
    "position": (lambda e: raw(e, "position", 77), 'effect "Shutter": Position is none of its choices'),
    "keyed position": (lambda e: key(e, "position", (1, -1)), 'effect "Shutter": Position is none'),
    "kind": (lambda e: raw(e.regions[0], "kind", 99), 'region "Face": Type is none'),
    "a bar": (lambda e: raw(e.shutters[0].bars[2], "weight", -4.0), 'shutter "Long", bar 3: Weight is -4, not 0 to'),
    "few bars": (lambda e: e.shutters[0].bars.remove(0), 'shutter "Long": 3 bars, and 4 frames'),
    "no keyed bars": (lambda e: key(e.shutters[0].bars[3], "weight", (1, 1)) or e.shutters[0].bars.clear(), ": 0 bars"),
    "nan bar": (lambda e: key(e.shutters[1].bars[0], "weight", (1, NAN)), 'shutter "Sharp", bar 1: Weight is nan'),
    "keyed nan": (lambda e: key(e.regions[0], "scale", (1, NAN), (9, NAN)), 'region "Face": Scale is nan'),
    "nan scale": (lambda e: raw(e.regions[0], "scale", NAN), 'region "Face": Scale is nan, not -1000 to 1000'),
    "rotation": (lambda e: raw(e.regions[0], "rotation", INF), 'region "Face": Rotation is inf, not -360000 to 360000'),
    "location": (lambda e: raw(e.regions[0], "location", [0.0, NAN]), 'region "Face": Location is nan'),
    "opacity": (lambda e: raw(ramp(e), "opacity", 1.5), 'region "Ramp": Opacity is 1.5, not 0 to 1'),
    "no matte": (lambda e: ramp(e, "MATTE"), 'region "Ramp": it has no matte file'),
    "no matte strip": (lambda e: raw(ramp(e, "MATTE", matte="STRIP"), "strip", "x"), "its matte strip was deleted"),
    "channel": (lambda e: raw(ramp(e, "MATTE", matte="STRIP", strip_name="images"), "channel", 9), "Channel is none"),
    "offset": (lambda e: raw(image(e), "offset", 2**31 - 1), 'region "Ramp": Offset is 2.147484e+09, not'),
    "follow": (lambda e: raw(e.shutters[0], "follow", 9), 'shutter "Long": Exposure Moves With is none of its choices'),
    "trail": (lambda e: follow_camera(e) or key(e.shutters[0], "trail", (1, NAN), (9, NAN)), '"Long": Distance is nan'),
    "camera": (lambda e: follow_camera(e) or raw(e.camera, "location", [0.0, NAN]), 'camera of effect "Shutter": Loc'),
    "follow edges": (lambda e: raw(e, "edge_aware", 1.5), 'effect "Shutter": Follow Edges is 1.5, not 0 to 1'),
    "source time": (lambda e: use_time(e, NAN), 'effect "Shutter": Source Time is nan'),
    "nan strokes": (lambda e: draw(e.scene.annotation.layers[0], [(0, NAN)]), 'region "Face": a point of its strokes'),
    "transform": (lambda e: setattr(strip_of(e).transform, "offset_x", NAN), '"Shutter": a number of its transform'),
    "shutters": (lambda e: [e.shutters.add() for _ in range(MAX_SHUTTERS)], f"at most {MAX_SHUTTERS} shutters"),
    "no shutters": (lambda e: e.shutters.clear(), '"Shutter" has no shutter'),
    "points": (lambda e: draw(e.scene.annotation.layers[0], [(0, 0)] * 100_001), "more than 100000 points"),
    "no identity": (
        lambda e: setattr(e, "source", "") or setattr(source_of(e), "virtual_shutter_source", ""),
        'the source strip of "Shutter" was deleted',
    ),
    "a meta": (lambda e: identify_another(e), 'the source of "Shutter", "other", is not a movie'),
}


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_one_sentence_tells_the_place(bpy, edit, effect, tmp_path, name):
    """From the renderer, and from wherever the effect is shown no trace."""
    scene = effect.scene
    assert picture_of(scene, 4).shape == (24, 40, 4)
    change, sentence = IMPOSSIBLE[name]
    change(effect)
    with pytest.raises(effect_source.FAULTS) as raised:
        picture_of(scene, 4)
    assert sentence in str(raised.value)
    assert len(str(raised.value)) <= 300
    with suppress(*effect_source.FAULTS, RecipeError):
        matte_export.recipe_for(edit, effect, strip_of(effect), tmp_path / "r.json")
    show(bpy, edit)


def test_what_f_curves_give_stays_in_range(bpy, edit, effect):
    """As Blender has it: a curve that overshoots is cut off where the property ends."""

    region = effect.regions[0]
    key(region, "width", (1, -5), (9, -5))
    key(region, "scale", (1, 1e30), (9, 1e30))
    key(effect.shutters[1].bars[0], "weight", (1, 1e30), (9, 1e30))
    edit.frame_set(3)
    found = state(edit, effect, strip_of(effect), 3)
    assert (region.width, region.scale) == (0, 1000)
    assert found.shapes[0].width == 0
    assert np.ptp(found.shapes[0].strokes[0], axis=0).max() < 1000
    assert found.bars[1, 0] == 1e6


def test_a_strip_that_is_scaled_to_nothing(bpy, edit, effect):
    """A strip may grow from nothing: where nobody sees it, its scribbles do not matter. A recipe would lack them."""
    strip = strip_of(effect)
    strip.transform.scale_x = 0
    assert picture_of(effect.scene, 4).shape == (24, 40, 4)
    with pytest.raises(effect_source.FAULTS, match='strip "Shutter" is too small to find its scribbles'):
        snapshot.recipe_of(edit, effect, strip)
    show(bpy, edit)


def test_what_nobody_renders_does_not_matter(bpy, edit, effect):
    """Names twice, layers and shutters that there are not, places in lists beyond their ends."""
    before = picture_of(effect.scene, 4)
    raw(effect, "active_shutter", -3)
    raw(effect, "active_region", 99)
    raw(effect, "start", NAN)
    raw(effect.shutters[0], "color", [NAN, 2.0, -1.0])
    for layer, shutter in (("none", "Sharp"), ("Face", "none")):
        region = effect.regions.add()
        region.name, region.layer, region.shutter = "Face", layer, shutter
    edit.virtual_shutter.effects.add().name = effect.name
    effect = edit.virtual_shutter.effects[0]
    assert selection.active_shutter(effect) is selection.active_region(effect) is None
    assert np.array_equal(picture_of(effect.scene, 4), before)
    show(bpy, edit)


@pytest.mark.parametrize("start", [NAN, 1e30])
def test_keys_stay_where_they_are_when_the_start_is_none(bpy, edit, effect, start):
    def keys():
        return [tuple(point.co) for curve in fcurves.curves_under(edit, "") for point in curve.keyframe_points]

    before = keys()
    raw(effect, "start", start)
    reconcile.update()
    assert keys() == before
    assert edit.virtual_shutter.effects[0].start == 1


def test_a_copy_has_the_same_impossible_choice(bpy, edit, effect):
    """Copies of what cannot be copied would come with every update, and never be finished."""
    raw(effect, "position", 77)
    raw(effect.regions[0], "kind", 99)
    edit.sequence_editor.strips.new_scene("copy", effect.scene, 5, 100)
    for _ in range(3):
        reconcile.tidy()
    assert len(edit.virtual_shutter.effects) == 2
    for scene in [effect.scene for effect in edit.virtual_shutter.effects]:
        with pytest.raises(effect_source.FAULTS, match="is none of its choices"):
            picture_of(scene, 4)


def test_editors_can_mend_it(bpy, edit, effect):
    scene = effect.scene
    raw(effect, "window", 10**9)
    raw(effect, "position", 77)
    effect.shutters[0].bars.clear()
    effect.shutters[0].bars.add()
    effect.window, effect.position = 6, "END"
    assert [len(shutter.bars) for shutter in effect.shutters] == [6, 6]
    effect.shutters[0].bars.remove(0)
    with sequencer(bpy):
        assert bpy.ops.shutter.preset(preset="ANGLE_360") == {"FINISHED"}  # of the active one
        effect.active_shutter = 0
        assert bpy.ops.shutter.preset(preset="ANGLE_360") == {"FINISHED"}
    assert picture_of(scene, 4).shape == (24, 40, 4)


class Layout:
    """Takes all that a panel draws, as a region does that is in no window."""

    def __init__(self, *_arguments, **_options):
        pass

    def __getattr__(self, _name):
        return Layout

    def separator(self):
        pass


def show(bpy, edit):
    """Calls what Blender calls where an effect is shown: handlers, polls, panels, gizmos."""
    reconcile.update()
    invalidation.invalidate_changed(edit)
    assert not invalidation.invalidate_changed(edit), "it would be drawn again and again"
    with sequencer(bpy) as area:
        region = next(region for region in area.regions if region.type == "PREVIEW")
        with bpy.context.temp_override(region=region):
            context = bpy.context
            preview_areas.shown(context)
            bar_editor.bar_under(context, 30, 30)
            region_gizmo.place(context)
            for module in (operators, bar_editor, region_gizmo):
                for cls in blender.classes_of(module):
                    if hasattr(cls, "poll"):
                        cls.poll(context)
            probe_gizmo.SHUTTER_GGT_split.poll(context)
            for cls in blender.classes_of(panels):
                if issubclass(cls, bpy.types.Panel) and cls.poll(context):
                    functions = {name: each for name, each in inspect.getmembers(cls) if inspect.isfunction(each)}
                    type("Drawn", (), {**functions, "layout": Layout()})().draw(context)
            found = selection.active(context)
            for region in found[1].regions if found else ():
                panels.SHUTTER_UL_regions.draw_item(None, context, Layout(), found[1], region, 0, None, "", 0)
