"""Effects as recipes: what was imported comes back exactly, and what Blender's own tools made agrees at every frame."""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from made_recipes import is_same
from support import recipe, source_time, state, write_frames
from test_fields import other_value

from shutter_addon.blender.data import annotations, fcurves, recipe_import
from shutter_addon.blender.editing import add_effect, shutter_edits
from shutter_addon.blender.output.matte_export import recipe_for
from shutter_addon.core.messages import EffectError
from shutter_addon.core.model.effect import Camera, Effect
from shutter_addon.core.model.fields import fields_of
from shutter_addon.core.model.frame_state import Options
from shutter_addon.core.recipes import recipe_file, records

sys.path.append(str(Path(__file__).parents[1] / "differential"))
import cases  # noqa: E402: random recipes

FIRST, LAST = 31, 70
ASPECT = 40 / 24


@pytest.fixture
def effect_on(bpy, edit, tmp_path):
    """An effect on an image strip from frame 31 to 70; gives edit, effect and strip."""
    first = write_frames(tmp_path / "in", np.zeros((2, 24, 40, 3), dtype=np.uint8))
    source = edit.sequence_editor.strips.new_image("images", str(first), 1, FIRST)
    source.right_handle = LAST + 1
    strip, effect = add_effect.add_effect(edit, source)
    return edit, effect, strip


def apply(effect_on, data):
    source = recipe_file.parse(json.dumps(data)) if isinstance(data, dict) else data
    recipe_import.apply(*effect_on, source, folder_of(effect_on))


def export(effect_on):
    return recipe_for(*effect_on, folder_of(effect_on) / "recipe.json")


def folder_of(effect_on):
    """Beside that of the footage."""
    return Path(effect_on[0].sequence_editor.strips["images"].directory).parent


@pytest.mark.parametrize("seed", range(40))
def test_a_recipe_comes_back_as_it_was(effect_on, seed):
    case = cases.make(seed, mixed=True)
    cases.write_mattes(case, folder_of(effect_on))
    source = recipe_file.parse(case.recipe)
    apply(effect_on, source)
    assert is_same(export(effect_on), source)


@pytest.mark.parametrize("seed", range(12))
def test_on_a_moved_turned_and_scaled_strip(effect_on, seed):
    rng, t = np.random.default_rng(seed), effect_on[2].transform
    t.rotation, t.scale_x, t.scale_y, t.offset_x = rng.uniform((-2, 0.3, 1.3, -300), (2, 3, 1.3, 300))
    t.origin = 0.2, 0.7
    source = recipe_file.parse(json.dumps(cases.random_recipe(rng, 9)))
    apply(effect_on, source)
    found = export(effect_on)
    for region, wanted in zip(found.regions, source.regions, strict=True):
        for stroke, original in zip(region.drawings.strokes[0], wanted.drawings.strokes[0], strict=True):
            assert np.allclose(stroke, original, rtol=0, atol=2e-6)
    apply(effect_on, found)
    before, after = (records.recipe_of(each) | {"regions": []} for each in (found, export(effect_on)))
    assert after == before


def test_odd_values_of_all_fields_come_back(effect_on):
    """Large and small ones, between frames, and names of any characters."""
    keys = [{"frame": -4.75, "bars": [0, 1.234567e-05]}, {"frame": 49.5, "bars": [0.1, 3], "ease": "constant"}]
    named = {"name": "", "color": [0, 1, 0.1], "bars": [1e6, 0]}, {"name": "a\n\x7f\u202e𝄞", "keys": keys}
    region = {"name": "", "shutter": "", "width": 10, "strokes": [[[-1, 2], [1.999999, 1e-06]]]}
    region["keys"] = [{"frame": 3.75, "location": [-100, 0.1], "rotation": 720, "scale": -0.001}]
    camera = [{"frame": -0.5, "location": [-100, 99.99], "rotation": -719.99, "scale": -50}]
    time = [{"frame": 0.25, "value": -10}, {"frame": 50, "value": 9999.99, "ease": "bezier"}]
    fields = {field.recipe: other_value(field) for field in fields_of(Options, Effect, Camera).values() if field.recipe}
    data = recipe(2, shutters=named, regions=[region], camera=camera, time=time) | fields | {"window": 2}
    for edge_aware in (0.3333333, [{"frame": -5, "value": 0.1}, {"frame": 49.75, "value": 1}]):
        source = recipe_file.parse(json.dumps(data | {"edge_aware": edge_aware}))
        apply(effect_on, source)
        assert is_same(export(effect_on), source)


