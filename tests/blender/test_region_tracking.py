"""Regions that are tracked, and that follow tracks of movie clips: their keys, the editor's, and what is said."""

import numpy as np
import pytest
from support import call, does, image_strip, request, started, write_frames

from shutter_addon.blender.data import annotations, fcurves, selection, snapshot, strips
from shutter_addon.blender.editing import bar_edits, motion_keys, region_edits
from shutter_addon.blender.editing.motion_keys import MotionKeys
from shutter_addon.core.model.motions import Placement
from shutter_addon.features.tracking.blender import track_region

SIZE = np.array([240, 160])
COUNT = 20
RNG = np.random.default_rng(3)


def texture(height, width):
    """Smooth noise, full of corners."""
    import cv2

    noise = RNG.random((height, width, 3)).astype(np.float32)
    return (255 * np.clip(cv2.GaussianBlur(noise, (0, 0), 2) * 4 - 1.5, 0, 1)).astype(np.uint8)


BEHIND, SUBJECT = texture(*SIZE[::-1]), texture(60, 60)


def centre(index):
    """Of the subject in a source frame, in pixels, y down."""
    return np.array([50.5 + 6 * index, 60.5 + 20 * np.sin(index / 6)])


def turned(index):
    """Degrees counter-clockwise, and the scale."""
    return 1.5 * index, 1 + 0.01 * index


def picture(index, covered=()):
    import cv2

    (x, y), (angle, scale) = centre(index), turned(index)
    matrix = cv2.getRotationMatrix2D((29.5, 29.5), angle, scale)
    matrix[:, 2] += (x - 30, y - 30)
    size = SIZE.tolist()
    moved = cv2.warpAffine(SUBJECT, matrix, size, flags=cv2.INTER_CUBIC)
    mask = cv2.warpAffine(np.ones((60, 60), np.uint8), matrix, size, flags=cv2.INTER_NEAREST)
    frame = np.where(mask[..., None], moved, BEHIND)
    if index in covered:
        frame[:, 60:] = 128
    return frame


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    return write_frames(tmp_path_factory.mktemp("moving"), [picture(i) for i in range(COUNT)])


@pytest.fixture
def region(bpy, edit, frames):
    """A region, drawn around the subject where it is at the first frame of the strip, frame 11."""
    return drawn(edit, new_source(edit, frames))


def new_source(edit, first):
    edit.render.resolution_x, edit.render.resolution_y = SIZE.tolist()
    return image_strip(edit, first, 11)


def drawn(edit, source, at=None):
    _strip, effect = started(edit, source, chosen=True)
    edit.frame_set(11)
    region = region_edits.add_region(effect, effect.shutters[1], "LASSO")
    middle = (centre(0) if at is None else np.array(at)) - SIZE / 2
    points = middle * (1, -1) + [(-20, -20), (20, -20), (20, 20), (-20, 20)]
    annotations.add_stroke(annotations.layer_of(effect, region).frames.new(11), points)
    return region


def active(bpy):
    return selection.active(bpy.context)


def track(bpy, direction="BOTH"):
    edit, effect, strip = active(bpy)
    frames = track_region.frames_to_track(edit, strip, direction)
    return list(track_region.track(edit, effect, strip, 0, frames))


def apart(bpy, frame, index, *, of=0):
    """Pixels between the corners of the region at a frame, and those of the subject in a source frame; `of`: the frame
    of the source in which it was drawn."""
    edit, effect, strip = active(bpy)
    (stroke,) = snapshot.region_at(edit, effect, strip, 0, (frame,)).at(frame).strokes
    (angle, scale), (angle_drawn, scale_drawn) = turned(index), turned(of)
    turn = scale / scale_drawn * np.exp(1j * np.radians(angle - angle_drawn))
    offsets = turn * np.array([-20 - 20j, 20 - 20j, 20 + 20j, -20 + 20j])
    expected = centre(index) * (1, -1) + np.stack([offsets.real, offsets.imag], axis=1) + (0, SIZE[1])
    return np.abs(stroke * SIZE - expected).max()


