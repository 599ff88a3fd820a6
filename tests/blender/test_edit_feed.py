"""An edit that Blender renders by itself has the bits that the engine's pictures give it, whatever else is in it."""

import os
import shutil
import tempfile
from contextlib import contextmanager
from operator import attrgetter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import OpenImageIO
import pytest
from support import EXTENSION, noise, noise_film, started

from shutter_addon.blender.output import edit_feed
from shutter_addon.blender.output.edit_feed import LevelsFile
from shutter_addon.blender.rendering import render_job

COUNT, HEIGHT, WIDTH = 6, 24, 40


@pytest.fixture
def made(bpy, edit, tmp_path, monkeypatch):
    """Makes an edit of noise with so many channels under an effect, dithered: its source, effect and strip. Files of
    levels lie in a folder of their own."""

    def make(channels=3):
        found = noise_film(edit, noise(COUNT, HEIGHT, WIDTH, channels), tmp_path)
        edit.render.dither_intensity = 1
        settings = edit.render.image_settings
        settings.file_format, settings.color_depth, settings.color_mode = "PNG", "8", "RGB"
        return found

    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    return make


def look(edit):
    """All that a render might leave changed in an edit."""
    editor = edit.sequence_editor
    strips = [(s.name, s.channel, s.mute, s.blend_type, s.blend_alpha, s.select) for s in editor.strips_all]
    return strips, editor.use_cache_raw, editor.use_cache_final, editor.active_strip


def levels_of(path):
    return OpenImageIO.ImageBuf(str(path)).get_pixels("uint8")


def levels_in(folder):
    """Of all pictures of the film there, which are removed."""
    found = np.stack([levels_of(path) for path in sorted(folder.iterdir())])
    shutil.rmtree(folder)
    return found


def pictures(bpy, edit, folder):
    edit.render.filepath = f"{folder}/"
    assert bpy.ops.render.render(animation=True, scene=edit.name) == {"FINISHED"}
    assert len(list(folder.iterdir())) == edit.frame_end
    return levels_in(folder)


@contextmanager
def calling(handlers, function):
    """While it is one of Blender's handlers, the first one."""
    handlers.insert(0, function)
    try:
        yield
    finally:
        handlers.remove(function)


@pytest.fixture
def compared(bpy, edit, tmp_path, monkeypatch):
    """Renders an edit by the engine alone, and as ever: asserts equal bits, and gives the frames that needed no
    engine."""

    def compare():
        edit.frame_set(edit.frame_start)  # animation is as it will be left
        fed, write = [], LevelsFile.write

        def note(file, levels):
            fed.append(edit.frame_current)
            write(file, levels)

        with monkeypatch.context() as patch:
            patch.setattr(edit_feed, "begin", lambda _scene: None)
            expected = pictures(bpy, edit, tmp_path / "engine")
        edit.sequence_editor.use_cache_raw = edit.sequence_editor.use_cache_final = True
        before = look(edit)
        with monkeypatch.context() as patch:
            patch.setattr(LevelsFile, "write", note)
            found = pictures(bpy, edit, tmp_path / "fed")
        assert np.array_equal(found, expected)
        assert len({picture.tobytes() for picture in found}) == edit.frame_end
        assert look(edit) == before
        assert list((tmp_path / "temporary").iterdir()) == []
        return fed

    return compare


ALL = list(range(2, COUNT + 1))  # the first may be all that is rendered
# By name: what is set, of the edit, its source or the effect's strip, and which frames need no engine then.
SETTINGS = {
    "plain": ("edit.use_gravity", False, ALL),  # which changes no picture
    "without_dither": ("edit.render.dither_intensity", 0, ALL),
    "with_alpha_channel": ("edit.render.image_settings.color_mode", "RGBA", ALL),
    "jpeg": ("edit.render.image_settings.file_format", "JPEG", ALL),
    "black_and_white": ("edit.render.image_settings.color_mode", "BW", []),
    "sixteen_bits": ("edit.render.image_settings.color_depth", "16", []),
    "another_view": ("edit.view_settings.view_transform", "AgX", []),
    "brighter_view": ("edit.view_settings.exposure", 0.5, []),
    "smaller": ("edit.render.resolution_percentage", 50, []),
    "larger_edit": ("edit.render.resolution_x", WIDTH + 8, []),
    "with_metadata_of_strips": ("edit.render.metadata_input", "STRIPS", []),
    "replacing": ("strip.blend_type", "REPLACE", ALL),
    "blended": ("strip.blend_type", "MULTIPLY", []),
    "half_shown": ("strip.blend_alpha", 0.5, []),
    "moved": ("strip.transform.offset_x", 3, []),
    "cropped": ("strip.crop.min_x", 5, []),
    "marked": ("strip.scene.render.use_stamp", True, []),
    "deinterlaced": ("strip.use_deinterlace", True, []),
    "muted": ("strip.mute", True, []),
    "ends_early": ("strip.right_handle", 5, [2, 3, 4]),
    "in_the_topmost_channel": ("strip.channel", 128, []),
    "over_nothing": ("source.mute", True, ALL),
    "behind_its_source": ("source.right_handle", 5, ALL),
}


