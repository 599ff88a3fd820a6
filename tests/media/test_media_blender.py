"""Frames as Blender itself shows them in a plain strip, of movies and of image sequences. test_own_decoding.py has
Blender decode movies whose times and order of frames are odd."""

import numpy as np
import pytest
from blender_pictures import blender
from footage import make_movie, movies_of_every_matrix, picture, save_image, see_through, tagged_movies
from footage import tags as tagged

from shutter_addon.media import open_source

RGB, RGBA = picture(5) / np.float32(255), see_through(5) / np.float32(255)
STRAIGHT = {"oiio__UnassociatedAlpha": 1}
ASSOCIATED = np.dstack([RGBA[..., :3] * RGBA[..., 3:], RGBA[..., 3]])
LAYERS = np.dstack([RGB / 2, ASSOCIATED])
FIRST_LAYER = [*(f"a.{c}" for c in "RGB"), *(f"z.Combined.{c}" for c in "RGBA")]

# By how many 255ths frames of these movies may differ; of others, by none.
ROUNDED = dict.fromkeys(
    ("ten_bits.mp4", "bt2020.mkv", "prores.mov", "rgb48.mkv", "turned_deep.mp4", "blur_deep.mkv"), 0.7
)
ROUNDED |= dict.fromkeys(("alpha.mov", "alpha_png.mov", "alpha.webm", "blur_alpha.mov"), 0.7)
# Blender's PNG holds straight 8 bits: coarse where alpha is low.
ROUNDED |= {"alpha_deep.mov": 1.5, "alpha_prores.mov": 1.5}


def images(folder):
    for name, array, samples, more in [
        *(("rgb8.png", RGB, "uint8", {}), ("rgb16.png", RGB, "uint16", {}), ("gray.png", RGB[..., :1], "uint8", {})),
        *(("rgba8.png", RGBA, "uint8", STRAIGHT), ("rgba16.png", RGBA, "uint16", STRAIGHT)),
        ("gray_alpha.png", RGBA[..., [0, 3]], "uint8", STRAIGHT),
        *(("rgb.jpg", RGB, "uint8", {}), ("turned.jpg", RGB, "uint8", {"Orientation": 6})),
        *(("rgb8.tif", RGB, "uint8", {}), ("turned.tif", RGB, "uint8", {"Orientation": 6})),
        *(("rgba8.tif", RGBA, "uint8", STRAIGHT), ("associated8.tif", ASSOCIATED, "uint8", {})),
        *(("rgb16.tif", RGB, "uint16", {}), ("associated16.tif", ASSOCIATED, "uint16", {})),
        *(("float.tif", RGB, "float", {}), ("float_alpha.tif", RGBA, "float", STRAIGHT)),
        ("ten_bits.dpx", RGB, "uint16", {"oiio__BitsPerSample": 10}),
        ("log.dpx", RGB, "uint16", {"oiio__BitsPerSample": 10, "dpx__Transfer": "Printing density"}),
        *(("half.exr", RGB, "half", {}), ("float_alpha.exr", ASSOCIATED, "float", {})),
        ("gray.exr", RGB[..., :1], "half", {}),
        ("layers.exr", np.dstack([RGB / 2, RGB]), "half", {"names": ["l.R", "l.G", "l.B", "R", "G", "B"]}),
        ("render.exr", ASSOCIATED, "half", {"names": [f"ViewLayer.Combined.{c}" for c in "RGBA"]}),
        *(("radiance.hdr", RGB, "float", {}), ("targa.tga", RGBA, "uint8", {}), ("bitmap.bmp", RGB, "uint8", {})),
        *(
            ("web.webp", RGB, "uint8", {}),
            ("two.tga", RGBA[..., [0, 3]], "uint8", {}),
            ("clear.bmp", RGBA, "uint8", {}),
        ),
        ("inside.exr", RGB, "half", {"at": (10, 6), "display": (0, 0, 160, 90)}),
        ("inside_alpha.exr", ASSOCIATED, "half", {"at": (10, 6), "display": (0, 0, 160, 90)}),
        ("outside.exr", ASSOCIATED, "half", {"at": (-10, -6), "display": (0, 0, 64, 32)}),
        ("across.exr", RGB, "half", {"at": (40, -20), "display": (0, 0, 128, 64)}),
        ("across_alpha.exr", ASSOCIATED, "half", {"at": (-40, 20), "display": (-10, 0, 128, 64)}),
        ("beside.exr", ASSOCIATED, "half", {"at": (300, 0), "display": (0, 0, 200, 200)}),
        ("placed.tif", RGB, "uint8", {"at": (5, 7), "display": (0, 0, 200, 100)}),
        ("unnamed.tif", RGBA, "uint8", {"names": ["R", "G", "B", "unknown"], "alpha": -1}),
        *(("clear.webp", RGBA, "uint8", STRAIGHT), ("clear.jp2", RGBA, "uint8", STRAIGHT)),
        *(("plain.jp2", RGB, "uint16", {}), ("plain.sgi", RGB, "uint16", {}), ("clear.sgi", RGBA, "uint8", {})),
        ("pair.exr", ASSOCIATED[..., [0, 3]], "half", {"names": ["Y", "A"]}),
        ("whole.exr", RGB, "uint", {}),
        ("plain_layer.exr", LAYERS, "half", {"names": [*"RGB", *(f"l.{c}" for c in "RGBA")]}),
        ("first_layer.exr", LAYERS, "half", {"names": FIRST_LAYER}),
        ("no_combined.exr", LAYERS, "half", {"names": [f"V.{name}" for name in FIRST_LAYER]}),
        ("xyz.exr", RGB, "half", {"names": [*"XYZ"]}),
    ]:
        yield name, save_image(folder / name, array, samples, **more)


