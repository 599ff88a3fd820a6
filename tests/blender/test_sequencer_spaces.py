"""Colors of a still effect are those of its source in the color spaces that Blender's sequencer has."""

import numpy as np
from support import effect_of, recipe, write_frames

from shutter_addon.blender.rendering import render_job

LEVELS = 1
# Where Blender changes colors of a strip that it lays over others.
LOSSY = {
    *("ACES 1.3 sRGB", "ACES 2.0 sRGB", "ADX10", "ADX16"),
    *("AgX Base sRGB", "AgX Log", "Khronos PBR Neutral sRGB"),
}


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


def test_an_effect_that_is_added_keeps_all_colours(edit, render, tmp_path, capfd, monkeypatch):
    """And an editor who lays it over others is told where these change some; a few of the spaces that do not."""
    # A picture of all colors in steps of 17 levels.
    cube = np.stack(np.meshgrid(*[np.arange(0, 256, 17, dtype=np.uint8)] * 3), axis=-1).reshape(1, 64, 64, 3)
    first = write_frames(tmp_path / "in", cube)
    edit.render.resolution_x = edit.render.resolution_y = 64
    spaces = [item.identifier for item in edit.sequencer_colorspace_settings.bl_rna.properties["name"].enum_items]
    assert len(spaces) > 50
    for space in sorted(LOSSY | set(spaces[::9])):
        told = f'In the color space "{space}" Blender'
        edit.sequencer_colorspace_settings.name = space
        monkeypatch.setattr(render_job.job, "said", set())  # what was said is not said again
        for strip in list(edit.sequence_editor.strips):
            edit.sequence_editor.strips.remove(strip)
        source = edit.sequence_editor.strips.new_image("colours", str(first), 1, 1)
        source.right_handle = 3
        strip, _effect = effect_of(edit, source, recipe(1, [1]))
        assert strip.blend_type == ("REPLACE" if space in LOSSY else "ALPHA_OVER"), space
        assert apart(edit, render, strip) <= LEVELS, space
        assert told not in capfd.readouterr().err
        if space in LOSSY:
            strip.blend_type = "ALPHA_OVER"
            assert apart(edit, render, strip) > LEVELS, space
            assert told in capfd.readouterr().err
