"""Movies are rendered from files of finished levels: the same pictures as by the engine."""

import json

import numpy as np
import OpenImageIO
import pytest
from support import recipe, write_frames

from shutter_addon.core import recipe as recipes


@pytest.fixture
def film(bpy, edit, tmp_path):
    """An edit of eight frames of half-transparent noise under an effect of two shutters and a line; its source."""
    from shutter_addon.blender.data import recipe_import
    from shutter_addon.blender.editing import add_effect
    from shutter_addon.blender.rendering import session

    session.forget()
    noise = np.random.default_rng(0).integers(0, 256, (8, 24, 40, 4), dtype=np.uint8)
    source = edit.sequence_editor.strips.new_image("images", str(write_frames(tmp_path / "in", noise[:1])), 1, 1)
    write_frames(tmp_path / "in", noise)
    for i in range(2, 9):
        source.elements.append(f"f{i:04d}.png")
    edit.render.resolution_x, edit.render.resolution_y = 40, 24
    edit.frame_start, edit.frame_end = 1, 8
    strip, effect = add_effect.add_effect(edit, source)
    line = {"shutter": "S1", "kind": "line", "width": 0.1, "strokes": [[[0.2, 0.2], [0.3, 0.8]]]}
    data = recipe(4, [1, 1, 1, 1], [0, 0, 1, 0], regions=[line], border=True)
    recipe_import.apply(edit, effect, strip, recipes.parse(json.dumps(data)))
    edit.sequence_editor.use_cache_raw = edit.sequence_editor.use_cache_final = False
    source.mute = True
    return edit


def rendered(edit, folder):
    """The film as pictures of 8 bits, over black as a movie's: (frames, H, W, 3)."""
    import bpy

    settings = edit.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "PNG", "8", "RGB"
    edit.render.filepath = f"{folder}/"
    bpy.ops.render.render(animation=True, scene=edit.name)
    return np.stack([OpenImageIO.ImageBuf(str(path)).get_pixels("uint8") for path in sorted(folder.iterdir())])


def test_levels_are_those_of_the_engine(film, tmp_path):
    from shutter_addon.blender.rendering import movie_feed

    expected = rendered(film, tmp_path / "engine").astype(int)
    before = [strip.name for strip in film.sequence_editor.strips_all]
    with movie_feed.feeding(film):
        fed = rendered(film, tmp_path / "fed")
    assert len(fed) == len(expected) == 8
    apart = np.abs(fed - expected)
    assert apart.max() <= 1
    assert (apart > 0).mean() < 0.001
    assert [strip.name for strip in film.sequence_editor.strips_all] == before


def test_a_file_whose_pixels_are_replaced(tmp_path):
    from shutter_addon.blender.rendering.movie_feed import LevelsFile

    levels = np.random.default_rng(0).integers(0, 256, (2, 5, 7, 4), dtype=np.uint8)
    levels[..., 3] = 255
    file = LevelsFile(tmp_path / "levels.tif", 7, 5)
    for shown in levels:
        file.write(shown)
        assert np.array_equal(OpenImageIO.ImageBuf(str(file.path)).get_pixels("uint8"), shown)
    file.close()
