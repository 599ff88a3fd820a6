"""Every frame as Blender itself shows it in a plain strip, for movies and for image sequences."""

import numpy as np
import pytest
from blender_pictures import blender
from footage import (
    TAGGED,
    TAGS,
    make_movie,
    movies_of_every_matrix,
    picture,
    save_image,
    see_through,
    tagged_movies,
    tags,
)

from shutter_addon.media import open_source

RGB, RGBA = picture(5) / np.float32(255), see_through(5) / np.float32(255)
STRAIGHT = {"oiio__UnassociatedAlpha": 1}
ASSOCIATED = np.dstack([RGBA[..., :3] * RGBA[..., 3:], RGBA[..., 3]])
LAYERS = np.dstack([RGB / 2, ASSOCIATED])
FIRST_LAYER = [*(f"a.{c}" for c in "RGB"), *(f"z.Combined.{c}" for c in "RGBA")]

EXACT = (
    "b_frames.mp4 open.mkv open.mp4 open.ts hevc.mp4 refresh.mp4 mpeg4.avi mpeg4.mp4 mpeg2.mpg mpeg2.ts "
    "vp9.webm ntsc.mov film.mp4 variable.mkv variable.mp4 sound.mkv animation.gif edit_list.mp4 late.mp4 "
    "late.mkv no_key_first.ts no_index.avi bunny bt709.mp4 bt601.mp4 full_range.mp4 jpeg_range.mp4 yuv444.mp4 "
    "mjpeg.avi rgb.mkv gray.mkv odd.avi turned_90.mp4 turned_180.mp4 turned_270.mp4 fields_420.avi "
    "fields_422.mkv fields_444.mp4 blur_size.avi blur_rgb.mkv "
    "stamped.mkv set_back.mkv pairs.mkv one_time.mkv"
)
ROUNDED = (
    "ten_bits.mp4 bt2020.mkv prores.mov rgb48.mkv turned_deep.mp4 blur_deep.mkv alpha.mov alpha_png.mov "
    "alpha.webm blur_alpha.mov pq.mkv hlg.mkv premultiplied.png"
)
IMAGES = (
    "rgb8.png rgba8.png rgb16.png rgba16.png gray.png gray_alpha.png rgb.jpg turned.jpg rgb8.tif "
    "turned.tif rgba8.tif associated8.tif rgb16.tif associated16.tif float.tif float_alpha.tif "
    "ten_bits.dpx log.dpx half.exr float_alpha.exr gray.exr layers.exr render.exr radiance.hdr targa.tga "
    "bitmap.bmp web.webp straight.exr log.png acescg.exr filmic.png linear.png "
    "inside.exr inside_alpha.exr outside.exr across.exr across_alpha.exr beside.exr placed.tif unnamed.tif two.tga "
    "clear.bmp clear.webp plain.jp2 clear.jp2 plain.sgi clear.sgi pair.exr "
    "whole.exr plain_layer.exr first_layer.exr no_combined.exr xyz.exr"
)


