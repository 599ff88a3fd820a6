"""Effects over in-between frames: what their windows show, and what becomes of bars when the factor changes.

Pictures are compared with means of frames that are known: the cache is written with random ones in place of flow's."""

import itertools
from functools import partial
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest
from standin import between
from support import picture_of, request, write_frames

from shutter_addon.blender.data import fcurves
from shutter_addon.core.frames import light
from shutter_addon.core.model import shutters
from shutter_addon.media import flow, inbetween, open_source

FACTOR, COUNT, CUT = 4, 12, 6


def cut_film():
    """Two shots (n, 24, 40, 3), each a texture that moves by a pixel a frame."""
    rng = np.random.default_rng(7)
    shots = [rng.integers(0, 256, (6, 10, 3), dtype=np.uint8).repeat(4, 0).repeat(4, 1) for _ in range(2)]
    return np.stack([np.roll(shots[k >= CUT], k, axis=1) for k in range(COUNT)])


@pytest.fixture
def cache(bpy, tmp_path):
    """The folder of in-between frames."""
    from shutter_addon.blender.rendering import render_settings

    with render_settings.using(render_settings.RenderSettings(inbetween=tmp_path / "cache")):
        yield tmp_path / "cache"


@pytest.fixture
def film(cache, tmp_path):
    """A cut film with its in-betweens: the first file, and all frames in linear light (count, H, W, 3)."""

    first = write_frames(tmp_path / "film", cut_film())
    with open_source(first) as source:
        build(source, cache)
        with inbetween.InbetweenSource(source, cache, FACTOR, "quick") as every:
            frames = np.stack([every.read(i)[..., :3] for i in range(every.count)])
    return first, light.to_linear(frames / 255)


def build(source, folder, **more):
    with mock.patch.object(flow, "between", between):
        return inbetween.build(source, folder, FACTOR, "quick", **more)


@pytest.fixture
def add(bpy, edit):
    """Puts an effect of the factor on an image strip of files from frame 1 on; shutter: its bars."""
    from shutter_addon.blender.editing import add_effect, bar_edits, shutter_edits

    def added(first, count, bars, **options):
        source = edit.sequence_editor.strips.new_image("film", str(first), 1, 1)
        for number in range(2, count + 1):
            source.elements.append(f"f{number:04d}.png")
        strip, effect = add_effect.add_effect(edit, source)
        edit.render.resolution_x, edit.render.resolution_y = 40, 24
        effect.inbetween = str(FACTOR)
        effect.window = len(bars)
        shutter_edits.add_shutter(effect, "S")
        bar_edits.paint(effect, 0, bars)
        for name, value in options.items():
            setattr(effect, name, value)
        return source, strip, effect

    return added


def shown(frames, indices):
    """The mean of these frames, in 8-bit levels."""
    return light.to_encoded(frames[list(indices)].mean(axis=0)) * 255


def test_a_window_counts_in_betweens(film, add, edit, render, same_pixels):
    first, frames = film
    add(first, COUNT, np.ones(6))
    for frame, picture in render(edit, (1, 3)).items():
        start = (frame - 1) * FACTOR
        same_pixels(picture[..., :3], shown(frames, range(start, start + 6)), 1)


def test_a_window_stops_in_the_middle_of_a_cut_pair(film, add, edit, render, same_pixels):
    """Whose in-betweens are copies of the nearer frame; hold repeats the last of the shot."""
    first, frames = film
    _source, _strip, effect = add(first, COUNT, np.ones(10))
    end = (CUT - 1) * FACTOR + FACTOR // 2  # the last of the first shot
    for frame, picture in render(edit, (5, 6, 7)).items():
        window = np.arange((frame - 1) * FACTOR, (frame - 1) * FACTOR + 10)
        same_pixels(picture[..., :3], shown(frames, np.minimum(window, end) if frame <= CUT else window), 1)
    effect.position = "END"
    window = np.maximum(np.arange(CUT * FACTOR - 6, CUT * FACTOR + 4), end + 1)
    same_pixels(render(edit, (7,))[7][..., :3], shown(frames, window), 1)
    effect.stop_at_cuts, effect.position = False, "START"
    same_pixels(render(edit, (6,))[6][..., :3], shown(frames, range(20, 30)), 1)


