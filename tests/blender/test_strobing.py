"""Exposures with too few frames: said for footage that moves by known pixels a frame, and mended by Smooth Streaks."""

import time
from pathlib import Path

import numpy as np
import pytest
from standin import moving
from support import image_strip, picture_of, request, write_frames

from shutter_addon.blender.data import consistency, fcurves, selection, snapshot
from shutter_addon.blender.editing import add_effect, bar_edits, shutter_edits
from shutter_addon.features.smooth import smooth
from shutter_addon.features.smooth.blender import strobing

WIDTH, HEIGHT, COUNT = 320, 180, 12  # at this height, 2 pixels look smooth


@pytest.fixture
def add(bpy, edit, tmp_path):
    """Puts an effect of shutters with these bars on a film that moves by pixels a frame: edit, effect, strip."""
    strobing.forget()

    def added(pixels, *bars, repeat=1, **options):
        first = write_frames(tmp_path / "film", moving(pixels, COUNT, WIDTH, HEIGHT).repeat(repeat, 0)[:COUNT])
        source = image_strip(edit, first, 1, 1, "film")
        edit.render.resolution_x, edit.render.resolution_y = WIDTH, HEIGHT
        strip, effect = add_effect.add_effect(edit, source)
        effect.inbetween, effect.window = "1", len(bars[0])
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
    for _ in range(4):
        frame = edit.frame_current
        taken = snapshot.take(edit, effect, strip, (frame,))
        found = strobing.look(effect, taken, *asked(edit, effect, strip, frame))[0]
        if not strobing.is_busy():
            return found
        until = time.monotonic() + 60
        while not strobing.advance():
            assert time.monotonic() < until
            time.sleep(0.001)
    raise AssertionError("it is never done")


@pytest.mark.parametrize(
    ("pixels", "bars", "is_told"),
    [(1, [1] * 8, False), (3, [1] * 8, True), (20, [1] * 8, True), (12, [1, 0, 1, 0], False), (12, [0, 0, 1], False)],
)
def test_streaks_whose_steps_look_like_steps_are_told(add, pixels, bars, is_told):
    assert looked(*add(pixels, bars)) == (pytest.approx(pixels, abs=0.3) if is_told else None)


def test_shutters_that_are_not_seen_do_not_count(add):
    edit, effect, strip = add(12, [1, 0, 0, 0], np.ones(4), border=True)
    assert looked(edit, effect, strip) is None
    effect.shutters.move(1, 0)
    assert looked(edit, effect, strip) == pytest.approx(12, abs=0.3)


def test_what_is_followed_has_no_steps(add):
    edit, effect, strip = add(12, np.ones(4))
    assert looked(edit, effect, strip) == pytest.approx(12, abs=0.3)
    for frame in (1, COUNT):
        effect.camera.location = (-12 * (frame - 1) / WIDTH, 0)
        effect.camera.keyframe_insert("location", frame=frame)
    for curve in fcurves.curves_under(edit, effect.camera.path_from_id()):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    effect.shutters[0].follow = "CAMERA"
    assert looked(edit, effect, strip) is None


def test_frames_that_repeat_are_told(add):
    """Once the source was read; where they are shown as filmed, nobody looks."""
    edit, effect, strip = add(4, np.ones(4), inbetween="2", repeat=2)
    assert looked(edit, effect, strip) is None
    assert not strobing.repeats(effect)
    picture_of(effect.scene, 4)
    assert looked(edit, effect, strip) is None
    assert strobing.repeats(effect)
    effect.skip_repeats = False
    picture_of(effect.scene, 4)
    assert looked(edit, effect, strip) is None
    assert not strobing.repeats(effect)


def test_drawing_never_waits_and_measures_once(add, monkeypatch):
    edit, effect, strip = add(12, np.ones(4))
    measured, moved = [], smooth.moved
    monkeypatch.setattr(smooth, "moved", lambda *given: measured.append(given[1]) or moved(*given))
    taken = snapshot.take(edit, effect, strip, (4,))
    assert strobing.look(effect, taken, *asked(edit, effect, strip, 4))[0] is None
    assert not measured
    for frame in (4, 5, 6, 4):
        edit.frame_set(frame)
        looked(edit, effect, strip)
    assert len(measured) == len(set(measured)) <= COUNT
    assert strobing.last(effect) == pytest.approx(12, abs=0.3)
    edit.frame_set(7)
    assert strobing.last(effect) is None


def test_what_is_known_is_forgotten_with_the_file(add, bpy):
    looked(*add(12, np.ones(4)))
    assert strobing._measuring.moved  # nobody else is told what is kept
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert not strobing._measuring.moved  # likewise
    assert not strobing._measuring.looks  # likewise


# The button


def test_smooth_streaks_has_as_many_moments_as_it_takes(add, bpy):
    edit, effect, strip = add(12, np.ones(4))
    folder = sorted(path.name for path in Path(bpy.data.filepath).parent.rglob("*"))
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.shutter.smooth_streaks("EXEC_DEFAULT", True) == {"FINISHED"}
    assert (effect.inbetween, effect.window) == ("AUTO", 4)
    assert consistency.bars(effect.shutters[0]).tolist() == [1] * 4
    assert asked(edit, effect, strip, 4)[0].source.step == 8
    assert looked(edit, effect, strip) is None
    assert sorted(path.name for path in Path(bpy.data.filepath).parent.rglob("*")) == folder
    bpy.ops.ed.undo()
    assert selection.active(bpy.context)[1].inbetween == "1"
