"""In-between frames in files: what is built, kept, found damaged, and given back."""

import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import weakref
from contextlib import suppress
from functools import partialmethod
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest
from footage import picture, save_image, see_through

from shutter_addon.core import atomic_write
from shutter_addon.core.farm import claims
from shutter_addon.core.frames.source_wrapper import SourceWrapper
from shutter_addon.media import MediaError, cuts, flow, inbetween, inbetween_cache, open_source
from shutter_addon.media.folder import Folder

ROOT = Path(__file__).parents[2]
FACTOR, COUNT = 4, 6
STRAIGHT = {"oiio__UnassociatedAlpha": 1}


def blend(first, second, factor, *_):
    """A plain blend, in place of optical flow."""
    for step in range(1, factor):
        weight = step / factor
        yield (first * (1.0 - weight) + second * weight).astype(first.dtype)


def build(source, folder, *, between=blend, **more):
    with mock.patch.object(flow, "between", between):
        return inbetween.build(source, folder, FACTOR, "quick", **more)


def state(source, folder):
    return inbetween_cache.state(source, folder, FACTOR, "quick")


def opened(source, folder):
    return inbetween.InbetweenSource(source, folder, FACTOR, "quick")


def kept(folder):
    """{path in the folder: hash} of all files."""
    paths = [path for path in folder.rglob("*") if path.is_file()]
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def pictures(folder):
    return sorted(path for path in folder.glob("*/*") if path.suffix in (".png", ".exr"))


def footage(folder, count=COUNT, *, samples="uint8", suffix=".png", alpha=False):
    """Numbered pictures, so that any two differ."""
    folder.mkdir(exist_ok=True)
    for number in range(count):
        stored = (see_through if alpha else picture)(number)
        stored = stored if samples == "uint8" else stored / np.float32(255)
        save_image(folder / f"f{number:03d}{suffix}", stored, samples, **STRAIGHT)
    return folder / f"f000{suffix}"


@pytest.fixture
def source(tmp_path):
    with open_source(footage(tmp_path / "shot")) as source:
        source.fps = 24
        yield source


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "cache"


@pytest.mark.parametrize("alpha", [False, True])
@pytest.mark.parametrize(
    ("samples", "suffix"),
    [("uint8", ".png"), ("uint16", ".png"), ("uint16", ".tif"), ("half", ".exr"), ("float", ".exr"), ("float", ".tif")],
)
def test_frames_come_back_as_they_were_built(tmp_path, folder, samples, suffix, alpha):
    first = footage(tmp_path / "shot", 3, samples=samples, suffix=suffix, alpha=alpha)
    with open_source(first) as source:
        assert build(source, folder) == ("ready", 2, 2)
        frames = [source.read(index) for index in range(3)]
        expected = [frames[0], *blend(*frames[:2], FACTOR), frames[1], *blend(*frames[1:], FACTOR), frames[2]]
        with opened(source, folder) as between:
            assert between.count == len(expected)
            for index, frame in enumerate(expected):
                found = between.read(index)
                assert found.dtype == source.dtype
                assert np.array_equal(found, frame), index


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_equal_pictures_are_equal_files(tmp_path, name):
    frame = see_through(3) if name == "a.png" else see_through(3).astype(np.float16)
    path, written = tmp_path / name, []
    for _ in range(2):
        inbetween_cache.write_picture(path, frame, "straight")
        written.append(path.read_bytes())
        time.sleep(1.01)  # time stamps in EXR files are seconds
    assert written[0] == written[1]


def test_is_a_source_of_a_higher_rate(source, folder):
    build(source, folder)
    between = opened(source, folder)
    assert (between.count, between.fps) == ((COUNT - 1) * FACTOR + 1, 24 * FACTOR)
    assert (between.width, between.alpha, between.path) == (source.width, source.alpha, source.path)
    with pytest.raises(IndexError):
        between.read(between.count)


def test_a_missing_frame_is_never_made_up(source, folder):
    build(source, folder, pairs=range(2))
    between = opened(source, folder)
    assert [between.has(index) for index in range(between.count)] == [
        index < 2 * FACTOR or index % FACTOR == 0 for index in range(between.count)
    ]
    with pytest.raises(MediaError, match=r"in-between frames of frame 3 are missing"):
        between.read(2 * FACTOR + 1)
    build(source, folder)
    assert between.read(2 * FACTOR + 1).shape == (source.height, source.width, 4)


