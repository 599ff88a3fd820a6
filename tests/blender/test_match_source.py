"""An effect goes along with its source, by itself or by Match Source: a still shutter shows what the source shows."""

import numpy as np
import pytest
from support import LASSO, effect_of, noise, recipe, write_movie

from shutter_addon.blender import handlers
from shutter_addon.blender.data import annotations, fcurves, selection
from shutter_addon.blender.editing import match_source, reconcile
from shutter_addon.blender.rendering import render_job
from shutter_addon.core.model.scribbles import mapped

LEVELS = 1
STILL = recipe(4, [1, 0, 0, 0])
TRIANGLE = LASSO["strokes"]
SCRIBBLED = recipe(4, [1, 0, 0, 0], [0, 0, 0, 1], regions=[LASSO])
DRAWN_TWICE = SCRIBBLED | {"regions": [LASSO | {"keys": [{"frame": f, "strokes": TRIANGLE} for f in (1, 31)]}]}


pytestmark = pytest.mark.usefixtures("no_exception")


@pytest.fixture(scope="module")
def movie(tmp_path_factory):
    return make_movie(tmp_path_factory.mktemp("movie") / "small.mkv", 32, 24)


@pytest.fixture(scope="module")
def large_movie(tmp_path_factory):
    """The same number of frames, larger and of another aspect."""
    return make_movie(tmp_path_factory.mktemp("movie") / "large.mkv", 40, 40)


