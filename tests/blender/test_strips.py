"""Which source frame an effect shows: what Blender itself shows for the plain strip, whatever was done to it."""

import ctypes

import numpy as np
import pytest
from support import effect_of, image_strip, noise_film, recipe, request, sequencer, write_frames, write_movie

from shutter_addon.blender.data import annotations, strips
from shutter_addon.blender.rendering import job_snapshots as snapshots
from shutter_addon.blender.rendering import render_job

LEVELS = 1
MOST = 20  # pictures of an effect
SELECTED = 1 << 4  # SEQ_KEY_SELECTED in a retiming key's flag, behind a double: Python cannot select one


@pytest.fixture(scope="module")
def movie(tmp_path_factory):
    """A movie of 60 frames, 32×32, 24 fps; frame i is a grey of its own."""
    return write_movie(tmp_path_factory.mktemp("movie") / "grey.mkv", greys())


def greys():
    frames = np.repeat(np.arange(5, 245, 4, dtype=np.uint8), 32 * 32 * 3).reshape(60, 32, 32, 3)
    frames[:, :16, :, 0] = 260 - frames[:, :16, :, 0].astype(int)
    return frames


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    frames = np.repeat(np.arange(5, 245, 12, dtype=np.uint8), 32 * 32 * 3).reshape(20, 32, 32, 3)
    return write_frames(tmp_path_factory.mktemp("images"), frames)


@pytest.fixture
def effect_on(bpy, edit):
    """Puts an effect on a strip: still frames by default; gives strip and effect."""
    edit.render.resolution_x = edit.render.resolution_y = 32
    edit.frame_start, edit.frame_end = -100, 300

    def add(source, data=None):
        return effect_of(edit, source, data or recipe(4, [1, 0, 0, 0]))

    return add


def new_movie(edit, path, start=1, channel=1):
    return edit.sequence_editor.strips.new_movie("movie", str(path), channel, start)


def check(edit, render, effect_strips, frames):
    """The effects show the frames that the plain strips show; so do their pictures, asked for out of order."""
    for strip in effect_strips:
        strip.mute = True
    # In order: what Blender shows of a slowed strip depends on what it has shown before.
    plain = render(edit, frames)
    for strip in effect_strips:
        strip.mute = False
        effect = strips.find_effect(strip.scene)[1]
        for frame in (frame for frame in frames if strip.left_handle <= frame < strip.right_handle):
            index = request(edit, effect, strip, frame).index
            assert 4 * index + 5 == pytest.approx(plain[frame][-1, 0, 0], abs=LEVELS), f"at frame {frame}"
    shown = render(edit, [int(frame) for frame in np.random.default_rng(0).permutation(list(frames))[:MOST]])
    for frame, picture in shown.items():
        assert np.abs(picture - plain[frame]).max() <= LEVELS, f"at frame {frame}"
    assert len({p[0, 0, 0] for p in plain.values()}) > len(frames) / 20, "the plain strip shows several frames"


@pytest.mark.parametrize("percentage", [100, 50])
def test_still_frames_beyond_the_content(edit, render, effect_on, movie, percentage):
    source = new_movie(edit, movie, start=10)
    edit.render.resolution_percentage = percentage
    source.left_handle, source.right_handle = 1, 90
    strip, _ = effect_on(source)
    check(edit, render, [strip], [1, 5, 9, 10, 11, 40, 69, 70, 71, 89])


def test_hard_cut_source(edit, render, effect_on, movie):
    right = new_movie(edit, movie, start=10).split(30, "HARD")
    strip, _ = effect_on(right)
    check(edit, render, [strip], range(30, 70, 3))


@pytest.fixture
def retime(bpy, edit):
    """Works on a strip's retiming keys, the chosen one of them, by Blender's operators, which know where strips lie."""

    def run(operator, strip, chosen=None, **options):
        for i, key in enumerate(strip.retiming_keys):
            flag = ctypes.c_int.from_address(key.as_pointer() + 8)
            flag.value = flag.value & ~SELECTED | SELECTED * (i == chosen)
        for each in edit.sequence_editor.strips_all:
            each.select = each == strip
        edit.sequence_editor.active_strip, strip.show_retiming_keys = strip, True
        with sequencer(bpy) as area, bpy.context.temp_override(region=area.regions[-1]):
            assert getattr(bpy.ops.sequencer, f"retiming_{operator}")(**options) == {"FINISHED"}

    return run


