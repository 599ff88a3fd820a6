"""Exposures with too few frames: said for footage that moves by known pixels a frame, and mended by in-between frames.

In-between frames are random ones in place of flow's, which takes long."""

import time

import cv2
import numpy as np
import pytest
from standin import between
from support import request, write_frames

from shutter_addon.media import flow

WIDTH, HEIGHT, COUNT = 320, 180, 12  # at this height, 2 pixels look smooth


def film(pixels):
    """Frames (n, H, W, 3) of a texture that moves to the left."""
    noise = np.random.default_rng(2).integers(0, 256, (60, 160, 3), dtype=np.uint8)
    texture = cv2.resize(noise, None, fx=4, fy=4, interpolation=cv2.INTER_CUBIC)
    return np.stack([texture[20 : 20 + HEIGHT, 8 + k * pixels : 8 + k * pixels + WIDTH] for k in range(COUNT)])


@pytest.fixture
def add(bpy, edit, tmp_path):
    """Puts an effect of shutters with these bars on a film that moves by pixels a frame: edit, effect, strip."""
    from shutter_addon.blender.data import selection
    from shutter_addon.blender.editing import add_effect, bar_edits, shutter_edits
    from shutter_addon.blender.rendering import strobing

    strobing.forget()

    def added(pixels, *bars, **options):
        first = write_frames(tmp_path / "film", film(pixels))
        source = edit.sequence_editor.strips.new_image("film", str(first), 1, 1)
        for number in range(2, COUNT + 1):
            source.elements.append(f"f{number:04d}.png")
        edit.render.resolution_x, edit.render.resolution_y = WIDTH, HEIGHT
        strip, effect = add_effect.add_effect(edit, source)
        effect.window = len(bars[0])
        for i, each in enumerate(bars):
            shutter_edits.add_shutter(effect, f"S{i}")
            bar_edits.paint(effect, i, each)
        for name, value in options.items():
            setattr(effect, name, value)
        selection.choose(edit, strip)
        edit.frame_set(4)
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "film.blend"))
        return edit, effect, strip

    yield added
    strobing.forget()


def asked(edit, effect, strip, frame):
    found = request(edit, effect, strip, frame)
    return found.renderer, found.request


def looked(edit, effect, strip):
    """What is said once all is measured, as a frame that stays is drawn again and again."""
    from shutter_addon.blender.data import snapshot
    from shutter_addon.blender.rendering import strobing

    for _ in range(4):
        frame = edit.frame_current
        taken = snapshot.take(edit, effect, strip, (frame,))
        found = strobing.look(effect, strip, taken, *asked(edit, effect, strip, frame)).known
        if not strobing.is_busy():
            return found
        until = time.monotonic() + 60
        while not strobing.advance():
            assert time.monotonic() < until
            time.sleep(0.001)
    raise AssertionError("it is never done")


@pytest.mark.parametrize(("pixels", "factor"), [(0, None), (1, None), (3, 2), (5, 4), (7, 4), (12, 8), (20, 16)])
def test_the_least_factor_whose_steps_look_smooth(add, pixels, factor):
    edit, effect, strip = add(pixels, np.ones(8))
    found = looked(edit, effect, strip)
    if factor is None:
        assert found is None
        return
    assert found.step == pytest.approx(pixels, abs=0.3)
    assert found.factor == factor
    assert found.seconds > 0
    assert found.size > 0


@pytest.mark.parametrize("bars", [[1, 0, 0, 0], [1, 0, 1, 0], [0, 0, 1, 0]])
def test_still_frames_and_separate_ones_have_no_streaks(add, bars):
    assert looked(*add(12, bars)) is None


def test_shutters_that_are_not_seen_do_not_count(add):
    edit, effect, strip = add(12, [1, 0, 0, 0], np.ones(4), border=True)
    assert looked(edit, effect, strip) is None
    effect.shutters.move(1, 0)
    assert looked(edit, effect, strip).factor == 8


def test_what_is_followed_has_no_steps(add):
    """The camera's keys move as the footage does."""
    edit, effect, strip = add(12, np.ones(4))
    assert looked(edit, effect, strip).factor == 8
    for frame in (1, COUNT):
        effect.camera.location = (-12 * (frame - 1) / WIDTH, 0)
        effect.camera.keyframe_insert("location", frame=frame)
    from shutter_addon.blender.data import fcurves

    for curve in fcurves.curves_under(edit, effect.camera.path_from_id()):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    effect.shutters[0].follow = "CAMERA"
    assert looked(edit, effect, strip) is None


def test_no_more_bars_than_there_is_room_for(add):
    edit, effect, strip = add(12, np.ones(100))
    assert looked(edit, effect, strip).factor == 2
    effect.window = 200
    found = looked(edit, effect, strip)
    assert (found.factor, found.seconds) == (None, None)


def test_in_between_frames_make_steps_smaller(add):
    edit, effect, strip = add(12, np.ones(4))
    effect.inbetween = "4"
    found = looked(edit, effect, strip)
    assert found.step == pytest.approx(3, abs=0.2)
    assert found.factor == 8
    effect.inbetween = "8"
    assert looked(edit, effect, strip) is None


