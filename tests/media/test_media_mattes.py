"""Mattes in files: the values of every kind of channel, against what was written; one sentence where there are none."""

import struct

import numpy as np
import pytest
from footage import make_movie, save_image, save_parts

from shutter_addon.media import MediaError, open_source
from shutter_addon.media.image_writing import write_exr
from shutter_addon.media.opening import MatteFile

LEVEL = 1 / 255
SIZE = WIDTH, HEIGHT = 36, 20
REC709 = 0.2126, 0.7152, 0.0722
STRAIGHT = {"oiio__UnassociatedAlpha": 1}
TOPS = {"uint8": 255, "uint16": 65535}


def noise(channels=1, seed=0, size=SIZE):
    """(height, width, channels) float64 of 0 … 1, with both ends."""
    values = np.random.default_rng(seed).random((size[1], size[0], channels))
    values.flat[:2] = 0, 1
    return values


def stored(values, kind):
    if kind in TOPS:
        samples = np.rint(values * TOPS[kind]).astype(kind)
        return samples, samples / TOPS[kind]
    samples = values.astype({"half": np.float16, "float": np.float32}[kind])
    return samples, samples.astype(np.float64)


def values_of(path, channel="luminance", index=0, **options):
    with MatteFile(path, channel, **options).open() as matte:
        values = matte.read(index)
        assert values.shape == (matte.height, matte.width)
    assert values.dtype == np.float32
    assert values.flags.c_contiguous
    assert values.flags.writeable
    return values


def sentence(path, channel="luminance", **options):
    with pytest.raises(MediaError) as caught:
        MatteFile(path, channel, **options).open()
    text = str(caught.value)
    assert "\n" not in text
    assert path.name in text
    return text


KINDS = [("png", "uint8"), ("png", "uint16"), ("tif", "uint8"), ("tif", "uint16"), ("tif", "float")]
KINDS += [("exr", "half"), ("exr", "float")]


@pytest.mark.parametrize(("suffix", "kind"), [*KINDS, ("bmp", "uint8")])
def test_a_grey_file_is_its_grey(tmp_path, suffix, kind):
    samples, expected = stored(noise(), kind)
    names = {"names": ["Y"]} if suffix == "exr" else {}
    path = save_image(tmp_path / f"a.{suffix}", samples, kind, **names)
    for channel in ("luminance", "red", "green", "blue"):
        assert np.abs(values_of(path, channel) - expected[..., 0]).max() < 1e-7
    assert (values_of(path, "alpha") == 1).all()


@pytest.mark.parametrize("alpha", [False, True])
@pytest.mark.parametrize(("suffix", "kind"), KINDS)
def test_the_channels_of_colours(tmp_path, suffix, kind, alpha):
    samples, expected = stored(noise(3 + alpha), kind)
    path = save_image(tmp_path / f"a.{suffix}", samples, kind, **STRAIGHT)
    for i, channel in enumerate(("red", "green", "blue")):
        assert np.abs(values_of(path, channel) - expected[..., i]).max() < 1e-7
    assert np.abs(values_of(path) - expected[..., :3] @ REC709).max() < 1e-6
    assert np.abs(values_of(path, "alpha") - (expected[..., 3] if alpha else 1)).max() < 1e-7


def test_values_are_clamped_and_numbers(tmp_path):
    odd = np.array([-3, -np.inf, np.nan, np.inf, 7, 0.25, 1, -0.0], np.float32)
    expected = [0, 0, 0, 1, 1, 0.25, 1, 0]
    for kind in ("half", "float"):
        grey = save_image(tmp_path / "a.exr", odd.reshape(1, -1, 1), kind, names=["Y"])
        assert values_of(grey)[0].tolist() == expected
        colours = save_image(tmp_path / "b.exr", np.tile(odd[:, None], 3)[None], kind)
        assert np.abs(values_of(colours)[0] - expected).max() < 1e-6


def test_a_channel_by_its_name(tmp_path):
    names = ["A", "B", "G", "R", "Sharp", "ViewLayer.IndexOB.X", "alpha.R"]
    values = noise(len(names)).astype(np.float32)
    path = save_image(tmp_path / "a.exr", values, "float", names=names)
    for name, place in (*((name, names.index(name)) for name in names[4:]), ("red", 3)):
        assert np.array_equal(values_of(path, name), values[..., place])


@pytest.mark.parametrize("names", [["red", "alpha"], ["R", "G", "B", "red", "alpha"]])
def test_coefficients_of_shutters_that_are_called_as_colours_are(tmp_path, names):
    values = noise(len(names)).astype(np.float32)
    write_exr(tmp_path / "0001.exr", values, names)
    for name in ("red", "alpha"):
        assert np.array_equal(values_of(tmp_path / "0001.exr", name), values[..., names.index(name)])