BARS = [
    {"frame": 3, "bars": [1, 0, 0.5, 0], "ease": "bezier"},
    {"frame": 17, "bars": [0, 0.2, 0, 1]},
    {"frame": 30, "bars": [0.3, 0, 0, 1]},
]
MOVES = [
    {"frame": 2, "location": [0.1, 0]},
    {"frame": 20, "location": [0.5, 0.3], "rotation": 90, "scale": 2, "ease": "bezier"},
    {"frame": 33, "strokes": [[[0.3, 0.2], [0.9, 0.9], [0.8, 0.1]]], "scale": 0.5},
]
BASE = {
    "version": 2,
    "window": 4,
    "inbetween": 2,
    "edge_aware": [{"frame": 4, "value": 0.25, "ease": "bezier"}, {"frame": 24, "value": 1}],
    "time": [{"frame": 2, "value": 1}, {"frame": 20, "value": 9.5, "ease": "bezier"}, {"frame": 31, "value": 3}],
    "shutters": [{"name": "Plain", "bars": [1, 1, 1, 1]}, {"name": "Keyed", "keys": BARS}],
    "regions": [{"shutter": "Keyed", "name": "Face", "strokes": [[[0.1, 0.5], [0.4, 0.6]]], "keys": MOVES}],
}
PLAIN = recipe(1, [1])


def curve(edit, name, index=0):
    found = (c for c in fcurves.curves_under(edit, "virtual_shutter") if c.data_path.endswith(name))
    return next(c for c in found if c.array_index == index)


def blenders_own_handles(edit, effect):
    for name in ("location", "rotation", "scale", "shutters[1].bars[2].weight", "source_time", "edge_aware"):
        for key in curve(edit, name).keyframe_points:
            key.interpolation, key.handle_left_type, key.handle_right_type = "BEZIER", "AUTO_CLAMPED", "AUTO_CLAMPED"
        curve(edit, name).update()


def free_handles(edit, effect):
    key = curve(edit, "location").keyframe_points[0]
    key.interpolation, key.handle_right_type, key.handle_right = "BEZIER", "FREE", (45, 3)


def keyed_by_blender_in_part(edit, effect):
    """Some bars, some channels, some frames."""
    for name in ("bars[0].weight", "bars[3].weight", "rotation", "scale"):
        found = next(c for c in fcurves.curves_under(edit, "") if c.data_path.endswith(name))
        fcurves.remove_curves(edit, found.data_path)
    for frame, weight in ((35, 0.9), (50, 0.2)):
        effect.shutters[1].bars[1].weight = weight
        edit.keyframe_insert("virtual_shutter.effects[0].shutters[1].bars[1].weight", frame=frame)
    effect.regions[0].rotation = 1
    edit.keyframe_insert("virtual_shutter.effects[0].regions[0].rotation", frame=44.5)
    effect.regions[0].scale = 0.7


def elastic(edit, effect):
    for name in ("location", "shutters[1].bars[0].weight"):
        curve(edit, name).keyframe_points[0].interpolation = "ELASTIC"


def modifiers(edit, effect):
    curve(edit, "location").modifiers.new("CYCLES")
    curve(edit, "rotation").modifiers.new("NOISE")
    curve(edit, "source_time").modifiers.new("NOISE")
    curve(edit, "edge_aware").modifiers.new("NOISE")


def extrapolated(edit, effect):
    for name in ("location", "source_time", "edge_aware"):
        curve(edit, name).extrapolation = "LINEAR"


def muted(edit, effect):
    curve(edit, "location", 1).mute = curve(edit, "source_time").mute = True
    curve(edit, "shutters[1].bars[3].weight").mute = True


def sampled(edit, effect):
    for name in ("location", "shutters[1].bars[0].weight"):
        curve(edit, name).convert_to_samples(25, 80)


def placed_without_keys(edit, effect):
    fcurves.remove_curves(edit, "virtual_shutter.effects[0].regions")
    layer = effect.scene.annotation.layers[0]
    layer.frames.remove(layer.frames[1])
    effect.regions[0].location, effect.regions[0].rotation = (0.25, 0.5), 0.3


def drawn_apart_from_keys(edit, effect):
    """Drawings before the first key, between keys, and after the last."""
    for number, x in ((25, 3), (43, 9), (68, -4)):
        drawing = effect.scene.annotation.layers[0].frames.new(number)
        annotations.add_stroke(drawing, np.array([(x, 1), (-x, 5)]))


def two_of_a_name(edit, effect):
    effect.shutters[0].name = "Keyed"


def stretched(edit, effect):
    """Keys lie at thirds of frames, which float32 has others of than Python."""
    keys = (100, 0.2, "linear"), (200, 0.8, "linear")
    fcurves.set_keys(edit, f"{effect.path_from_id()}.edge_aware", 0, keys)
    effect.regions.clear()
    edit.render.frame_map_old, edit.render.frame_map_new = 300, 100


CASES = [
    blenders_own_handles, free_handles, keyed_by_blender_in_part, elastic, modifiers, extrapolated, muted, sampled,
    placed_without_keys, drawn_apart_from_keys, two_of_a_name, stretched,
]  # fmt: skip