def keyed(owner, name, values):
    for frame, value in values.items():
        setattr(owner, name, value)
        owner.keyframe_insert(name, frame=frame)


def above(edit, folder, first=1, stop=COUNT + 1):
    other = edit.sequence_editor.strips.new_image("above", str(folder / "in" / "f0003.png"), 6, first)
    other.right_handle, other.blend_alpha = stop, 0.4
    return other


def brighten(strip):
    strip.modifiers.new("Bright", "BRIGHT_CONTRAST").bright = 20


def adjusted(edit, source, strip, folder):
    brighten(edit.sequence_editor.strips.new_effect("layer", "ADJUSTMENT", 7, 1, length=COUNT))


def in_a_transition(edit, source, strip, folder):
    inputs = {"input1": strip, "input2": above(edit, folder)}
    edit.sequence_editor.strips.new_effect("cross", "CROSS", 8, 1, length=COUNT, **inputs)


def over_more(edit, source, strip, folder):
    strip.channel = 4
    other = edit.sequence_editor.strips.new_image("below", str(folder / "in" / "f0002.png"), 3, 1)
    other.right_handle = COUNT + 1


def over_another(edit, source, strip, folder):
    over_more(edit, source, strip, folder)
    source.mute = True


def in_a_meta(edit, source, strip, folder):
    meta = edit.sequence_editor.strips.new_meta("meta", 9, 1)
    strip.move_to_meta(meta)
    source.move_to_meta(meta)
    meta.right_handle = COUNT + 1


def two_effects(edit, source, strip, folder):
    source.right_handle = strip.right_handle = 5
    other = edit.sequence_editor.strips.new_image("second", str(folder / "in" / "f0005.png"), 1, 5)
    other.right_handle = COUNT + 1
    other.elements.append("f0006.png")
    second, effect = started(edit, other)
    effect.edges = "SHORTEN"  # an exposure longer than its clip would slide to one place
    second.right_handle = COUNT + 1


def keyed_effect(edit, source, strip, folder):
    keyed(edit.virtual_shutter.effects[0].shutters[0].bars[0], "weight", {1: 0.2, COUNT: 1.0})


# By name: what changes the edit, its source or the effect's strip, and which frames need no engine then.
EDITS = {
    "fading": (lambda edit, source, strip, folder: keyed(strip, "blend_alpha", {1: 1.0, COUNT: 0.2}), []),
    "modified": (lambda edit, source, strip, folder: brighten(strip), []),
    "cut": (lambda edit, source, strip, folder: strip.split(frame=4, split_method="SOFT"), ALL),
    "titled": (lambda edit, source, strip, folder: above(edit, folder, 3, 5), [2, 5, 6]),
    "title_is_muted": (lambda edit, source, strip, folder: setattr(above(edit, folder, 3, 5), "mute", True), ALL),
    "title_comes": (lambda edit, source, strip, folder: keyed(above(edit, folder), "mute", {1: True, 4: False}), []),
    "adjusted": (adjusted, []),
    "in_a_transition": (in_a_transition, []),
    "in_a_meta": (in_a_meta, []),
    "over_more": (over_more, ALL),
    "over_another": (over_another, []),
    "two_effects": (two_effects, ALL),
    "keyed_effect": (keyed_effect, ALL),
}


@pytest.mark.usefixtures("on_numpy")
@pytest.mark.parametrize("name", [*SETTINGS, *EDITS])
def test_bits_are_the_engines(edit, made, compared, tmp_path, name):
    source, _effect, strip = made()
    if name in SETTINGS:
        place, value, expected = SETTINGS[name]
        owner, _, what = place.rpartition(".")
        setattr(attrgetter(owner)(SimpleNamespace(edit=edit, source=source, strip=strip)), what, value)
    else:
        change, expected = EDITS[name]
        change(edit, source, strip, tmp_path)
    edit.frame_end = COUNT if expected else 4
    assert compared() == expected


def test_footage_with_an_alpha_is_left_to_the_engine(edit, made, compared):
    made(channels=4)
    assert compared() == []


def test_a_script_may_change_the_effect_at_a_frame(bpy, edit, made, compared, tmp_path):
    _source, effect, _strip = made()

    def change(_scene, *_):
        effect.shutters[0].bars[0].weight = 0.1 * edit.frame_current

    with calling(bpy.app.handlers.render_pre, change):
        assert compared() == ALL
        changed = pictures(bpy, edit, tmp_path / "changed")
    edit.frame_set(4)
    change(edit)
    still = pictures(bpy, edit, tmp_path / "still")
    assert [np.array_equal(changed[frame - 1], still[frame - 1]) for frame in (3, 4, 5)] == [False, True, False]