def test_a_channel_of_another_part(tmp_path):
    """The first part that has it; whole numbers stand for themselves."""
    values = noise(1).astype(np.float32)
    objects, nothing = (values > 0.5).astype(np.float32), np.zeros_like(values)
    colours = nothing.repeat(3, 2), ["R", "G", "B"], ["half"] * 3
    both = np.dstack([objects, values]), ["id", "m"], ["uint", "float"]
    path = save_parts(tmp_path / "a.exr", colours, both, (nothing, ["m"], ["half"]))
    assert np.array_equal(values_of(path, "m"), values[..., 0])
    assert np.array_equal(values_of(path, "id"), objects[..., 0])


@pytest.mark.parametrize(
    ("at", "display"),
    [((5, 7), (2, 3, 39, 24)), ((-9, -4), (0, 0, 100, 60)), ((90, 50), (0, 0, 100, 60)), ((300, 0), (0, 0, 20, 20))],
)
def test_a_cropped_exr_lies_in_its_display_window(tmp_path, at, display):
    values = noise(1).astype(np.float32)
    path = save_image(tmp_path / "a.exr", values, "float", at=at, display=display, names=["m"])
    expected = np.zeros((display[3], display[2]))
    for y, x in np.ndindex(expected.shape):
        row, column = y + display[1] - at[1], x + display[0] - at[0]
        if 0 <= row < HEIGHT and 0 <= column < WIDTH:
            expected[y, x] = values[row, column, 0]
    assert np.array_equal(values_of(path, "m"), expected)
    # A larger data window is the picture, as of footage, in Blender as well.
    path = save_image(tmp_path / "a.exr", values, "float", at=(-2, -2), display=(0, 0, 20, 10), names=["m"])
    assert np.array_equal(values_of(path, "m"), values[..., 0])


def test_data_windows_may_differ(tmp_path):
    for n, size in enumerate([(20, 10), (8, 5)]):
        at = n + 1, n
        save_image(tmp_path / f"m_{n}.exr", noise(size=size), "float", at=at, display=(0, 0, 30, 16), names=["m"])
    values = values_of(tmp_path / "m_0.exr", "m", 1)
    assert np.abs(values[1:6, 2:10] - noise(size=(8, 5))[..., 0]).max() < 1e-6
    assert np.count_nonzero(values) <= 40


def test_frames_of_a_sequence(tmp_path):
    """A gap holds the file before; so do the first and the last one, before and behind."""
    for place, number in enumerate((3, 4, 7, 8)):
        save_image(tmp_path / f"m_{number:03}.png", np.full((8, 8, 1), place, np.uint8))
    with MatteFile(tmp_path / "m_003.png").open() as matte:
        assert (matte.width, matte.height, matte.count) == (8, 8, 6)
        found = [round(matte.read(index)[0, 0] * 255) for index in (-100, -1, 0, 1, 2, 3, 4, 5, 6, 100)]
        assert found == [0, 0, 0, 1, 1, 1, 2, 3, 3, 3]


MOVIES = [  # codec, suffix, format, bits, full range, the tag (1: limited, 2: full)
    ("ffv1", "mkv", "gray", 8, True, None),
    ("ffv1", "mkv", "gray10le", 10, True, None),
    ("ffv1", "mkv", "yuv420p", 8, False, None),
    ("ffv1", "mkv", "yuv420p10le", 10, False, None),
    ("ffv1", "mkv", "yuv420p10le", 10, True, 2),
    ("libx264", "mp4", "yuv420p", 8, False, 1),
    ("libx264", "mp4", "yuv420p", 8, True, 2),
]


