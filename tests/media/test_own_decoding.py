"""Movies that a second Blender decodes, beside the same ones by PyAV; and that Blender's life."""

import os
import select
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from fractions import Fraction
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from footage import cut_file, damage_frame, make_movie, movies_that_cannot_be_opened, number, picture, save_image

from shutter_addon.media import MediaError, blender_movie, files, open_source
from shutter_addon.media.blender_movie import BlenderMovie, frame_rate
from shutter_addon.media.opening import MatteFile, movie_channel

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "shutter_addon" / "blender" / "data" / "decoding_process.py"
SAID = ["path", "width", "height", "count", "fps", "dtype", "transfer", "alpha", "options", "has_audio"]
# Levels of 65535: of RGB with 16 bits, Blender's own way to floats loses so many.
DEEP = 33
linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks at processes as Linux shows them")


@pytest.fixture(autouse=True)
def _lent():
    """Blender as a library decodes; one process for all tests that lend no other."""
    if BlenderMovie.decoder.command != [sys.executable, str(SCRIPT)]:
        blender_movie.lend([sys.executable, str(SCRIPT)])


@pytest.fixture(autouse=True, scope="module")
def _ended():
    yield
    blender_movie.lend(None)


def process():
    return BlenderMovie.decoder.process.pid


def assert_same(path, *, deinterlace=False):
    """A movie says the same of itself, and has the same frames, whoever decodes it, also backwards."""
    way = {"deinterlace": deinterlace}
    with open_source(path, **way) as by_pyav, BlenderMovie(path, **way) as by_blender:
        assert {name: getattr(by_blender, name) for name in SAID} == {name: getattr(by_pyav, name) for name in SAID}
        for index in [*range(by_pyav.count), *range(by_pyav.count - 1, -1, -5)]:
            ours, theirs = by_blender.read(index), by_pyav.read(index)
            most = np.abs(ours.astype(int) - theirs).max()
            assert most <= (DEEP if theirs.dtype == np.uint16 else 0), (path.name, index, most)


def test_movies_are_those_that_pyav_decodes(movies, coloured, deinterlaced):
    for path in (*(path for path, _numbers in movies.values()), *coloured.values()):
        assert_same(path)
    for path in deinterlaced.values():
        assert_same(path, deinterlace=True)


def test_many_movies_at_a_time_and_names_of_all_kinds(tmp_path):
    names = ["a b.mp4", "Größe.mp4", "映画 ().mp4", "-x.mp4", "'q'.mp4", "%04d#1.mp4", "10.mp4", "11.mp4"]
    with ExitStack() as opened:
        sources = []
        for place, name in enumerate(names):
            pictures = [picture(20 * place + n) for n in range(3)]
            path = make_movie(tmp_path / name, "libx264", pictures=pictures, options={"qp": "0"})
            sources.append(opened.enter_context(BlenderMovie(path)))
        for index in (0, 1, 2):
            assert [number(source.read(index)) for source in sources] == [20 * n + index for n in range(len(names))]
        with ThreadPoolExecutor(4) as threads:
            first, second = threads.map(lambda source: [number(source.read(n)) for n in (0, 2, 1)], sources[:2])
        assert (first, second) == ([0, 2, 1], [20, 22, 21])


def test_arrays_belong_to_the_caller_and_a_closed_movie_is_read_again(movies):
    source = BlenderMovie(movies["b_frames.mp4"][0])
    first = source.read(3)
    kept = first.copy()
    first[:] = 7
    with BlenderMovie(source.path) as other:
        source.close()
        source.close()
        for index in (1, 2, 3):
            assert np.array_equal(other.read(index), source.read(index))
    assert np.array_equal(source.read(3), kept)
    source.close()


def test_another_file_in_its_place_is_one_sentence(tmp_path):
    path = make_movie(tmp_path / "a.mp4", "libx264", 3)
    with BlenderMovie(path) as source:
        source.close()
        path.write_bytes(make_movie(tmp_path / "b.mp4", "libx264", 3, size=(64, 32)).read_bytes())
        with pytest.raises(MediaError, match=r"^frame 1 of a\.mp4 cannot be decoded: the file is another one now$"):
            source.read(1)
        with pytest.raises(IndexError):
            source.read(3)