def test_at_a_cut_it_slides_by_in_betweens(film, add, edit, render, same_pixels):
    """The shot's last filmed frame lasts as long as any."""
    first, frames = film
    _source, _strip, effect = add(first, COUNT, np.ones(10), edges="SLIDE")
    last = (CUT - 1) * FACTOR
    for frame, picture in render(edit, (3, 5, 6)).items():
        start = min((frame - 1) * FACTOR, last + FACTOR - 10)
        window = np.minimum(np.arange(start, start + 10), last + FACTOR // 2)
        same_pixels(picture[..., :3], shown(frames, window), 1)
    effect.position = "END"
    window = np.arange(last + FACTOR // 2 + 1, last + FACTOR // 2 + 11)
    same_pixels(render(edit, (7,))[7][..., :3], shown(frames, window), 1)


def test_an_exposure_that_follows_takes_the_motion_between(film, add, edit, render, same_pixels):
    """By four pixels a filmed frame, so that in-between ones are seen at whole pixels; those beyond the cut are not."""
    first, frames = film
    _source, _strip, effect = add(first, COUNT, np.ones(6))
    effect.shutters[0].follow = "CAMERA"
    for frame in (1, COUNT):
        effect.camera.location = (FACTOR * frame / 40, 0)
        edit.keyframe_insert(effect.camera.path_from_id("location"), frame=frame)
    for curve in fcurves.curves_under(edit, effect.camera.path_from_id("location")):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    end = (CUT - 1) * FACTOR + FACTOR // 2  # the last of the first shot
    for frame, picture in render(edit, (2, 6)).items():
        start = (frame - 1) * FACTOR
        window = np.minimum(np.arange(start, start + 6), end)
        moved = np.stack([np.roll(frames[k], start - k, axis=1) for k in window])
        same_pixels(picture[:, :-6, :3], shown(moved, range(6))[:, :-6], 1)


def test_reversed_frames(film, add, edit, render, same_pixels):
    first, frames = film
    source, *_ = add(first, COUNT, np.ones(5))
    source.use_reverse_frames = True
    same_pixels(render(edit, (2,))[2][..., :3], shown(frames, range(39, 43 + 1)), 1)


def test_a_slow_strip_shows_in_betweens(film, add, edit, render, same_pixels):
    first, frames = film
    source, strip, _effect = add(first, COUNT, [1.0, 0, 0, 0])
    source.retiming_keys.add(timeline_frame=1)
    source.retiming_keys.add(timeline_frame=source.right_handle)
    source.retiming_keys[-1].timeline_frame = 1 + 4 * COUNT
    strip.right_handle = source.right_handle

    found = {frame: request(edit, _effect, strip, frame).index for frame in range(1, 30)}
    assert len(set(found.values())) > 20
    for frame, picture in render(edit, (3, 8)).items():
        same_pixels(picture[..., :3], shown(frames, [found[frame]]), 1)
        assert abs(found[frame] - (frame - 1)) <= 1


def test_what_is_missing_is_said_and_what_is_built_is_shown(cache, film, add, edit, render, tmp_path, same_pixels):
    from shutter_addon.blender.data import strips
    from shutter_addon.media import MediaError, inbetween_cache

    first, frames = film
    *_, effect = add(first, COUNT, np.ones(6))
    picture = partial(picture_of, effect.scene, 2)
    picture()
    with open_source(first) as source:
        inbetween_cache.purge(cache, source)
    for way in (picture, request(*strips.find_effect(effect.scene), 2).check):
        with pytest.raises(MediaError, match=r"in-between frames of frame 2 are missing"):
            way()
    with open_source(first) as source:
        build(source, cache, pairs=range(1, 3))
    same_pixels(light.to_encoded(picture()[..., :3]) * 255, shown(frames, range(4, 10)), 1)
    effect.inbetween = "1"  # a frame and a half
    same_pixels(light.to_encoded(picture()[..., :3]) * 255, shown(frames, (4, 4, 8)), 1)


def test_in_betweens_of_a_file_that_was_replaced_are_not_shown(cache, film, add, edit, monkeypatch):
    from shutter_addon.blender.data import source_media
    from shutter_addon.blender.rendering import invalidation
    from shutter_addon.media import MediaError

    seconds = itertools.count(1e6, 10)  # so that all files are looked at each time
    monkeypatch.setattr(source_media, "time", SimpleNamespace(monotonic=lambda: next(seconds)))
    first, _ = film
    *_, effect = add(first, COUNT, np.ones(6))
    before = picture_of(effect.scene, 2)
    invalidation.invalidate_changed(edit)
    (first.parent / "f0003.png").write_bytes((first.parent / "f0009.png").read_bytes())
    assert invalidation.invalidate_changed(edit)
    with pytest.raises(MediaError, match=r"in-between frames of frame 2 are missing"):
        picture_of(effect.scene, 2)
    with open_source(first) as source:
        build(source, cache)
    assert not np.allclose(picture_of(effect.scene, 2), before)


def test_finished_frames_are_dropped_when_in_betweens_come_and_go(cache, film, add, edit):
    from shutter_addon.blender.rendering import invalidation
    from shutter_addon.media.inbetween_cache import purge

    first, _ = film
    add(first, COUNT, np.ones(6))
    invalidation.invalidate_changed(edit)
    assert not invalidation.invalidate_changed(edit)
    with open_source(first) as source:
        purge(cache, source)
    assert invalidation.invalidate_changed(edit)
    assert not invalidation.invalidate_changed(edit)
    with open_source(first) as source:
        build(source, cache, pairs=range(1))
    assert invalidation.invalidate_changed(edit)


# Bars


@pytest.mark.parametrize("factor", ["2", "4", "8", "16"])
def test_bars_stand_for_the_same_times_at_another_factor(effect, factor):
    from shutter_addon.blender.editing import bar_edits

    rng = np.random.default_rng(3)
    for shutter in effect.shutters:
        bar_edits.set_bars(shutter, rng.random(8))
    bar_edits.key_bars(effect, 0)
    effect.id_data.frame_set(9)
    bar_edits.set_bars(effect.shutters[0], rng.random(8))
    bar_edits.key_bars(effect, 0)
    before = [[at(effect, i, frame) for frame in (1, 9)] for i in range(2)]
    effect.inbetween = factor
    assert effect.window == 8 * int(factor)
    for i in range(2):
        for frame, old in zip((1, 9), before[i], strict=True):
            assert at(effect, i, frame) == pytest.approx(np.repeat(old, int(factor)), abs=1e-6)
    effect.inbetween = "1"
    assert [[at(effect, i, frame).tolist() for frame in (1, 9)] for i in range(2)] == [
        [pytest.approx(old, abs=1e-6) for old in shutter] for shutter in before
    ]


def at(effect, index, frame):
    from shutter_addon.blender.data import snapshot

    return snapshot.bars_at(effect.id_data, effect, index, frame)


def test_a_part_of_a_source_frame_becomes_a_whole_one(effect):
    """With closed bars at the window's far side."""
    from shutter_addon.blender.data import consistency
    from shutter_addon.blender.editing import bar_edits

    effect.inbetween = "8"
    effect.window = 12
    bar_edits.set_bars(effect.shutters[0], np.ones(12))
    effect.inbetween = "1"
    assert consistency.bars(effect.shutters[0]).tolist() == [1, 0.5]
    assert shutters.multiplied(np.ones(12), 8, 1, "end").tolist() == [0.5, 1]
    assert shutters.multiplied(np.ones(12), 8, 1, "center").tolist() == [1, 0.5]
    assert shutters.multiplied(np.ones(12), 8, 4).tolist() == [1] * 6


def test_too_many_bars_are_refused_and_nothing_changes(effect, capfd):
    from shutter_addon.blender.data import consistency

    effect.window = 40
    before = [consistency.bars(shutter).tolist() for shutter in effect.shutters]
    effect.inbetween = "8"
    assert "8× in-between frames take 320 bars; a shutter has 256 at most" in capfd.readouterr().err
    assert (effect.inbetween, effect.window) == ("1", 40)
    assert [consistency.bars(shutter).tolist() for shutter in effect.shutters] == before
    with pytest.raises(shutters.ShutterError, match="not 320"):
        shutters.multiplied(np.ones(40), 1, 8)


def test_a_copy_of_an_effect_keeps_its_bars(effect, edit):
    from shutter_addon.blender.data import property_copy

    effect.inbetween = "4"
    path = effect.path_from_id()
    copy = edit.virtual_shutter.effects.add()
    effect = edit.path_resolve(path)
    property_copy.copy_properties(effect, copy)
    assert (copy.inbetween, copy.window, copy.bars_per_frame) == ("4", 32, 4)
    assert [len(shutter.bars) for shutter in copy.shutters] == [32, 32]
