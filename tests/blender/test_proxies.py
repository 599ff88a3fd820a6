"""Proxies that Blender itself has built, found where it puts them."""

import numpy as np
import OpenImageIO
import pytest
from support import image_strip, sequencer, write_frames, write_movie

from shutter_addon.blender.data import source_media
from shutter_addon.blender.data.source_media import proxy_of

COUNT, WIDTH, HEIGHT = 6, 72, 48


def pictures():
    """A bright field on a dark one, which moves by a quarter of its width a frame."""
    frames = np.full((COUNT, HEIGHT, WIDTH, 3), 40, np.uint8)
    for index, frame in enumerate(frames):
        frame[12:36, 6 * index : 6 * index + 24] = 200, 120, 160
    return frames


@pytest.fixture
def built(bpy, edit, tmp_path):
    """Sets up a strip, has Blender build its proxies of a half, and gives the strip."""

    def strip(kind):
        if kind == "IMAGE":
            return image_strip(edit, write_frames(tmp_path / "in", pictures()))
        path = write_movie(tmp_path / "movie.mp4", pictures(), "libx264", "yuv420p", 25, {"qp": "10"})
        return edit.sequence_editor.strips.new_movie("movie", str(path), 2, 1)

    def build(kind):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edit.blend"))
        found = strip(kind)
        found.select = found.use_proxy = found.proxy.build_50 = True
        bpy.ops.render.render()  # after a film that was stopped Blender builds none, until something is rendered
        with sequencer(bpy):
            assert bpy.ops.sequencer.rebuild_proxy() == {"FINISHED"}
        return found

    return build


def proxied(edit, strip):
    """The strip's medium at half its size, as a preview reads it."""
    return source_media.spec(strip).open(2, source_media.proxy_of(edit, strip, 50))


def assert_read(edit, strip):
    """Every frame is from a proxy, and nearest to the footage's own."""
    with proxied(edit, strip) as source, source_media.spec(strip).open(2) as footage:
        assert source.from_proxy
        assert (source.width, source.height, source.count) == (WIDTH // 2, HEIGHT // 2, COUNT)
        own = np.array([footage.read(index) for index in range(COUNT)]).astype(int)
        for index in range(COUNT):
            apart = np.abs(source.read(index) - own).mean(axis=(1, 2, 3))
            assert (apart.argmin(), apart[index] > 0, apart[index] < 8) == (index, True, True)


@pytest.mark.parametrize(
    ("kind", "storage", "folder"),
    [("MOVIE", "PER_STRIP", ""), ("IMAGE", "PER_STRIP", ""), ("MOVIE", "PROJECT", "//its"), ("MOVIE", "PROJECT", "")],
)
def test_where_blender_puts_them(edit, built, kind, storage, folder):
    edit.sequence_editor.proxy_storage, edit.sequence_editor.proxy_dir = storage, folder
    assert_read(edit, built(kind))


@pytest.mark.parametrize("kind", ["MOVIE", "IMAGE"])
def test_of_a_linked_edit(bpy, edit, built, tmp_path, kind):
    """Paths are from the file that the edit is in."""
    strip = built(kind)
    if kind == "MOVIE":
        strip.filepath = "//movie.mp4"
    else:
        strip.directory = "//in/"
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    (tmp_path / "main").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "main" / "main.blend"))
    with bpy.data.libraries.load(str(tmp_path / "edit.blend"), link=True) as (_, linked):
        linked.scenes = ["Scene"]
    (scene,) = linked.scenes
    assert_read(scene, scene.sequence_editor.strips[0])


@pytest.mark.parametrize("kind", ["MOVIE", "IMAGE"])
def test_when_they_are_read(bpy, edit, built, tmp_path, kind):
    strip = built(kind)
    first = proxy_of(edit, strip, 50)
    assert first == proxy_of(edit, strip, 50)
    assert proxy_of(edit, strip, 25) is None  # not to be built
    strip.proxy.build_25 = True
    assert proxy_of(edit, strip, 25) is None  # not there
    strip.use_proxy = False
    assert proxy_of(edit, strip, 50) is None
    strip.use_proxy = True
    edit.sequencer_colorspace_settings.name = "Linear Rec.709"
    assert (proxy_of(edit, strip, 50) is None) == (kind == "IMAGE")
    edit.sequencer_colorspace_settings.name = "sRGB"
    strip.proxy.quality = 20
    with sequencer(bpy):
        bpy.ops.sequencer.rebuild_proxy()
    assert proxy_of(edit, strip, 50) not in (None, first)
    for file in (file for file in tmp_path.rglob("BL_proxy/**/*") if file.is_file()):
        file.unlink()
    assert not proxied(edit, strip).from_proxy


@pytest.mark.parametrize(
    ("name", "samples", "space"),
    [
        ("f.png", "uint8", "Non-Color"),
        ("f.png", "uint8", "Linear Rec.709"),
        ("f.png", "uint16", "Filmic sRGB"),
        ("f.tif", "uint16", "sRGB"),
        ("f.exr", "half", "Linear Rec.709"),
        ("f.exr", "float", "ACEScg"),
        ("f.exr", "half", "Non-Color"),
    ],
)
@pytest.mark.parametrize("divisor", [1, 2])
def test_samples_of_images(bpy, edit, tmp_path, name, samples, space, divisor):
    """Whatever Blender makes of them, it is the footage's light; brighter than white too, where that has it."""
    picture = np.full((HEIGHT, WIDTH, 3), 0.25, np.float32)
    picture[:, WIDTH // 2 :] = 3.0 if name == "f.exr" else 0.6
    image = OpenImageIO.ImageBuf(picture)
    image.set_write_format(samples)
    image.write(str(tmp_path / name))
    strip = edit.sequence_editor.strips.new_image("image", str(tmp_path / name), 1, 1)
    strip.colorspace_settings.name = space
    strip.select = strip.use_proxy = strip.proxy.build_50 = True
    strip.proxy.quality = 95
    with sequencer(bpy):
        bpy.ops.sequencer.rebuild_proxy()
    spec, proxy = source_media.spec(strip), source_media.proxy_of(edit, strip, 50)
    with spec.open(divisor, proxy) as source, spec.open(divisor) as footage:
        assert source.from_proxy
        ours, own = source.read(0), footage.read(0)
    assert (ours.dtype, ours.shape) == (own.dtype, own.shape)
    places = (5, 5, -6), (5, -6, 5)
    np.testing.assert_allclose(ours[places].astype(float), own[places].astype(float), rtol=0.02)
