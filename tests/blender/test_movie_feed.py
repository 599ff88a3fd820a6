"""Movies are rendered from files of finished levels: the same pictures as by the engine."""

import os
import shutil
import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from support import noise_film

from shutter_addon.blender.output import edit_feed
from shutter_addon.blender.output.edit_feed import LevelsFile
from shutter_addon.core import atomic_write


@pytest.fixture
def film(bpy, edit, tmp_path):
    """An edit of eight frames of noise under an effect of two shutters and a line; its source."""
    noise = np.random.default_rng(0).integers(0, 256, (8, 24, 40, 3), dtype=np.uint8)
    source, _effect, _strip = noise_film(edit, noise, tmp_path)
    source.mute = True
    return edit


def blenders_own(bpy):
    """Its colour configuration."""
    return Path(bpy.utils.system_resource("DATAFILES", path="colormanagement"), "config.ocio")


def rendered(edit, folder):
    """The film as pictures of 8 bits, over black as a movie's: (frames, H, W, 3)."""
    import bpy

    settings = edit.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "PNG", "8", "RGB"
    edit.render.filepath = f"{folder}/"
    bpy.ops.render.render(animation=True, scene=edit.name)
    return np.stack([OpenImageIO.ImageBuf(str(path)).get_pixels("uint8") for path in sorted(folder.iterdir())])


def test_levels_are_those_of_the_engine(bpy, film, tmp_path, monkeypatch):
    """And what a killed render has left is removed. OCIO is as a Blender with a window has it: its own file."""
    monkeypatch.setenv("OCIO", str(blenders_own(bpy)))
    monkeypatch.setattr(tempfile, "tempdir", str(place := tmp_path / "temporary"))
    left = place / f".part-{0:016x}"
    left.mkdir(parents=True)
    os.utime(left, (0, 0))
    with monkeypatch.context() as patch:
        patch.setattr(edit_feed, "begin", lambda _scene: None)
        expected = rendered(film, tmp_path / "engine").astype(int)
    before = [strip.name for strip in film.sequence_editor.strips_all]
    folders = []
    bpy.app.handlers.render_post.append(lambda *_: folders.extend(place.iterdir()))
    fed = rendered(film, tmp_path / "fed")
    assert folders[-1] != left  # it is there until the second frame
    assert len(set(folders) - {left}) == 1
    assert atomic_write.is_part(folders[-1].name)
    assert list(place.iterdir()) == []
    assert len(fed) == len(expected) == 8
    assert np.array_equal(fed, expected)
    assert [strip.name for strip in film.sequence_editor.strips_all] == before


def test_a_studios_colour_configuration_leaves_the_film_to_the_engine(bpy, film, tmp_path, monkeypatch):
    own, studio = blenders_own(bpy), tmp_path / "config.ocio"
    studio.write_text(f"# of a studio\n{own.read_text()}")
    written, write = [], LevelsFile.write
    monkeypatch.setattr(LevelsFile, "write", lambda *given: (written.append(1), write(*given)))
    for given, fed in ((own, 7), (studio, 0)):
        monkeypatch.setenv("OCIO", str(given))
        written.clear()
        rendered(film, tmp_path / given.parent.name)
        assert len(written) == fed


def test_a_file_that_is_gone_leaves_the_film_to_the_engine(bpy, film, tmp_path, monkeypatch):
    """Blender would show it as a picture of one colour."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    with monkeypatch.context() as patch:
        patch.setattr(edit_feed, "begin", lambda _scene: None)
        expected = rendered(film, tmp_path / "engine").astype(int)

    def lose(edit, *_):
        if edit.frame_current == 4:
            for folder in (tmp_path / "temporary").glob(".part-*"):
                shutil.rmtree(folder)

    bpy.app.handlers.render_post.append(lose)
    fed = rendered(film, tmp_path / "fed")
    assert np.array_equal(fed, expected)


@pytest.mark.parametrize(("width", "height"), [(7, 5), (16, 64), (40, 65)])
def test_a_file_whose_pixels_are_replaced(tmp_path, width, height):
    levels = np.random.default_rng(0).integers(0, 256, (2, height, width, 4), dtype=np.uint8)
    levels[..., 3] = 255
    file = LevelsFile(tmp_path / "levels.tif", width, height)
    spec = OpenImageIO.ImageBuf(str(file.path)).spec()
    assert (spec.tile_width % 16, spec.tile_height) == (0, 64)
    for shown in levels:
        file.write(shown)
        assert np.array_equal(OpenImageIO.ImageBuf(str(file.path)).get_pixels("uint8"), shown)
    file.close()