def test_retimed_strips_that_are_not_the_first(edit, render, effect_on, movie, retime):
    """Set Speed; keys, one with a transition; then cut both ways, moved, trimmed, and moved into a meta."""
    new_movie(edit, movie)
    slow, ramp = new_movie(edit, movie, 81), new_movie(edit, movie, 241)
    retime("segment_speed_set", slow, speed=50.0)
    assert slow.right_handle == 201
    for frame in (256, 281):
        ramp.retiming_keys.add(timeline_frame=frame)
    retime("segment_speed_set", ramp, 2, speed=40.0)
    retime("transition_add", ramp, 1, duration=8)
    assert len(ramp.retiming_keys) == 5
    (slow_effect, _), (ramp_effect, _) = effect_on(slow), effect_on(ramp)
    check(edit, render, [slow_effect, ramp_effect], [*range(81, 201), *range(241, ramp.right_handle)])
    slow_effect.split(121, "SOFT"), slow.split(121, "SOFT")
    for strip in (ramp, ramp_effect):
        strip.content_start += 7
    ramp.left_handle = ramp_effect.left_handle = 255
    effects = [strip for strip in edit.sequence_editor.strips if strip.type == "SCENE"]
    assert len(effects) == 3
    frames = [*range(81, 201, 4), *range(255, ramp.right_handle, 4)]
    check(edit, render, effects, frames)
    meta = edit.sequence_editor.strips.new_meta("Meta", 5, 255)
    for strip in (ramp, ramp_effect):
        strip.move_to_meta(meta)
    meta.right_handle = ramp.right_handle
    check(edit, render, effects, frames)


def test_a_freeze_frame(edit, render, effect_on, movie, retime):
    source = new_movie(edit, movie)
    source.retiming_keys.add(timeline_frame=31)
    source.retiming_keys[-1].timeline_frame = 120
    retime("freeze_frame_add", source, 1, duration=10)
    assert len(source.retiming_keys) == 4
    strip, _ = effect_on(source)
    check(edit, render, [strip], range(1, source.right_handle))


@pytest.mark.parametrize("fps", [24, 25, 30])
def test_a_movie_of_240_fps_that_keeps_its_speed(bpy, edit, render, effect_on, tmp_path, fps):
    """As the Add menu adds it, with "Adjust Playback Rate"."""
    edit.render.fps = fps
    path = str(write_movie(tmp_path / "fast.mkv", greys(), rate=240))
    with sequencer(bpy):
        bpy.ops.sequencer.movie_strip_add(
            filepath=path, frame_start=1, channel=1, sound=False, adjust_playback_rate=True, use_framerate=False
        )
    (source,) = edit.sequence_editor.strips
    assert source.right_handle - source.left_handle < 10
    strip, _ = effect_on(source)
    check(edit, render, [strip], range(source.left_handle, source.right_handle))


def test_the_window_counts_source_frames_in_playing_order(edit, render, effect_on, images):
    """Two frames on, at a still frame: of a reversed strip, the frame two before."""
    source = image_strip(edit, images)
    source.use_reverse_frames = True
    effect_on(source, recipe(4, [0, 0, 1, 0]))
    shown = render(edit, [1, 10, 19])
    assert [shown[f][0, 0, 0] for f in (1, 10, 19)] == pytest.approx([12 * 17 + 5, 12 * 8 + 5, 5], abs=1)


def test_the_window_reaches_past_a_trim(edit, render, effect_on, images):
    source = image_strip(edit, images)
    source.right_handle = 6
    effect_on(source, recipe(8, [0, 0, 0, 0, 0, 0, 0, 1]))
    assert render(edit, [5])[5][0, 0, 0] == pytest.approx(12 * 11 + 5, abs=1)