def test_hostile_files_are_pictures_or_one_sentence_and_all_else_goes_on(movies, tmp_path):
    """Blender may read some of them, as PyAV does."""
    noise, still = tmp_path / "noise.mkv", save_image(tmp_path / "still.png", picture(1)).rename(tmp_path / "still.mp4")
    noise.write_bytes(np.random.default_rng(3).bytes(9000))
    damaged = damage_frame(movies["b_frames.mp4"][0], tmp_path / "damaged.mp4", 9)
    cut = cut_file(movies["open.mkv"][0], tmp_path / "cut.mkv", 0.5)
    refused = {}
    for path in (noise, still, damaged, cut, *(path for _, path in movies_that_cannot_be_opened(tmp_path, movies))):
        try:
            with BlenderMovie(path) as source:
                for index in (0, source.count // 2, source.count - 1):
                    assert source.read(index).shape == (source.height, source.width, 4)
        except MediaError as error:
            refused[path.name] = str(error)
    assert [*refused] == ["noise.mkv", "still.mp4", "song.wav", "undecodable.mkv", "head.mkv", "absurd.avi", "raw.h264"]
    for name, sentence in refused.items():
        begins = f"{name}: cannot be read as a movie (Blender ", f"{name}: its length is unknown"
        assert sentence.startswith(begins), sentence
    assert_same(movies["b_frames.mp4"][0])


def test_frame_rates_are_those_of_films():
    odd = ["25/2", "100/7", "2997/50", "1667/100", "1/10", "30000/1001", "24000/1001", "120000/1001"]
    for rate in map(Fraction, ("24", "25", *odd)):
        assert frame_rate(float(np.float32(rate))) == rate


@pytest.fixture
def _no_pyav(monkeypatch):
    monkeypatch.setitem(sys.modules, "shutter_addon.media.movie", None)
    monkeypatch.setitem(sys.modules, "av", None)
    files.pyav_missing.cache_clear()
    yield
    files.pyav_missing.cache_clear()


def test_channels_are_those_that_pyav_decodes(coloured):
    for name in ("bt709.mp4", "alpha_png.mov", "ten_bits.mp4", "gray.mkv"):
        for channel in ("luminance", "red", "green", "blue", "alpha"):
            movies = BlenderMovie(coloured[name]), open_source(coloured[name])
            with movie_channel(movies[0], channel) as ours, movie_channel(movies[1], channel) as theirs:
                one, other = ours.read(1), theirs.read(1)  # PyAV's luminance of grey pictures is their luma
                assert one.shape == other.shape or (name, channel) == ("gray.mkv", "luminance")
                assert not one.size or np.abs(one.astype(int) - other).max() == 0


@pytest.mark.usefixtures("_no_pyav")
def test_without_pyav_movies_are_opened_so(coloured):
    with open_source(coloured["bt709.mp4"], divisor=2) as source:
        assert (source.by_blender, source.width, source.height) == (True, 64, 32)
        assert source.read(0).shape == (32, 64, 4)
        assert source.file_kind == "a movie, read by a second Blender"
    with MatteFile(coloured["bt709.mp4"], "red").open() as channel:
        assert channel.read(0).shape == (64, 128)
    refused = r"^bt709\.mp4: movies need the Python package PyAV"
    with pytest.raises(MediaError, match=refused):
        MatteFile(coloured["bt709.mp4"], "red", stream=1).open()
    with pytest.raises(MediaError, match=refused):
        open_source(coloured["bt709.mp4"], stream=1)
    blender_movie.lend(None)
    with pytest.raises(MediaError, match=refused):
        open_source(coloured["bt709.mp4"])


@linux
def test_memory_stays_bounded_and_a_blender_that_was_killed_is_followed_by_another(bunny):
    def resident():
        return int(Path(f"/proc/{process()}/statm").read_text().split()[1]) * 4096

    with BlenderMovie(bunny) as source:
        for index in range(10):
            last = source.read(index)
        before = resident()
        for index in range(10, 40):
            source.read(index)
        assert resident() - before < 20 * last.nbytes  # 30 kept ones would be 120, as floats
        os.kill(process(), signal.SIGKILL)
        assert np.array_equal(source.read(9), last)


def test_an_answer_that_nobody_waited_for_is_not_the_next_one(movies, monkeypatch):
    path, numbers = movies["b_frames.mp4"]
    with BlenderMovie(path) as source:
        assert number(source.read(1)) == numbers[1]
        interrupted = mock.Mock(side_effect=KeyboardInterrupt)
        monkeypatch.setattr(blender_movie, "_line", interrupted)  # private: an interrupt comes while it waits
        with pytest.raises(KeyboardInterrupt):
            source.read(3)
        monkeypatch.undo()
        assert number(source.read(7)) == numbers[7]


SILENT = [sys.executable, "-c", "import time; time.sleep(600)"]


BRIEF = [[sys.executable, "-c", code] for code in ("pass", "import sys; print(sys.argv[-1])")]


@pytest.mark.parametrize("command", [["/nowhere/blender"], *BRIEF, SILENT])
def test_a_blender_that_does_not_answer_is_killed_and_one_sentence(coloured, monkeypatch, command):
    monkeypatch.setattr(blender_movie, "ANSWERING", 1)
    monkeypatch.setattr(blender_movie, "ENDING", 0.1)
    blender_movie.lend(command)
    reason = "has ended" if command[0] == sys.executable else "cannot be started: No such file or directory"
    sentence = rf"^bt709\.mp4: cannot be read as a movie \(the Blender that decodes it {reason}\)$"
    with pytest.raises(MediaError, match=sentence):
        BlenderMovie(coloured["bt709.mp4"])
    assert BlenderMovie.decoder.process is None


def test_nobody_waits_for_an_answer_that_does_not_come(coloured, monkeypatch):
    """Who lends no Blender any more, as the extension that is switched off, least of all."""
    blender_movie.lend(SILENT)
    with ThreadPoolExecutor(1) as threads:
        asked = threads.submit(BlenderMovie, coloured["bt709.mp4"])
        while BlenderMovie.decoder.process is None:
            assert not asked.done()
        monkeypatch.setattr(blender_movie, "ENDING", 0.1)
        blender_movie.lend(None)
        with pytest.raises(MediaError, match=r"\(no Blender decodes it any more\)$"):
            asked.result(20)


LEAVING = """
import json, os, sys, time
open(sys.argv[1], "a").write("begun ")
sys.stdin.readline()
about = {"size": [8, 8], "count": 2, "fps": 25, "alpha": False, "deep": False, "audio": False, "bytes": 0}
print(sys.argv[-1] + json.dumps(about), flush=True)
for number in (0, 1):
    os.close(number)
time.sleep(600)
"""


def test_no_blender_is_begun_to_close_a_movie(coloured, tmp_path, monkeypatch):
    """Nor does a movie of one that cannot be asked any more fail to be closed."""
    begun = tmp_path / "begun"
    blender_movie.lend([sys.executable, "-c", LEAVING, str(begun)])
    source = BlenderMovie(coloured["bt709.mp4"])
    monkeypatch.setattr(blender_movie, "ENDING", 0.1)
    source.close()
    source.close()
    assert begun.read_text() == "begun "


PARENT = """
import sys
from shutter_addon.media import blender_movie
from shutter_addon.media.blender_movie import BlenderMovie
blender_movie.lend([sys.executable, sys.argv[1]])
source = BlenderMovie(sys.argv[2])
print(BlenderMovie.decoder.process.pid, flush=True)
sys.stdin.read()
"""


@linux
def test_it_ends_with_the_process_that_asked_however_that_ends(movies):
    for end in (signal.SIGKILL, None):
        command = [sys.executable, "-c", PARENT, SCRIPT, movies["b_frames.mp4"][0]]
        with subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as parent:
            pid = int(parent.stdout.readline())
            if end is not None:
                parent.send_signal(end)
            parent.stdin.close()
        with suppress(ProcessLookupError):  # it has ended
            handle = os.pidfd_open(pid)
            assert select.select([handle], [], [], 20)[0], "it goes on"
            os.close(handle)
