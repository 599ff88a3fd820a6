"""Movies: which frame an index means, in any order."""

import gc
import random
import sys
from contextlib import suppress
from pathlib import Path

import av
import numpy as np
import pytest
from footage import HEIGHT, WIDTH, cut_file, damage_frame, make_movie, number, picture

from shutter_addon.media import MediaError, PrefetchSource, open_source


def test_index_means_frame_on_screen_in_any_order(movies):
    for name, (path, numbers) in movies.items():
        with open_source(path) as source:
            frames = [source.read(index) for index in range(source.count)]
            shown = [number(frame) for frame in frames]
            assert shown == sorted(shown) or name in ("stamped.mkv", "set_back.mkv"), name
            assert numbers is None or shown == numbers, name
            order = list(range(source.count))
            random.Random(name).shuffle(order)
            for index in [*order, *reversed(range(source.count)[-15:])]:
                assert np.array_equal(source.read(index), frames[index]), (name, index)
        for index in {0, source.count // 2, source.count - 1}:
            with open_source(path) as source:
                assert np.array_equal(source.read(index), frames[index]), (name, index)


def test_onwards_neither_seeks_nor_decodes_twice(bunny, monkeypatch):
    packets, seeks, opens = [], [], av.open

    class Movie:
        def __init__(self, *given, **options):
            self.container = opens(*given, **options)

        def __getattr__(self, name):
            return getattr(self.container, name)

        def demux(self):
            for packet in self.container.demux():
                if packet.size and packet.stream.type == "video":
                    packets.append(packet.pos)
                yield packet

        def seek(self, *given, **options):
            seeks.append(given)
            self.container.seek(*given, **options)

    monkeypatch.setattr(av, "open", Movie)
    with open_source(bunny) as source:
        for index in range(40):
            source.read(index)
    assert seeks == []
    assert len(set(packets)) == len(packets)
    ahead = 2 + 16 + 16  # the shown one and the next one, those out of order, and those of a decoder's threads
    assert 40 <= len(packets) <= 40 + ahead


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


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_threads_end_when_a_movie_is_closed(movies, tmp_path):
    """Without the garbage collector; of sound movies, of damaged ones, and of one that cannot be opened."""
    whole = movies["b_frames.mp4"][0]
    bad = damage_frame(whole, tmp_path / "damaged.mp4", 9), cut_file(whole, tmp_path / "cut.mp4", 0.5)

    def use(path):
        with suppress(MediaError), PrefetchSource(open_source(path)) as ahead, open_source(path) as source:
            for index in (0, source.count - 1, 9, 2):
                for each in (ahead, source):
                    with suppress(MediaError):
                        each.read(index)

    def threads():
        return len(list(Path("/proc/self/task").iterdir()))

    use(whole)
    gc.disable()
    try:
        before = threads()
        for path in 3 * [whole, movies["open.mkv"][0], movies["vp9.webm"][0], *bad]:
            use(path)
        assert threads() <= before
    finally:
        gc.enable()