def test_a_single_picture_keeps_its_floats(bpy, edit, made, tmp_path):
    """It may be saved as others than the edit's settings say."""
    made()
    edit.render.dither_intensity = 0
    edit.frame_set(4)
    bpy.ops.render.render()
    settings = edit.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    bpy.data.images["Render Result"].save_render(str(tmp_path / "still.exr"), scene=edit)
    values = OpenImageIO.ImageBuf(str(tmp_path / "still.exr")).get_pixels("float")[..., :3]
    assert len(np.unique(values)) > 256


@pytest.mark.parametrize("how", ["stopped", "saved"])
def test_the_edit_is_put_back(bpy, edit, made, tmp_path, how):
    """Of a render that ends early, and before a file is saved in the midst of one."""
    made()
    before, seen = look(edit), []

    def act(scene, *_):
        if scene.render.engine == "VIRTUAL_SHUTTER" or scene.frame_current != 4:
            return
        seen.append(look(edit) != before)
        if how == "stopped":
            render_job.job.stopping = True
        else:
            bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edit.blend"), copy=True)

    edit.render.filepath = f"{tmp_path / 'out'}/"
    with calling(bpy.app.handlers.render_post, act):
        bpy.ops.render.render(animation=True)
    assert seen == [True]
    assert look(edit) == before
    assert len(list((tmp_path / "out").iterdir())) == (4 if how == "stopped" else COUNT)
    if how == "saved":
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "edit.blend"))
        scene = bpy.context.scene
        assert [strip[:5] for strip in look(scene)[0]] == [strip[:5] for strip in before[0]]
        assert look(scene)[1:3] == before[1:3]


def test_a_file_that_is_gone_leaves_the_film_to_the_engine(bpy, edit, made, compared, tmp_path):
    """Blender would show it as a picture of one color. What a killed render has left is removed, too."""
    made()
    left = tmp_path / "temporary" / f".part-{0:016x}"
    left.mkdir()
    os.utime(left, (0, 0))

    def lose(edit, *_):
        if edit.frame_current == 4:
            for folder in (tmp_path / "temporary").glob(".part-*"):
                shutil.rmtree(folder)

    with calling(bpy.app.handlers.render_post, lose):
        assert compared() == [2, 3, 4, 5]  # the last one in vain


def test_a_studios_colour_configuration_leaves_the_film_to_the_engine(bpy, edit, made, compared, tmp_path, monkeypatch):
    """A Blender with a window sets its own file."""
    made()
    own = Path(bpy.utils.system_resource("DATAFILES", path="colormanagement"), "config.ocio")
    studio = tmp_path / "config.ocio"
    studio.write_text(f"# of a studio\n{own.read_text()}")
    for given, fed in ((own, ALL), (studio, [])):
        monkeypatch.setenv("OCIO", str(given))
        assert compared() == fed


@pytest.mark.parametrize(("width", "height"), [(7, 5), (16, 64), (40, 65)])
def test_a_file_whose_pixels_are_replaced(tmp_path, width, height):
    levels = noise(2, height, width, 4)
    levels[..., 3] = 255
    file = LevelsFile(tmp_path / "levels.tif", width, height)
    spec = OpenImageIO.ImageBuf(str(file.path)).spec()
    assert (spec.tile_width % 16, spec.tile_height) == (0, 64)
    for shown in levels:
        file.write(shown)
        assert np.array_equal(levels_of(file.path), shown)
    file.close()


def test_what_cannot_be_written_is_left_to_the_engine(edit, made, compared, monkeypatch):
    made()

    def no_room(*_):
        raise OSError(28, "No space left on device", "picture.tif")

    monkeypatch.setattr(edit_feed, "LevelsFile", no_room)
    assert compared() == []


def test_blender_itself_renders_the_same(bpy, edit, made, blender, tmp_path):
    made()
    edit.render.filepath = "//out/"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edit.blend"))
    # Says how often the file was written, and, of the second render, leaves all to the engine.
    module = f"import {EXTENSION}.shutter_addon.blender.output.edit_feed as feed; "
    note = "write = feed.LevelsFile.write; feed.LevelsFile.write = lambda *given: (print('FED'), write(*given))"
    films = []
    for told, fed in ((note, COUNT - 1), ("feed.begin = lambda scene: None", 0)):
        done = blender(tmp_path / "edit.blend", "--python-expr", module + told, "-a")
        assert done.returncode == 0, done.stderr
        assert done.stdout.count("FED") == fed, done.stdout + done.stderr
        films.append(levels_in(tmp_path / "out"))
        assert len(films[-1]) == COUNT
    assert np.array_equal(*films)
