"""Files are written whole or not at all, and through no link."""

import os
import time
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import pytest

from shutter_addon.core import atomic_write


def listed(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_there_once_it_is_whole_and_no_link_is_followed(tmp_path):
    path = tmp_path / "a.txt"
    path.symlink_to("others")
    path.write_text("old")
    with atomic_write.writing(path) as part:
        part.write_text("new")
        assert path.read_text() == "old"
        assert part.name == path.name
    assert path.read_text() == "new"
    assert (tmp_path / "others").read_text() == "old"
    assert listed(tmp_path) == ["a.txt", "others"]


def test_what_fails_leaves_nothing(tmp_path):
    def stopped():
        with atomic_write.writing(tmp_path / "a.txt") as part:
            part.write_text("half")
            part.with_name("more").mkdir()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert listed(tmp_path) == []
    with pytest.raises(FileNotFoundError), atomic_write.writing(tmp_path / "a.txt"):
        pass
    assert listed(tmp_path) == []


def test_any_name_that_a_file_may_have(tmp_path):
    """It is for whom any new file is."""
    (tmp_path / "plain").write_text("")
    for name in ("a.txt", "a" * 255, "ä" * 127):
        with atomic_write.writing(tmp_path / name) as part:
            part.write_text(name)
        assert (tmp_path / name).read_text() == name
        assert (tmp_path / name).stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_many_write_the_same_file_at_once(tmp_path):
    together = Barrier(8, timeout=20)

    def write(number):
        with atomic_write.writing(tmp_path / "a.txt") as part:
            together.wait()
            part.write_text(f"{number}" * 9999)
            together.wait()

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(write, range(8)))
    assert (tmp_path / "a.txt").read_text() in [f"{number}" * 9999 for number in range(8)]
    assert listed(tmp_path) == ["a.txt"]


def test_what_was_left_behind_is_known_by_name_kind_and_age(tmp_path):
    names = [f".part-{number:016x}" for number in range(4)]
    for name in names:
        (tmp_path / name).mkdir()
        (tmp_path / name / "a.txt").write_text("half")
    (tmp_path / ".part-of-my-film").mkdir()
    (tmp_path / f".part-{9:016x}").symlink_to(names[0])
    for name in ("", *names[:3], f"{names[0]}/a.txt", f"{names[1]}/a.txt"):
        os.utime(tmp_path / name, (0, 0))
    os.utime(tmp_path / names[3] / "a.txt", (0, 0))
    atomic_write.clear_up(tmp_path)
    assert listed(tmp_path) == sorted([".part-of-my-film", f".part-{9:016x}", *names[2:]])


def test_a_clock_ahead_of_the_drives_makes_nothing_left_behind(tmp_path, monkeypatch):
    later = time.time() + 2 * atomic_write.LEFT_BEHIND
    with atomic_write.part_folder(tmp_path) as live:
        monkeypatch.setattr(time, "time", lambda: later)
        atomic_write.clear_up(tmp_path)
        assert listed(tmp_path) == [live.name]
        os.utime(live, (0, 0))
        atomic_write.clear_up(tmp_path)
        assert listed(tmp_path) == []
