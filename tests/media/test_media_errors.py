"""Bad input: one clear sentence that names the file, and whatever is sound can still be read."""

import contextlib
import faulthandler
import os
import re
import shutil
import struct
import zlib

import numpy as np
import pytest
from footage import COUNT, cut_file, damage_frame, make_movie, movies_that_cannot_be_opened, number, picture, save_image

from shutter_addon.media import MediaError, open_source
from shutter_addon.media.image_writing import write_exr
from shutter_addon.media.sequence import IMAGE_SUFFIXES


def sentence(path, longest=150, **options):
    with pytest.raises(MediaError) as caught:
        open_source(path, **options)
    text = str(caught.value)
    assert "\n" not in text
    assert len(text) < longest
    return text


def readable(source):
    """{index: number shown} of the frames that can be read, and {index: sentence} of the others."""
    good, bad = {}, {}
    for index in range(source.count):
        try:
            good[index] = number(source.read(index))
        except MediaError as error:
            bad[index] = str(error)
    return good, bad


OTHER = "is no file, but a pipe, a socket or a device"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes by name")
def test_a_pipe_or_a_device(tmp_path, request):
    """A hang ends all tests: libraries that wait for a pipe wait on after a signal."""
    faulthandler.dump_traceback_later(60, exit=True)
    request.addfinalizer(faulthandler.cancel_dump_traceback_later)
    for name in ("clip.mp4", "frame_1.png"):
        os.mkfifo(tmp_path / name)
        assert sentence(tmp_path / name) == f"{name}: {OTHER}"
        (tmp_path / name).unlink()
        (tmp_path / name).symlink_to("/dev/zero")
        assert sentence(tmp_path / name) == f"{name}: {OTHER}"


def test_not_media(tmp_path):
    for name in ("clip.mp4", "frame.png", "notes.txt"):
        (tmp_path / name).write_text("This is a text, not a picture. " * 40)
        pattern = rf"{name}: (no video stream|cannot be read as (a movie|an image) \(.+\))$"
        assert re.match(pattern, sentence(tmp_path / name))


def test_movies_that_cannot_be_opened(tmp_path, movies):
    for told, path in movies_that_cannot_be_opened(tmp_path, movies):
        assert sentence(path) == f"{path.name}: {told}"
    assert sentence(movies["open.mp4"][0], stream=1) == "open.mp4: no video stream 1, it has 1"


@pytest.mark.parametrize(
    ("suffix", "codec", "least", "options"),  # least: hardly fewer frames than a decoder without threads gives
    [
        ("mp4", "libx264", 40, {"mux": {"movflags": "faststart"}, "options": {"bf": "3", "g": "12"}}),
        ("mkv", "libx264", 48, {"options": {"bf": "3", "g": "12"}}),
        ("avi", "mpeg4", 30, {"options": {"bf": "2", "g": "12"}}),
        ("mov", "qtrle", 55, {"pix_fmt": "rgb24", "mux": {"movflags": "faststart"}}),
    ],
)
def test_cut_off_movie_keeps_what_it_has(tmp_path, suffix, codec, least, options):
    whole = make_movie(tmp_path / f"whole.{suffix}", codec, 100, **options)
    with open_source(whole) as source, open_source(cut_file(whole, tmp_path / f"cut.{suffix}", 0.6)) as cut:
        expected, none = readable(source)
        good, bad = readable(cut)
        assert none == {}
        assert good == readable(cut)[0] == {index: expected[index] for index in good}
    assert len(good) >= least
    assert bad
    for index, text in bad.items():
        assert re.match(rf"frame {index} of cut\.{suffix} cannot be decoded: (the file is cut off|its data are)", text)


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt", "options"),
    [
        ("a.mov", "png", "rgb24", {}),
        ("a.avi", "mjpeg", "yuvj420p", {}),
        ("a.mp4", "libx264", "yuv420p", {"g": "1", "preset": "ultrafast"}),
        ("a.mkv", "ffv1", "yuv420p", {"g": "1", "slicecrc": "1"}),
    ],
)
def test_damaged_frame_in_the_middle(tmp_path, name, codec, pix_fmt, options):
    whole = make_movie(tmp_path / f"whole_{name}", codec, 30, pix_fmt=pix_fmt, options=options)
    with open_source(damage_frame(whole, tmp_path / name, 17)) as source:
        good, bad = readable(source)
    assert list(bad) == [17]
    assert re.match(rf"frame 17 of {name} cannot be decoded: its data are damaged", bad[17])
    assert good == {n: n for n in range(30) if n != 17}


