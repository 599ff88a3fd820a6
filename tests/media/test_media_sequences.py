"""Image sequences: which file an index means, and the samples as the files hold them."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from footage import number, picture, save_image, save_parts, see_through

from shutter_addon.media import MediaError, open_source, sequence
from shutter_addon.media.sequence import by_number, numbered_alike

STRAIGHT = {"oiio__UnassociatedAlpha": 1}


def numbered(folder, names):
    for n, name in enumerate(names):
        save_image(folder / name, picture(n))
    return folder / names[0]


def shown(source):
    return [number(source.read(index)) for index in range(source.count)]


@pytest.mark.parametrize(
    ("names", "numbers"),
    [
        (["a_001.png", "a_002.png", "a_003.png"], [0, 1, 2]),
        (["7.png", "8.png", "9.png", "10.png"], [0, 1, 2, 3]),
        (["s2_t3_09v.tif", "s2_t3_10v.tif", "s2_t4_10v.tif", "s3_t3_10v.tif"], [0, 1]),
        (["x-0998.png", "x-0999.png", "x-1000.png"], [0, 1, 2]),
        (["a.1.png", "b.2.png", "a.2.jpg", "a.2.png"], [0, 3]),
        (["still.png", "still1.png"], [0]),
    ],
)
def test_files_are_found_by_number(tmp_path, names, numbers):
    with open_source(numbered(tmp_path, names)) as source:
        assert shown(source) == numbers
        assert source.count == len(numbers)
        assert source.fps is None


def test_a_file_by_its_number():
    names = [("a_09.png", 1, "a_10.png"), ("s2_t3_09v.tif", 91, "s2_t3_100v.tif"), ("7.jp2", 1, "8.jp2")]
    names += [("x-0100.png", -1, "x-0099.png"), ("two\nlines_1.png", 1, "two\nlines_2.png")]
    for name, frame, wanted in names:
        assert by_number(Path("folder 1", name))(frame) == Path("folder 1", wanted)
    assert by_number(Path("folder 1", "still.jp2")) is None


@pytest.mark.parametrize(
    "names",
    [
        ["sc02_tk05_0001_v3.png", "sc02_tk05_0002_v3.png", "sc02_tk05_0004_v3.png"],
        ["sc02_0001_v3.png", "sc02_0002_v3.png", "sc02_0003_v3.png", "sc02_0001_v4.png", "sc02_0002_v4.png"],
        ["0009_1920x1080.png", "0010_1920x1080.png", "0011_1920x1080.png"],
        ["cam1_0001.png", "cam1_0002.png", "cam1_0003.png", *(f"cam{n}_0001.png" for n in range(2, 9))],
        ["shot_v001.png", "shot_v002.png", "shot_v003.png"],
        ["a1_v0001.png", "a1_v0002.png", "a1_v0003.png", "a2_v0001.png"],
    ],
)
def test_the_number_that_varies_is_the_frame_number(tmp_path, names):
    first = numbered(tmp_path, names)
    with open_source(first) as source:
        assert list(dict.fromkeys(source.files)) == [tmp_path / name for name in names[:3]]
    assert by_number(first, listed=True)(1) == tmp_path / names[1]
    assert numbered_alike(first) == [tmp_path / name for name in names[:3]]


def test_gap_holds_the_file_before(tmp_path):
    first = numbered(tmp_path, ["a_03.png", "a_04.png", "a_07.png", "a_09.png"])
    with open_source(first) as source:
        assert shown(source) == [0, 1, 1, 1, 2, 2, 3]
    with open_source(tmp_path / "a_07.png") as source:  # a sequence starts with the file given
        assert shown(source) == [2, 2, 3]


@pytest.mark.parametrize("stray", ["a_0106.png", f"a_{10**59 + 7}.png"])
def test_a_number_far_off_belongs_to_another_sequence(tmp_path, stray):
    first = numbered(tmp_path, ["a_0003.png", "a_0004.png", stray])
    told = f"a_0003.png: the sequence ends with a_0004.png; too many numbers lie before {stray}"
    with open_source(first) as source:
        assert (source.files, source.left_out) == ([first, tmp_path / "a_0004.png"], told)
    numbered(tmp_path, ["a_0003.png", "a_0004.png", "a_0105.png"])  # after the widest gap
    with open_source(first) as source:
        assert (source.files[101], source.files[102]) == (tmp_path / "a_0004.png", tmp_path / "a_0105.png")


def test_no_longer_than_blender_counts(tmp_path, monkeypatch):
    monkeypatch.setattr(sequence, "LONGEST", 1000)
    first = numbered(tmp_path, ["a_0.png", *(f"a_{number}.png" for number in range(100, 1200, 100))])
    with open_source(first) as source:
        assert source.count == 901
        assert source.left_out.endswith("too many numbers lie before a_1000.png")


def test_listed_files_are_frames_by_place(tmp_path):
    numbered(tmp_path, ["a_03.png", "a_04.png", "b.png"])
    files = ["b.png", "a_03.png", "a_03.png", tmp_path / "a_04.png"]
    for path in (tmp_path, tmp_path / "b.png"):
        with open_source(path, files=files) as source:
            assert shown(source) == [2, 0, 0, 1]


def test_data_windows_that_differ(tmp_path):
    for n, size in enumerate([(128, 64), (100, 40)]):
        save_image(tmp_path / f"a_{n}.exr", picture(n, *size) / 255, "half", at=(n, n), display=(0, 0, 160, 90))
    sentence = r"^a_1\.exr: is 100×40 \(its data window\), but a_0\.exr is 128×64$"
    with open_source(tmp_path / "a_0.exr") as source, pytest.raises(MediaError, match=sentence):
        source.read(1)


@pytest.mark.parametrize("alphas", [(1, 0, 0), (0, 0, 1), (0, 1, 0), (0, 0, 0)])
@pytest.mark.parametrize("colours", [1, 3])
@pytest.mark.parametrize("suffix", [".png", ".tif", ".exr"])
def test_one_file_with_alpha_among_others(tmp_path, suffix, colours, alphas):
    for n, alpha in enumerate(alphas):
        channels = [*range(colours), 3][: colours + alpha]
        names = {"names": ["RGBA"[i] if colours == 3 else "YYYA"[i] for i in channels]} if suffix == ".exr" else {}
        kind = "half" if suffix == ".exr" else "uint8"
        save_image(tmp_path / f"a_{n}{suffix}", see_through(n)[..., channels] / np.float32(255), kind, **names)
    with open_source(tmp_path / f"a_0{suffix}") as source:
        assert source.alpha == ("opaque" if not any(alphas) else "premultiplied" if suffix == ".exr" else "straight")
        top = np.iinfo(source.dtype).max if source.dtype.kind == "u" else 1
        for n, alpha in enumerate(alphas):
            stored = see_through(n)[..., 3] / 255 if alpha else 1
            assert np.abs(source.read(n)[..., 3] / top - stored).max() < 0.001


def test_a_file_that_gets_alpha(tmp_path):
    """What was found out of a file holds as long as the file is the same."""
    first = numbered(tmp_path, ["a_0.png", "a_1.png", "a_2.png"])
    assert open_source(first).alpha == "opaque"
    save_image(tmp_path / "a_1.png", see_through(1), **STRAIGHT)
    assert open_source(first).alpha == "straight"


@pytest.mark.parametrize(
    ("names", "wanted"),
    [
        (["R", "G", "B", "A", "Z"], [0, 1, 2, 3]),
        (["V.Normal.X", *(f"V.{layer}.{c}" for layer in ("Glow", "Combined") for c in "RGB")], [4, 5, 6]),
        (["Z", "mask.Y"], [1]),
        (["l.R", "l.G", "l.B", "l.A", "R", "G", "B"], [4, 5, 6]),
        (["b.R", "b.G", "b.B", "b.A", "a.R", "a.G", "a.B"], [4, 5, 6]),
        (["Normal.X", "Normal.Y", "Normal.Z", "mask.Y"], [0, 1, 2]),
    ],
)
def test_layers_with_colours_are_chosen(tmp_path, names, wanted):
    stored = np.linspace(0, 1, len(names)).astype(np.float16) * np.ones((4, 6, 1), np.float16)
    with open_source(save_image(tmp_path / "a.exr", stored, "half", names=names)) as source:
        pixel = source.read(0)[2, 3]
    expected = [stored[0, 0, i] for i in wanted]
    assert list(pixel[:3]) == (expected * 3 if len(wanted) == 1 else expected[:3])
    assert pixel[3] == (expected[3] if len(wanted) == 4 else 1)


def test_parts_are_searched_for_colours(tmp_path):
    depth, colour = (np.full((8, 8, count), value, np.float32) for count, value in ((1, 9), (3, 0.25)))
    path = save_parts(tmp_path / "a.exr", (depth, ["Z"], ["half"]), (colour, ["R", "G", "B"], ["half"] * 3))
    with open_source(path) as source:
        assert list(source.read(0)[4, 4]) == [0.25, 0.25, 0.25, 1]


def test_palette_becomes_rgba(tmp_path):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">2I5B", 2, 1, 8, 3, 0, 0, 0)  # 2 × 1 pixels with a palette of red and half clear green
    chunks = {b"IHDR": header, b"PLTE": b"\xff\0\0\0\xff\0", b"tRNS": b"\xff\x80", b"IDAT": zlib.compress(b"\0\0\1")}
    data = b"".join(chunk(name, data) for name, data in {**chunks, b"IEND": b""}.items())
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + data)
    with open_source(tmp_path / "a.png") as source:
        assert source.read(0).tolist() == [[[255, 0, 0, 255], [0, 255, 0, 128]]]


def test_an_unknown_colour_space(tmp_path, blender_config):
    path = save_image(tmp_path / "a.png", picture(0))
    with pytest.raises(MediaError, match=r"^a.png: unknown colour space Nonsense$"):
        open_source(path, colorspace="Nonsense", config=blender_config)