def keys(bpy, channel="location"):
    """By F-curve of a channel: (frame, value, type, interpolation) of its keys."""
    edit, effect, _strip = active(bpy)
    curves = fcurves.curves_under(edit, f"{effect.path_from_id()}.regions[0].{channel}")
    return [[(*key.co, key.type, key.interpolation) for key in curve.keyframe_points] for curve in curves]


def types(bpy):
    """Of the keys of the location by their frames."""
    return {frame: kind for frame, _value, kind, _ease in keys(bpy)[0]}


def move(bpy, frame, index, *, of=0):
    """The editor's key at a frame: where the subject is in a source frame."""
    edit, effect, _strip = active(bpy)
    edit.frame_set(frame)
    region, (angle, scale), (angle_drawn, scale_drawn) = effect.regions[0], turned(index), turned(of)
    region.location = (centre(index) - centre(of)) * (1, -1) / SIZE
    region.rotation, region.scale = np.radians(angle - angle_drawn), scale / scale_drawn
    motion_keys.insert(effect, 0)


def test_a_region_is_tracked_to_both_ends(bpy, region):
    bpy.context.scene.frame_set(20)
    move(bpy, 20, 9)
    assert set(track(bpy)) == set(range(11, 31)) - {20}
    assert max(apart(bpy, frame, frame - 11) for frame in range(11, 31)) < 1.5
    found = types(bpy)
    assert found.pop(20) == "KEYFRAME"
    assert set(found.values()) == {"GENERATED"}
    assert {11, 30} <= found.keys()
    assert len(found) < 15, "they are thinned"
    assert {ease for curve in keys(bpy) for *_, ease in curve} == {"LINEAR"}
    assert len(keys(bpy, "confidence")[0]) == 20
    assert all(track_region.confidence_at(active(bpy)[1], 0, frame) > 0.5 for frame in range(11, 31))
    assert list(region.stops) == keys(bpy, "opacity") == [], "it stays in the picture"


def test_a_wrong_frame_is_mended_by_a_key_and_tracking_again(bpy, edit, region):
    """The editor's keys stay as they are, and the track goes through them; so do made ones that were dragged in the
    Graph Editor, which leaves their type."""
    track(bpy)
    move(bpy, 25, 14)
    active(bpy)[1].regions[0].location[1] += 12 / SIZE[1]
    motion_keys.insert(active(bpy)[1], 0)
    values = {frame: value for frame, value, kind, _ in keys(bpy)[1] if kind == "KEYFRAME"}
    assert values.keys() == {11, 25}
    track(bpy)
    assert {frame: value for frame, value, kind, _ in keys(bpy)[1] if kind == "KEYFRAME"} == pytest.approx(values)
    assert apart(bpy, 12, 1) < 2
    assert apart(bpy, 25, 14) == pytest.approx(12, abs=0.1)
    assert 3 < apart(bpy, 18, 7) < 9, "half of both"
    curve = fcurves.find_curve(edit, "virtual_shutter.effects[0].regions[0].location", 1)
    key = next(key for key in curve.keyframe_points if key.type == "GENERATED" and 12 < key.co[0] < 24)
    frame, dragged = int(key.co[0]), key.co[1] + 0.05
    key.co[1] = dragged
    curve.update()
    track(bpy)
    assert curve.evaluate(frame) == pytest.approx(dragged)


def placed(bpy, frame):
    """All that is keyed of where the region is at a frame."""
    edit, effect, _strip = active(bpy)
    names = "location", "rotation", "scale"
    curves = [c for name in names for c in fcurves.curves_under(edit, f"{effect.path_from_id()}.regions[0].{name}")]
    return [curve.evaluate(frame) for curve in curves]


@pytest.mark.parametrize(("motion", "is_keyed"), [("LOCATION", False), ("SCALE", True)])
def test_frames_outside_of_what_was_tracked_stay_where_they_are(bpy, edit, region, motion, is_keyed):
    """Forward from a mended frame, and until another one, between keys that an earlier track has thinned."""
    track(bpy)
    before = {frame: placed(bpy, frame) for frame in range(11, 31)}
    edit.frame_set(18)
    for _drag in range(2):
        region.location[1] += 6 / SIZE[1]
        if is_keyed:  # as its handle does
            motion_keys.insert(active(bpy)[1], 0)
    _edit, effect, strip = active(bpy)
    frames = track_region.frames_to_track(edit, strip, "FORWARD", 20)
    effect.regions[0].motion = motion
    steps = track_region.track(edit, effect, strip, 0, frames)
    assert next(steps) == 19
    for frame in (*range(11, 18), *range(20, 31)):
        assert placed(bpy, frame) == pytest.approx(before[frame], abs=1e-5)
    assert list(steps) == [20]
    for frame in (*range(11, 18), *range(21, 31)):
        assert placed(bpy, frame) == pytest.approx(before[frame], abs=1e-5)
    assert placed(bpy, 20)[1] == pytest.approx(before[20][1] + 12 / SIZE[1], abs=1.5 / SIZE[1])