def make_movie(path, width, height):
    """Forty frames of large pixels; 24 fps."""
    return write_movie(path, noise(40, height // 8, width // 8, 3).repeat(8, 1).repeat(8, 2))


@pytest.fixture
def made(bpy, edit, movie):
    """A movie strip from frame 1 to 40 with a still effect, or that of a recipe; effect strip and source."""
    edit.render.resolution_x, edit.render.resolution_y = 48, 48
    edit.frame_start, edit.frame_end = -100, 300

    def make(data=STILL):
        source = edit.sequence_editor.strips.new_movie("movie", str(movie), 1, 1)
        strip, _effect = effect_of(edit, source, data)
        selection.choose(edit, strip)
        bpy.context.view_layer.update()
        return strip, source

    return make


@pytest.fixture
def shown(edit, render):
    """The pictures of a strip when the other ones are muted: {frame: (H, W, 4)}."""

    def pictures(strip, frames):
        muted = [(other, other.mute) for other in edit.sequence_editor.strips]
        for other, _ in muted:
            other.mute = other != strip
        result = render(edit, frames)
        for other, mute in muted:
            other.mute = mute
        return result

    return pictures


def match(bpy):
    """As a button does it, with its step of undo."""
    assert bpy.ops.shutter.match_source("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.context.view_layer.update()


def words():
    """Of all effects."""
    import bpy

    bpy.context.view_layer.update()
    effects = bpy.context.scene.virtual_shutter.effects
    return sorted({word for effect in effects for word in match_source.shown(effect).differences})


def apart(some, others) -> float:
    return max(np.abs(some[frame] - others[frame]).max() for frame in some)


def transform(source):
    source.transform.scale_x, source.transform.scale_y = 0.75, 1.5
    source.transform.offset_x, source.transform.rotation = 5, 0.4
    source.transform.origin = 0.25, 0.75


def crop(source):
    source.crop.min_x, source.crop.max_y = 6, 4


def flip(source):
    source.use_flip_x = True


def color(source):
    source.color_multiply, source.color_saturation = 0.5, 0.5


def slow_down(source):
    source.retiming_keys.add(timeline_frame=1)
    source.retiming_keys[-1].timeline_frame = 81


def lengthen(source):
    source.left_handle, source.right_handle = -4, 51


def trim(source):
    source.left_handle, source.right_handle = 11, 31


LOOKS, RANGES = (transform, crop, flip, color), (slow_down, lengthen, trim)


@pytest.mark.parametrize("change", [*LOOKS, *RANGES], ids=lambda change: change.__name__)
def test_matched_it_shows_what_its_source_shows(bpy, edit, made, shown, change):
    strip, source = made()
    assert words() == []
    change(source)
    assert words() == [change.__name__ if change in LOOKS else "range"]
    step = 13 if change in LOOKS else 4
    frames = range(min(source.left_handle, 1), max(source.right_handle, 41), step)  # in order: see test_strips.check
    plain = shown(source, frames)
    assert apart(shown(strip, frames), plain) > 20
    match(bpy)
    assert words() == []
    assert apart(shown(strip, frames), plain) <= LEVELS


def test_a_strip_is_mixed_as_its_source_once_it_is_placed(bpy, made):
    """By a factor that no one sees; one that an editor sets stays."""
    strip, _source = made()
    for name, value in {"scale_x": 0.5, "rotation": 0.2, "filter": "CUBIC_MITCHELL"}.items():
        assert strip.color_multiply == 1
        before = getattr(strip.transform, name)
        setattr(strip.transform, name, value)
        assert words() == ["transform"]
        assert 1 < strip.color_multiply < 1.000001
        setattr(strip.transform, name, before)
        bpy.context.view_layer.update()
    strip.transform.keyframe_insert("offset_x", frame=1)
    bpy.context.view_layer.update()
    assert strip.color_multiply > 1
    strip.color_multiply = 0.5
    bpy.context.view_layer.update()
    assert strip.color_multiply == 0.5


def strokes(effect) -> list:
    layer = annotations.layer_of(effect, effect.regions[0])
    return [tuple(point.co) for drawing in layer.frames for stroke in drawing.strokes for point in stroke.points]


def test_refused_without_a_source(bpy, edit, made):
    _strip, source = made()
    edit.sequence_editor.strips.remove(source)
    with pytest.raises(RuntimeError, match="The Shutter strip has no source"):
        bpy.ops.shutter.match_source()


def test_scribbles_stay_on_the_picture(bpy, edit, made):
    strip, source = made(SCRIBBLED)
    effect = edit.virtual_shutter.effects[0]
    before = strokes(effect)
    transform(source), flip(source)
    match(bpy)
    assert strokes(effect) != before
    assert on_picture(effect, strip) == pytest.approx(np.array(TRIANGLE[0]), abs=1e-5)


def on_picture(effect, strip) -> np.ndarray:
    """The strokes' points, as fractions of the strip's picture."""
    to_image = annotations.picture_to_image(strip, annotations.picture_size(effect))
    return mapped(np.linalg.inv(to_image), np.array(strokes(effect))[:, :2])


def test_keys_of_the_transform_are_copied(bpy, edit, made, shown):
    strip, source = made()
    strip.transform.keyframe_insert("rotation", frame=1)
    for frame, offset in ((1, -10), (21, 10)):
        source.transform.offset_x = offset
        source.transform.keyframe_insert("offset_x", frame=frame)
    assert words() == ["transform"]
    match(bpy)
    assert words() == []
    plain = shown(source, [1, 11, 21])
    assert apart(plain, dict.fromkeys(plain, plain[1])) > 20
    assert apart(shown(strip, [1, 11, 21]), plain) <= LEVELS
    assert not fcurves.curves_under(edit, f"{strip.path_from_id()}.transform.rotation")
    fcurves.curves_under(edit, f"{source.path_from_id()}.")[0].keyframe_points[1].co[1] = 11
    assert words() == ["transform"]


def test_a_source_that_was_moved_alone_takes_keys_along(bpy, edit, made, shown):
    keyed = recipe(4, {1: [1, 0, 0, 0], 2: [1, 0, 0, 0], 31: [0, 0, 0, 1]})
    strip, source = made(keyed)
    before = shown(strip, [5, 25])
    source.content_start -= 50
    match(bpy)
    after = shown(strip, [-45, -25])
    assert (strip.left_handle, strip.right_handle) == (-49, -9)
    assert np.array_equal(after[-45], before[5])
    assert np.array_equal(after[-25], before[25])


def test_never_over_a_neighbor(bpy, edit, made, capfd):
    strip, source = made()
    neighbor = edit.sequence_editor.strips.new_effect("Title", "TEXT", strip.channel, 45, length=10)
    source.left_handle, source.right_handle = -4, 61
    match(bpy)
    assert (strip.left_handle, strip.right_handle) == (-4, 45)
    assert (neighbor.left_handle, neighbor.right_handle) == (45, 55)
    assert '"Title" is in the way: "Shutter" does not have the whole range of its source' in capfd.readouterr().out
    assert words() == []


def test_parts_of_a_cut_effect_match_their_own_part(bpy, edit, made, shown, capfd):
    strip, source = made()
    for other in edit.sequence_editor.strips:  # Blender cuts connected strips together
        other.select = other == source
    with bpy.context.temp_override(sequencer_scene=edit):
        bpy.ops.sequencer.disconnect()
    right = strip.split(21, "SOFT")
    assert words() == []
    lengthen(source), transform(source)
    frames = [-4, 5, 25, 50]
    plain = shown(source, frames)
    for half in (strip, right):
        selection.choose(edit, half)
        match(bpy)
    assert [(s.left_handle, s.right_handle) for s in (strip, right)] == [(-4, 21), (21, 51)]
    assert "in the way" not in capfd.readouterr().out
    assert apart(shown(strip, frames[:2]), {f: plain[f] for f in frames[:2]}) <= LEVELS
    assert apart(shown(right, frames[2:]), {f: plain[f] for f in frames[2:]}) <= LEVELS
    assert len(edit.virtual_shutter.effects) == 2


def test_scribbles_stay_on_the_picture_of_their_own_frame(bpy, edit, made):
    _strip, source = made(DRAWN_TWICE)
    before = np.array(strokes(edit.virtual_shutter.effects[0]))
    for frame, offset in ((1, -4), (31, 8)):
        source.transform.offset_x = offset
        source.transform.keyframe_insert("offset_x", frame=frame)
    edit.frame_set(12)
    match(bpy)
    moved = np.array(strokes(edit.virtual_shutter.effects[0])) - before
    assert moved == pytest.approx(np.array([[-4, 0, 0]] * 3 + [[8, 0, 0]] * 3), abs=1e-4)


@pytest.mark.parametrize("scribbled", [False, True])
def test_a_larger_file_of_another_aspect_is_followed_by_itself(bpy, edit, made, shown, large_movie, scribbled):
    strip, source = made(SCRIBBLED if scribbled else STILL)
    effect = edit.virtual_shutter.effects[0]
    source.filepath = str(large_movie)
    for _ in range(2):
        assert words() == []
        assert annotations.picture_size(effect) == (40, 40)
        assert not scribbled or on_picture(effect, strip) == pytest.approx(np.array(TRIANGLE[0]), abs=1e-5)
    if not scribbled:
        assert apart(shown(strip, [1, 20, 40]), shown(source, [1, 20, 40])) <= LEVELS


def test_undo_takes_size_and_scribbles_along(bpy, edit, made, large_movie):
    _strip, source = made(SCRIBBLED)
    bpy.ops.ed.undo_push(message="before")
    before = strokes(edit.virtual_shutter.effects[0])
    source.filepath = str(large_movie)
    bpy.ops.ed.undo_push(message="replaced, before it is followed")
    bpy.context.view_layer.update()
    after = strokes(edit.virtual_shutter.effects[0])
    for operator, size, expected in ((bpy.ops.ed.undo, (32, 24), before), (bpy.ops.ed.redo, (40, 40), after)):
        operator()
        bpy.context.view_layer.update()
        effect = bpy.context.scene.virtual_shutter.effects[0]
        assert annotations.picture_size(effect) == size
        assert np.array(strokes(effect)) == pytest.approx(np.array(expected), abs=1e-4)


def test_a_render_without_a_window_follows_a_file_that_was_replaced(edit, made, render, large_movie):
    strip, source = made()
    updates = handlers.bpy.app.handlers.depsgraph_update_post
    updates.remove(handlers.HANDLERS["depsgraph_update_post"])
    source.filepath, source.mute = str(large_movie), True
    picture = render(edit, [5])[5]
    updates.append(handlers.HANDLERS["depsgraph_update_post"])
    assert (picture[24, :, 3] > 0).sum() == 40
    assert strip.scene.render.resolution_y == 40


def test_a_film_keeps_its_size(bpy, edit, made, large_movie, monkeypatch, tmp_path):
    _strip, source = made()
    monkeypatch.setattr(render_job, "runs", lambda: True)
    source.filepath = str(large_movie)
    bpy.context.view_layer.update()
    assert annotations.picture_size(edit.virtual_shutter.effects[0]) == (32, 24)
    monkeypatch.undo()
    reconcile.update()
    assert annotations.picture_size(edit.virtual_shutter.effects[0]) == (40, 40)
    source.filepath = str(tmp_path / "gone.mkv")
    bpy.context.view_layer.update()
    assert annotations.picture_size(edit.virtual_shutter.effects[0]) == (40, 40), "a missing file leaves it"


def test_another_rate_of_the_edit(bpy, edit, made, shown):
    strip, source = made()
    edit.render.fps, edit.render.fps_base = 30, 1.001
    bpy.context.view_layer.update()
    assert (strip.scene.render.fps, strip.scene.render.fps_base) == (edit.render.fps, edit.render.fps_base)
    assert words() == []
    assert apart(shown(strip, [1, 20, 40]), shown(source, [1, 20, 40])) <= LEVELS


def test_another_size_of_the_edit(bpy, edit, made, shown):
    """Blender scales no strip: picture and scribbles stay about the image's center."""
    strip, _source = made(SCRIBBLED)
    effect = edit.virtual_shutter.effects[0]
    before, drawn = shown(strip, [5])[5], strokes(effect)
    edit.render.resolution_x, edit.render.resolution_y = 96, 64
    bpy.context.view_layer.update()
    assert words() == []
    assert strokes(effect) == drawn
    after = shown(strip, [5])[5]
    assert after.shape[:2] == (64, 96)
    assert np.abs(after[8:56, 24:72] - before).max() <= LEVELS


def test_missing_modifiers_of_the_source_are_told(bpy, edit, made):
    """Of the same type and number is alike; what the source does not use does not count."""
    strip, source = made()
    strip.modifiers.new("Own", "BRIGHT_CONTRAST")
    source.modifiers.new("Same", "BRIGHT_CONTRAST").bright = 5
    source.modifiers.new("Off", "MASK").mute = True
    for lacks in (False, True):
        bpy.context.view_layer.update()
        assert match_source.shown(edit.virtual_shutter.effects[0]).lacks_modifiers is lacks
        source.modifiers.new("Own", "COLOR_BALANCE")
