"""Every change that changes pictures reaches the sequencer's cache of finished frames; playing does not."""

from unittest.mock import Mock

import numpy as np
import pytest
from support import KEYED, effect_of, image_strip, noise, request, write_frames

from shutter_addon.blender import handlers
from shutter_addon.blender.data import fcurves, source_media, strips
from shutter_addon.blender.rendering import invalidation, session
from shutter_addon.media import sequence

FRAME = 5


@pytest.fixture
def images(tmp_path):
    return write_frames(tmp_path / "in", noise(30, 32, 32, 3))


@pytest.fixture
def effect(bpy, edit, images, on_numpy):
    """An effect on an image strip, with keyed bars and a region that moves."""
    edit.render.resolution_x = edit.render.resolution_y = 32
    _strip, effect = effect_of(edit, image_strip(edit, images), KEYED | {"border": True})
    bpy.context.view_layer.update()
    return effect


def curve(edit, name):
    return next(c for c in fcurves.curves_under(edit, "virtual_shutter") if c.data_path.endswith(name))


def location(edit):
    return curve(edit, "regions[0].location")


def layer(edit):
    return edit.virtual_shutter.effects[0].scene.annotation.layers[0]


def insert_key(edit):
    edit.virtual_shutter.effects[0].shutters[0].bars[3].weight = 1
    edit.keyframe_insert("virtual_shutter.effects[0].shutters[0].bars[3].weight", frame=FRAME)


def move_handle(edit):
    key = location(edit).keyframe_points[0]
    key.interpolation, key.handle_right, key.handle_right_type = "BEZIER", (8, 0.2), "FREE"


def mute_curve(edit):
    edit.frame_set(1)  # the value stays what it is at this frame
    location(edit).mute = True


def draw_stroke(edit):
    stroke = layer(edit).frames[0].strokes.new()
    stroke.points.add(3)
    stroke.points.foreach_set("co", [-16, 16, 0, 0, 16, 0, -16, 0, 0])


def change_property(edit):
    effect = edit.virtual_shutter.effects[0]
    effect.interpolation, effect.position = "VALUE", "END"


def move_effect_strip(edit):
    """Strokes lie in the sequencer's image: they stay where they are."""
    next(s for s in edit.sequence_editor.strips if s.type == "SCENE").transform.offset_x += 6


CHANGES = {
    "insert_key": insert_key,
    "move_key": lambda edit: curve(edit, "shutters[0].bars[0].weight").keyframe_points[1].co.__setitem__(0, 6),
    "change_value": lambda edit: location(edit).keyframe_points[1].co.__setitem__(1, 0.6),
    "delete_key": lambda edit: location(edit).keyframe_points.remove(location(edit).keyframe_points[1]),
    "move_handle": move_handle,
    "change_ease": lambda edit: setattr(location(edit).keyframe_points[0], "interpolation", "CONSTANT"),
    "mute_curve": mute_curve,
    "add_modifier": lambda edit: setattr(location(edit).modifiers.new("NOISE"), "strength", 2),
    "draw_stroke": draw_stroke,
    "erase_stroke": lambda edit: layer(edit).frames[0].strokes.remove(layer(edit).frames[0].strokes[0]),
    "delete_layer": lambda edit: edit.virtual_shutter.effects[0].scene.annotation.layers.remove(layer(edit)),
    "remove_shutter": lambda edit: edit.virtual_shutter.effects[0].shutters.remove(1),
    "change_property": change_property,
    "follow_edges": lambda edit: setattr(edit.virtual_shutter.effects[0], "edge_aware", 1),
    "reverse_source": lambda edit: setattr(edit.sequence_editor.strips["images"], "use_reverse_frames", True),
    "slip_source": lambda edit: setattr(edit.sequence_editor.strips["images"], "content_start", -2),
    "move_effect_strip": move_effect_strip,
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_is_rendered_and_so_are_undo_and_redo(bpy, edit, effect, render, change):
    """And equals what a render without any cache gives."""
    before = render(edit, [FRAME])[FRAME]
    bpy.ops.ed.undo_push(message="before")
    CHANGES[change](edit)
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="after")
    after = render(edit, [FRAME])[FRAME]
    assert not np.array_equal(after, before)
    for step, expected in ((bpy.ops.ed.undo, before), (bpy.ops.ed.redo, after)) * 2:
        step()
        edit = bpy.context.scene
        assert np.array_equal(render(edit, [FRAME])[FRAME], expected)
    edit.sequence_editor.use_cache_raw = edit.sequence_editor.use_cache_final = False
    render(edit, [FRAME + 1])
    assert np.array_equal(render(edit, [FRAME])[FRAME], after)


