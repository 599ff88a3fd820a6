"""Regions end where their tracks end, and with their shots: by keys of their opacity, which the editor sees."""

import numpy as np
import pytest
from support import call, request, write_frames
from test_region_tracking import COUNT, SIZE, active, drawn, keys, new_source, picture, texture, track

from shutter_addon.blender.data import fcurves, recipe_import, snapshot
from shutter_addon.blender.rendering import sessions
from shutter_addon.core.recipes import recipe_file
from shutter_addon.features.tracking.blender import track_region

LAST = 46  # the last timeline frame of the footage that is covered
OTHER = texture(*SIZE[::-1]) // 4


def shot(count):
    """Of another place."""
    return [np.roll(OTHER, 2 * i, axis=1) for i in range(count)]


@pytest.fixture
def between_cuts(bpy, edit, tmp_path):
    """The subject's shot, at the timeline frames 19 to 38, between two others."""
    shots = [*shot(8), *(picture(i) for i in range(COUNT)), *[np.ascontiguousarray(f[::-1]) for f in shot(8)]]
    region = drawn(edit, new_source(edit, write_frames(tmp_path / "cuts", shots)), at=None)
    edit.frame_set(19)
    yield region
    sessions.forget()


@pytest.fixture
def covered(bpy, edit, tmp_path):
    """From frame 30 on nothing is seen of the subject."""
    count = LAST - 10
    frames = [picture(min(i, COUNT - 1), range(COUNT - 1, count)) for i in range(count)]
    region = drawn(edit, new_source(edit, write_frames(tmp_path / "covered", frames)))
    yield region
    sessions.forget()


def opacity(bpy, frames):
    edit, effect, strip = active(bpy)
    region = snapshot.region_at(edit, effect, strip, 0, frames)
    return [region.at(frame).opacity for frame in frames]


def alike(bpy, frame, plain):
    """Whether a frame's picture is what a shutter makes of it without the region."""
    return np.array_equal(request(*active(bpy), frame).picture(), plain)


def without_region(bpy, frame):
    _edit, effect, _strip = active(bpy)
    name, effect.regions[0].shutter = effect.regions[0].shutter, "nobody's"
    found = request(*active(bpy), frame).picture()
    effect.regions[0].shutter = name
    return found


def test_it_ends_at_the_cuts_before_and_behind(bpy, between_cuts):
    """And so do recipes of it."""
    bpy.ops.ed.undo_push(message="before")
    assert call(bpy, "track") == {"FINISHED"}
    shares = [0.0] * 8 + [1.0] * 20 + [0.0] * 8
    assert opacity(bpy, range(11, 47)) == shares
    for frame, is_there in ((18, False), (19, True), (38, True), (39, False)):
        assert alike(bpy, frame, without_region(bpy, frame)) != is_there, frame
    assert {kind for _frame, _value, kind, _ease in keys(bpy, "opacity")[0]} == {"GENERATED"}
    bpy.ops.ed.undo()
    assert not keys(bpy, "opacity")
    assert not keys(bpy), "it is the same step of undo"
    bpy.ops.ed.redo()
    edit, effect, strip = active(bpy)
    effect.camera.influence = 0.25
    found = recipe_file.parse(recipe_file.dump(snapshot.recipe_of(edit, effect, strip)))
    assert found.camera.influence.at(1) == 0.25
    assert [found.for_picture(1.5).regions[0].opacity.at(frame) for frame in range(1, 37)] == shares
    recipe_import.apply(edit, effect, strip, found)
    assert opacity(bpy, range(11, 47)) == shares
    assert effect.camera.influence == 0.25


def test_it_fades_where_the_subject_is_covered_and_the_picture_halfway(bpy, edit, covered):
    """Tracked again without Track Ends, nothing is left of the made keys."""
    _edit, effect, _strip = active(bpy)
    effect.regions[0].opacity = 0.75
    track(bpy)
    (first,) = (frame for frame, *_ in track_region.stops(effect, 0))
    shares = opacity(bpy, range(11, LAST + 1))
    assert shares[first - 11 :] == [0.0] * (LAST + 1 - first)
    assert shares[: first - 15] == [0.75] * (first - 15)
    assert shares[first - 15 : first - 11] == pytest.approx([0.6, 0.45, 0.3, 0.15])
    fading = request(*active(bpy), first - 2).picture()
    assert not alike(bpy, first - 2, without_region(bpy, first - 2))
    (curve,) = fcurves.curves_under(edit, f"{effect.regions[0].path_from_id()}.opacity")
    curve.mute = True
    assert not np.array_equal(fading, request(*active(bpy), first - 2).picture())
    curve.mute = False
    edit.frame_set(LAST)
    assert effect.regions[0].opacity == 0
    edit.frame_set(11)
    effect.regions[0].track_ends = False
    track(bpy)
    assert not keys(bpy, "opacity")
    assert effect.regions[0].opacity == 0.75


def test_tracked_again_the_made_keys_are_replaced_and_the_editors_stay(bpy, edit, covered):
    _edit, effect, _strip = active(bpy)
    region = effect.regions[0]
    region.opacity = 0.5
    region.keyframe_insert("opacity", frame=13)
    track(bpy)
    first = track_region.stops(effect, 0)[0][0]
    before = keys(bpy, "opacity")
    assert opacity(bpy, (13, 20, first)) == pytest.approx([0.5, 0.5, 0])
    track(bpy)
    assert keys(bpy, "opacity") == before
    edit.frame_set(first + 4)
    region.keyframe_insert("location", frame=first + 4)
    region.track_ends = False
    edit.frame_set(11)
    track(bpy)
    assert [key[:3] for key in keys(bpy, "opacity")[0]] == [(13, 0.5, "KEYFRAME")]