def test_keys_are_set_at_the_edits_frame(bpy, edit, region):
    other = bpy.data.scenes.new("other")
    other.frame_set(25)
    bpy.context.window.scene = other
    effect = edit.virtual_shutter.effects[0]
    motion_keys.insert(effect, 0)
    bar_edits.key_bars(effect, 0)
    curves = fcurves.curves_under(edit, effect.path_from_id())
    assert {key.co[0] for curve in curves for key in curve.keyframe_points} == {11}
    assert bar_edits.unkey_bars(effect, 0)


def test_tracks_of_a_stretched_timeline(bpy, edit, region):
    """Their keys lie where they are read; those that an editor sets as Blender's own, at the timeline's frame."""
    edit.render.frame_map_old, edit.render.frame_map_new = 100, 300
    effect = active(bpy)[1]
    track(bpy)
    assert max(apart(bpy, frame, frame - 11) for frame in range(11, 31)) < 2
    assert [frame for frame, *_ in keys(bpy)[0]][:: len(keys(bpy)[0]) - 1] == pytest.approx([11 / 3, 10])
    assert [track_region.confidence_at(effect, 0, frame) for frame in (11, 31)] == [1, None]
    move(bpy, 8, 13)
    effect.regions[0].location[1] += 12 / SIZE[1]
    motion_keys.insert(effect, 0)
    assert [key[0] for key in keys(bpy)[0] if key[2] == "KEYFRAME"] == pytest.approx([11 / 3, 8])
    edit.frame_set(11)
    track(bpy)
    assert apart(bpy, 12, 1) < 2
    assert apart(bpy, 24, 13) == pytest.approx(12, abs=0.1)


@pytest.mark.parametrize(
    ("operator", "channel", "part", "name", "sentence"),
    [
        ("track", "rotation", "curve", "lock", '"Rotation" is locked or muted'),
        ("track", "opacity", "curve", "lock", '"Opacity" is locked or muted'),
        ("track", "rotation", "group", "mute", '"Location" is locked or muted'),
        ("region_key", "rotation", "group", "lock", '"Location" is locked or muted'),
        ("region_key", "rotation", "curve", "mute", '"Rotation" is locked or muted'),
    ],
)
def test_curves_that_take_no_keys_are_said(bpy, edit, region, operator, channel, part, name, sentence):
    move(bpy, 15, 4)
    region.keyframe_insert("opacity", frame=15)
    (curve,) = fcurves.curves_under(edit, f"virtual_shutter.effects[0].regions[0].{channel}")
    setattr(curve if part == "curve" else curve.group, name, True)
    edit.frame_set(20)
    refuses(bpy, operator, f'region "Sharp": the F-curve of {sentence}')


def test_a_region_that_was_moved_and_not_keyed_is_tracked_from_where_it_is(bpy, edit, region):
    move(bpy, 11, 3)
    bpy.context.scene.frame_set(20)
    region.location = (centre(9) - centre(0)) * (1, -1) / SIZE
    region.rotation, region.scale = np.radians(turned(9)[0]), turned(9)[1]
    track(bpy, "FORWARD")
    assert apart(bpy, 20, 9) < 0.01
    assert apart(bpy, 22, 11) < 2


def begun(bpy, until):
    """Tracking that has come to a frame."""
    edit, effect, strip = active(bpy)
    steps = track_region.track(edit, effect, strip, 0, range(11, 31))
    while next(steps) < until:
        pass
    return steps