def images(folder):
    """Images in many formats."""
    for name, array, samples, more in [
        ("rgb8.png", RGB, "uint8", {}),
        ("rgba8.png", RGBA, "uint8", STRAIGHT),
        ("rgb16.png", RGB, "uint16", {}),
        ("rgba16.png", RGBA, "uint16", STRAIGHT),
        ("gray.png", RGB[..., :1], "uint8", {}),
        ("gray_alpha.png", RGBA[..., [0, 3]], "uint8", STRAIGHT),
        ("rgb.jpg", RGB, "uint8", {}),
        ("turned.jpg", RGB, "uint8", {"Orientation": 6}),
        ("rgb8.tif", RGB, "uint8", {}),
        ("turned.tif", RGB, "uint8", {"Orientation": 6}),
        ("rgba8.tif", RGBA, "uint8", STRAIGHT),
        ("associated8.tif", ASSOCIATED, "uint8", {}),
        ("rgb16.tif", RGB, "uint16", {}),
        ("associated16.tif", ASSOCIATED, "uint16", {}),
        ("float.tif", RGB, "float", {}),
        ("float_alpha.tif", RGBA, "float", STRAIGHT),
        ("ten_bits.dpx", RGB, "uint16", {"oiio__BitsPerSample": 10}),
        ("log.dpx", RGB, "uint16", {"oiio__BitsPerSample": 10, "dpx__Transfer": "Printing density"}),
        ("half.exr", RGB, "half", {}),
        ("float_alpha.exr", ASSOCIATED, "float", {}),
        ("gray.exr", RGB[..., :1], "half", {}),
        ("layers.exr", np.dstack([RGB / 2, RGB]), "half", {"names": ["l.R", "l.G", "l.B", "R", "G", "B"]}),
        ("render.exr", ASSOCIATED, "half", {"names": [f"ViewLayer.Combined.{c}" for c in "RGBA"]}),
        ("radiance.hdr", RGB, "float", {}),
        ("targa.tga", RGBA, "uint8", {}),
        ("bitmap.bmp", RGB, "uint8", {}),
        ("web.webp", RGB, "uint8", {}),
        ("inside.exr", RGB, "half", {"at": (10, 6), "display": (0, 0, 160, 90)}),
        ("inside_alpha.exr", ASSOCIATED, "half", {"at": (10, 6), "display": (0, 0, 160, 90)}),
        ("outside.exr", ASSOCIATED, "half", {"at": (-10, -6), "display": (0, 0, 64, 32)}),
        ("across.exr", RGB, "half", {"at": (40, -20), "display": (0, 0, 128, 64)}),
        ("across_alpha.exr", ASSOCIATED, "half", {"at": (-40, 20), "display": (-10, 0, 128, 64)}),
        ("beside.exr", ASSOCIATED, "half", {"at": (300, 0), "display": (0, 0, 200, 200)}),
        ("placed.tif", RGB, "uint8", {"at": (5, 7), "display": (0, 0, 200, 100)}),
        ("unnamed.tif", RGBA, "uint8", {"names": ["R", "G", "B", "unknown"], "alpha": -1}),
        ("two.tga", RGBA[..., [0, 3]], "uint8", {}),
        ("clear.bmp", RGBA, "uint8", {}),
        ("clear.webp", RGBA, "uint8", STRAIGHT),
        ("plain.jp2", RGB, "uint16", {}),
        ("clear.jp2", RGBA, "uint8", STRAIGHT),
        ("plain.sgi", RGB, "uint16", {}),
        ("clear.sgi", RGBA, "uint8", {}),
        ("pair.exr", ASSOCIATED[..., [0, 3]], "half", {"names": ["Y", "A"]}),
        ("whole.exr", RGB, "uint", {}),
        ("plain_layer.exr", LAYERS, "half", {"names": [*"RGB", *(f"l.{c}" for c in "RGBA")]}),
        ("first_layer.exr", LAYERS, "half", {"names": FIRST_LAYER}),
        ("no_combined.exr", LAYERS, "half", {"names": [f"V.{name}" for name in FIRST_LAYER]}),
        ("xyz.exr", RGB, "half", {"names": [*"XYZ"]}),
    ]:
        yield name, save_image(folder / name, array, samples, **more)


@pytest.fixture(scope="module")
def compared(tmp_path_factory, movies, coloured, deinterlaced, bunny, blender_config):
    """compared(name): (a source, what Blender says of the file and shows). One Blender session renders all."""
    folder = tmp_path_factory.mktemp("blender")
    files, options, jobs = {}, {}, {}

    def job(name, path, frames, source=None, **more):
        files[name] = path
        jobs[name] = {"files": [str(path)], "frames": frames, **more}
        options[name] = {"files": None if "movie" in more else [path], **(source or {})}

    for name, (path, _) in movies.items():
        job(name, path, list(range(open_source(path).count)), movie=True)
    job("bunny", bunny, [0, 1, 60, 131], movie=True)
    for name, path in coloured.items():
        job(name, path, [0, 2], movie=True)
    for name, path in (*tagged_movies(folder), *movies_of_every_matrix(folder)):
        job(name, path, [0, 2], movie=True)
    for name, path in deinterlaced.items():
        job(name, path, [0, 1], {"deinterlace": True}, movie=True, deinterlace=True)
    for name, path in images(folder):
        job(name, path, [0], depth="16")
    alpha = {"alpha": "straight"}
    job("straight.exr", folder / "float_alpha.exr", [0], alpha, depth="16", alpha_mode="STRAIGHT")
    alpha = {"alpha": "premultiplied"}
    job("premultiplied.png", folder / "rgba8.png", [0], alpha, depth="16", alpha_mode="PREMUL")
    for name, curve, space in (("pq.mkv", 16, "Rec.2100-PQ"), ("hlg.mkv", 18, "Rec.2100-HLG")):
        more = {"pix_fmt": "yuv420p10le", "tags": tags(9, 1, curve, 9)}
        path = make_movie(folder / name, "ffv1", 2, **more)  # Blender tells the space from the tags
        job(name, path, [1], {"colorspace": space, "config": blender_config}, movie=True, depth="16")
    for name, file, space in [
        ("log.png", "rgb16.png", "ARRI LogC4"),
        ("filmic.png", "rgb8.png", "Filmic sRGB"),
        ("linear.png", "rgb8.png", "Linear Rec.709"),
        ("acescg.exr", "float_alpha.exr", "ACEScg"),
    ]:
        job(
            name,
            folder / file,
            [0],
            {"colorspace": space, "config": blender_config},
            depth="16",
            colorspace=space,
        )

    shown = blender(folder, jobs)
    return lambda name: (open_source(files[name], **options[name]), shown[name])


