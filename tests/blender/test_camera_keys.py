"""The camera's keys: tracked, by the button Tripod, and from the 2D stabilization of a movie clip."""

import math

import cv2
import numpy as np
import pytest
from support import call, does, request, started, write_frames
from test_region_tracking import SIZE, active, new_source, texture

from shutter_addon.blender.data import annotations, consistency, fcurves, snapshot
from shutter_addon.blender.editing import region_edits
from shutter_addon.core.model import motions
from shutter_addon.core.model.motions import Similarity
from shutter_addon.features.tracking import camera_tracking, registration
from shutter_addon.features.tracking.blender import track_region

WIDTH, HEIGHT = SIZE.tolist()
COUNT = 12
CENTRE = np.array([0.5, 0.5])
ENDS = np.array([0, WIDTH, HEIGHT * 1j, WIDTH + HEIGHT * 1j])
WALL, SUBJECT, DARK = texture(300, 400), texture(110, 160), texture(HEIGHT, WIDTH) // 4


def seen_from(index):
    """The motion from the wall to what a shaken camera shows of it in a source frame."""
    turn = (1 + 0.01 * math.sin(index)) * np.exp(1j * np.radians(2 * math.sin(1.3 * index)))
    return Similarity(complex(turn), complex(120 + 80j - turn * (200 + 6 * math.sin(2 * index) + 150j)))


def picture(index):
    """The wall, and a subject before it that goes its own way."""
    frame = cv2.warpAffine(WALL, registration.matrix(seen_from(index)), (WIDTH, HEIGHT), flags=cv2.INTER_CUBIC)
    left = 20 + 3 * index
    frame[25:135, left : left + 160] = SUBJECT
    return frame


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    return write_frames(tmp_path_factory.mktemp("shaken"), [picture(i) for i in range(COUNT)])


@pytest.fixture
def effect(edit, frames):
    """On a strip from frame 11 on; at its first frame the active region, a lasso, surrounds the subject."""
    return new_effect(edit, new_source(edit, frames))


def new_effect(edit, source):
    _strip, effect = started(edit, source, chosen=True)
    edit.frame_set(16)
    region = region_edits.add_region(effect, effect.shutters[1], "LASSO")
    corners = np.array([(-102, 57), (62, 57), (62, -57), (-102, -57)])
    annotations.add_stroke(annotations.layer_of(effect, region).frames.new(11), corners)
    for frame in (11, 11 + COUNT):
        region.location = 3 * (frame - 11) / WIDTH, 0
        region.keyframe_insert("location", frame=frame)
    for curve in fcurves.curves_under(edit, region.path_from_id()):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    return effect


def keys(bpy, channel="location"):
    """By F-curve of a channel of the camera: (frame, value, type) of its keys."""
    edit, effect, _strip = active(bpy)
    path = f"{effect.camera.path_from_id()}.{channel}"
    return [[(*key.co, key.type) for key in curve.keyframe_points] for curve in fcurves.curves_under(edit, path)]


def placements(bpy):
    """By timeline frame, of all that the strip has."""
    edit, effect, strip = active(bpy)
    shown = range(strip.left_handle, strip.right_handle)
    camera = snapshot.camera_at(edit, effect, shown)
    return {frame: camera.placement(frame) for frame in shown}


def apart(found, expected, start):
    """Pixels by which a corner of the picture is off at most, at frames after another one; expected: by frame the
    motion from what stands still to what the strip shows."""
    moved = {frame: motions.motion_between(found[start], found[frame], CENTRE, CENTRE, SIZE) for frame in expected}
    true = {frame: expected[frame].after(expected[start].inverse()) for frame in expected}
    return max(np.abs(moved[frame](ENDS) - true[frame](ENDS)).max() for frame in expected)


TRUTH = {11 + index: seen_from(index) for index in range(COUNT)}