@pytest.fixture(scope="module")
def compared(tmp_path_factory, coloured, deinterlaced, bunny, blender_config):
    """compared(name): (a source, what Blender says of the file and shows). compared.most: the names, and the largest
    error of each. One Blender session renders all."""
    folder = tmp_path_factory.mktemp("blender")
    files, options, jobs, largest = {}, {}, {}, {}

    def job(name, path, frames, source=None, most=None, **more):
        files[name], largest[name] = path, most or ROUNDED.get(name, 0.01)
        jobs[name] = {"files": [str(path)], "frames": frames, **more}
        options[name] = {"files": None if "movie" in more else [path], **(source or {})}

    job("bunny", bunny, [0, 60, 131], movie=True)
    for name, path in coloured.items():
        job(name, path, [0, 2], movie=True)
    for name, path in movies_of_every_matrix(folder):
        job(name, path, [2], movie=True)
    for name, path in tagged_movies(folder):
        job(name, path, [2], most=0.7, movie=True)
    for name, path in deinterlaced.items():
        job(name, path, [0, 1], {"deinterlace": True}, movie=True, deinterlace=True)
    for name, path in images(folder):
        job(name, path, [0], most=0.05, depth="16")
    alpha = {"alpha": "straight"}
    job("straight.exr", folder / "float_alpha.exr", [0], alpha, most=0.05, depth="16", alpha_mode="STRAIGHT")
    alpha = {"alpha": "premultiplied"}
    job("premultiplied.png", folder / "rgba8.png", [0], alpha, most=0.7, depth="16", alpha_mode="PREMUL")
    for name, curve, space in (("pq.mkv", 16, "Rec.2100-PQ"), ("hlg.mkv", 18, "Rec.2100-HLG")):
        more = {"pix_fmt": "yuv420p10le", "tags": tagged(9, 1, curve, 9)}
        path = make_movie(folder / name, "ffv1", 2, **more)  # Blender tells the space from the tags
        job(name, path, [1], {"colorspace": space, "config": blender_config}, most=0.7, movie=True, depth="16")
    for name, file, space in [
        ("log.png", "rgb16.png", "ARRI LogC4"),
        ("filmic.png", "rgb8.png", "Filmic sRGB"),
        ("linear.png", "rgb8.png", "Linear Rec.709"),
        ("acescg.exr", "float_alpha.exr", "ACEScg"),
    ]:
        more = {"colorspace": space, "config": blender_config}
        job(name, folder / file, [0], more, most=0.05, depth="16", colorspace=space)

    shown = blender(folder, jobs)

    def compared(name):
        return open_source(files[name], **options[name]), shown[name]

    compared.most = largest
    return compared


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


def test_frames_are_those_that_blender_shows(compared):
    wrong = {}
    for name, most in compared.most.items():
        source, shown = compared(name)
        assert [source.width, source.height, source.count] == [*shown["size"], shown["count"]], name
        pictures = shown["pictures"].items()
        error = max(np.abs(displayed(source.read(index), source) - theirs).max() for index, theirs in pictures)
        wrong |= {name: error * 255} if error * 255 >= most else {}
    assert wrong == {}