def displayed(frame, source):
    """The frame in display values 0…1 with associated alpha, as the view transform Standard shows it."""
    frame = frame / np.float64(np.iinfo(frame.dtype).max if frame.dtype.kind == "u" else 1)
    colour, alpha = frame[..., :3], frame[..., 3:]
    if source.alpha == "premultiplied":
        colour = np.divide(colour, alpha, out=np.zeros_like(colour), where=alpha > 0)
    if source.transfer == "linear":
        curve = 1.055 * np.maximum(colour, 0.0031308) ** (1 / 2.4) - 0.055
        colour = np.where(colour <= 0.0031308, colour * 12.92, curve)
    return np.dstack([np.clip(colour, 0, 1) * alpha, alpha])


def largest_error(compared, name):
    """In 255ths, over all frames that Blender rendered."""
    source, shown = compared(name)
    assert [source.width, source.height] == shown["size"]
    assert source.count == shown["count"]
    errors = [
        np.abs(displayed(source.read(index), source) - theirs).max() * 255
        for index, theirs in shown["pictures"].items()
    ]
    return max(errors)


@pytest.mark.parametrize("name", EXACT.split())
def test_8_bit_movies_are_blenders_bit_for_bit(compared, name):
    assert largest_error(compared, name) < 0.01


@pytest.mark.parametrize(
    "name",
    ROUNDED.split(),
)
def test_others_differ_by_rounding_only(compared, name):
    assert largest_error(compared, name) < 0.7


@pytest.mark.parametrize("tags", TAGS)
@pytest.mark.parametrize("ending", TAGGED)
def test_colours_are_those_that_blender_takes_from_the_file(compared, tags, ending):
    assert largest_error(compared, f"{tags}.{ending}") < 0.7


@pytest.mark.parametrize("space", range(16))
def test_every_matrix_is_blenders(compared, space):
    assert largest_error(compared, f"matrix_{space}.ts") < 0.01


@pytest.mark.parametrize("name", ["alpha_deep.mov", "alpha_prores.mov"])
def test_deep_alpha_is_taken_for_premultiplied(compared, name):
    assert largest_error(compared, name) < 1.5  # Blender's PNG holds straight 8 bits: coarse where alpha is low


@pytest.mark.parametrize(
    "name",
    IMAGES.split(),
)
def test_images_are_blenders(compared, name):
    assert largest_error(compared, name) < 0.05


@pytest.mark.parametrize("name", ["b_frames.mp4", "ntsc.mov", "film.mp4", "variable.mkv"])
def test_rate_is_blenders(compared, name):
    source, shown = compared(name)
    assert float(source.fps) == pytest.approx(shown["fps"], rel=1e-6)


def test_comparison_sees_one_level(compared):
    """A picture one level brighter than Blender's does not pass for equal."""
    source, shown = compared("rgb.mkv")
    frame = source.read(0).copy()
    frame[40, 50, 1] ^= 1
    assert np.abs(displayed(frame, source) - shown["pictures"][0]).max() * 255 == pytest.approx(1, abs=0.01)