def test_state_and_chunks(source, folder):
    assert state(source, folder) == ("missing", 0, COUNT - 1)
    assert build(source, folder, pairs=range(3)) == ("ready", 3, 3)
    assert state(source, folder) == ("partial", 3, COUNT - 1)
    assert build(source, folder, pairs=range(3, COUNT - 1)) == ("ready", 2, 2)
    assert state(source, folder) == ("ready", COUNT - 1, COUNT - 1)
    chunks = kept(folder)
    build(source, folder.with_name("whole"))
    assert kept(folder.with_name("whole")) == chunks
    pictures(folder)[-1].unlink()
    assert state(source, folder).name == "partial"


def test_nothing_is_built_twice(source, folder):
    def never(*_):
        raise AssertionError

    build(source, folder)
    seen = []
    assert build(source, folder, between=never, update=lambda *at: seen.append(at)).name == "ready"
    assert seen == [(done, COUNT - 1) for done in range(1, COUNT)]


def test_cancelled_keeps_what_is_finished(source, folder):
    done = []
    result = build(source, folder, update=lambda *at: done.append(at), cancelled=lambda: len(done) >= 2)
    assert result.name == "partial"
    assert 2 <= result.done == state(source, folder).done < COUNT - 1


def test_cancelled_within_a_pair(source, folder):
    assert build(source, folder, cancelled=lambda: bool(pictures(folder))) == ("partial", 0, COUNT - 1)
    assert state(source, folder).done == 0
    build(source, folder)
    build(source, folder.with_name("whole"))
    assert kept(folder) == kept(folder.with_name("whole"))