@pytest.mark.parametrize("off", [0, 1])
@pytest.mark.parametrize(("codec", "suffix", "pix_fmt", "bits", "full", "tag"), MOVIES)
def test_the_range_of_a_movie_is_expanded(tmp_path, codec, suffix, pix_fmt, bits, full, tag, off):
    """off: by how much its chroma is, as some coders leave it."""
    scale, kind = 1 << (bits - 8), np.uint8 if bits == 8 else np.uint16
    codes = np.linspace(0, 256 * scale - 1, WIDTH * HEIGHT).astype(kind).reshape(HEIGHT, WIDTH)  # all code values
    expected = codes / (256 * scale - 1) if full else ((codes / scale - 16) / 219).clip(0, 1)
    # The bytes as PyAV takes them: luma, then what belongs to two chroma planes of a quarter each.
    chroma = np.full((0 if pix_fmt.startswith("gray") else HEIGHT // 2, WIDTH), (128 + off) * scale, kind)
    frame = np.concatenate([codes, chroma])
    tags = {"color_range": tag} if tag else {}
    options = {"qp": "0"} if codec == "libx264" else {}
    formats = {"pix_fmt": pix_fmt, "array_format": pix_fmt}
    path = tmp_path / f"a.{suffix}"
    make_movie(path, codec, pictures=[frame] * 2, size=SIZE, options=options, tags=tags, **formats)
    with MatteFile(path).open() as matte, open_source(path) as source:
        values, rgba = matte.read(1), source.read(1)
        assert matte.count == 2
    rgb = rgba[..., :3] / np.iinfo(rgba.dtype).max
    assert np.abs(values - expected).max() < (1.6 if off else 0.51 if bits == 8 else 0.1) * LEVEL
    assert np.abs(values - rgb @ REC709).max() < (0.01 if bits == 8 else 1) * LEVEL


@pytest.mark.parametrize("colorspace", [1, 5])
@pytest.mark.parametrize("pix_fmt", ["yuv420p", "yuv444p10le", "bgr0", "gbrp10le"])
def test_the_channels_of_a_coloured_movie(tmp_path, pix_fmt, colorspace):
    """Those of the RGB that footage has; with another matrix than Rec.709's, luma is not the luminance."""
    frames = [np.rint(noise(3, seed) * 255).astype(np.uint8) for seed in range(2)]
    tags = {"colorspace": colorspace} if pix_fmt.startswith("yuv") else {}
    path = make_movie(tmp_path / "a.mkv", "ffv1", pictures=frames, pix_fmt=pix_fmt, size=SIZE, tags=tags)
    with open_source(path) as source:
        rgb = source.read(1)[..., :3] / np.iinfo(source.dtype).max
    for i, channel in enumerate(("red", "green", "blue")):
        assert np.abs(values_of(path, channel, 1) - rgb[..., i]).max() < 1e-6
    assert np.abs(values_of(path, "luminance", 1) - rgb @ REC709).max() < 1e-6
    assert (values_of(path, "alpha") == 1).all()
    if pix_fmt == "bgr0":
        assert np.array_equal(rgb * 255, frames[1])


@pytest.mark.parametrize(("codec", "pix_fmt"), [("png", "rgba"), ("png", "rgba64be"), ("qtrle", "argb")])
def test_the_alpha_of_a_movie(tmp_path, codec, pix_fmt):
    array_format, kind = (pix_fmt, np.uint16) if pix_fmt == "rgba64be" else ("rgba", np.uint8)
    top = np.iinfo(kind).max
    frames = [np.rint(noise(4, seed) * top).astype(kind) for seed in range(2)]
    path = make_movie(tmp_path / "a.mov", codec, pictures=frames, pix_fmt=pix_fmt, array_format=array_format, size=SIZE)
    assert np.abs(values_of(path, "alpha", 1) - frames[1][..., 3] / top).max() < 1e-4
    assert np.abs(values_of(path, "red", 1) - frames[1][..., 0] / top).max() < 1e-4


def test_a_channel_of_another_name(tmp_path, movies):
    layers = [f"layer{n:02}.{channel}" for n in range(4) for channel in "BGR"]
    exr = save_image(tmp_path / "a.exr", noise(12), "half", names=layers)
    told = ", ".join(f"layer{n:02}.{channel}" for n in range(4) for channel in "RGB")
    assert sentence(exr, "Sharp") == f"a.exr: has no channel Sharp, but {told}"
    png = save_image(tmp_path / "a.png", noise(3), "uint8")
    usual = "luminance, red, green, blue, alpha"
    assert sentence(png, "Sharp") == f"a.png: has no channel Sharp, but {usual}"
    assert sentence(movies["b_frames.mp4"][0], "R") == f"b_frames.mp4: has no channel R, but {usual}"
    bare = save_image(tmp_path / "b.exr", noise(2), "half", names=["Long", "Sharp"])
    assert sentence(bare) == "b.exr: no colour channels, only Long, Sharp"


def test_a_channel_that_a_later_frame_lacks(tmp_path):
    for n, name in enumerate(["Sharp", "Soft"]):
        save_image(tmp_path / f"m_{n}.exr", noise(), "half", names=[name])
    lacking = pytest.raises(MediaError, match=r"^m_1\.exr: has no channel Sharp, but Soft$")
    with MatteFile(tmp_path / "m_0.exr", "Sharp").open() as matte, lacking:
        matte.read(1)


def test_a_display_window_of_absurd_size(tmp_path):
    path = save_image(tmp_path / "a.exr", noise(), "half", names=["m"], display=(0, 0, 47, 43))
    data = path.read_bytes()
    window = struct.pack("<4i", 0, 0, 46, 42)
    assert data.count(window) == 1
    path.write_bytes(data.replace(window, struct.pack("<4i", 0, 0, 59_999, 59_999)))
    assert "60000×60000 are too many pixels" in sentence(path, "m") or "cannot be read" in sentence(path, "m")