@pytest.mark.parametrize(("again", "is_closed"), [(False, True), (True, False)])
def test_undo_while_it_runs_ends_it_without_another_key(bpy, edit, region, again, is_closed):
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="drawn")
    bpy.context.scene.virtual_shutter.effects[0].regions[0].width = 0.5
    bpy.ops.ed.undo_push(message="widened")
    if again:
        bpy.ops.ed.undo()
    steps = begun(bpy, 15)
    (bpy.ops.ed.redo if again else bpy.ops.ed.undo)()
    before = everything(bpy)
    assert before[2] == [[]] * 4
    assert bpy.context.scene.virtual_shutter.effects[0].regions[0].width == pytest.approx(0.5 if again else 0.02)
    if not is_closed:
        assert list(steps) == []
    steps.close()
    assert everything(bpy) == before


@pytest.mark.parametrize("change", ["remove", "other", "move", "effects", "file"])
def test_what_happens_to_its_region_ends_it_without_another_key(bpy, edit, region, change):
    effect = active(bpy)[1]
    steps = begun(bpy, 15)
    if change == "remove":
        region_edits.remove_region(effect, 0)
    elif change == "other":
        region_edits.add_region(effect, effect.shutters[1])
        region_edits.move(effect, "region", 1, 0)
    elif change == "move":
        effect.start += 3
    elif change == "effects":  # the collection is elsewhere in memory
        for _ in range(40):
            edit.virtual_shutter.effects.add()
    else:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        assert list(steps) == []
        return
    before = keys(bpy)
    assert len(list(steps)) == (15 if change == "effects" else 0)
    assert (keys(bpy) == before) == (change != "effects")


def test_what_the_editor_keys_is_sure(bpy, edit, region):
    track(bpy)
    _edit, effect, _strip = active(bpy)
    keys = MotionKeys(effect, 0, "SCALE")
    keys.write({}, dict.fromkeys(range(13, 16), 0.3))
    move(bpy, 14, 3)
    assert [track_region.confidence_at(effect, 0, frame) for frame in (13, 14, 15)] == pytest.approx([0.3, 1, 0.3])
    keys.write({}, dict.fromkeys(range(13, 16), 0.2))
    assert track_region.confidence_at(effect, 0, 14) == pytest.approx(0.2)


# The operators


def everything(bpy):
    """All that tracking changes."""
    edit = bpy.context.scene
    region = edit.virtual_shutter.effects[0].regions[0]
    stops = [(stop.frame, stop.forward, stop.fault) for stop in region.stops]
    numbers = tuple(region.location), region.rotation, region.scale, region.confidence
    return numbers, stops, [keys(bpy, channel) for channel in ("location", "rotation", "scale", "confidence")]


def refuses(bpy, name, sentence, **settings):
    """An operator says that, and changes nothing."""
    before = everything(bpy)
    with pytest.raises(RuntimeError, match=sentence):
        call(bpy, name, **settings)
    assert everything(bpy) == before


def test_tracking_is_one_step_of_undo(bpy, region):
    move(bpy, 14, 3)
    region.track_until, region.track_all_keys, region.motion = 18, True, "LOCATION"
    does(bpy, everything, "track", direction="FORWARD")
    assert types(bpy).keys() == set(range(14, 19))
    assert [len(curve) for curve in keys(bpy, "rotation")] == [1], "as the region says"
    region = active(bpy)[1].regions[0]
    region.track_until, region.track_all_keys = 0, False
    does(bpy, everything, "track", direction="BOTH")
    assert types(bpy).keys() >= {11, 30}


def test_what_cannot_be_tracked_is_said(bpy, edit, region):
    effect = active(bpy)[1]
    layer = annotations.layer_of(effect, region)
    edit.frame_set(5)
    refuses(bpy, "track", "Move the playhead onto the Shutter strip")
    edit.frame_set(30)
    refuses(bpy, "track", "there is no other frame to track", direction="FORWARD")
    edit.frame_set(11)
    region.location = 3, 0
    refuses(bpy, "track", "the region lies outside the picture")
    region.location = 0, 0
    layer.frames.remove(layer.frames[0])
    refuses(bpy, "track", "the region has no strokes to follow")
    strips.source_of(*active(bpy)).directory = "/nowhere/"
    refuses(bpy, "track", "no such file")


