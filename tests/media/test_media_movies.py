"""Movies: which frame an index means, in any order."""

import random
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest
from footage import COUNT, HEIGHT, WIDTH, cut_file, damage_frame, make_movie, number, picture

from shutter_addon.media import open_source

UGLY = (
    "b_frames.mp4 open.mkv open.mp4 open.ts hevc.mp4 refresh.mp4 mpeg4.avi mpeg4.mp4 mpeg2.mpg mpeg2.ts "
    "vp9.webm ntsc.mov film.mp4 variable.mkv variable.mp4 sound.mkv animation.gif edit_list.mp4 late.mp4 "
    "late.mkv fields.mkv no_key_first.ts no_index.avi stamped.mkv set_back.mkv pairs.mkv"
)
NAMES = UGLY.split()
ROOT = Path(__file__).parents[2]


def all_frames(source):
    return [source.read(i) for i in range(source.count)]


@pytest.mark.parametrize("name", NAMES)
def test_index_means_frame_on_screen(movies, name):
    path, numbers = movies[name]
    with open_source(path) as source:
        shown = [number(frame) for frame in all_frames(source)]
    assert shown == sorted(shown) or name in ("stamped.mkv", "set_back.mkv")
    assert numbers is None or shown == numbers


@pytest.mark.parametrize("name", NAMES)
def test_any_order_gives_the_same_frames(movies, name):
    with open_source(movies[name][0]) as source:
        frames = all_frames(source)
        order = 2 * list(range(source.count))
        random.Random(name).shuffle(order)
        wrong = [i for i in [*order, *reversed(range(source.count))] if not np.array_equal(source.read(i), frames[i])]
    assert wrong == []


