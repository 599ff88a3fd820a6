"""Smooth effects: what their windows show, which moments there are, and what stays as it is when Smooth changes.

Pictures are compared with sums of moments that are known: random ones in place of flow's (standin.py)."""

import json
import threading
import time

import numpy as np
import pytest
from made_recipes import made
from standin import Between, moments, moving, spread
from support import image_strip, picture_of, request, write_frames

from shutter_addon.blender.data import consistency, fcurves, preview_areas, snapshot
from shutter_addon.blender.editing import add_effect, bar_edits, shutter_edits
from shutter_addon.blender.rendering import effect_source, previews, render_job, sessions
from shutter_addon.core.frames import light
from shutter_addon.features.smooth import smooth
from shutter_addon.features.smooth.blender import smooth_previews
from shutter_addon.media import flow, open_source

STEPS, COUNT, CUT = 4, 12, 6
LAST = (CUT - 1) * STEPS  # the first shot's last filmed frame, and the moments that are nearest to it:
END = LAST + STEPS // 2


def cut_film():
    """Two shots (n, 24, 40, 3), each a texture that moves by a pixel a frame."""
    rng = np.random.default_rng(7)
    shots = [rng.integers(0, 256, (6, 10, 3), dtype=np.uint8).repeat(4, 0).repeat(4, 1) for _ in range(2)]
    return np.stack([np.roll(shots[k >= CUT], k, axis=1) for k in range(COUNT)])


@pytest.fixture
def filmed(tmp_path):
    """A cut film: the first file."""
    return write_frames(tmp_path / "film", cut_film())


@pytest.fixture
def film(filmed, monkeypatch):
    """The same with moments that are known: the first file, and all in linear light (count, H, W, 3)."""
    monkeypatch.setattr(flow, "Between", Between)
    with open_source(filmed) as source:
        every = moments(np.stack([source.read(k) for k in range(COUNT)]), STEPS)
    return filmed, light.to_linear(every[..., :3] / 255)


@pytest.fixture
def add(bpy, edit):
    """Puts a smooth effect on an image strip of files from frame 1 on; bars: of its shutter."""

    def added(first, bars, smooth=str(STEPS), **options):
        source = image_strip(edit, first, 1, 1, "film")
        strip, effect = add_effect.add_effect(edit, source)
        size = effect.scene.render
        edit.render.resolution_x, edit.render.resolution_y = size.resolution_x, size.resolution_y
        effect.inbetween = smooth
        effect.window = len(bars)
        shutter_edits.add_shutter(effect, "S")
        bar_edits.paint(effect, 0, bars)
        for name, value in options.items():
            setattr(effect, name, value)
        return source, strip, effect

    yield added
    sessions.forget()


def shown(frames, indices, bars):
    """The picture of a window of these moments, in 8-bit levels."""
    weights = spread(bars, STEPS)
    weighed = np.tensordot(weights / weights.sum(), frames[list(indices)], 1)
    return light.to_encoded(weighed) * 255


def around(start, bars):
    return np.arange(start, start + len(bars) * STEPS)


def test_a_window_stops_in_the_middle_of_a_cut_pair(film, add, edit, render, same_pixels):
    """Whose moments are copies of the nearer frame; hold repeats the last of the shot."""
    first, frames = film
    bars = np.ones(3)
    _source, _strip, effect = add(first, bars)
    for frame, picture in render(edit, (4, 5, 6, 7)).items():
        window = around((frame - 1) * STEPS, bars)
        window = np.minimum(window, END) if frame <= CUT else window
        same_pixels(picture[..., :3], shown(frames, window, bars), 1)
    effect.position = "END"
    window = np.maximum(around((CUT - 2) * STEPS, bars), END + 1)
    same_pixels(render(edit, (7,))[7][..., :3], shown(frames, window, bars), 1)
    effect.stop_at_cuts, effect.position = False, "START"
    same_pixels(render(edit, (6,))[6][..., :3], shown(frames, around(LAST, bars), bars), 1)


