"""One click makes a layer of a region: a sharp subject, or one that leaves a trail."""

import numpy as np
import pytest
from support import call, does, write_frames
from test_region_tracking import SIZE, active, centre, drawn, new_source, picture

from shutter_addon.blender.editing import region_edits
from shutter_addon.blender.rendering import sessions
from shutter_addon.features.tracking.blender import track_region

COUNT = 24


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
