"""Snapshots: all that an effect strip's pictures depend on, as plain data that no later edit changes."""

import pickle

import numpy as np
import pytest
from support import image_strip, sequencer, started, state, write_frames

from shutter_addon.blender.data import annotations, fcurves, recipe_import, snapshot, source_media, strips
from shutter_addon.blender.editing import bar_edits, region_edits, shutter_edits
from shutter_addon.blender.rendering import invalidation
from shutter_addon.core.messages import EffectError

FRAMES = range(1, 25)


@pytest.fixture
def found(bpy, edit, tmp_path):
    """Edit, effect and strip; shutters keyed by bars and by value, a region keyed and drawn twice, options keyed."""
    frames = np.random.default_rng(0).integers(0, 256, (24, 24, 40, 3), dtype=np.uint8)
    strip, effect = started(edit, image_strip(edit, write_frames(tmp_path / "in", frames)))
    effect.window = 4
    for frame, bars in ((1, [1, 0, 0, 0]), (20, [0, 0, 0, 1])):
        edit.frame_set(frame)
        bar_edits.paint(effect, 1, bars, key=True)
    region = region_edits.add_region(effect, effect.shutters[1])
    for frame in (1, 12):
        drawing = annotations.layer_of(effect, region).frames.new(frame)
        annotations.add_stroke(drawing, np.array([(-5.0 - frame, 2), (8, 3)]))
        region.location[0] = frame / 100
        region.keyframe_insert("location", frame=frame)
        effect.position = "START" if frame == 1 else "END"
        effect.keyframe_insert("position", frame=frame)
    return edit, effect, strip


def states(snapshot) -> list:
    return [snapshot.effect.at(frame).key for frame in FRAMES]


def test_it_holds_no_blender_data_and_does_not_change(found):
    """What a pickle holds is plain."""
    edit, effect, strip = found
    taken = snapshot.take(edit, effect, strip, FRAMES)
    before, plain = states(taken), pickle.dumps(taken)
    assert len(set(before)) == len(before) - 4  # the last keys hold from frame 20 on
    bar_edits.paint(effect, 0, [0, 1, 1, 0])
    region_edits.remove_region(effect, 0)
    shutter_edits.remove_shutter(effect, 1)
    effect.light = "ENCODED"
    strip.transform.offset_x = 9
    edit.sequence_editor.strips.remove(strip)
    assert states(taken) == before == states(pickle.loads(plain))


def test_many_frames_are_those_of_each(found):
    for interpolation in ("DISPLACEMENT", "VALUE"):
        found[1].interpolation = interpolation
        single = [snapshot.take(*found, (frame,)).effect.at(frame).key for frame in FRAMES]
        assert states(snapshot.take(*found, FRAMES)) == single


def test_what_is_wrong_at_one_frame_is_told_there(found):
    edit, effect, _ = found
    path = f"{effect.path_from_id()}.shutters[0].bars"
    for i in range(4):  # closes at frame 9 alone
        fcurves.set_keys(edit, f"{path}[{i}].weight", 0, [(8, 1, "linear"), (9, 0, "linear"), (10, 1, "linear")])
    taken = snapshot.take(*found, FRAMES)
    assert taken.effect.at(8).bars[0].tolist() == taken.effect.at(10).bars[0].tolist() == [1] * 4
    with pytest.raises(EffectError, match='shutter "Long" at frame 9: all bars are zero'):
        taken.effect.at(9)


def test_scribbles_follow_a_keyed_transform(found):
    *_, strip = found
    still = snapshot.take(*found, FRAMES)
    for frame, offset in ((1, 0), (12, 10)):
        strip.transform.offset_x = offset
        strip.transform.keyframe_insert("offset_x", frame=frame)
    moving = snapshot.take(*found, FRAMES)
    for frame, pixels in ((1, 0), (12, 10), (24, 10)):
        apart = still.effect.at(frame).shapes[0].strokes[0] - moving.effect.at(frame).shapes[0].strokes[0]
        assert apart[:, 0] * 40 == pytest.approx([pixels] * 2, abs=1e-4)


def test_what_is_drawn_is_read_once_until_something_changes(bpy, found, monkeypatch):
    edit, effect, strip = found
    asked, take, look = [], snapshot.take, source_media.media_key
    monkeypatch.setattr(snapshot, "take", lambda *a, **k: asked.append("take") or take(*a, **k))
    monkeypatch.setattr(source_media, "media_key", lambda *a: asked.append("files") or look(*a))
    invalidation.invalidate_changed(edit)

    def drawn():
        asked.clear()
        invalidation.invalidate_changed(edit)
        return {invalidation.current(edit, effect, strip, 5) for _ in range(3)}

    assert len(drawn()) == 1
    assert asked == ["files", "take", "files"]
    kept = drawn()
    assert asked == ["files"]
    assert drawn() == kept
    effect.shutters[0].bars[0].weight = 0.5
    assert drawn() != kept
    assert asked == ["files", "take", "files"]


def test_a_part_of_a_cut_source_is_read_as_itself(bpy, found):
    """Though the files of another part were looked at last."""
    edit, effect, strip = found
    source = strips.source_of(edit, effect, strip)
    right = source.split(12, "SOFT")
    right.colorspace_settings.name = "Non-Color"
    with sequencer(bpy):
        for other in edit.sequence_editor.strips_all:
            other.select = other == strip
        bpy.ops.sequencer.split(frame=12, type="SOFT", side="RIGHT")
    (later,) = (s for s in strips.effect_strips(edit) if s != strip)
    invalidation.invalidate_changed(edit)
    for part, own in ((strip, source), (later, right), (strip, source)):
        effect = strips.effect_of(edit, part.scene)
        taken = invalidation.current(edit, effect, part, part.left_handle)
        assert taken.timing.name == own.name
        assert taken.source.options["colorspace"] == own.colorspace_settings.name
        assert snapshot.take(edit, effect, part, (part.left_handle,)).source == taken.source


def test_keys_follow_time_stretching(found):
    """As Blender's own: a key's place on a timeline that is stretched is not its frame. What is sampled, kept by the
    sequencer, exported and told of the bars follows; what changes bars at their keys does not move these."""
    edit, effect, strip = found

    def seen(frame):
        now = state(edit, effect, strip, frame)
        return [*now.bars[1], now.options.position == "end"]

    before = [seen(frame) for frame in (1, 5.5, 10, 20)]
    assert len({*map(tuple, before)}) == 4
    keys = snapshot.recipe_of(edit, effect, strip).shutters[1].bars.channel.frames
    invalidation.invalidate_changed(edit)
    edit.render.frame_map_old, edit.render.frame_map_new = 100, 200
    assert invalidation.invalidate_changed(edit)
    np.testing.assert_allclose([seen(frame) for frame in (2, 11, 20, 40)], before, atol=1e-6)
    edit.frame_set(40)
    assert bar_edits.key_state(effect, 1)[0] == "keyed"
    np.testing.assert_allclose(bar_edits.bars_now(effect, 1), before[3][:4], atol=1e-6)
    stretched = snapshot.recipe_of(edit, effect, strip).shutters[1].bars.channel.frames
    assert stretched[-1] == 2 * keys[-1]
    recipe_import.apply(edit, effect, strip, snapshot.recipe_of(edit, effect, strip))
    assert snapshot.recipe_of(edit, effect, strip).shutters[1].bars.channel.frames == stretched
    effect.window = 5
    path = f"{effect.path_from_id()}.shutters[1].bars[0].weight"
    assert fcurves.points_of(fcurves.find_curve(edit, path))[:, 0].tolist() == [1, 20]