def test_an_exposure_that_follows_takes_the_motion_between(film, add, edit, render, same_pixels):
    """By four pixels a filmed frame, so that moments are seen at whole pixels; those beyond the cut are not."""
    first, frames = film
    bars = np.ones(2)
    _source, _strip, effect = add(first, bars)
    effect.shutters[0].follow = "CAMERA"
    for frame in (1, COUNT):
        effect.camera.location = (STEPS * frame / 40, 0)
        edit.keyframe_insert(effect.camera.path_from_id("location"), frame=frame)
    for curve in fcurves.curves_under(edit, effect.camera.path_from_id("location")):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    start = STEPS
    window = around(start, bars)
    moved = np.stack([np.roll(frames[k], start - k, axis=1) for k in window])
    expected = shown(moved, range(len(window)), bars)
    same_pixels(render(edit, (2,))[2][:, :-6, :3], expected[:, :-6], 1)


def test_a_slow_strip_shows_moments(film, add, edit, render, same_pixels):
    first, frames = film
    source, strip, effect = add(first, [1.0])
    source.retiming_keys.add(timeline_frame=1)
    source.retiming_keys.add(timeline_frame=source.right_handle)
    source.retiming_keys[-1].timeline_frame = 1 + 4 * COUNT
    strip.right_handle = source.right_handle
    found = {frame: request(edit, effect, strip, frame).index for frame in range(1, 30)}
    assert len(set(found.values())) > 20
    for frame, picture in render(edit, (3, 8)).items():
        same_pixels(picture[..., :3], light.to_encoded(frames[found[frame]]) * 255, 1)
        assert abs(found[frame] - (frame - 1)) <= 1


# Still frames


@pytest.mark.parametrize("position", ["START", "CENTER", "END"])
def test_a_still_frame_is_the_filmed_one_bit_for_bit(filmed, add, edit, render, position):
    """As the preset makes it, at every smoothness, before a shutter that streaks."""
    *_, effect = add(filmed, np.ones(4), "1", position=position)
    shutter_edits.apply_preset(effect, 0, "STILL")
    frames = 1, 6, 7, 12
    plain = {frame: picture_of(effect.scene, frame) for frame in frames}
    film = cut_film()
    for steps in ("1", "2", "16", "AUTO"):
        effect.inbetween = steps
        for frame, picture in render(edit, frames).items():
            assert np.array_equal(picture[..., :3], film[frame - 1]), (steps, frame)
            # In float, sums of more moments are rounded otherwise.
            assert np.abs(picture_of(effect.scene, frame) - plain[frame]).max() < 1e-4, (steps, frame)


# Bars


@pytest.mark.parametrize("smooth", ["2", "AUTO"])
def test_bars_stay_as_they_are(effect, smooth):
    """Keyed ones as well, and their number; those of presets are the presets'."""
    rng = np.random.default_rng(3)
    bar_edits.set_bars(effect.shutters[0], rng.random(8))
    bar_edits.key_bars(effect, 0)
    effect.id_data.frame_set(9)
    bar_edits.set_bars(effect.shutters[0], rng.random(8))
    bar_edits.key_bars(effect, 0)

    def seen():
        keyed = [snapshot.bars_at(effect.id_data, effect, 0, frame).tolist() for frame in (1, 5, 9)]
        return effect.window, keyed, consistency.bars(effect.shutters[1]).tolist(), consistency.preset_of(effect, 1)

    before = seen()
    assert before[3] == "STILL"
    effect.inbetween = smooth
    assert seen() == before
    effect.window = 5
    assert len(effect.shutters[0].bars) == 5, "they are counted in filmed frames"
    effect.inbetween = "1"
    assert effect.window == 5


def test_a_shape_is_spread_over_its_own_time(film, add, edit):
    """Bars that are the shape of a frame of the timeline, which are no frames."""
    first, _ = film
    _source, strip, effect = add(first, [1, 1, 0, 0], stop_at_cuts=False)
    effect.shutters[0].length = "TIMELINE"
    (bars,) = request(edit, effect, strip, 3).state.bars
    # The first half of one filmed frame, which is two of its four moments.
    assert np.flatnonzero(bars > 1e-9).tolist() == [0, 1]
    assert bars[0] == pytest.approx(bars[1])


# How many moments there are


@pytest.mark.parametrize(("pixels", "steps"), [(0, 1), (1, 1), (3, 2), (7, 4), (20, 16)])
def test_automatic_takes_as_many_as_the_fastest_motion_needs(add, edit, tmp_path, pixels, steps):
    """At this height, two pixels look smooth."""
    _source, strip, effect = add(write_frames(tmp_path / "film", moving(pixels)), np.ones(4), "AUTO")
    found = request(edit, effect, strip, 2)
    assert found.renderer.source.step == steps
    assert found.state.bars.shape == (1, 4 * steps)
    assert found.state.bars.sum() == pytest.approx(4)


