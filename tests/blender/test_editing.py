"""Changes to an effect: data, F-curves and annotation layers stay together."""

import numpy as np
import pytest
from support import state

from shutter_addon.blender.data import annotations, consistency, fcurves, selection, strips
from shutter_addon.blender.editing import add_effect, bar_edits, motion_keys, region_edits, shutter_edits
from shutter_addon.media import opencv

RNG = np.random.default_rng(5)


@pytest.fixture
def three(effect):
    """An effect with shutters A, B and C of random bars, keyed at frames 1 and 9."""
    edit = effect.id_data
    for i, name in enumerate("ABC"):
        if i == len(effect.shutters):
            shutter_edits.add_shutter(effect)
        effect.shutters[i].name = name
        for frame in (1, 9):
            edit.frame_set(frame)
            bar_edits.set_bars(effect.shutters[i], RNG.random(effect.window))
            bar_edits.key_bars(effect, i)
    return effect


def curves(effect, under):
    """Keys of the effect's F-curves under a path: {(path from there, index): [(frame, value, interpolation)]}."""
    path = f"{effect.path_from_id()}.{under}"
    return {
        (c.data_path.removeprefix(path), c.array_index): [(*k.co, k.interpolation) for k in c.keyframe_points]
        for c in fcurves.curves_under(effect.id_data, path)
    }


def shutters_of(effect):
    """By name: color and keys."""
    return {s.name: (tuple(s.color), curves(effect, f"shutters[{i}].")) for i, s in enumerate(effect.shutters)}


def regions_of(effect):
    return {r.name: (r.shutter, r.layer, curves(effect, f"regions[{i}].")) for i, r in enumerate(effect.regions)}


def layers(effect):
    return [layer.info for layer in effect.scene.annotation.layers]


def picture_bars(effect, index, frame):
    """What a picture at a frame is made with."""
    edit, _, strip = strips.find_effect(effect.scene)
    return state(edit, effect, strip, frame).bars[index]


# Finding


def test_the_active_shutter_and_its_active_region(effect):
    effect.active_shutter = 1
    assert selection.active_shutter(effect) == effect.shutters[1]
    assert selection.active_region(effect) is None
    region_edits.add_region(effect, effect.shutters[1])
    assert selection.active_region(effect) == effect.regions[0]
    effect.active_shutter = 0
    assert selection.active_region(effect) is None, "the region is the other shutter's"
    effect.shutters.clear()
    assert selection.active_shutter(effect) is None
    assert selection.active_region(effect) is None


def test_with_a_shutter_one_of_its_regions_is_active(effect):
    """Else the list shows regions, and every button says that there is none."""
    for shutter in (0, 0, 1, 1, 0):
        region_edits.add_region(effect, effect.shutters[shutter])
    effect.active_shutter = 1
    assert effect.active_region == 3
    region_edits.remove_region(effect, 3)
    assert effect.active_region == 2
    region_edits.remove_region(effect, 2)
    assert selection.active_region(effect) is None
    effect.active_shutter = 0
    assert selection.active_region(effect).shutter == "Long"
    shutter_edits.remove_shutter(effect, 0)
    assert effect.active_region == 0


def test_a_unique_name_is_the_wish_or_begins_with_it():
    for taken, found in ((set(), "A"), ({"A"}, "A.001"), ({"A", "A.001"}, "A.002"), ({"a", "A.001"}, "A")):
        assert consistency.unique("A", taken) == found


# Shutters


def test_an_added_shutter_is_open_has_a_name_and_a_color_and_is_active(effect):
    first, second = (shutter_edits.add_shutter(effect).name for _ in range(2))
    assert (first, second) == ("Shutter", "Shutter.001")
    assert effect.active_shutter == 3
    assert consistency.bars(effect.shutters[3]).tolist() == [1] * 8
    assert len({tuple(shutter.color) for shutter in effect.shutters}) == 4
    for _ in shutter_edits.COLORS:  # there are more shutters than colors
        shutter_edits.add_shutter(effect)
    assert len({shutter.name for shutter in effect.shutters}) == 4 + len(shutter_edits.COLORS)


def test_a_duplicate_comes_behind_with_bars_and_keys_of_its_own(three):
    before = shutters_of(three)
    region_edits.add_region(three, three.shutters[0])
    copy = shutter_edits.duplicate_shutter(three, 0)
    assert copy == three.shutters[1]
    assert three.active_shutter == 1
    assert [shutter.name for shutter in three.shutters] == ["A", "A.001", "B", "C"]
    after = shutters_of(three)
    assert {name: after[name] for name in "ABC"} == before
    assert after["A.001"][1] == before["A"][1] != {}
    assert after["A.001"][0] not in [color for color, _ in before.values()]
    assert consistency.bars(three.shutters[1]).tolist() == consistency.bars(three.shutters[0]).tolist()
    assert three.regions[0].shutter == "A"


