"""A still-frame shutter reproduces the source: bit for bit at 8 bits, for every frame of a real film."""

import av
import numpy as np
import OpenImageIO
import pytest
from support import effect_of, image_strip, recipe


@pytest.fixture
def still_on(edit):
    """An edit of a movie under a still-frame effect, in the movie's size; gives the effect's strip."""

    def make(path):
        source = edit.sequence_editor.strips.new_movie("movie", str(path), 1, 1)
        strip, _effect = effect_of(edit, source, recipe(16, np.eye(16)[0]))
        size = strip.scene.render
        edit.render.resolution_x, edit.render.resolution_y = size.resolution_x, size.resolution_y
        return strip

    return make


def test_frames_of_big_buck_bunny_in_random_order(edit, render, bunny, still_on):
    strip = still_on(bunny)
    source = next(s for s in edit.sequence_editor.strips if s.type == "MOVIE")
    frames = range(1, 133, 19)
    strip.mute, source.mute = True, False
    plain = render(edit, frames)
    strip.mute, source.mute = False, True  # or Blender would decode below the effect, and seek as well
    for frame in (int(frame) for frame in np.random.default_rng(0).permutation(frames)):
        assert np.array_equal(render(edit, [frame])[frame], plain[frame]), f"frame {frame}"


TAGGED = {
    "bt601": ("yuv420p", 5, 1),
    "bt709": ("yuv420p", 1, 1),
    "full range": ("yuv420p", 1, 2),
    "4:4:4": ("yuv444p", 6, 1),
    "10 bit": ("yuv420p10le", 1, 1),
    "10 bit full range": ("yuv422p10le", 5, 2),
}


@pytest.mark.parametrize("kind", TAGGED)
def test_tagged_files(edit, render, tmp_path, still_on, kind, same_pixels):
    pixels, matrix, color_range = TAGGED[kind]
    path = tmp_path / "tagged.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25, options={"qp": "0"})
        stream.width, stream.height, stream.pix_fmt = 64, 48, pixels
        stream.codec_context.colorspace, stream.codec_context.color_range = matrix, color_range
        rng = np.random.default_rng(0)
        for _ in range(3):
            small = rng.integers(0, 256, (12, 16, 3), dtype=np.uint8).repeat(4, 0).repeat(4, 1)
            frame = av.VideoFrame.from_ndarray(small, format="rgb24")
            frame = frame.reformat(format=pixels, dst_colorspace=matrix, dst_color_range=color_range)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    strip = still_on(path)
    shown = render(edit, [2, 1], "16")
    strip.mute = True
    plain = render(edit, [1, 2], "16")
    for frame in (1, 2):
        same_pixels(shown[frame], plain[frame], 1)
        assert plain[frame][..., :3].std() > 20


IMAGES = {
    "8 bit": ("a.png", "uint8", 3),
    "16 bit with alpha": ("a.png", "uint16", 4),
    "jpeg": ("a.jpg", "uint8", 3),
    "tiff": ("a.tif", "uint16", 3),
    "float tiff": ("a.tif", "float", 3),
    "dpx": ("a.dpx", "uint16", 3),
    "half exr with alpha": ("a.exr", "half", 4),
    "float exr": ("a.exr", "float", 3),
    "grey": ("a.png", "uint8", 1),
}


@pytest.mark.parametrize("kind", IMAGES)
def test_images(edit, render, tmp_path, kind, same_pixels):
    """Every format, with Blender's own idea of its color space and alpha; two steps of the window each way."""
    name, samples, channels = IMAGES[kind]
    rng = np.random.default_rng(0)
    for i in (1, 2, 3):
        pixels = rng.random((24, 32, channels), dtype=np.float32)
        if channels == 4:
            pixels[..., :-1] *= pixels[..., -1:]
        image = OpenImageIO.ImageBuf(pixels)
        image.set_write_format(samples)
        assert image.write(str(tmp_path / f"{i}{name}")), image.geterror()
    source = image_strip(edit, tmp_path / f"1{name}")
    edit.render.resolution_x, edit.render.resolution_y = 32, 24
    plain = render(edit, [1, 2, 3], "16")
    effect_of(edit, source, recipe(2, [1, 0]))
    shown = render(edit, [3, 1, 2], "16")
    for frame in (1, 2, 3):
        solid = plain[frame][..., 3] > 25  # of less, straight colors are mostly rounding
        same_pixels(shown[frame][solid][None], plain[frame][solid][None], 1)
        same_pixels(shown[frame][..., 3:], plain[frame][..., 3:], 1)
        assert plain[frame][..., 0].std() > 20
