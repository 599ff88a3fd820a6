"""Footage read from proxies: which may stand for it, and what is read where they do not."""

import numpy as np
import OpenImageIO
import pytest
from footage import COUNT, HEIGHT, WIDTH, cut_file, damage_frame, make_movie, number, picture, rotate_movie, see_through

from shutter_addon.media import open_source
from shutter_addon.media.opening import with_proxy

CLEAR = {"pix_fmt": "argb", "pictures": [see_through(n) for n in range(COUNT)], "array_format": "rgba"}


def other_pictures(count=COUNT, size=(WIDTH, HEIGHT)):
    """The numbered pictures with numbers of another hundred, to tell a proxy's from the footage's."""
    return [picture(100 + n, WIDTH, HEIGHT)[:: HEIGHT // size[1], :: WIDTH // size[0]] for n in range(count)]


def proxy_movie(path, count=COUNT, size=(WIDTH, HEIGHT), **options):
    return make_movie(path, "mpeg4", pictures=other_pictures(count, size), size=size, **options)


@pytest.fixture(scope="module")
def footage(tmp_path_factory):
    return make_movie(tmp_path_factory.mktemp("footage") / "footage.mp4", "mpeg4")


def shown(source, indices):
    frames = [source.read(index) for index in indices]
    assert {frame.shape for frame in frames} == {(source.height, source.width, 4)}
    assert {frame.dtype for frame in frames} == {source.dtype}
    return [number(frame.repeat(WIDTH // source.width, 0).repeat(WIDTH // source.width, 1)) for frame in frames]


@pytest.mark.parametrize("size", [(WIDTH, HEIGHT), (WIDTH // 2, HEIGHT // 2), (WIDTH // 4, HEIGHT // 4)])
@pytest.mark.parametrize("divisor", [1, 2, 4])
def test_frames_are_the_proxys_in_the_footages_size(footage, tmp_path, size, divisor):
    path = proxy_movie(tmp_path / "proxy.avi", size=size)
    with with_proxy(open_source(footage, divisor=divisor), path) as source:
        assert source.from_proxy
        assert (source.width, source.height) == (WIDTH // divisor, HEIGHT // divisor)
        assert (source.path, source.count) == (footage, COUNT)
        assert shown(source, (0, 7, COUNT - 1, 3)) == [100, 107, 99 + COUNT, 103]


def test_samples_are_the_footages(tmp_path):
    """Of deep movies; tests/blender/test_proxies.py has images."""
    deep = make_movie(tmp_path / "deep.mkv", "ffv1", pix_fmt="yuv420p10le")
    path = proxy_movie(tmp_path / "proxy.avi")
    with with_proxy(open_source(deep), path) as source, open_source(path) as proxy:
        assert (source.from_proxy, source.dtype) == (True, np.uint16)
        assert np.array_equal(source.read(5), proxy.read(5).astype(np.uint16) * 257)


def test_one_that_does_not_fit_is_not_read(footage, tmp_path):
    proxy = proxy_movie(tmp_path / "proxy.mp4")
    clear = make_movie(tmp_path / "clear.mov", "qtrle", **CLEAR)
    (tmp_path / "text.avi").write_text("no movie")
    deep = make_movie(tmp_path / "deep.mkv", "ffv1", pix_fmt="yuv420p10le")
    lengths = [proxy_movie(tmp_path / f"{count}.avi", count) for count in (COUNT - 1, COUNT + 1)]
    changed = cut_file(proxy, tmp_path / "cut.mp4", 0.5), rotate_movie(proxy, tmp_path / "turned.mp4", 90)
    for path in (tmp_path / "missing.avi", tmp_path / "text.avi", tmp_path, *lengths, *changed, clear, deep):
        with with_proxy(open_source(footage, divisor=2), path) as source:
            assert not source.from_proxy, path.name
            assert shown(source, (0, 7)) == [0, 7], path.name
    with with_proxy(open_source(clear), proxy) as source:
        assert not source.from_proxy  # what is seen through is lost in it


def test_a_damaged_frame_is_the_footages(footage, tmp_path):
    whole = make_movie(tmp_path / "whole.mkv", "mjpeg", pix_fmt="yuvj420p", pictures=other_pictures())
    with with_proxy(open_source(footage, divisor=2), damage_frame(whole, tmp_path / "damaged.mkv", 9)) as source:
        assert shown(source, range(7, 12)) == [107, 108, 9, 110, 111]
    folder = tmp_path / "images"
    folder.mkdir()
    for n, pixels in enumerate(other_pictures(3)):
        OpenImageIO.ImageBuf(picture(n)).write(str(tmp_path / f"f{n}.png"))
        OpenImageIO.ImageBuf(np.ascontiguousarray(pixels)).write(str(folder / f"f{n}.jpg"))
    (folder / "f1.jpg").unlink()
    (folder / "f2.jpg").write_bytes(b"\xff\xd8 no picture")
    images = open_source(tmp_path / "f0.png")
    with with_proxy(images, folder, files=[folder / f"f{n}.jpg" for n in range(3)]) as source:
        assert shown(source, range(3)) == [100, 1, 2]
