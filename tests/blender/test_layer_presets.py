"""One click makes a layer of a region: a sharp subject, one that leaves a trail, or one that the exposure follows.

The last, Panning Shot, tracks what was not tracked.
"""

import numpy as np
import pytest
from support import call, does, request, write_frames
from test_region_tracking import SIZE, active, centre, drawn, keys, move, new_source, picture

from shutter_addon.blender.editing import region_edits, shutter_edits
from shutter_addon.blender.rendering import render_settings, sessions
from shutter_addon.core.frames import light
from shutter_addon.features.tracking.blender import track_region

COUNT = 24
FRAME = 20  # on the timeline, of the source's frame 9


@pytest.fixture
def region(bpy, edit, tmp_path):
    frames = write_frames(tmp_path / "passing", [picture(i) for i in range(COUNT)])
    yield drawn(edit, new_source(edit, frames))
    sessions.forget()


def bars(effect):
    return {shutter.name: [bar.weight for bar in shutter.bars] for shutter in effect.shutters}


STILL, LONG = [0, 0, 0, 1, 0, 0, 0, 0], [1] * 8


@pytest.mark.parametrize(("name", "own", "rest"), [("sharp_subject", STILL, LONG), ("clean_trail", LONG, STILL)])
def test_one_click_and_one_undo(bpy, region, name, own, rest):
    def seen(bpy):
        effect = active(bpy)[1]
        return bars(effect), effect.regions[0].is_layer, effect.position

    does(bpy, seen, name)
    assert seen(bpy) == ({"Long": rest, "Sharp": own}, True, "CENTER")


def test_a_region_of_the_default_shutter_gets_one_of_its_own(bpy, region):
    effect = active(bpy)[1]
    region_edits.assign_region(effect, 0, effect.shutters[0])
    track_region.make_follow(effect, 0, "REGION", False)
    effect.shutters[0].follow_region = effect.regions[0].name
    call(bpy, "sharp_subject")
    assert effect.shutters[0].follow == "NOTHING", "what followed follows no more"
    assert effect.regions[0].shutter == "Subject"
    assert bars(effect)["Subject"] == STILL
    assert bars(effect)["Long"] == LONG


def test_another_region_keeps_its_shutter(bpy, region):
    effect = active(bpy)[1]
    region_edits.add_region(effect, effect.shutters["Sharp"], name="Other")
    effect.active_shutter, effect.active_region = 1, 0
    call(bpy, "clean_trail")
    assert [each.shutter for each in effect.regions] == ["Subject", "Sharp"]
    assert bars(effect)["Sharp"] == STILL, "the frames lie around the shown one now, which it goes on to show"


def test_the_subject_has_the_same_pixels_with_more_frames(bpy, edit, region, render):
    """The README's minute: Sharp Subject, then Frames raised."""
    region.location = (centre(12) - centre(0)) / SIZE * (1, -1)
    call(bpy, "sharp_subject")
    eight = render(edit, [23])[23][..., :3]
    active(bpy)[1].window = 24
    more = render(edit, [23])[23][..., :3]
    x, y = centre(12).astype(int)
    inside = np.s_[y - 12 : y + 12, x - 12 : x + 12]
    assert np.abs(eight[inside] - picture(12)[inside]).mean() < 2
    assert np.abs(more[inside] - eight[inside]).max() <= 1
    assert np.abs(more - eight).mean() > 0.5, "all else runs together for longer"


def test_without_a_region_there_is_no_subject(bpy, edit, region):
    region_edits.remove_region(active(bpy)[1], 0)
    for name in ("sharp_subject", "clean_trail"):
        with pytest.raises(RuntimeError, match="The shutter has no region: draw one"):
            call(bpy, name)


# Panning Shot


def everything(bpy):
    """All that the button changes."""
    effect = active(bpy)[1]
    shutters = [(s.name, s.follow, s.follow_region, [bar.weight for bar in s.bars]) for s in effect.shutters]
    names = [(region.name, region.shutter, region.is_layer) for region in effect.regions]
    return shutters, names, effect.position, [keys(bpy, channel) for channel in ("location", "rotation", "confidence")]