def test_a_button_goes_to_the_frames_that_need_a_look(bpy, edit, region):
    keys = MotionKeys(active(bpy)[1], 0, "SCALE")
    keys.write({11: Placement(), 15: Placement()}, {11: 1.0, 12: 0.9, 13: 0.4, 14: 0.6, 15: 0.0})
    call(bpy, "track_look")
    assert edit.frame_current == 13
    call(bpy, "track_look")
    assert edit.frame_current == 15
    call(bpy, "track_look", frame=12)
    assert edit.frame_current == 12


# Following


@pytest.fixture
def clip(bpy, frames):
    """A clip of the same footage, whose tracks are where the subject's corners and its middle are."""
    clip = bpy.data.movieclips.load(str(frames))
    for name, offset in (("a", 20 + 20j), ("b", 20 - 20j), ("c", -20 - 20j), ("d", -20 + 20j), ("middle", 0)):
        mark(clip.tracking.objects[0].tracks.new(name=name, frame=1), offset)
    return clip


def mark(track, offset, frames=range(1, COUNT + 1)):
    """Puts a track's markers on a point of the subject, from its middle on, y up."""
    for frame in frames:
        angle, scale = turned(frame - 1)
        place = offset * scale * np.exp(1j * np.radians(angle))
        x, y = centre(frame - 1) * (1, -1) + (place.real, SIZE[1] + place.imag)
        track.markers.insert_frame(frame, co=(x / SIZE[0], y / SIZE[1]))


def set_up(region, clip, kind, track="", holder=""):
    region.follow_clip, region.follow_kind, region.follow_track, region.follow_object = clip, kind, track, holder


def plane_track(bpy, clip):
    """A plane track of the four corners; only an editor of clips makes one."""
    holder = clip.tracking.objects[0]
    for track in holder.tracks:
        track.select = track.name != "middle"
    window = bpy.data.window_managers[0].windows[0]
    area = window.screen.areas[0]
    before, area.type = area.type, "CLIP_EDITOR"
    area.spaces.active.clip = clip
    with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
        assert bpy.ops.clip.create_plane_track() == {"FINISHED"}
    area.type = before
    return holder.plane_tracks[0]


def test_a_region_follows_a_track(bpy, edit, region, clip):
    set_up(region, clip, "TRACK", "middle")
    move(bpy, 15, 4)
    does(bpy, everything, "follow")
    shown = [np.array(key) for key in keys(bpy)[0]]
    assert types(bpy)[15] == "KEYFRAME"
    assert {kind for frame, kind in types(bpy).items() if frame != 15} == {"GENERATED"}
    assert len(shown) < 15
    middles = [centre(frame - 11) - centre(0) for frame in range(11, 31)]
    x = fcurves.find_curve(bpy.context.scene, "virtual_shutter.effects[0].regions[0].location", 0)
    assert max(abs(x.evaluate(11 + i) * SIZE[0] - middle[0]) for i, middle in enumerate(middles)) < 1
    assert len(keys(bpy, "rotation")[0]) == 1, "a single track does not turn"
    bpy.context.scene.frame_set(21)  # the editor mends what is followed
    active(bpy)[1].regions[0].location[1] += 0.1
    motion_keys.insert(active(bpy)[1], 0)
    call(bpy, "follow")
    y = fcurves.find_curve(bpy.context.scene, "virtual_shutter.effects[0].regions[0].location", 1)
    off = {frame: y.evaluate(frame) - (centre(0) - centre(frame - 11))[1] / SIZE[1] for frame in (11, 15, 18, 21, 28)}
    assert off == pytest.approx({11: 0, 15: 0, 18: 0.05, 21: 0.1, 28: 0.1}, abs=1.5 / SIZE[1])


@pytest.mark.parametrize("kind", ["OBJECT", "PLANE", "CUP"])
def test_a_region_follows_several_points(bpy, edit, region, clip, kind):
    """Of the camera, of a plane, and of an object of its own, where those of the camera are elsewhere."""
    if kind == "PLANE":
        set_up(region, clip, "PLANE", plane_track(bpy, clip).name)
    elif kind == "OBJECT":
        set_up(region, clip, "OBJECT")
        move(bpy, 15, 4)
    else:
        for track in clip.tracking.objects[0].tracks:
            track.markers[0].co = (0.9, 0.9)
        holder = clip.tracking.objects.new("Cup")
        for name, offset in (("left", -20), ("right", 20)):
            mark(holder.tracks.new(name=name, frame=1), offset)
        set_up(region, clip, "OBJECT", holder="Cup")
    call(bpy, "follow")
    assert max(apart(bpy, frame, frame - 11) for frame in range(11, 31)) < 1