def test_an_effect_moved_with_its_source_takes_its_keys_along(edit, render, effect_on, movie):
    source = new_movie(edit, movie)
    strip, _ = effect_on(source, recipe(4, {1: [1, 0, 0, 0], 31: [0, 0, 0, 1]}))
    before = render(edit, [1, 11, 31])
    for s in (strip, source):
        s.content_start += 40
    after = render(edit, [41, 51, 71])
    for frame in (1, 11, 31):
        assert np.array_equal(after[frame + 40], before[frame])


@pytest.mark.parametrize("flips", [(True, False), (False, True)])
def test_scribbles_lie_where_they_are_seen_on_a_mirrored_strip(bpy, edit, render, effect_on, images, flips):
    """Drawn at the upper left of the image: there it is the last frame, whichever part of the source that is."""
    source = image_strip(edit, images)
    source.use_flip_x, source.use_flip_y = flips
    _strip, effect = effect_on(source, recipe(4, [1, 0, 0, 0], [0, 0, 0, 1], border=True))
    region = effect.regions.add()
    region.shutter, region.kind = "S1", "LASSO"
    layer = effect.scene.annotation.layers.new("corner")
    region.layer = layer.info
    annotations.add_stroke(layer.frames.new(1), np.array([(-12, 4), (-4, 4), (-4, 12), (-12, 12)]))
    picture = render(edit, [5])[5]
    assert picture[16 - 8, 16 - 8, 0] == 12 * 7 + 5
    assert picture[16 + 8, 16 + 8, 0] < 12 * 6


def test_inside_a_meta_strip(edit, render, effect_on, movie):
    meta = edit.sequence_editor.strips.new_meta("Meta", 1, 1)
    source = meta.strips.new_movie("movie", str(movie), 1, 1)
    strip, _effect = effect_on(source)
    assert strip.parent_meta() == meta
    assert strip.channel == source.channel + 1
    meta.right_handle = 61
    check(edit, render, [strip], [1, 20, 60])


@pytest.mark.parametrize("full", [True, False])
def test_a_copied_edit_has_effects_of_its_own(bpy, edit, render, effect_on, movie, full):
    source = new_movie(edit, movie)
    _, effect = effect_on(source, recipe(4, [0, 0, 1, 0], regions=[]))
    before = render(edit, [5])[5]
    if full:
        with bpy.context.temp_override(scene=edit):
            bpy.ops.scene.new(type="FULL_COPY")
        copy = next(s for s in bpy.data.scenes if s != edit and s.virtual_shutter.effects)
    else:
        copy = edit.copy()
    assert np.array_equal(render(copy, [5])[5], before)
    own = copy.virtual_shutter.effects[0]
    assert own.scene != effect.scene
    own.shutters[0].bars[2].weight, own.shutters[0].bars[0].weight = 0, 1
    assert render(copy, [5])[5][20, 0, 0] == pytest.approx(4 * 4 + 5, abs=1)
    assert np.array_equal(render(edit, [5])[5], before)


def test_a_hard_cut_changes_no_picture(bpy, edit, render, tmp_path):
    """Each part has a source of its own, whose content ends at the cut."""
    frames = np.random.default_rng(2).integers(0, 256, (9, 24, 40, 3), dtype=np.uint8)
    source, _effect, strip = noise_film(edit, frames, tmp_path)
    before = render(edit, [3, 5, 8])
    source.split(5, "HARD")  # and the effect strip, which is connected
    right = next(each for each in edit.sequence_editor.strips if each.type == "SCENE" and each != strip)
    after = render(edit, [3, 5, 8])
    assert all(np.array_equal(after[frame], before[frame]) for frame in before)
    snapshots.begin(edit.session_uid)
    try:
        # What a job of the window reads, which is not to be seen.
        of_parts = [part for half in (strip, right) for part in render_job.job.film_data.taken[half.scene.session_uid]]
        assert [shown for shown, _ in of_parts] == [range(1, 5), range(5, 10)]
        assert of_parts[0][1].timing != of_parts[1][1].timing
        assert max(of_parts[0][1].frames) < 7 < max(of_parts[1][1].frames)
    finally:
        snapshots.end()