def test_every_file_that_is_cut_short_is_found_and_built_again(source, folder):
    build(source, folder)
    whole, between = kept(folder), opened(source, folder)
    for file in pictures(folder):
        for damage in (lambda data: data[: len(data) // 2], lambda data: b""):
            file.write_bytes(damage(file.read_bytes()))
            with pytest.raises(MediaError, match=f"{file.name}: this in-between frame is damaged or gone"):
                between.read(int(file.stem))
            build(source, folder)
            assert kept(folder) == whole


def test_damage_within_a_picture_is_never_shown(source, folder):
    build(source, folder)
    between = opened(source, folder)
    for file in pictures(folder):
        whole = between.read(int(file.stem))
        file.write_bytes(flipped(file.read_bytes()))
        with suppress(MediaError):
            assert np.array_equal(between.read(int(file.stem)), whole)


def flipped(data):
    place = random.Random(len(data)).randrange(len(data))
    return data[:place] + bytes([data[place] ^ 16]) + data[place + 1 :]


def test_a_damaged_manifest_and_a_lost_mark_are_made_again(source, folder):
    save_image(source.files[2], picture(1))  # two equal frames
    build(source, folder)
    whole = kept(folder)
    next(folder.glob("*/00000001.same")).unlink()
    next(folder.glob("*/manifest.json")).write_text("{")
    with opened(source, folder) as between:
        assert not between.has(2 * FACTOR - 1)
    assert build(source, folder).name == "ready"
    assert kept(folder) == whole


def test_equal_frames_need_no_pictures(source, folder):
    save_image(source.files[3], picture(2))
    build(source, folder)
    assert len(pictures(folder)) == (COUNT - 2) * (FACTOR - 1)
    between = opened(source, folder)
    for step in range(FACTOR):
        assert np.array_equal(between.read(2 * FACTOR + step), source.read(2))


def test_a_repeated_frame_needs_no_pictures_though_a_codec_saw_it(source, folder):
    noise = np.random.default_rng(1).integers(0, 2, picture(2).shape)
    save_image(source.files[3], (picture(2) | noise).astype(np.uint8))
    build(source, folder)
    assert np.array_equal(opened(source, folder).read(2 * FACTOR + 3), source.read(2))


def test_nothing_is_made_up_across_a_cut(tmp_path, folder):
    (tmp_path / "shot").mkdir()
    random = np.random.default_rng(7)
    for number in range(12):
        if number % 6 == 0:
            texture = random.integers(0, 256, (8, 16, 3)).astype(np.uint8).repeat(8, 0).repeat(8, 1)
        save_image(tmp_path / "shot" / f"{number}.png", np.roll(texture, number, 1))
    with open_source(tmp_path / "shot" / "0.png") as source:
        build(source, folder)
        assert len(pictures(folder)) == 10 * (FACTOR - 1)
        between = opened(source, folder)
        shown = [between.read(5 * FACTOR + step) for step in range(FACTOR)]
        for frame, expected in zip(shown, (5, 5, 5, 6), strict=True):
            assert np.array_equal(frame, source.read(expected))
        build(source, folder.with_name("chunk"), pairs=range(5, 6))
        assert not pictures(folder.with_name("chunk"))


@pytest.mark.parametrize("lost", [4, 5, 6, 8])
def test_what_a_lost_frame_might_hide_is_not_kept(tmp_path, folder, lost):
    """A frame that has a say in a cut cannot be read for a while: nothing is made up across the cut meanwhile."""
    (tmp_path / "shot").mkdir()
    for number, shade in enumerate([*np.random.default_rng(7).integers(0, 256, (2, 8, 16, 3))]):
        texture = shade.astype(np.uint8).repeat(8, 0).repeat(8, 1)
        for k in range(6 * number, 6 * number + 6):
            save_image(tmp_path / "shot" / f"{k}.png", np.roll(texture, k, 1))
    with open_source(tmp_path / "shot" / "0.png") as source:
        read = source.read

        def fail(index):
            if index == lost:
                raise MediaError(f"{lost}.png: not there for a moment")
            return read(index)

        source.read = fail
        with pytest.raises(MediaError, match=f"{lost}.png: not there"):
            build(source, folder, pairs=range(5, 6))
        assert state(source, folder).done == 0
        source.read = read
        build(source, folder, pairs=range(5, 6))
        assert not pictures(folder)
        assert np.array_equal(opened(source, folder).read(5 * FACTOR + 3), source.read(6))


def test_found_again_where_all_has_moved(source, folder, tmp_path):
    build(source, folder)
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    shutil.copytree(folder, moved / "cache")  # copies have other time stamps
    shutil.copytree(source.path.parent, moved / "shot")
    with open_source(moved / "shot" / source.path.name) as other:
        assert state(other, moved / "cache").name == "ready"
    save_image(moved / "shot" / source.files[3].name, picture(99))
    with open_source(moved / "shot" / source.path.name) as changed:
        assert state(changed, moved / "cache").name == "stale"


@pytest.mark.parametrize("resized", [True, False])
def test_stale_when_the_source_changed(source, folder, resized):
    build(source, folder)
    if resized:
        source.files[-1].unlink()
    else:
        save_image(source.files[2], picture(99))
    with open_source(source.path) as changed:
        assert state(changed, folder).name == "stale"
        assert not opened(changed, folder).has(1)
        build(changed, folder)
        assert state(changed, folder).name == "ready"


def test_stale_after_a_retouch_that_keeps_the_size(tmp_path, folder):
    (tmp_path / "shot").mkdir()
    shots = [np.tile(picture(number, 640, 360), (2, 2, 1)) for number in range(3)]
    files = [tmp_path / "shot" / f"{number}.tif" for number in range(3)]
    for file, shot in zip(files, shots, strict=True):
        save_image(file, shot, compression="none")
    size = files[1].stat().st_size
    with open_source(files[0]) as source:
        build(source, folder)
        assert state(source, folder).name == "ready"
        shots[1][500, 700] ^= 1
        save_image(files[1], shots[1], compression="none")
        assert files[1].stat().st_size == size
        assert state(source, folder).name == "stale"


def test_another_factor_or_reading_is_another_cache(source, folder):
    build(source, folder)
    assert inbetween_cache.state(source, folder, 8, "quick").name == "missing"
    assert inbetween_cache.state(source, folder, FACTOR, "good").name == "missing"
    source.transfer = "linear"
    assert state(source, folder).name == "stale"
    source.transfer, source.options = "srgb", {"deinterlace": True}
    assert state(source, folder).name == "stale"


def test_purge_takes_only_what_was_built(source, folder, tmp_path):
    build(source, folder)
    own = [folder / "notes.txt", next(folder.iterdir()) / "mine.png", folder / "other" / "manifest.json"]
    for path in own:
        path.parent.mkdir(exist_ok=True)
        path.write_text("{}")
    with open_source(footage(tmp_path / "second", 2)) as second:
        build(second, folder)
        size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and path not in own)
        freed = inbetween_cache.purge(folder, source)
        assert state(second, folder).name == "ready"
        assert state(source, folder).name == "missing"
        freed += inbetween_cache.purge(folder, second)
    assert freed == size
    assert sorted(path for path in folder.rglob("*") if path.is_file()) == sorted(own)


def test_what_could_not_be_removed_is_found_again(source, folder, monkeypatch):
    def refusing(place, name, busy, remove=Folder.remove):
        if name == busy.name:
            raise PermissionError(13, "Permission denied", str(busy))
        return remove(place, name)

    build(source, folder)
    for busy in pictures(folder):
        with monkeypatch.context() as patch:
            patch.setattr(Folder, "remove", partialmethod(refusing, busy=busy))
            with pytest.raises(MediaError, match=r"cannot be removed \(Permission denied\)"):
                inbetween_cache.purge(folder, source)
        assert inbetween_cache.size(folder, source) > 0
        assert inbetween_cache.purge(folder, source) > 0
        assert not list(folder.iterdir())
        build(source, folder)


def test_what_cannot_be_written_is_one_sentence(source, folder):
    folder.write_text("in the way")
    with pytest.raises(MediaError, match=r"in-between frames cannot be written there \(Not a directory\)"):
        build(source, folder)


def test_a_broken_source_frame_leaves_what_is_built(source, folder):
    data = source.files[4].read_bytes()
    source.files[4].write_bytes(data[: len(data) // 2])
    with pytest.raises(MediaError, match=r"f004.png"):
        build(source, folder)
    assert state(source, folder) == ("partial", 3, COUNT - 1)


def test_a_full_disk_leaves_what_is_built(source, folder):
    resource = pytest.importorskip("resource")
    build(source, folder.with_name("whole"))
    build(source, folder, pairs=range(2))
    sizes = sorted(path.stat().st_size for path in pictures(folder.with_name("whole")))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (sizes[len(sizes) // 2], hard))
        with pytest.raises(MediaError, match=r"could not be written whole \(file too large"):
            build(source, folder)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)
    assert kept(folder).items() <= kept(folder.with_name("whole")).items()
    assert 2 <= state(source, folder).done < COUNT - 1
    assert not list(folder.rglob(".*"))


@pytest.mark.parametrize("processors", [1, 16])
@pytest.mark.parametrize("size", [(640, 360), (1920, 1080), (4096, 2160), (16384, 8192)])
@pytest.mark.parametrize("samples", ["uint8", "uint16", "float32"])
def test_pairs_at_work_fit_into_memory(monkeypatch, processors, size, samples):
    """And with them the frames beyond, up to eight that have a say in whether there is a cut."""
    monkeypatch.setattr(inbetween.os, "process_cpu_count", lambda: processors, raising=False)
    source = SimpleNamespace(width=size[0], height=size[1], dtype=np.dtype(samples))
    workers, ahead = inbetween._workers(source), inbetween._ahead(source)  # pictures too large for any build in a test
    pair = 26 * 16 * size[0] * size[1]  # layers of four float32
    beyond = ahead * 4 * source.dtype.itemsize * size[0] * size[1]
    assert beyond <= 640 << 20
    assert ahead == 8 or size[0] > 4096 or samples == "float32"
    assert 1 <= workers <= processors
    assert workers == 1 or workers * pair + beyond <= 4 << 30
    assert workers == processors or (workers + 1) * pair + beyond > 4 << 30


class Counting(SourceWrapper):
    """A source that counts what is read of it, and how many of its frames are held at the same time."""

    def __init__(self, source):
        super().__init__(source)
        self.reads, self.most, self._given = [], 0, []

    def read(self, index):
        frame = self._source.read(index)
        self.reads.append(index)
        self._given = [given for given in self._given if given() is not None] + [weakref.ref(frame)]
        self.most = max(self.most, len(self._given))
        return frame


@pytest.mark.parametrize("first", [0, 15])
def test_frames_read_ahead_have_a_bound_and_are_read_once_within_it(tmp_path, monkeypatch, first):
    """Of a still scene through a codec, where every pair might be a repeated frame and asks all around it."""
    (tmp_path / "shot").mkdir()
    random = np.random.default_rng(3)
    for number in range(30):
        noise = random.integers(0, 2, picture(2).shape)
        save_image(tmp_path / "shot" / f"{number:02d}.png", (picture(2) | noise).astype(np.uint8))
    monkeypatch.setattr(inbetween.os, "process_cpu_count", lambda: 1, raising=False)
    with open_source(tmp_path / "shot" / "00.png") as source:
        size, found = source.read(0).nbytes, []
        for room in (8, 3, 0):
            monkeypatch.setattr(inbetween, "AHEAD", room * size)
            folder, counting = tmp_path / f"{room}", Counting(source)
            assert build(counting, folder, pairs=range(first, 29)).done == 29 - first
            cache = inbetween_cache.InbetweenCache(source, folder, FACTOR, "quick")
            cache.load()
            found.append((cache.listed.kinds, kept(folder)))
            # The pair, and what decides what it is: on both sides, some of it read ahead (cuts bounds its bytes).
            assert counting.most <= 2 + 2 * cuts.NEIGHBOURS
            again = len(counting.reads) - len(set(counting.reads))
            assert again == 0 if room == 8 else 0 < again <= 30 - first
    assert found[0] == found[1] == found[2]


PEAK = """
import re, sys
from pathlib import Path
import cv2
import numpy as np
sys.path.insert(0, "tests/media")
from test_media_flow import frame, noise
from shutter_addon.media import flow, inbetween

def resident(which):
    return 1024 * int(re.search(which + r":\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1])

cv2.setNumThreads(1)
wide = cv2.resize(noise(1), (976, 540))
small = frame(noise(1), np.float32)
list(flow.between(small, small, 2, "good", alpha="straight"))
before = resident("VmRSS")
ends = [frame(wide[:, x : x + 960], np.float32, 0.5) for x in (0, 8)]
Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
for picture in flow.between(*ends, 16, "good", alpha="straight"):
    pass
assert resident("VmHWM") - before < inbetween.LAYERS * 16 * 960 * 540, (resident("VmHWM") - before) / (16 * 960 * 540)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_a_pair_takes_no_more_memory_than_is_reckoned():
    subprocess.run([sys.executable, "-c", PEAK], cwd=ROOT, check=True)


BUILDER = """
import os, sys, time
sys.path.insert(0, "tests/media")
from test_media_inbetween import blend, build
from shutter_addon.media import open_source

def slow(*frames):
    os.write(1, b"made ")  # at once: print writes the end of a line apart, and threads come between
    for picture in blend(*frames):
        time.sleep(0.01)
        yield picture

print("ready", flush=True)
sys.stdin.readline()
build(open_source(sys.argv[1]), sys.argv[2], between=slow)
"""


def builder(source, folder):
    """A process that builds as soon as its input ends."""
    command = [sys.executable, "-c", BUILDER, str(source.path), str(folder)]
    process = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    process.stdout.readline()
    return process


def test_killed_anywhere_it_goes_on_to_the_same_files(tmp_path, folder, monkeypatch):
    with open_source(footage(tmp_path / "shot", 40)) as source:
        build(source, folder.with_name("whole"))
        pauses, killed = random.Random(5), []
        while len(killed) < 10 or not state(source, folder).done:  # a busy machine builds nothing in so short a time
            with builder(source, folder) as process:
                process.stdin.close()
                time.sleep(pauses.uniform(0.0, 0.01 * max(10, len(killed))))
                process.kill()
            killed.append(process.returncode)
        assert set(killed) == {-signal.SIGKILL if os.name == "posix" else 1}
        assert 0 < state(source, folder).done < 39
        shutil.copytree(folder, folder.with_name("killed"))
        inbetween_cache.purge(folder.with_name("killed"), source)
        assert not list(folder.with_name("killed").iterdir())
        monkeypatch.setattr(atomic_write, "LEFT_BEHIND", 0)
        monkeypatch.setattr(claims, "PATIENCE", 0.1)
        build(source, folder)
        assert kept(folder) == kept(folder.with_name("whole"))
        assert not list(folder.rglob(".*"))


def test_two_processes_at_once_build_each_pair_once(tmp_path, folder):
    with open_source(footage(tmp_path / "shot", 30)) as source:
        with builder(source, folder) as one, builder(source, folder) as two:
            one.stdin.close()
            two.stdin.close()
            made = one.stdout.read() + two.stdout.read()
        assert (one.returncode, two.returncode) == (0, 0)
        assert made.split() == 29 * [b"made"]
        assert not list(folder.rglob(".*"))
        build(source, folder.with_name("whole"))
        assert kept(folder) == kept(folder.with_name("whole"))
        assert all(opened(source, folder).read(index) is not None for index in range(29 * FACTOR))


def test_footage_that_is_written_to_amid_a_build(tmp_path, folder):
    first = footage(tmp_path / "shot", 4)
    last = first.with_name("f003.png")

    def overwrite(done, _total):
        if done == 1:
            save_image(last, picture(9), "uint8", **STRAIGHT)

    with open_source(first) as source, pytest.raises(MediaError, match=r"f000\.png: was written to while"):
        build(source, folder, update=overwrite)
    save_image(last, picture(3), "uint8", **STRAIGHT)
    with open_source(first) as source:
        assert state(source, folder).done == 0
        build(source, folder)
        build(source, folder.with_name("whole"))
        assert kept(folder) == kept(folder.with_name("whole"))


def test_estimate_is_near_what_is_built(bunny, folder):
    with open_source(bunny) as movie:
        source = SourceWrapper(movie)
        source.count = 4  # the first frames alone
        build(source, folder)
        size = sum(path.stat().st_size for path in pictures(folder))
        assert 0.7 * size < inbetween.estimate(source) * (FACTOR - 1) < 1.5 * size