def test_damaged_frame_leaves_other_groups_alone(tmp_path, movies):
    """A damaged P frame of H.264 spoils its group at most; the groups before and after are as they were."""
    path = damage_frame(movies["b_frames.mp4"][0], tmp_path / "a.mp4", 13)
    with open_source(movies["b_frames.mp4"][0]) as sound, open_source(path) as source:
        for index in [*range(12), *range(24, COUNT)]:
            assert np.array_equal(source.read(index), sound.read(index)), index
        for index in (-1, COUNT):
            with pytest.raises(IndexError, match=rf"frame {index} of a\.mp4: it has frames 0 to {COUNT - 1}"):
                source.read(index)


def test_unlike_frames_of_a_sequence(tmp_path):
    for n in range(5):
        save_image(tmp_path / f"a_{n}.png", picture(n))
    save_image(tmp_path / "a_1.png", picture(1, 64, 64))
    save_image(tmp_path / "a_2.png", picture(2) / 255, "uint16")
    cut_file(tmp_path / "a_3.png", tmp_path / "a_3.png", 0.5)
    with open_source(tmp_path / "a_0.png") as source:
        (tmp_path / "a_4.png").unlink()
        good, bad = readable(source)
    assert good == {0: 0}
    assert bad[1] == "a_1.png: is 64×64, but a_0.png is 128×64"
    assert bad[2] == "a_2.png: has uint16 samples, but a_0.png has uint8"
    assert re.match(r"a_3\.png: cannot be (decoded|read as an image) \(.+\)$", bad[3])
    assert bad[4] == f"a_4.png: no such file in {tmp_path}"


def test_images_that_blender_does_not_read(tmp_path):
    text = "an image of a kind that Blender does not read; save it as PNG, TIFF or EXR first"
    for name in ("a.jxl", "a.ppm", "a.gif"):
        path = save_image(tmp_path / name, picture(5))
        if name != "a.gif":  # which is a movie as well
            assert sentence(path) == f"{name}: {text}"
        assert sentence(tmp_path, files=[name]) == f"{name}: {text}"
        path.rename(tmp_path / "a.png")
        assert sentence(tmp_path / "a.png") == f"a.png: {text}"
    for name in ("a.ppm", "a%d.ppm", "a.jls"):  # which FFmpeg knows by their names alone
        (tmp_path / name).write_bytes(b"P6 4 4 255 " + bytes(4 * 4 * 3))
        assert sentence(tmp_path / name) == f"{name}: {text}"


def test_images_without_colours_or_files(tmp_path):
    path = save_image(tmp_path / "z.exr", np.ones((4, 4, 2), np.float32), "half", names=["Z", "depth.V"])
    assert re.match(r"z\.exr: no colour channels, only (Z, depth\.V|depth\.V, Z)$", sentence(path))
    assert sentence(tmp_path, files=[]) == f"{tmp_path.name}: an image sequence without files"


WRITABLE = sorted(IMAGE_SUFFIXES - {".cin", ".psd", ".rgba", ".bw", ".j2c", ".jpe", ".jpeg", ".tiff", ".rgbe"})


def test_noise_by_the_name_of_an_image(tmp_path):
    for suffix in IMAGE_SUFFIXES:
        (tmp_path / f"a{suffix}").write_bytes(np.random.default_rng(0).bytes(5000))
        told = sentence(tmp_path / f"a{suffix}", 200)
        assert re.match(rf"a\{suffix}: cannot be read as an image \(.{{12,}}\)$", told)


@pytest.mark.parametrize("suffix", WRITABLE)
def test_damaged_images(tmp_path, suffix):
    """Cut off anywhere, bits flipped anywhere, most of them in the header: a picture, or a sentence."""
    rng, path, told = np.random.default_rng(0), tmp_path / f"a{suffix}", []
    whole = save_image(tmp_path / f"whole{suffix}", picture(5)).read_bytes()
    for turn in range(60):
        data = bytearray(whole)
        if turn % 3 == 0:
            del data[rng.integers(1, len(data)) :]
        else:
            for place in rng.integers(0, len(data) if turn % 3 == 1 else min(512, len(data)), 3):
                data[place] ^= 1 << rng.integers(8)
        path.write_bytes(data)
        try:
            with open_source(path) as source:
                source.read(0)
        except MediaError as error:
            told.append(str(error))
    assert len(told) > 2
    assert all(re.match(rf"a\{suffix}: .*[^ :(]\)?$", text) for text in told)


