"""Claims: one holder at a time, another when that is killed; and which version of an edit a job's pictures are of."""

import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from itertools import chain
from pathlib import Path

import pytest

from shutter_addon.core.farm import claims, job_file
from shutter_addon.core.farm.claims import Claims
from shutter_addon.core.farm.job_file import EditVersion

ROOT = Path(__file__).parents[2]
BEAT, PATIENCE = 0.05, 0.5  # seconds
# Takes what it can of names, each time that it gets a line of them; says what it has got.
WORKER = """
import json, sys
from pathlib import Path
from shutter_addon.core.farm.claims import Claims

with Claims(Path(sys.argv[1]), patience=0.5, beat=0.05) as claims:
    print("ready", flush=True)
    for line in sys.stdin:
        print(json.dumps([name for name in json.loads(line) if claims.take(name)]), flush=True)
"""


class Worker:
    """A process with claims."""

    def __init__(self, folder):
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen([sys.executable, "-c", WORKER, str(folder)], cwd=ROOT, **pipes)
        assert self.process.stdout.readline() == "ready\n"

    def ask(self, *names):
        self.process.stdin.write(json.dumps(names) + "\n")
        self.process.stdin.flush()

    def took(self):
        return json.loads(self.process.stdout.readline())

    def take(self, *names):
        self.ask(*names)
        return self.took()


@pytest.fixture
def worker(tmp_path):
    made = []

    def make():
        made.append(Worker(tmp_path))
        return made[-1]

    yield make
    for each in made:
        each.process.kill()
        each.process.communicate()


def until(condition):
    """Waits for a condition, for a minute at most."""
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_name_has_one_holder(worker):
    names = [f"{number:04d}" for number in range(500)]
    workers = [worker() for _ in range(3)]
    for each in workers:
        each.ask(*names)
    assert sorted(chain.from_iterable(each.took() for each in workers)) == names


def test_a_killed_holders_claim_goes_to_one_alone(worker):
    holder, *others = (worker() for _ in range(3))
    assert holder.take("a", "b") == ["a", "b"]
    assert others[0].take("a") == []
    holder.process.kill()
    taken = []

    def try_all():
        for each in others:
            each.ask("a", "b")
        taken.extend(chain.from_iterable(each.took() for each in others))
        return len(taken) == 2

    until(try_all)
    assert sorted(taken) == ["a", "b"]
    for _ in range(3):
        try_all()
    assert sorted(taken) == ["a", "b"]


def test_a_holder_that_works_keeps_its_claim(worker, tmp_path):
    """However long it works: its claim is touched again and again, for many times the other's patience."""
    holder = worker()
    assert holder.take("a") == ["a"]
    (path,) = tmp_path.iterdir()
    seen = set()
    with Claims(tmp_path, PATIENCE, BEAT) as mine:
        while len(seen) <= 3 * PATIENCE / BEAT:
            assert not mine.take("a")
            seen.add(path.stat().st_mtime_ns)
            time.sleep(0.01)


def test_nothing_remains_of_what_was_released(worker, tmp_path):
    holder = worker()
    assert holder.take("a", "b") == ["a", "b"]
    holder.process.kill()
    with Claims(tmp_path, PATIENCE, BEAT) as mine:
        until(lambda: mine.take("a"))
        mine.release("a")
        assert sorted(os.listdir(tmp_path)) == [".claim-b-0"]
        assert mine.take("a")
        assert mine.take("c")
    assert os.listdir(tmp_path) == [".claim-b-0"]


def test_what_a_stranger_put_there_holds_nothing_up(tmp_path):
    (tmp_path / "elsewhere").touch()
    (tmp_path / ".claim-a-0").symlink_to("elsewhere")
    (tmp_path / ".claim-b-0").mkdir()
    with Claims(tmp_path, 0.05, BEAT) as mine:
        for name in "ab":
            until(lambda name=name: mine.take(name))


def test_a_folder_that_cannot_be_written_is_told_and_a_full_disk_leaves_no_claim(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    with Claims(tmp_path / "none") as mine, pytest.raises(FileNotFoundError):
        mine.take("a")
    with Claims(tmp_path) as mine:
        monkeypatch.setattr(claims.socket, "gethostname", full)
        with pytest.raises(OSError, match="No space"):
            mine.take("a")
        monkeypatch.undo()
        assert os.listdir(tmp_path) == []
        assert mine.take("a")


VERSION = EditVersion("0.1.0", "5.2.0", "", "ab" * 32, "cd" * 32)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"extension": "0.2.0"}, "the extension (0.1.0, here 0.2.0)"),
        ({"blender": "5.2.1"}, "Blender (5.2.0, here 5.2.1)"),
        ({"colours": "12" * 32}, f"the OpenColorIO configuration (, here {'12' * 8})"),
        ({"blend": "00" * 32}, "the .blend file ("),
        ({"footage": "00" * 32}, "the footage ("),
    ],
)
def test_another_version_is_refused_and_what_differs_is_named(tmp_path, change, told):
    job_file.guard(tmp_path, VERSION)  # there is none yet
    job_file.write(tmp_path, VERSION)
    job_file.guard(tmp_path, VERSION)
    other = replace(VERSION, **change)
    assert other.key != VERSION.key
    with pytest.raises(job_file.JobError) as error:
        job_file.guard(tmp_path, other)
    assert str(error.value).startswith(f"{tmp_path / job_file.NAME}: the job is of another version of {told}")


@pytest.mark.parametrize("content", ["", "{", "[]", "null", '{"version": 1}', '{"version": 1, "edit": 3}'])
def test_a_damaged_file_is_told(tmp_path, content):
    (tmp_path / job_file.NAME).write_text(content)
    with pytest.raises(job_file.JobError, match="is damaged"):
        job_file.guard(tmp_path, VERSION)


def test_a_pictures_note_is_read_back():
    assert job_file.key_in(job_file.note(VERSION.key)) == VERSION.key
    for text in ("", "mine", "virtual_shutter edit ", f"virtual_shutter edit {VERSION.key}0"):
        assert job_file.key_in(text) is None