def test_a_removed_shutter_takes_its_keys_regions_and_layers_along(three):
    for name in "BAB":
        region_edits.add_region(three, three.shutters[name])
        motion_keys.insert(three, len(three.regions) - 1)
    shutters, regions = shutters_of(three), regions_of(three)
    shutter_edits.remove_shutter(three, 1)
    del shutters["B"], regions["B"], regions["B.001"]
    assert shutters_of(three) == shutters
    assert regions_of(three) == regions
    assert layers(three) == ["A"]
    assert [shutter.name for shutter in three.shutters] == ["A", "C"]
    assert three.active_shutter == 1
    shutter_edits.remove_shutter(three, 1)
    shutter_edits.remove_shutter(three, 0)
    assert three.active_shutter == three.active_region == 0
    assert curves(three, "") == {}
    assert layers(three) == []


@pytest.mark.parametrize(("index", "to", "order"), [(0, 2, "BCA"), (2, 0, "CAB"), (1, 1, "ABC"), (1, 2, "ACB")])
def test_a_moved_shutter_keeps_its_keys(three, index, to, order):
    before = shutters_of(three)
    region_edits.move(three, "shutter", index, to)
    assert "".join(shutter.name for shutter in three.shutters) == order
    assert shutters_of(three) == before
    assert three.active_shutter == to


def test_regions_follow_the_name_and_scribbles_the_color_of_their_shutter(three):
    for name in "AB":
        region_edits.add_region(three, three.shutters[name])
    three.shutters[0].name = "B"
    assert three.shutters[0].name == "B.001"
    assert [region.shutter for region in three.regions] == ["B.001", "B"]
    three.shutters[0].name = "B.001"
    assert three.shutters[0].name == "B.001"
    for _ in range(2):
        colors = [tuple(layer.color) for layer in three.scene.annotation.layers]
        assert colors == [pytest.approx(tuple(shutter.color)) for shutter in list(three.shutters)[:2]]
        three.shutters[1].color = (0.1, 0.2, 0.3)


# Bars


def test_a_summary_in_words():
    assert bar_edits.summary(np.ones(8)) == "360° (8 of 8 frames)"
    assert bar_edits.summary([1, 0, 0, 0]) == "90° (1 of 4 frames)"
    assert bar_edits.summary([0.5, 0.5]) == "360° (2 of 2 frames)"
    assert bar_edits.summary(np.float32([0.1] * 10)) == "360° (10 of 10 frames)"
    assert "never opens" in bar_edits.summary([0, 0])
    assert bar_edits.summary([1, 0.5, 0, 0], "MEDIAN") == "Median of 2 frames"
    assert bar_edits.summary([0, 1], "LIGHTEST") == "Lightest of 1 frame"


