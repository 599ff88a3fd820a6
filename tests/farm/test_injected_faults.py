"""A farm's bad nights: whatever goes wrong is told, nothing wrong is delivered, and the same job, submitted again once
the fault is gone, gives the very files that a night without faults gives."""

import ctypes
import json
import os
import shutil
import signal
import struct
import subprocess
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest
from farm_job import ROOT, Job

sys.path.insert(1, str(ROOT / "tests" / "blender"))

from support import flip_bit, refused, small_disk, write_movie

FRAMES, CHUNKS = 16, ("1:6", "7-16")
WIDTH, HEIGHT = 128, 72
JOB = "virtual_shutter_job.json"
TONE = 8000 * np.sin(np.arange(48000) * 0.05)
OLD = b"the film of last night"
RECIPE = {
    "version": 2,
    "window": 8,
    "shutters": [{"name": "Long", "bars": [1] * 8}, {"name": "Sharp", "bars": [1] + [0] * 7}],
    "regions": [{"name": "side", "shutter": "Sharp", "kind": "matte", "path": "matte.mkv", "channel": "red"}],
}

# Runs one command after another in a process: a line of JSON is a command, a line of JSON is what came of it. Claims of
# killed workers count as abandoned after a moment, for there is nobody else who works.
WORKER = """
import contextlib, io, json, sys
import bpy
from shutter_addon import blender
from shutter_addon.blender import command
from shutter_addon.core.farm import claims

claims.PATIENCE = 0.5
blender.register()
for line in sys.stdin:
    with contextlib.redirect_stderr(io.StringIO()) as said, contextlib.redirect_stdout(io.StringIO()):
        code = command.main(json.loads(line))
    print("\\n" + json.dumps([code, said.getvalue()]), flush=True)
"""


class Node(Job):
    """A machine's view of a job. Its pictures and its film lie elsewhere."""

    @property
    def pictures(self):
        return self.folder.parent / "pictures"

    @property
    def movie(self):
        return self.folder.parent / "films" / "film.mp4"

    def look(self):
        return "check", self.edit, "--output", self.pictures, "--resume", "--movie", self.movie

    def render(self, frames=f"1:{FRAMES}"):
        return "render", self.edit, "--output", self.pictures, "--frames", frames, "--resume", "--device", "cpu"

    def join(self):
        return "join", self.pictures, "--edit", self.edit, "--output", self.movie

    def steps(self):
        """The commands of a whole submission, in their order."""
        return [self.look(), *map(self.render, CHUNKS), self.join()]


def _started(arguments):
    """The process of a command."""
    command = [sys.executable, "-m", "shutter_addon", *map(str, arguments)]
    return subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)


def _ended(process):
    """The exit code of a process, and its one sentence."""
    with process:
        _, said = process.communicate(timeout=120)
    return process.returncode, said


def _without_waiting(said):
    """What a worker said, but that it waits for others."""
    lines = said.splitlines(keepends=True)
    return "".join(line for line in lines if not line.endswith("which other workers have claimed\n"))


@contextmanager
def _worker(before=()):
    """Gives a function that runs a command in a process that runs many: exit code, and what it said."""
    command = [*map(str, before), sys.executable, "-c", WORKER]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, cwd=ROOT, **pipes) as process:

        def run(*arguments):
            print(json.dumps(list(map(str, arguments))), file=process.stdin, flush=True)
            return next(tuple(json.loads(line)) for line in process.stdout if line.startswith("["))

        yield run
        process.stdin.close()


@pytest.fixture(scope="module")
def worker():
    with _worker() as run:
        yield run


@pytest.fixture(scope="module")
def whole(worker, tmp_path_factory):
    """A node whose job went well, each step in one piece."""
    node = Node(tmp_path_factory.mktemp("whole") / "node")
    node.folder.mkdir()
    write_movie(node.folder / "film.mkv", _passing(), rate=FRAMES, tone=TONE)
    write_movie(node.folder / "matte.mkv", _halves(), rate=FRAMES)
    recipe = node.folder / "recipe.json"
    recipe.write_text(json.dumps(RECIPE))
    first = "render", node.folder / "film.mkv", "--recipe", recipe, "--save", node.edit
    whole = "render", node.edit, "--output", node.pictures, "--device", "cpu"
    for step in (first, node.look(), whole, node.join()):
        assert worker(*step) == (0, "")
    assert len(_pictures(node)) == FRAMES
    return node