@pytest.mark.parametrize("change", CASES, ids=lambda change: change.__name__)
def test_what_blender_made_agrees_at_every_frame(effect_on, change):
    """Within the tolerance that export states, and again after importing it."""
    apply(effect_on, BASE)
    change(effect_on[0], effect_on[1])
    found = export(effect_on)
    for frame in range(FIRST, LAST + 1):
        check(found.for_picture(ASPECT).at(frame - FIRST + 1), state(*effect_on, frame))
        time, _ = source_time(effect_on[0], effect_on[1], frame)
        assert found.time.at(frame - FIRST + 1)[0] == pytest.approx(time, abs=1e-3)
    apply(effect_on, found)
    assert is_same(export(effect_on), found)


def check(instant, wanted):
    assert instant.options.edge_aware == pytest.approx(wanted.options.edge_aware, abs=1e-4)
    options = dataclasses.replace(instant.options, edge_aware=wanted.options.edge_aware)
    assert options == wanted.options
    assert instant.bars == pytest.approx(wanted.bars, abs=1e-4)
    for shape, other in zip(instant.shapes, wanted.shapes, strict=True):
        assert (shape.shutter, shape.kind, shape.width) == (other.shutter, other.kind, pytest.approx(other.width))
        for points, others in zip(shape.strokes, other.strokes, strict=True):
            assert points == pytest.approx(others, abs=3e-4)


def test_what_is_imported_is_shown(effect_on):
    """With every ease and every kind of key; and another recipe leaves nothing of it."""
    moves = [
        {"frame": 2, "ease": "bezier", "location": [0.1, -0.2]},
        {"frame": 6, "ease": "constant", "rotation": 50, "scale": 0.5},
        {"frame": 9, "ease": "bezier", "strokes": [[[0.3, 0.9], [0.2, 0.2], [0.9, 0.5]]]},
        {"frame": 15, "strokes": [[[0, 1], [1, 0]], [[0.5, 0.2]]], "location": [0.3, 0.3], "scale": 2},
    ]
    lasso = {"shutter": "Plain", "kind": "lasso", "strokes": [[[0.1, 0.2], [0.9, 0.3], [0.4, 0.8]]], "keys": moves}
    held = {"name": "Held", "keys": [key | {"ease": "constant"} for key in BARS]}
    data = BASE | {"shutters": [*BASE["shutters"], held], "regions": [*BASE["regions"], lasso], "exposure": "weighted"}
    for said in (data, PLAIN):
        apply(effect_on, said)
        wanted = recipe_file.parse(json.dumps(said)).for_picture(ASPECT)
        for frame in np.arange(0, 24, 0.5):
            check(state(*effect_on, frame + FIRST - 1), wanted.at(frame))
    assert not fcurves.curves_under(effect_on[0], "")
    assert not list(effect_on[1].scene.annotation.layers)


def test_a_source_time_without_keys_holds_a_frame(effect_on):
    apply(effect_on, PLAIN)
    effect_on[1].use_source_time, effect_on[1].source_time = True, 3.5
    assert records.recipe_of(export(effect_on))["time"] == [{"frame": 1, "value": 3.5, "ease": "linear"}]
    effect_on[1].use_source_time = False
    assert export(effect_on).time is None
    apply(effect_on, PLAIN | {"time": [{"frame": 1, "value": 3.5}]})
    assert effect_on[1].use_source_time
    apply(effect_on, PLAIN)
    assert not effect_on[1].use_source_time


@pytest.mark.parametrize("letter", ["a", "𝄞"])
def test_names_are_as_long_as_recipes_have_them(effect_on, letter):
    """In characters; whoever types more gets as many as there may be."""
    _, effect, _ = effect_on
    apply(effect_on, BASE)
    for item in (effect.shutters[0], effect.regions[0]):
        item.name = letter * 100
        assert item.name == letter * 63
    for _ in range(2):
        shutter_edits.duplicate_shutter(effect, 0)
    names = [shutter.name for shutter in effect.shutters]
    assert names[:3] == [letter * 63, f"{letter * 59}.002", f"{letter * 59}.001"]
    assert [shutter.name for shutter in export(effect_on).shutters] == names
    for shutter in effect.shutters:  # as a copied file may have them
        shutter.bl_system_properties_get()["name"] = letter * 63
    names = [shutter.name for shutter in export(effect_on).shutters]
    assert names[:2] == [letter * 63, f"{letter * 61} 2"]
    assert len(set(names)) == len(names)


def test_what_no_recipe_can_hold(effect_on):
    edit, effect, _ = effect_on
    with pytest.raises(EffectError, match='"Shutter" has no shutter'):
        export(effect_on)
    apply(effect_on, BASE)
    effect.regions[0].shutter = "Nobody"
    assert export(effect_on).regions == ()
    effect.regions[0].shutter = "Keyed"
    effect.scene.annotation.layers.remove(effect.scene.annotation.layers[0])
    assert export(effect_on).regions == ()
    for k in range(4):
        curve(edit, f"shutters[1].bars[{k}].weight").keyframe_points[1].co[1] = 0
    with pytest.raises(EffectError, match='shutter "Keyed" at frame 47: all bars are zero'):
        export(effect_on)