def test_tracks_that_end_are_followed_by_way_of_others(bpy, edit, region, clip):
    tracks = clip.tracking.objects[0].tracks
    for k, track in enumerate(tracks):
        for frame in range(1, COUNT + 1):
            if frame > 12 if k < 2 else frame < 8:
                track.markers.find_frame(frame).mute = True
    set_up(region, clip, "OBJECT")
    call(bpy, "follow")
    assert max(apart(bpy, frame, frame - 11) for frame in range(11, 31)) < 1


def test_a_gap_in_a_track_is_bridged_and_unsure(bpy, edit, region, clip):
    track = clip.tracking.objects[0].tracks["middle"]
    for frame in (8, 9):
        track.markers.find_frame(frame).mute = True
    set_up(region, clip, "TRACK", "middle")
    call(bpy, "follow")
    effect = active(bpy)[1]
    assert track_region.next_unsure(effect, 0, 11) == 18
    assert track_region.next_unsure(effect, 0, 18) is None
    assert track_region.lost(effect, 0) is None


@pytest.mark.parametrize("operator", ["track", "follow"])
def test_a_trimmed_reversed_and_retimed_strip_shows_other_frames(bpy, edit, frames, clip, operator):
    source = new_source(edit, frames)
    source.use_reverse_frames = True
    source.retiming_keys.add(timeline_frame=11)
    source.retiming_keys[-1].timeline_frame = 49
    source.left_handle = 15
    set_up(drawn(edit, source, at=centre(COUNT - 1)), clip, "OBJECT")
    shown = {frame: request(*active(bpy), frame).index for frame in range(15, 49)}
    edit.frame_set(15)
    move(bpy, 15, shown[15], of=COUNT - 1)
    call(bpy, operator)
    assert len(set(shown.values())) > 15
    worst = max(apart(bpy, frame, index, of=COUNT - 1) for frame, index in shown.items())
    assert worst < (2 if operator == "track" else 1.2)


def test_a_clip_of_other_footage_is_refused(bpy, edit, region, clip, frames, tmp_path):
    other = bpy.data.movieclips.load(str(write_frames(tmp_path / "other", [picture(0)] * COUNT)))
    later = bpy.data.movieclips.load(str(frames.with_name("f0003.png")))
    for wrong in (other, later):
        mark(wrong.tracking.objects[0].tracks.new(name="middle", frame=1), 0)
        set_up(region, wrong, "TRACK", "middle")
        refuses(bpy, "follow", f'clip "{wrong.name}" does not begin with the same file as strip "images"')
    clip.filepath = str(frames.parent / ".." / frames.parent.name / frames.name)
    set_up(region, clip, "TRACK", "middle")
    assert call(bpy, "follow") == {"FINISHED"}


def test_what_cannot_be_followed_is_said(bpy, edit, region, clip):
    refuses(bpy, "follow", "Choose a clip first")
    set_up(region, clip, "TRACK", "none")
    refuses(bpy, "follow", 'clip "f0001.png" has no track "none"')
    set_up(region, clip, "PLANE", "middle")
    refuses(bpy, "follow", 'clip "f0001.png" has no track "middle"')
    set_up(region, clip, "OBJECT", holder="Cup")
    refuses(bpy, "follow", 'clip "f0001.png" has no track "Cup"')
    set_up(region, clip, "TRACK", "middle")
    clip.tracking.objects[0].tracks["middle"].markers.find_frame(1).mute = True
    refuses(bpy, "follow", '"middle" of clip "f0001.png" has no marker at frame 11')
    edit.frame_set(5)
    refuses(bpy, "follow", '"middle" of clip "f0001.png" has no marker at frame 5')
    edit.frame_set(12)
    layer = annotations.layer_of(active(bpy)[1], region)
    layer.frames.remove(layer.frames[0])
    refuses(bpy, "follow", 'region "Sharp" has no strokes')