def levels_off(bpy, frame):
    """How far the subject, and what is behind it, is at most from the shown frame, in 8-bit levels."""
    found = request(*active(bpy), frame)
    off = np.abs(255 * light.to_encoded(found.picture()[..., :3].astype(float)) - picture(found.index)).max(axis=2)
    x, y = centre(found.index).round().astype(int)
    return off[y - 8 : y + 9, x - 8 : x + 9].max(), off[-25:, 60:-60].max()


def test_one_click_tracks_and_follows_and_one_undo_takes_it_back(bpy, region):
    bpy.ops.ed.undo_push(message="before")
    before = everything(bpy)
    assert call(bpy, "panning_shot") == {"FINISHED"}
    shutters, names, position, _curves = after = everything(bpy)
    assert shutters[0] == ("Long", "REGION", "Sharp", [1.0] * 8), "all else follows the region"
    assert shutters[1] == ("Sharp", "NOTHING", "", [0, 0, 0, 1.0, 0, 0, 0, 0]), "which is sharp in the shown frame"
    assert (names, position) == ([("Sharp", "Sharp", True)], "CENTER")
    assert len(keys(bpy, "confidence")[0]) == COUNT, "all of the strip is tracked"
    moving = request(*active(bpy), FRAME).state.following
    assert (moving.turns == 1).all(), "the subject turns and grows, and nothing turns with it"
    assert active(bpy)[1].shutters[0].follow_smooth == 6
    bpy.ops.ed.undo()
    assert everything(bpy) == before
    bpy.ops.ed.redo()
    assert everything(bpy) == after


def test_the_subject_is_sharp_and_all_behind_it_streaks(bpy, region):
    effect = active(bpy)[1]
    effect.window = 4
    call(bpy, "panning_shot")
    bpy.context.scene.frame_set(FRAME)
    with render_settings.using(device="cpu"):
        subject, behind = levels_off(bpy, FRAME)
        assert subject < 3
        assert behind > 60
        effect.shutters[0].follow = "NOTHING"
        subject, behind = levels_off(bpy, FRAME)
        assert subject < 3
        assert behind <= 1
        effect.regions[0].is_layer = False
        effect.regions[0].shutter = "Long"
        assert levels_off(bpy, FRAME)[0] > 60


def test_keys_of_motion_are_kept_and_with_auto_keying_the_bars_are_keyed(bpy, edit, region):
    for frame, index in ((11, 0), (30, 19)):
        move(bpy, frame, index)
    before = keys(bpy)
    edit.tool_settings.use_keyframe_insert_auto = True
    call(bpy, "panning_shot")
    edit.tool_settings.use_keyframe_insert_auto = False
    assert keys(bpy) == before
    assert not keys(bpy, "confidence"), "nothing was tracked"
    assert active(bpy)[1].shutters[0].follow_region == "Sharp"
    weights = edit.animation_data.action.layers[0].strips[0].channelbags[0].fcurves
    for shutter in range(2):
        path = f"virtual_shutter.effects[0].shutters[{shutter}].bars"
        assert sum(curve.data_path.startswith(path) for curve in weights) == 8


def test_other_shutters_keep_their_regions_and_a_name_is_one_regions(bpy, region):
    """Two regions of one name cannot be told apart by a shutter that follows one."""
    effect = active(bpy)[1]
    region_edits.add_region(effect, shutter_edits.add_shutter(effect, "Other"), name="Other")
    effect.regions[1].name = "Sharp"
    effect.active_shutter, effect.active_region = 1, 0
    for frame, index in ((11, 0), (30, 19)):
        move(bpy, frame, index)
    call(bpy, "panning_shot")
    assert [shutter.name for shutter in effect.shutters] == ["Long", "Sharp", "Other"]
    assert [(other.name, other.shutter) for other in effect.regions] == [("Sharp.001", "Sharp"), ("Sharp", "Other")]
    assert effect.shutters[0].follow_region == "Sharp.001"
    assert (effect.active_shutter, effect.active_region) == (1, 0)