@pytest.mark.parametrize(("smooth", "skips"), [("2", True), ("AUTO", True), ("AUTO", False)])
def test_repeated_frames_are_skipped(add, edit, tmp_path, smooth, skips):
    """Those that are shown twice are moments half-way then, and of Automatic's motion there is half."""
    first = write_frames(tmp_path / "film", moving(5).repeat(2, 0))
    _source, strip, effect = add(first, [1, 0], smooth, skip_repeats=skips, stop_at_cuts=False)
    picture = picture_of(effect.scene, 2)
    asked = request(edit, effect, strip, 2)
    assert asked.renderer.source.step == (2 if smooth == "2" or skips else 4)
    with open_source(first) as source:
        filmed = light.to_linear(source.read(1)[..., :3] / 255)
    is_filmed = np.allclose(picture[..., :3], filmed, atol=1e-3)
    assert (is_filmed, asked.renderer.source.repeats) == (not skips, skips)
    effect.inbetween = "1"
    np.testing.assert_allclose(picture_of(effect.scene, 2)[..., :3], filmed, atol=1e-3)


def test_motion_is_measured_once(add, edit, tmp_path, monkeypatch):
    """Whatever else changes; another file is another film."""
    asked, steps_for = [], smooth.steps_for
    monkeypatch.setattr(
        smooth, "steps_for", lambda *given, **more: asked.append((*given[1:], more)) or steps_for(*given, **more)
    )
    _source, strip, effect = add(write_frames(tmp_path / "film", moving(5)), np.ones(4), "AUTO")
    for position in ("START", "CENTER", "END"):
        effect.position = position
        request(edit, effect, strip, 2)
        sessions.forget()
    assert asked == [("auto", 4, {"skip_repeats": True})]


# Previews


def test_a_still_preview_is_plain_until_its_moments_are_there(film, add, edit, bpy, monkeypatch, same_pixels):
    """Drawn over and over, as the window does, and nobody has to click. No step of it waits for a frame that a thread
    makes; both renderers stay as it plays and stands still again."""
    first, frames = film
    bars = np.ones(3)
    _source, strip, effect = add(first, bars)
    drawing, gate = sessions.of_drawing(), threading.Event()
    monkeypatch.setattr(flow, "Between", lambda *given: gate.wait() and Between(*given))
    taken = snapshot.take(edit, effect, strip, (2,))
    plain = light.to_encoded(frames[[4, 8, 12]].mean(axis=0)) * 255

    def asked():
        smooth_previews.advance_smooth(60)
        return smooth_previews.smooth_request(drawing, taken, 2, effect_source.FULL)

    def same(request, expected):
        same_pixels(light.to_encoded(drawing.session.picture(request)[..., :3]) * 255, expected, 1)

    for _ in range(5):
        request, follows = asked()
        assert request.state.options.step == 1
        assert follows
        same(request, plain)
    gate.set()
    until = time.monotonic() + 20
    while follows:
        assert time.monotonic() < until
        request, follows = asked()
    same(request, shown(frames, around(4, bars), bars))
    both = drawing.request(taken, 2, effect_source.Detail(smooth=False)), request
    renderers = [drawing.renderer(each) for each in both]
    assert renderers[0] is not renderers[1]
    smooth_previews.rest_smooth()  # as it plays
    gate.clear()
    assert asked() == (request, False)  # what it needs is there: nothing plain comes before
    assert [drawing.renderer(each) for each in both] == renderers
    gate.set()


def test_a_dragged_playhead_and_a_preview_that_plays_wait_for_no_flow(bpy, monkeypatch):
    look = preview_areas.Look(scale=0.5, proxy=None, is_plain=True)
    assert previews._detail(bpy.context, look).smooth  # as a preview asks, which is drawn
    with monkeypatch.context() as playing:
        playing.setattr(previews, "_is_playing", lambda _context: True)  # no preview plays without a window
        assert not previews._detail(bpy.context, look).smooth  # likewise
    monkeypatch.setattr(render_job, "operators_running", lambda: {"ANIM_OT_change_frame"})
    assert not previews._detail(bpy.context, look).smooth  # likewise
    monkeypatch.setattr(previews.looking, "late_until", 0.0)
    assert not previews.is_read(bpy.context)  # as nothing does without a window