def test_the_camera_is_tracked_behind_what_regions_cover(bpy, effect):
    edit, effect, strip = active(bpy)
    assert set(track_region.track(edit, effect, strip, None, range(11, 23))) == TRUTH.keys() - {16}
    assert apart(placements(bpy), TRUTH, 16) < 0.6
    kinds = {frame: kind for frame, _value, kind in keys(bpy)[0]}
    assert kinds.pop(16) == "KEYFRAME"
    assert set(kinds.values()) == {"GENERATED"}
    assert len(keys(bpy, "confidence")[0]) == COUNT
    assert keys(bpy)[0][0][0] == 11


@pytest.mark.parametrize("name", ["track_camera", "tripod"])
def test_the_buttons_are_one_step_of_undo(bpy, effect, name):
    def seen(bpy):
        return keys(bpy), keys(bpy, "scale"), [shutter.follow for shutter in active(bpy)[1].shutters]

    effect.camera.track_until = 18
    does(bpy, seen, name)
    assert ("CAMERA" in seen(bpy)[2]) == (name == "tripod")


@pytest.mark.parametrize("has_region", [True, False])
def test_a_tripod_is_for_the_shutter_that_is_seen(bpy, effect, has_region):
    if not has_region:
        region_edits.remove_region(effect, 0)
    effect.camera.track_until = 18
    assert call(bpy, "tripod") == {"FINISHED"}
    effect = active(bpy)[1]
    index = int(has_region)
    assert [shutter.follow == "CAMERA" for shutter in effect.shutters] == [index == 0, index == 1]
    assert (effect.active_shutter, effect.position) == (index, "CENTER")
    assert consistency.bars(effect.shutters[index]) == pytest.approx(np.ones(effect.window))


def test_it_goes_on_behind_a_cut(bpy, edit, tmp_path):
    shots = [*(picture(i) for i in range(8)), *(np.roll(DARK, i, axis=1) for i in range(8))]
    effect = new_effect(edit, new_source(edit, write_frames(tmp_path / "cut", shots)))
    assert call(bpy, "track_camera") == {"FINISHED"}
    assert track_region.stops(effect, None) == []
    found = placements(bpy)
    assert found[18].location == pytest.approx(found[19].location, abs=0.25 / WIDTH)
    assert (found[26].location[0] - found[19].location[0]) * WIDTH == pytest.approx(7, abs=0.3)
    assert not keys(bpy, "influence")


def flash(edit, folder, black=range(16, 32), count=48):
    """A wall that glides by, a pixel a frame; it is black meanwhile."""
    shots = [np.roll(DARK * 4, 2 * i, axis=1) * np.uint8(i not in black) for i in range(count)]
    source = new_source(edit, write_frames(folder / "black", shots))
    _strip, effect = started(edit, source, chosen=True)
    effect.stop_at_cuts = False
    edit.frame_set(16)
    return effect


def test_where_the_cameras_motion_is_unknown_exposures_become_short(bpy, edit, tmp_path):
    """No exposure reaches over the edge of what is tracked, and from frame to frame none changes by more than two
    frames; behind that it goes on. Without the keys, they would be open throughout."""
    effect = flash(edit, tmp_path)
    call(bpy, "tripod")
    assert track_region.stops(effect, None) == [(27, camera_tracking.BARE, True)]
    state = {frame: request(*active(bpy), frame).state for frame in range(11, 59)}
    spans = {frame: np.flatnonzero(found.bars[0] > 1e-6) - found.options.before for frame, found in state.items()}
    for frame, span in spans.items():
        beyond = {frame + k for k in span.tolist()} & set(range(27, 43))
        assert beyond <= {frame}, (frame, span)
    lengths = [len(span) for span in spans.values()]
    assert max(abs(np.diff(lengths))) <= 2
    assert (lengths[5], lengths[22], lengths[-8]) == (8, 1, 8)
    for curve in fcurves.curves_under(edit, f"{effect.camera.path_from_id()}.influence"):
        curve.mute = True
    assert len(np.flatnonzero(request(*active(bpy), 34).state.bars[0])) == 8