def png(width, height):
    header = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    chunks = {b"IHDR": header, b"IDAT": zlib.compress(b"\0\0\0\0"), b"IEND": b""}
    data = [struct.pack(">I", len(d)) + n + d + struct.pack(">I", zlib.crc32(n + d)) for n, d in chunks.items()]
    return b"\x89PNG\r\n\x1a\n" + b"".join(data)


def tga(width, height):
    return struct.pack("<3B5x4H2B", 0, 0, 2, 0, 0, width, height, 24, 0)


def hdr(width, height):
    return f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode()


@pytest.mark.parametrize("header", [png, tga, hdr])
def test_images_of_absurd_size(tmp_path, header):
    path = tmp_path / f"a.{header.__name__}"
    path.write_bytes(header(60000, 60000) + bytes(100))
    told = rf"{path.name}: (60000×60000 are too many pixels|cannot be read as an image \(.+\)$)"
    assert re.match(told, sentence(path))
    path.write_bytes(header(16000, 16000) + bytes(100))
    with pytest.raises(MediaError, match=rf"^{re.escape(path.name)}: cannot be (decoded|read as an image) \(.+\)$"):
        open_source(path).read(0)


def test_damaged_image_whose_fault_is_no_text(tmp_path):
    """OpenEXR quotes what it finds."""
    path = save_image(tmp_path / "a.exr", picture(5) / 255, "half")
    data = path.read_bytes()
    for name in (b"compression\0compression", b"channels\0chlist", b"R\0", b"dataWindow\0box2i"):
        assert name in data
        path.write_bytes(data.replace(name, b"\xff\xfe" + name[2:] if len(name) > 2 else b"\xff\0", 1))
        with contextlib.suppress(MediaError):
            open_source(path).read(0)


@pytest.mark.skipif(os.name != "posix", reason="names are bytes on POSIX systems only")
def test_names_that_are_not_utf8(tmp_path):
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    folder.mkdir()
    image, movie = save_image(tmp_path / "a_1.png", picture(5)), make_movie(tmp_path / "m.mp4", "mpeg4", 3)
    for place in (folder / "a", tmp_path / os.fsdecode(b"\xff")):
        with open_source(shutil.copy(movie, f"{place}.mp4")) as source:
            assert number(source.read(2)) == 2
        text = sentence(shutil.copy(image, f"{place}_1.png"), longest=200)
        assert text.isprintable()
        assert text.endswith("its path is not UTF-8; rename the file, or the folder that is not")
    with pytest.raises(MediaError, match="its path is not UTF-8"):
        write_exr(folder / "a.exr", np.zeros((4, 4, 1), np.float32), ["Y"])


@pytest.mark.parametrize("name", ["open.mp4", "open.ts"])
def test_file_that_vanishes_and_comes_back(tmp_path, movies, name):
    path = tmp_path / name
    path.write_bytes(movies[name][0].read_bytes())
    with open_source(path) as source:
        expected = source.read(30)
        source.close()
        path.rename(tmp_path / "elsewhere")
        for index in (3, 30):
            with pytest.raises(MediaError, match=rf"frame {index} of {name} cannot be decoded: no such file"):
                source.read(index)
        (tmp_path / "elsewhere").rename(path)
        assert np.array_equal(source.read(30), expected)


VALUES = np.random.default_rng(1).random((40, 60, 2), np.float32)


@pytest.mark.parametrize("planted", [".0001.part.exr", "0001.exr"])
def test_nothing_is_written_through_a_link(tmp_path, planted):
    (tmp_path / "others").write_text("others'")
    (tmp_path / planted).symlink_to("others")
    write_exr(tmp_path / "0001.exr", VALUES, ["S1", "S2"])
    assert (tmp_path / "others").read_text() == "others'"
    assert not (tmp_path / "0001.exr").is_symlink()


@pytest.mark.parametrize("place", ["none/0001.exr", "file/0001.exr", "folder.exr"])
def test_what_cannot_be_written_is_one_sentence(tmp_path, place):
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder.exr").mkdir()
    with pytest.raises(MediaError, match="cannot be written") as raised:
        write_exr(tmp_path / place, VALUES, ["S1", "S2"])
    assert str(raised.value).startswith(str(tmp_path / place))
    assert {path.name for path in tmp_path.iterdir()} == {"file", "folder.exr"}
