"""Clip strips as sources: what Blender shows of the plain strip, whatever the clip's settings."""

import numpy as np
import pytest
from support import effect_of, in_sequencer, noise, picture_of, recipe, started, write_frames, write_movie

from shutter_addon.blender.rendering import effect_source


@pytest.fixture(scope="module")
def movie(tmp_path_factory):
    pictures = noise(20, 8, 12, 3).repeat(4, 1).repeat(4, 2)
    path = tmp_path_factory.mktemp("movie") / "noise.mkv"
    return write_movie(path, pictures, "libx264", "yuv420p", options={"qp": "0"})


def pngs(folder, channels=3):
    return write_frames(folder, noise(12, 32, 48, channels, seed=channels))


@pytest.fixture
def clip_strip(bpy, edit):
    """A clip strip of a file at frame 1 in an edit of its size."""
    edit.render.resolution_x, edit.render.resolution_y = 48, 32
    edit.frame_start, edit.frame_end = -100, 300

    def make(path, start=1):
        return edit.sequence_editor.strips.new_clip("clip", bpy.data.movieclips.load(str(path)), 1, start)

    return make


def check(edit, render, source, frames, depth="8"):
    plain = render(edit, frames, depth)
    effect_of(edit, source, recipe(4, [1, 0, 0, 0]))
    shown = render(edit, [int(frame) for frame in np.random.default_rng(0).permutation(list(frames))], depth)
    for frame in frames:
        solid = plain[frame][..., 3] > 25
        assert np.abs(shown[frame] - plain[frame])[solid].max() <= 1, f"at frame {frame}"
        assert np.abs(shown[frame] - plain[frame])[..., 3].max() <= 1, f"at frame {frame}"
        assert plain[frame][..., 0].std() > 20


def test_trimmed_cut_and_reversed(edit, render, clip_strip, movie):
    source = clip_strip(movie, 40)
    source.left_handle, source.right_handle = 43, 55
    source.use_reverse_frames = True
    check(edit, render, source.split(48, "HARD"), range(48, 55))


@pytest.mark.parametrize("channels", [3, 4])
def test_images(edit, render, tmp_path, clip_strip, channels):
    check(edit, render, clip_strip(pngs(tmp_path / "in", channels)), range(1, 13, 2))


def test_start_and_offset_of_images(bpy, edit, render, tmp_path, clip_strip):
    source = clip_strip(pngs(tmp_path / "in").with_name("f0003.png"))
    source.clip.frame_start, source.clip.frame_offset = 30, 2
    check(edit, render, source, range(1, 8))


def test_images_some_of_which_have_alpha(edit, render, tmp_path, clip_strip):
    first = pngs(tmp_path / "in", 3)
    later = pngs(tmp_path / "other", 4)
    for name in ("f0003.png", "f0007.png"):
        later.with_name(name).replace(first.with_name(name))
    check(edit, render, clip_strip(first), [1, 3, 4, 7], depth="16")


@pytest.mark.parametrize("space", ["Non-Color", "AgX Log"])
def test_colour_spaces(edit, render, tmp_path, clip_strip, movie, space):
    source = clip_strip(pngs(tmp_path / "in"))
    spaces = source.clip.colorspace_settings.bl_rna.properties["name"].enum_items.keys()
    source.clip.colorspace_settings.name = next(name for name in spaces if name.startswith(space))
    check(edit, render, source, [1, 2, 7], depth="16")


def test_what_is_not_supported_is_said(edit, clip_strip, movie):
    source = clip_strip(movie)
    strip, _effect = started(edit, source)
    picture_of(strip.scene, 1)
    source.stabilize2d = True
    with pytest.raises(effect_source.FAULTS, match='"clip": undistorted or stabilized clips are not supported'):
        picture_of(strip.scene, 1)
    source.stabilize2d, source.clip = False, None
    with pytest.raises(effect_source.FAULTS, match='"clip" has no clip'):
        picture_of(strip.scene, 1)


@pytest.mark.parametrize("speed", [37.0, 150.0])
def test_a_retimed_clip(bpy, edit, render, clip_strip, movie, speed):
    """What Python is not told of: keys of a clip that is not the edit's first strip."""
    clip_strip(movie).select = False
    source = clip_strip(movie, 41)
    edit.sequence_editor.active_strip, source.select, source.show_retiming_keys = source, True, True
    in_sequencer(bpy, bpy.ops.sequencer.retiming_segment_speed_set, speed=speed)
    assert abs(source.content_end - source.content_start - 20) > 3
    check(edit, render, source, range(41, source.right_handle))