# Files of format 1


def test_files_of_format_1_have_numbers_for_the_items(effect):
    """These are stored, and no words."""
    items = effect.bl_rna.properties["inbetween"].enum_items
    assert [items[word].value for word in ("1", "2", "4", "8", "16")] == [0, 1, 2, 3, 4]


def counted(bars, steps, position):
    """Bars of filmed frames by those of moments: the mean of each frame's, closed ones beyond the window."""
    bars = list(bars)
    while len(bars) % steps:
        bars = [0, *bars] if position == "END" else [*bars, 0]
    return [sum(bars[k : k + steps]) / steps for k in range(0, len(bars), steps)]


@pytest.mark.parametrize(
    ("steps", "window", "position"), [(2, 8, "START"), (8, 12, "CENTER"), (16, 33, "END"), (4, 1, "END")]
)
def test_bars_of_format_1_count_filmed_frames_now(bpy, effect, tmp_path, steps, window, position):
    """Keyed ones, too; recipes of the first version are read alike."""
    scene, bars = effect.id_data, np.random.default_rng(5).random((3, window))
    effect.position, effect.window = position, window
    bar_edits.set_bars(effect.shutters[1], bars[1])
    for frame, weights in ((1, bars[0]), (9, bars[2])):
        scene.frame_set(frame)
        bar_edits.set_bars(effect.shutters[0], weights)
        bar_edits.key_bars(effect, 0)
    effect.inbetween, scene.virtual_shutter.format = str(steps), 1
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "older.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "older.blend"))
    scene = bpy.context.scene
    effect = scene.virtual_shutter.effects[0]
    count = -(-window // steps)
    assert scene.virtual_shutter.format == 2
    assert (effect.inbetween, effect.window) == (str(steps), count)
    assert not effect.skip_repeats, "nothing was bridged"
    assert consistency.bars(effect.shutters[1]) == pytest.approx(counted(bars[1], steps, position), abs=1e-6)
    for frame, given in ((1, bars[0]), (9, bars[2])):
        expected = counted(given, steps, position)
        assert snapshot.bars_at(scene, effect, 0, frame) == pytest.approx(expected, abs=1e-6)
    paths = {curve.data_path.rpartition("bars[")[2] for curve in fcurves.curves_under(scene, effect.path_from_id())}
    assert paths == {f"{bar}].weight" for bar in range(count)}
    stored = bars[1].astype(np.float32).tolist()
    read = made(window, [{"name": "A", "bars": stored}], inbetween=steps, position=position.lower(), version=1)
    options = read.options.at(1)
    assert (options.window, options.skip_repeats) == (count, False)
    assert consistency.bars(effect.shutters[1]) == pytest.approx(read.shutters[0].bars.channel.at(1), abs=1e-6)


def test_an_imported_recipe_of_version_1_tells_what_it_lost(bpy, effect, tmp_path, capfd):
    data = {"version": 1, "window": 4, "inbetween": 4, "shutters": [{"name": "Long", "bars": [1, 1, 1, 0]}]}
    (tmp_path / "r.json").write_text(json.dumps(data))
    assert bpy.ops.shutter.recipe_import(filepath=str(tmp_path / "r.json")) == {"FINISHED"}
    told = 'Warning: shutter "Long": bars 1 to 4 of the older file are one filmed frame now, and expose other moments'
    assert told in "".join(capfd.readouterr())


def test_vectors_are_kept_beside_the_file(bpy, filmed, add, edit, tmp_path):
    """Where pictures are rendered, for the next time; not of an edit that was not saved."""
    _source, strip, effect = add(filmed, [1, 1])
    folder = tmp_path / "virtual_shutter_vectors"
    wanted = request(edit, effect, strip, 2).picture().copy()
    assert not folder.exists()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edit.blend"))
    scene = bpy.context.scene
    effect = scene.virtual_shutter.effects[0]
    written = []
    for _ in range(2):
        sessions.forget()
        np.testing.assert_array_equal(request(scene, effect, strip, 2).picture(), wanted)
        written.append({path: path.stat().st_mtime_ns for path in folder.glob("*.exr")})
    assert written[0]
    assert written[0].items() <= written[1].items()  # which are not written again