@pytest.mark.parametrize("name", NAMES)
def test_first_read_may_be_any_frame(movies, name):
    with open_source(movies[name][0]) as source:
        frames = all_frames(source)
    for index in (1, source.count // 2, source.count - 1):
        with open_source(movies[name][0]) as source:
            assert np.array_equal(source.read(index), frames[index])


def test_every_ugly_movie_is_tested(movies):
    shown_as_blender_does = ["one_time.mkv"]  # one of its frames, see test_media_blender.py
    assert sorted(movies) == sorted([*NAMES, *shown_as_blender_does])


def test_footage_is_as_ugly_as_it_claims(movies):
    """Open groups that lean on the group before, a variable rate, a shifted start, a start inside a group."""
    with av.open(str(movies["open.mkv"][0])) as movie:
        packets = [p for p in movie.demux(video=0) if p.size]
        keys = [i for i, p in enumerate(packets) if p.is_keyframe]
        assert any(packets[i + 1].pts < packets[i].pts for i in keys[1:])
    with av.open(str(movies["edit_list.mp4"][0])) as movie:
        assert next(movie.demux(video=0)).is_discard
    with av.open(str(movies["late.mp4"][0])) as movie:
        assert movie.streams.video[0].start_time > 0
    with av.open(str(movies["no_key_first.ts"][0])) as movie:
        assert not next(movie.demux(video=0)).is_keyframe
    with av.open(str(movies["no_index.avi"][0])) as movie:
        assert len(movie.streams.video[0].index_entries) < COUNT


def test_onwards_neither_seeks_nor_decodes_twice(bunny, read_through):
    with open_source(bunny) as source:
        for index in range(40):
            source.read(index)
    read_through(40)


def test_memory_stays_bounded(bunny):
    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

    with open_source(bunny) as source:
        for index in range(10):
            source.read(index)
        before = resident()
        for index in range(10, 130):
            source.read(index)
        assert resident() - before < 60 * source.read(0).nbytes  # 120 kept ones would be twice that


def test_arrays_belong_to_the_caller(movies):
    with open_source(movies["b_frames.mp4"][0]) as source:
        first, kept = source.read(3), source.read(3).copy()
        second = source.read(4)
        assert np.array_equal(first, kept)
        first[:] = 7
        assert np.array_equal(source.read(3), kept)
        assert not np.array_equal(second, kept)
        assert first.flags.c_contiguous
        assert first.flags.writeable
        assert first.shape == (HEIGHT, WIDTH, 4)


def test_what_a_movie_says_of_itself(movies, bunny):
    with open_source(movies["ntsc.mov"][0]) as source:
        assert (source.width, source.height, source.count) == (WIDTH, HEIGHT, COUNT)
        assert source.fps * 1001 == 30000
        assert (source.dtype, source.transfer, source.alpha) == (np.uint8, "srgb", "opaque")
    with open_source(bunny) as source:
        assert (source.width, source.height, source.count, source.fps) == (1280, 720, 132, 25)


@pytest.mark.parametrize("size", [(1, 1), (33, 17), (2, 2), (130, 66)])
@pytest.mark.parametrize("pix_fmt", ["yuv420p", "yuv444p", "yuv420p10le"])
def test_odd_sizes(tmp_path, size, pix_fmt):
    width, height = size
    arrays = [np.full((height, width, 3), 40 * n, np.uint8) for n in range(5)]
    path = make_movie(tmp_path / "odd.mkv", "ffv1", pix_fmt=pix_fmt, size=size, pictures=arrays)
    with open_source(path) as source:
        frames = all_frames(source)
        top = np.iinfo(source.dtype).max
    for array, frame in zip(arrays, frames, strict=True):
        assert frame.shape == (height, width, 4)
        assert np.abs(frame[..., :3] / top - array / 255).max() < 2 / 255
        assert (frame[..., 3] == top).all()


def test_deep_movies_keep_their_depth(tmp_path):
    levels = np.linspace(0, 65535, WIDTH * HEIGHT).astype(np.uint16).reshape(HEIGHT, WIDTH, 1).repeat(3, axis=2)
    arrays = [levels, levels // 2]
    path = make_movie(tmp_path / "deep.mkv", "ffv1", pix_fmt="rgb48le", pictures=arrays, array_format="rgb48le")
    with open_source(path) as source:
        assert source.dtype == np.uint16
        assert np.abs(source.read(0)[..., :3].astype(int) - levels).max() <= 1
        assert len(np.unique(source.read(1)[..., 0])) > 2000


def test_streams_are_counted_without_cover_pictures(tmp_path):
    path = tmp_path / "two.mkv"
    with av.open(str(path), "w") as out:
        streams = [out.add_stream("ffv1", rate=25) for _ in range(2)]
        for stream in streams:
            stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for n in range(4):
            for offset, stream in enumerate(streams):
                frame = av.VideoFrame.from_ndarray(picture(n + 100 * offset), format="rgb24")
                frame.pts = n
                out.mux(stream.encode(frame.reformat(format="yuv420p")))
        for stream in streams:
            out.mux(stream.encode())
    assert number(open_source(path).read(2)) == 2
    assert number(open_source(path, stream=1).read(2)) == 102


THREADS = """
import gc, sys
from pathlib import Path
from shutter_addon.media import PrefetchSource, MediaError, open_source
gc.disable()

def threads():
    return len(list(Path("/proc/self/task").iterdir()))

def use(path):
    try:
        with PrefetchSource(open_source(path)) as ahead, open_source(path) as source:
            for index in (0, source.count - 1, 9, 2):
                try:
                    ahead.read(index), source.read(index)
                except MediaError:
                    pass
    except MediaError:
        pass

use(sys.argv[1])
before = threads()
for _ in range(6):
    for path in sys.argv[1:]:
        use(path)
print(threads() - before)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_threads_end_when_a_movie_is_closed(movies, bunny, tmp_path):
    """Without the garbage collector; of sound movies, of damaged ones, and of one that cannot be opened."""
    whole = movies["b_frames.mp4"][0]
    bad = damage_frame(whole, tmp_path / "damaged.mp4", 9), cut_file(whole, tmp_path / "cut.mp4", 0.5)
    paths = bunny, whole, movies["open.mkv"][0], movies["vp9.webm"][0], *bad
    command = [sys.executable, "-c", THREADS, *map(str, paths)]
    assert subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout == "0\n"