def _passing():
    """Pictures of blocks that pass by."""
    random = np.random.default_rng(3)
    blocks = random.integers(0, 256, (HEIGHT // 4, (WIDTH + 3 * FRAMES) // 4, 3), dtype=np.uint8)
    wide = blocks.repeat(4, 0).repeat(4, 1)
    return [np.ascontiguousarray(wide[:, 3 * i : 3 * i + WIDTH]) for i in range(FRAMES)]


def _halves():
    """Pictures that are black at the left, and white at the right from a place that moves."""
    black = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    return [np.where(np.arange(WIDTH)[:, None] > 30 + 2 * i, np.uint8(255), black) for i in range(FRAMES)]


@pytest.fixture
def node(whole, tmp_path):
    """A node that has all that the job needs, and a film of last night; nothing is rendered."""
    node = Node(tmp_path / "Knoten Süd 1" / "node")
    shutil.copytree(whole.folder, node.folder)
    node.movie.parent.mkdir()
    node.movie.write_bytes(OLD)
    return node


@pytest.fixture
def submit(whole, worker):
    """Submits a node's job, and compares what it gives with that of the night without faults."""

    def run(node):
        for step in node.steps():
            code, said = worker(*step)
            assert (code, _without_waiting(said)) == (0, "")
        assert _pictures(node) == _pictures(whole)
        assert {path.name for path in node.pictures.iterdir() if not path.name.startswith((".part-", ".claim-"))} == {
            path.name for path in whole.pictures.iterdir()
        }
        assert node.movie.read_bytes() == whole.movie.read_bytes()

    return run


def _pictures(node):
    return {path.name: path.read_bytes() for path in node.pictures.glob("*.png")}


def _all_are_right(node, whole):
    """Whether whatever pictures there are are those of the night without faults, and whole."""
    return _pictures(node).items() <= _pictures(whole).items()


def _wait_for(found, process):
    """Waits until something is found, while the process runs."""
    while not (result := found()):
        assert process.poll() is None
        time.sleep(0.002)  # less than the shortest step that is watched
    return result


def _put(node, whole, frames=range(1, FRAMES + 1)):
    """Puts rendered frames, and the job's file, where the node's job has its own."""
    node.pictures.mkdir()
    for name in [JOB, *(f"{frame:04d}.png" for frame in frames)]:
        shutil.copy(whole.pictures / name, node.pictures)


# The command, what it writes, and how many files that are in the end.
KILLED = {
    "frames": (Node.render, lambda node: list(node.pictures.glob("*.png")), FRAMES),
    "join": (Node.join, lambda node: list(node.movie.parent.glob(".part-*/*")), 2),
}


@pytest.mark.parametrize("step", KILLED)
def test_a_killed_worker(whole, node, submit, step):
    command, written, count = KILLED[step]
    _put(node, whole, range(1, FRAMES + 1) if step == "join" else ())
    process = _started(command(node))
    _wait_for(lambda: written(node), process)
    process.kill()
    assert _ended(process) == (-signal.SIGKILL, "")
    assert 0 < len(written(node)) < count
    assert _all_are_right(node, whole)
    assert node.movie.read_bytes() == OLD
    submit(node)


def test_a_worker_that_is_asked_to_leave(whole, node, submit):
    _put(node, whole, ())
    process = _started(node.render())
    _wait_for(lambda: _pictures(node), process)
    process.terminate()
    code, said = _ended(process)
    assert (code, said.count("\n"), "stopped" in said) == (130, 1, True)
    assert _all_are_right(node, whole)
    assert 0 < len(_pictures(node)) < FRAMES
    assert {path.name for path in node.pictures.iterdir()} == {JOB, *_pictures(node)}
    submit(node)


FULL = {
    "frames": (Node.render, lambda node: node.pictures, 96 << 10),
    "join": (Node.join, lambda node: node.movie.parent, 24 << 10),
}


@pytest.mark.skipif(os.geteuid() != 0, reason="only root mounts a small disk")
@pytest.mark.parametrize("step", FULL)
def test_a_full_disk(whole, node, worker, submit, step):
    command, place, size = FULL[step]
    if step == "join":
        _put(node, whole)
    with small_disk(place(node), size) as disk:
        node.movie.write_bytes(OLD)
        refused(worker(*command(node)), str(place(node)), "no space left")
        assert _all_are_right(node, whole)
        assert node.movie.read_bytes() == OLD
        subprocess.run(["mount", "-o", "remount,size=8m", disk], check=True)
        submit(node)


# Runs a command (after a folder) that sees the folder read-only; nobody else does, and nothing stays mounted.
READ_ONLY = ("unshare", "--mount", "sh", "-c", 'mount --bind "$0" "$0" && mount -o remount,bind,ro "$0" && exec "$@"')


@pytest.mark.skipif(os.geteuid() != 0, reason="only root mounts")
def test_a_read_only_edit_with_all_that_it_needs(whole, node, submit):
    """Footage and edit lie on a drive that a node may only read."""
    with _worker((*READ_ONLY, node.folder)) as run:
        for step in (node.look(), node.render("3:4")):
            assert run(*step) == (0, "")
    submit(node)


def _film_of(count):
    return lambda node: write_movie(node.folder / "film.mkv", _passing()[:count], rate=FRAMES, tone=TONE)


def _cut(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _change_job(name, value):
    def change(node):
        job = json.loads((node.pictures / JOB).read_text())
        job["edit"][name] = value
        (node.pictures / JOB).write_text(json.dumps(job))

    return change


# What is planted, and words of the sentence of the worker that meets it.
FOUND_BY_RENDER = {
    "footage missing": (lambda node: (node.folder / "film.mkv").unlink(), ["film.mkv", "no such file"]),
    "footage shorter": (_film_of(FRAMES - 4), ["another version of the footage"]),
    "footage half copied": (lambda node: _cut(node.folder / "film.mkv"), ["another version of the footage"]),
    "matte missing": (lambda node: (node.folder / "matte.mkv").unlink(), ["another version of the footage"]),
    "other matte": (lambda node: flip_bit(node.folder / "matte.mkv"), ["another version of the footage"]),
    "other extension": (_change_job("extension", "0.0.9"), ["another version of the extension (0.0.9, here "]),
    "other Blender": (_change_job("blender", "5.1.0"), ["another version of Blender (5.1.0, here "]),
    "job file damaged": (lambda node: _cut(node.pictures / JOB), [JOB, "is damaged; check the edit again"]),
    "edit cut off": (lambda node: _cut(node.edit), ["edit.blend"]),
}


@pytest.mark.parametrize("fault", FOUND_BY_RENDER)
def test_a_fault_that_a_worker_meets(whole, node, worker, submit, fault):
    plant, words = FOUND_BY_RENDER[fault]
    _put(node, whole, range(1, 7))
    plant(node)
    refused(worker(*node.render(CHUNKS[1])), *words)
    assert _all_are_right(node, whole)
    assert node.movie.read_bytes() == OLD
    shutil.copytree(whole.folder, node.folder, dirs_exist_ok=True)
    submit(node)


def test_claims_of_a_machine_that_died(whole, node, worker, submit):
    _put(node, whole, range(1, 7))
    for name in ("0012_png-0", "0012_png-1", "0013_png-0"):
        (node.pictures / f".claim-{name}").write_text("0123456789abcdef node 4711\n")
    submit(node)


@contextmanager
def _moved_into(folder):
    """Gives a list that gets the names of all files that are moved into a folder, at the end."""
    libc = ctypes.CDLL(None, use_errno=True)
    watch, moved_to = libc.inotify_init1(os.O_NONBLOCK), 0x80
    assert libc.inotify_add_watch(watch, os.fsencode(folder), moved_to) >= 0
    names = []
    try:
        yield names
        events = os.read(watch, 1 << 20)
        while events:
            length = 16 + struct.unpack_from("iIII", events)[3]
            names.append(events[16:length].rstrip(b"\0").decode())
            events = events[length:]
    finally:
        os.close(watch)


def test_two_schedulers_at_once(whole, node, submit):
    """While one worker has claimed frames, another works on the rest: none is rendered twice."""
    _put(node, whole, ())
    with _moved_into(node.pictures) as moved:
        first = _started(node.render())
        _wait_for(lambda: list(node.pictures.glob(".claim-*")), first)
        first.send_signal(signal.SIGSTOP)
        second = _started(node.render())
        _wait_for(lambda: _pictures(node), second)
        first.send_signal(signal.SIGCONT)
        ended = [_ended(first), _ended(second)]
        assert [(code, _without_waiting(said)) for code, said in ended] == [(0, "")] * 2
    assert sorted(moved) == sorted(_pictures(whole))
    assert _pictures(node) == _pictures(whole)
    submit(node)


PLANT = """
import os, sys
import bpy

edit, marker = sys.argv[1:]
bpy.ops.wm.open_mainfile(filepath=edit)
text = bpy.data.texts.new("startup.py")
text.write(f"__import__('pathlib').Path({marker!r}).touch()")
text.use_module = True
bpy.ops.wm.save_mainfile()
bpy.ops.wm.open_mainfile(filepath=edit, use_scripts=True)
os.remove(marker)  # which the script has made
"""


def test_scripts_of_a_stranger_are_not_run(node, worker, tmp_path):
    marker = tmp_path / "was run"
    subprocess.run([sys.executable, "-c", PLANT, node.edit, marker], check=True, capture_output=True)
    for step in node.steps():
        assert worker(*step) == (0, "")
    assert not marker.exists()
