"""Folders of carried mattes that a stranger has prepared, or a disk has damaged.

What is read is right or refused, nothing outside is touched, and nothing hangs."""

import os
import random
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest
from footage import save_image
from test_carrying import HEIGHT, WIDTH, Footage, drawings

from shutter_addon.features.outlines import carried_mattes
from shutter_addon.features.outlines.subject_mattes import CarriedFile
from shutter_addon.media import MediaError, derived

if os.name != "posix":
    pytest.skip("pipes, sockets and devices by name, alarms: of POSIX systems only", allow_module_level=True)

FRAME = 1  # between two drawings


@pytest.fixture(autouse=True)
def in_time():
    def late(*_):
        raise AssertionError("it hangs")

    handler = signal.signal(signal.SIGALRM, late)
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, handler)


def read(folder):
    """The matte, as a program that begins anew reads it."""
    carried_mattes._writable.cache_clear()  # private: it lasts as long as the program
    carried_mattes._temporary.cache_clear()  # private: as before
    return CarriedFile(Footage(folder), drawings(0, 2), folder / "mattes").open().read(FRAME)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return tmp_path_factory.mktemp("made")


@pytest.fixture(scope="module")
def right(made):
    return read(made)


@pytest.fixture
def kept(made, right, tmp_path):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    (path,) = (tmp_path / "mattes").glob(f"*/{FRAME:08d}-*.png")
    return path


def sparse(path):
    with path.open("wb") as file:
        file.truncate(1 << 42)


KINDS = {
    "folder": Path.mkdir,
    "fifo": os.mkfifo,
    "device": lambda path: path.symlink_to("/dev/zero"),
    "loop": lambda path: path.symlink_to(path.name),
    "sparse": sparse,
    "bytes": lambda path: path.write_bytes(bytes(range(256)) * 9),
    "empty": lambda path: path.write_text(""),
}


@pytest.mark.parametrize("kind", KINDS)
def test_whatever_lies_in_a_mattes_place_is_not_opened(right, kept, kind, tmp_path):
    """The matte is right and takes its place again, or there is one sentence."""
    kept.unlink()
    KINDS[kind](kept)
    if kind == "folder":
        with pytest.raises(MediaError, match=f"{kept.name}: cannot be written"):
            read(tmp_path)
        return
    np.testing.assert_array_equal(read(tmp_path), right)
    assert kept.is_file()
    assert not kept.is_symlink()


@pytest.mark.parametrize("kind", ["fifo", "device", "loop", "bytes"])
def test_whatever_lies_in_the_folders_place_stays(right, kept, kind, tmp_path):
    """Mattes are kept elsewhere then, for as long as the program runs."""
    shutil.rmtree(kept.parent)
    KINDS[kind](kept.parent)
    np.testing.assert_array_equal(read(tmp_path), right)
    assert kept.parent.is_symlink() or not kept.parent.is_dir()


@pytest.mark.parametrize(
    "size", [(HEIGHT, WIDTH // 2, 1), (HEIGHT + 1, WIDTH, 1), (HEIGHT, WIDTH, 3), (HEIGHT, WIDTH, 1)]
)
@pytest.mark.parametrize(("samples", "about"), [("uint8", {}), ("uint16", {}), ("uint8", {"ImageDescription": "mine"})])
def test_a_picture_of_another_kind_is_never_shown(right, kept, size, samples, about, tmp_path):
    """None says how sure it is."""
    save_image(kept, np.zeros(size, np.float32), samples, **about)
    np.testing.assert_array_equal(read(tmp_path), right)


def test_nothing_outside_is_written(right, kept, tmp_path):
    """Neither through a link nor to a file that has another name as well."""
    outside = tmp_path / "outside.png"
    outside.write_text("someone's own")
    for target in (outside, tmp_path / "new.png"):
        kept.unlink()
        kept.symlink_to(target)
        np.testing.assert_array_equal(read(tmp_path), right)
        assert not kept.is_symlink()
    assert outside.read_text() == "someone's own"
    assert not (tmp_path / "new.png").exists()
    os.link(kept, tmp_path / "mine.png")
    kept.write_bytes(kept.read_bytes()[:40])  # of both
    np.testing.assert_array_equal(read(tmp_path), right)
    assert (tmp_path / "mine.png").stat().st_size == 40


def test_damage_of_any_kind_is_made_again(right, kept, tmp_path):
    whole = kept.read_bytes()
    for seed in range(12):
        rng, damaged = random.Random(seed), bytearray(whole)
        if seed % 4 == 0:
            del damaged[rng.randrange(len(damaged)) :]
        else:
            for _ in range(rng.randrange(1, 9)):
                damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
        kept.write_bytes(damaged)
        assert np.array_equal(read(tmp_path), right), seed
    kept.unlink()
    assert np.array_equal(read(tmp_path), right)


def test_footage_that_became_a_pipe_is_one_sentence(tmp_path):
    os.mkfifo(tmp_path / "film.mov")
    with pytest.raises(MediaError, match=r"^film\.mov: is no file$"):
        derived.content_digest(tmp_path / "film.mov")


def test_a_change_of_footage_is_another_folder(tmp_path):
    footage = Footage(tmp_path)
    before = derived.key(derived.identity(footage))
    os.utime(footage.path, (1, 1))
    assert derived.key(derived.identity(footage)) == before
    footage.path.write_bytes(b"the files of framez")
    assert derived.key(derived.identity(footage)) != before
    footage.options = {"deinterlace": True}
    footage.path.write_bytes(b"the files of frames")
    assert derived.key(derived.identity(footage)) != before
