"""Colours of a still effect are those of its source in every colour space that Blender's sequencer has."""

import numpy as np
import pytest
from support import effect_of, recipe, write_frames

from shutter_addon.blender.rendering import pictures

LEVELS = 1


@pytest.fixture
def spaces(edit):
    """The names of all."""
    return [item.identifier for item in edit.sequencer_colorspace_settings.bl_rna.properties["name"].enum_items]


@pytest.fixture
def made(edit, tmp_path):
    """Makes an effect on a picture of all colours in steps of 17 levels: its strip."""
    cube = np.stack(np.meshgrid(*[np.arange(0, 256, 17, dtype=np.uint8)] * 3), axis=-1).reshape(1, 64, 64, 3)
    first = write_frames(tmp_path / "in", cube)
    edit.render.resolution_x = edit.render.resolution_y = 64

    def make():
        for strip in list(edit.sequence_editor.strips):
            edit.sequence_editor.strips.remove(strip)
        source = edit.sequence_editor.strips.new_image("colours", str(first), 1, 1)
        source.right_handle = 3
        strip, _effect = effect_of(edit, source, recipe(1, [1]))
        return strip

    return make


def apart(edit, render, strip) -> float:
    """How many levels the effect is off the plain strip, of which nothing is kept: Blender would convert that as it
    lays another one over it."""
    edit.sequence_editor.use_cache_raw = edit.sequence_editor.use_cache_final = False
    strip.mute = True
    plain = render(edit, [1], "16")[1]
    strip.mute = False
    shown = render(edit, [2], "16")[2]
    assert plain.std() > 20
    return np.abs(shown - plain).max()


def test_an_effect_that_is_added_keeps_all_colours(edit, render, spaces, made):
    assert len(spaces) > 50
    off = {}
    for space in spaces:
        edit.sequencer_colorspace_settings.name = space
        strip = made()
        off[space] = apart(edit, render, strip)
    assert {space: levels for space, levels in off.items() if levels > LEVELS} == {}


def test_colours_that_blender_changes_are_told(edit, render, spaces, made, capfd, monkeypatch):
    """A strip that is laid over others loses some in a few spaces, an effect as any other."""
    strip = made()
    assert strip.blend_type == "ALPHA_OVER"
    for space in spaces:
        edit.sequencer_colorspace_settings.name = space
        capfd.readouterr()
        monkeypatch.setattr(pictures, "_said", set())  # what was said is not said again
        is_off = apart(edit, render, strip) > LEVELS
        assert (f'In the color space "{space}" Blender' in capfd.readouterr().err) == is_off, space
        if is_off:
            strip.blend_type = "REPLACE"
            assert apart(edit, render, strip) <= LEVELS
            strip.blend_type = "ALPHA_OVER"