def test_the_cache_is_on(bpy, edit, effect, render):
    """What the other tests rest on: without the handlers, a frame would be the old one."""
    before = render(edit, [FRAME])[FRAME]
    handlers.unregister()
    try:
        CHANGES["change_value"](edit)
        assert np.array_equal(render(edit, [FRAME])[FRAME], before)
    finally:
        handlers.register()
    assert not np.array_equal(render(edit, [FRAME])[FRAME], before)


def test_a_file_replaced_in_the_middle_is_rendered(bpy, edit, effect, render, images):
    """In place, as Blender writes over its own renders: the folder tells nothing of it."""
    before = render(edit, [FRAME])[FRAME]
    (images.parent / f"f{FRAME:04d}.png").write_bytes((images.parent / "f0030.png").read_bytes())
    after = render(edit, [FRAME])[FRAME]
    assert not np.array_equal(after, before)
    edit.sequence_editor.use_cache_raw = edit.sequence_editor.use_cache_final = False
    assert np.array_equal(render(edit, [FRAME])[FRAME], after)


@pytest.fixture
def asked(monkeypatch):
    """Counts the files of which it was asked whether they are the same."""
    monkeypatch.setattr(source_media, "stamp", Mock(wraps=source_media.stamp))
    return source_media.stamp


@pytest.fixture
def long(edit, effect, images):
    """A strip of a thousand files."""
    source = edit.sequence_editor.strips["images"]
    for name in [images.name] * 969 + ["f0030.png"]:
        source.elements.append(name)
    return source


def test_replaced_files_of_a_sequence_are_noticed_at_a_look(edit, effect, images):
    invalidation.invalidate_changed(edit)
    (images.parent / "f0016.png").write_bytes(images.read_bytes() + b"more")
    assert not invalidation.invalidate_changed(edit)
    source_media.look_again()
    assert invalidation.invalidate_changed(edit)
    assert not invalidation.invalidate_changed(edit)


@pytest.mark.usefixtures("long")
def test_a_redraw_asks_the_ends_of_a_sequence_alone(edit, effect, asked):
    (strip,) = strips.effect_strips(edit)
    invalidation.invalidate_changed(edit)
    for frame in (FRAME, FRAME + 1):
        asked.reset_mock()
        invalidation.invalidate_changed(edit)
        request(edit, effect, strip, frame)
        assert asked.call_count == 4


def test_a_film_asks_all_files_before_it_and_then_the_ends_alone(bpy, edit, render, long, asked, monkeypatch):
    begin, counts = session.RenderSession.begin_next, []

    def begin_next(*arguments):
        counts.append(asked.call_count)
        asked.reset_mock()
        begin(*arguments)

    monkeypatch.setattr(session.RenderSession, "begin_next", begin_next)
    render(edit, [FRAME])
    counts.clear()
    edit.frame_start, edit.frame_end = 7, 11
    bpy.ops.render.render(animation=True)
    assert counts[0] >= len(long.elements)
    assert len(counts) >= 5
    assert 2 <= max(counts[1:]) < 10


@pytest.mark.usefixtures("effect")
def test_what_is_known_of_files_is_bounded(edit, asked):
    source = edit.sequence_editor.strips["images"]

    def asks(number):
        asked.reset_mock()
        source.name = f"images {number}"
        source_media.media_key(source)
        return asked.call_count

    ends, all_files = 2, 2 + len(source.elements)
    assert {asks(number) for number in range(600)} == {all_files}
    assert [asks(number) for number in (599, 400, 0)] == [ends, ends, all_files]


def test_finished_frames_are_kept_while_nothing_changes(bpy, edit, effect, render, monkeypatch):
    """Frames are there even when no file can be read: playing and selecting drop none."""
    before = render(edit, [3, FRAME])
    monkeypatch.delattr(sequence.SequenceSource, "read")
    for frame in range(1, 20):
        edit.frame_set(frame)
        bpy.context.view_layer.update()
    edit.frame_end += 1
    curve(edit, "regions[0].location").keyframe_points[0].select_control_point = True
    bpy.context.view_layer.update()
    for frame, picture in render(edit, [FRAME, 3]).items():
        assert np.array_equal(picture, before[frame])