def test_without_opencv_nothing_is_said(add, monkeypatch):
    from shutter_addon.blender.rendering import strobing
    from shutter_addon.media import opencv

    monkeypatch.setattr(opencv, "cv2", None)
    edit, effect, strip = add(12, np.ones(4))
    assert looked(edit, effect, strip) is None
    assert not strobing.is_busy()


def test_drawing_never_waits_and_measures_once(add, monkeypatch):
    from shutter_addon.blender.rendering import strobing
    from shutter_addon.media import steps

    edit, effect, strip = add(12, np.ones(4))
    measured, moved = [], steps.moved
    monkeypatch.setattr(steps, "moved", lambda *given: measured.append(given[1]) or moved(*given))
    from shutter_addon.blender.data import snapshot

    taken = snapshot.take(edit, effect, strip, (4,))
    assert strobing.look(effect, strip, taken, *asked(edit, effect, strip, 4)).known is None
    assert not measured
    for frame in (4, 5, 6, 4):
        edit.frame_set(frame)
        looked(edit, effect, strip)
    assert len(measured) == len(set(measured)) <= COUNT
    assert strobing.last(effect).factor == 8
    edit.frame_set(7)
    assert strobing.last(effect) is None


# The button


@pytest.fixture
def smoothed(bpy, monkeypatch):
    monkeypatch.setattr(flow, "between", between)

    def press(factor):
        return bpy.ops.shutter.smooth_streaks("EXEC_DEFAULT", factor=str(factor))

    return press


@pytest.mark.parametrize("position", ["START", "CENTER", "END"])
@pytest.mark.parametrize("edges", ["HOLD", "MIRROR", "SHORTEN", "SLIDE"])
def test_all_that_the_strip_needs_is_built_and_no_more(add, smoothed, bpy, position, edges):
    from shutter_addon.blender.data import source_media, strips

    edit, effect, strip = add(3, [1, 1, 0, 0], position=position, edges=edges)
    strip.left_handle, strip.right_handle = 4, 7
    assert smoothed(4) == {"FINISHED"}
    assert (effect.inbetween, effect.window) == ("4", 16)
    for frame in range(4, 7):
        request(edit, effect, strip, frame).check()
    with source_media.open_media(strips.source_of(edit, effect, strip)) as medium:
        from shutter_addon.blender.data import inbetween_settings
        from shutter_addon.media import inbetween_cache

        built = inbetween_cache.state(medium, *inbetween_settings.settings(effect)).done
    assert 0 < built < COUNT - (edges != "MIRROR")  # which may be at a cut, and reaches farther then


@pytest.mark.parametrize("way", ["reversed", "slow", "source time"])
def test_whatever_the_strip_shows(add, smoothed, way):
    from shutter_addon.blender.data import strips

    edit, effect, strip = add(3, [1, 1, 1, 0])
    source = strips.source_of(edit, effect, strip)
    if way == "reversed":
        source.use_reverse_frames = True
    elif way == "slow":
        source.retiming_keys.add(timeline_frame=1)
        source.retiming_keys.add(timeline_frame=source.right_handle)
        source.retiming_keys[-1].timeline_frame = 1 + 3 * COUNT
        strip.right_handle = 25
    else:
        effect.use_source_time = True
        for frame, time in ((1, 9.0), (12, 2.5)):
            effect.source_time = time
            effect.keyframe_insert("source_time", frame=frame)
    assert smoothed(8) == {"FINISHED"}
    for frame in range(strip.left_handle, strip.right_handle):
        request(edit, effect, strip, frame).check()


def test_a_build_that_fails_changes_nothing(add, smoothed, tmp_path):
    _edit, effect, _strip = add(3, np.ones(4))
    (tmp_path / "film" / "f0006.png").write_bytes(b"")
    with pytest.raises(RuntimeError, match="f0006"):
        smoothed(4)
    assert (effect.inbetween, effect.window) == ("1", 4)


def test_more_bars_than_a_shutter_has_are_refused(add, smoothed):
    _edit, effect, _strip = add(3, np.ones(100))
    with pytest.raises(RuntimeError, match="not 800"):
        smoothed(8)
    assert (effect.inbetween, effect.window) == ("1", 100)


def test_the_estimate_is_near_what_is_built(add, smoothed, monkeypatch):
    from shutter_addon.blender.data import snapshot
    from shutter_addon.blender.rendering import strobing
    from shutter_addon.media import inbetween

    edit, effect, strip = add(3, np.ones(4))
    strip.left_handle, strip.right_handle = 3, 6
    taken = snapshot.take(edit, effect, strip, range(3, 6))
    with taken.source.open() as medium:
        needed = strobing.pairs(taken, medium, 4)
    assert needed == [2, 3, 4, 5, 6, 7]
    monkeypatch.setattr(inbetween, "cost", lambda *_: inbetween.Cost(pair=1.0, frame=0.0, size=1.0))
    assert looked(edit, effect, strip).seconds == len(needed)


def test_what_looks_smooth(bpy):
    from shutter_addon.blender.rendering import strobing

    assert [strobing.smooth(height) for height in (1080, 2160, 480)] == [3, 6, 2]