@pytest.mark.parametrize("window", [16, 24, 80])
def test_another_window_and_back_is_exact(three, window):
    shutter_edits.add_shutter(three)  # without keys
    before = shutters_of(three)
    bars = [consistency.bars(shutter) for shutter in three.shutters]
    three.window = window
    assert [len(shutter.bars) for shutter in three.shutters] == [window] * 4
    assert len(curves(three, "shutters")) == 3 * window
    for shutter, old in zip(three.shutters, bars, strict=True):
        assert consistency.bars(shutter).tolist() == np.repeat(old, window // 8).tolist()
    three.window = 8
    assert shutters_of(three) == before
    assert [consistency.bars(shutter).tolist() for shutter in three.shutters] == [b.tolist() for b in bars]


def test_a_single_keyed_bar_becomes_keys_on_all(effect):
    edit = effect.id_data
    for frame, weight in ((1, 0.0), (9, 1.0)):
        effect.shutters[0].bars[2].weight = weight
        edit.keyframe_insert(effect.shutters[0].bars[2].path_from_id("weight"), frame=frame)
    effect.window = 4
    assert len(curves(effect, "shutters[0]")) == 4
    assert picture_bars(effect, 0, 1) == pytest.approx([1, 0.5, 1, 1])
    assert picture_bars(effect, 0, 9) == pytest.approx([1, 1, 1, 1])


def test_key_states_as_blender_colors_them(effect):
    edit = effect.id_data
    edit.frame_set(4)
    assert bar_edits.key_state(effect, 0) == [""] * 8
    edit.keyframe_insert(effect.shutters[0].bars[2].path_from_id("weight"))
    assert bar_edits.key_state(effect, 0) == ["", "", "keyed", *[""] * 5]
    edit.frame_set(5)
    assert bar_edits.key_state(effect, 0)[2] == "animated"
    effect.shutters[0].bars[2].weight = 0.25
    assert bar_edits.key_state(effect, 0)[2] == "changed"


def test_keys_go_at_the_current_frame_alone(three):
    edit = three.id_data
    before = shutters_of(three)
    edit.frame_set(5)
    assert not bar_edits.unkey_bars(three, 1)
    assert shutters_of(three) == before
    bar_edits.key_bars(three, 1)
    assert {len(keys) for keys in curves(three, "shutters[1]").values()} == {3}
    assert bar_edits.unkey_bars(three, 1)
    assert not bar_edits.unkey_bars(three, 1)
    assert shutters_of(three) == before
    for frame in (1, 9):
        edit.frame_set(frame)
        assert bar_edits.unkey_bars(three, 1)
    del before["B"]
    after = shutters_of(three)
    assert after.pop("B")[1] == {}, "an F-curve without keys would hold the bars at zero"
    assert after == before


def test_bars_now_are_those_of_the_picture(three):
    edit = three.id_data
    for frame in np.arange(-2, 12, 0.5):
        edit.frame_set(int(frame // 1), subframe=frame % 1)
        for index in range(3):
            now = bar_edits.bars_now(three, index)
            assert now == pytest.approx(picture_bars(three, index, frame), abs=1e-9), frame
    # Between keys that is not what the F-curves show: times move.
    edit.frame_set(5)
    assert np.abs(bar_edits.bars_now(three, 0) - consistency.bars(three.shutters[0])).max() > 0.01


def test_a_key_between_keys_keeps_the_picture(effect):
    """Between two sharp frames lies a sharp frame: the F-curves, a cross-fade, would key two half ones."""
    edit = effect.id_data
    for frame, bars in ((1, np.eye(8)[0]), (9, np.eye(8)[7])):
        edit.frame_set(frame)
        bar_edits.paint(effect, 0, bars, key=True)
    edit.frame_set(5)
    shown = bar_edits.bars_now(effect, 0)
    assert shown[[3, 4]] == pytest.approx([0.5, 0.5])
    bar_edits.key_bars(effect, 0)
    assert bar_edits.key_state(effect, 0) == ["keyed"] * 8
    assert bar_edits.bars_now(effect, 0) == pytest.approx(shown, abs=1e-6)
    assert picture_bars(effect, 0, 5) == pytest.approx(shown, abs=1e-6)


# Regions


def test_a_region_has_a_layer_of_its_own_or_none(effect):
    effect.scene.annotation = None
    region = region_edits.add_region(effect, effect.shutters[1], "LASSO")
    assert (region.name, region.shutter, region.kind, region.layer) == ("Sharp", "Sharp", "LASSO", "Sharp")
    region = region_edits.add_region(effect, effect.shutters[1])
    assert (region.name, region.kind, region.layer) == ("Sharp.001", "LINE", "Sharp.001")
    assert effect.active_region == 1
    assert layers(effect) == ["Sharp", "Sharp.001"]
    assert annotations.layer_of(effect, region).info == "Sharp.001"
    assert effect.scene.annotation.layers.active_note == "Sharp.001"
    effect.scene.annotation.layers.remove(effect.scene.annotation.layers[1])
    assert annotations.layer_of(effect, region) is None
    effect.scene.annotation = None
    assert annotations.layer_of(effect, effect.regions[0]) is None
    region_edits.remove_region(effect, 0)
    assert len(effect.regions) == 1


# What can be keyed


def test_only_what_renders_by_its_keys_can_be_keyed(effect):
    """The renderer evaluates F-curves itself, as the effect's scene is another: keys on anything else would do
    nothing, or for the window leave the bars behind. Confidence is there to be looked at."""
    region_edits.add_region(effect, effect.shutters[1])
    groups = effect, effect.shutters[0], effect.shutters[0].bars[0], effect.regions[0], effect.camera
    kinds = "BOOLEAN", "ENUM", "FLOAT", "INT"
    can = {
        (type(group).__name__, prop.identifier)
        for group in groups
        for prop in group.bl_rna.properties
        if prop.is_animatable and prop.type in kinds
    }
    assert can == {
        ("ShutterBar", "weight"),
        *(("Shutter", name) for name in ("trail", "threshold", "softness")),
        *(("ShutterRegion", name) for name in ("width", "opacity", "feather")),
        *(("ShutterRegion", name) for name in ("location", "rotation", "scale", "confidence")),
        *(("ShutterEffect", name) for name in ("position", "interpolation", "light", "exposure", "edges")),
        *(("ShutterEffect", name) for name in ("aggregate", "border", "stop_at_cuts", "edge_aware", "source_time")),
        ("ShutterEffect", "decontaminate"),
        *(("ShutterCamera", name) for name in ("location", "rotation", "scale", "influence", "confidence")),
    }


@pytest.mark.parametrize(("has_opencv", "smooth"), [(True, "AUTO"), (False, "1")])
def test_a_new_effect_is_as_smooth_as_its_footage_needs(edit, effect, monkeypatch, has_opencv, smooth):
    """Where moments can be found; an effect that is made for a recipe gets what that says."""
    if not has_opencv:
        monkeypatch.setattr(opencv, "cv2", None)
    new = add_effect.add_effect(edit, edit.sequence_editor.strips["images"])[1]
    assert new.inbetween == "1"
    shutter_edits.start(new)
    assert (new.inbetween, new.edges, new.border) == (smooth, "SLIDE", True)
