"""The command `benchmark`: what it prints is what it measured, of pictures that are right."""

import json
import re
from types import SimpleNamespace

import numpy as np
import pytest

from shutter_addon.blender import command as program
from shutter_addon.blender.devices import machine
from shutter_addon.compute import benchmark, cpu
from shutter_addon.devices.device import NoDeviceError

TINY = "--sizes", "40x24,64x36", "--windows", "3,8"


@pytest.fixture
def measured(bpy, capsys, monkeypatch):
    """Runs the command in this process, with two lengths to look for: its exit code, stdout, stderr."""
    monkeypatch.setattr(benchmark, "LENGTHS", (2, 5))

    def run(*arguments):
        code = program.main(["benchmark", *map(str, arguments)])
        return code, *capsys.readouterr()

    return run


@pytest.mark.parametrize("device", ["auto", "cpu"])
def test_it_prints_what_it_writes(measured, tmp_path, device):
    file = tmp_path / "new" / "rows.json"
    code, printed, told = measured(*TINY, "--device", device, "--json", file)
    assert (code, told) == (0, "")
    found = json.loads(file.read_text(encoding="utf-8"))
    assert [path.name for path in file.parent.iterdir()] == ["rows.json"]
    assert [f"- {heading}: {value}" for heading, value in found["machine"].items()] == printed.splitlines()[
        : len(found["machine"])
    ]
    assert {"Virtual Shutter", "Blender", "Device", "Processor", "Memory", "System"} <= found["machine"].keys()
    assert benchmark.table(found["rows"], found["plays"]) in printed
    assert [(row["width"], row["height"], row["window"]) for row in found["rows"]] == [
        (40, 24, 3), (40, 24, 8), (64, 36, 3), (64, 36, 8),
    ]  # fmt: skip
    for row in found["rows"]:
        assert row["ms"] > 0
        assert row["fps"] == pytest.approx(1000 / row["ms"])
        assert row["error"] < 0.5
        assert (row["memory"] is None) == (device == "cpu")
    assert (found["machine"]["Device"] == "NumPy") == (device == "cpu")


def test_a_row_of_the_table():
    row = {"width": 1920, "height": 1080, "window": 16, "ms": 12.34, "readback_ms": 5.67, "fps": 81.03}
    row |= {"memory": 3 << 20, "error": 0.25}
    left_out = {"width": 3840, "height": 2160, "window": 64, "left_out": "too slow"}
    plays = [
        {"width": 1920, "height": 1080, "window": 48},
        {"width": 3840, "height": 2160, "window": None},
        {"width": 8, "height": 8, "window": 48, "left_out": "too slow"},
        {"width": 9, "height": 8, "window": None, "left_out": "too slow"},
    ]
    lines = benchmark.table([row, left_out], plays).splitlines()
    assert lines[2] == "| 1920×1080 | 16 | 12.3 | 81.0 | 5.7 | 3 | 0.25 |"
    assert lines[3].startswith("| 3840×2160 | 64 | too slow |")
    assert [line.split("|")[2].strip() for line in lines[-4:]] == ["48", "none", "48 or more", "not measured"]
    assert {line.count("|") for line in lines[:4]} == {8}


def test_a_wrong_picture_is_seen(monkeypatch):
    """A device that mixes up its frames, as a faulty driver might."""
    monkeypatch.setattr(cpu, "linear", lambda frame, source: np.full(frame.shape, 0.2, np.float32))
    assert benchmark.measure(cpu.CPUCompositor(), (40, 24), 8)["error"] > 10


def test_the_largest_window_that_plays(monkeypatch):
    asked = []

    def row(limit):
        def found(_size, window):
            asked.append(window)
            return {"left_out": "no room"} if window > 100 else {"fps": 30 if window <= limit else 10}

        return SimpleNamespace(row=found)

    for limit, largest in ((1, None), (2, 2), (50, 48), (300, 96)):
        assert benchmark.largest_that_plays(row(limit), (8, 8)) == {"width": 8, "height": 8, "window": largest}
    asked.clear()
    benchmark.largest_that_plays(row(1), (8, 8))
    assert asked == [2]


def test_what_would_take_too_long_is_left_out(measured):
    code, printed, _ = measured(*TINY, "--device", "cpu", "--seconds", "0")
    assert code == 0
    # The first measurement begins in any case: how long the next will take is known by it.
    assert printed.count("too slow") == 4
    assert re.search(r"\| 64×36 \| not measured \|", printed)


def test_a_quick_row_does_not_hide_a_slow_one(monkeypatch):
    now, seconds = [0.0], {4: 50.0, 5: 0.1, 6: 0.1}

    def measure(_compositor, _size, window):
        now[0] += seconds[window]
        return {"window": window}

    monkeypatch.setattr(benchmark, "measure", measure)
    monkeypatch.setattr(benchmark, "time", SimpleNamespace(monotonic=lambda: now[0]))
    rows = benchmark.Timetable(None, 107)
    assert [rows.row((8, 8), window).get("left_out") for window in (4, 5, 6)] == [None, None, "too slow"]


def test_without_gl_it_measures_numpy_and_says_why(measured, monkeypatch):
    reason = "no OpenGL 4.3: none; composing with NumPy, which is slow"
    monkeypatch.setattr(machine, "open_device", lambda wanted: (cpu.CPUCompositor(), reason))
    code, printed, _ = measured("--sizes", "40x24", "--windows", "3")
    assert code == 0
    assert f"- Device: NumPy\n- Because: {reason}\n" in printed


def refuses(wanted):
    raise NoDeviceError("no OpenGL 4.3: none")


def test_a_device_that_is_not_there(measured, monkeypatch, tmp_path):
    monkeypatch.setattr(machine, "open_device", refuses)
    assert measured("--device", "gpu", "--json", tmp_path / "o.json") == (
        2,
        "",
        "Virtual Shutter: no OpenGL 4.3: none\n",
    )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "arguments",
    [
        ("--sizes", "0x24"),
        ("--sizes", "40"),
        ("--sizes", "40x24,"),
        ("--sizes", "99999x9"),
        ("--windows", "1"),
        ("--windows", "257"),
        ("--windows", "8,x"),
        ("--seconds", "soon"),
        ("--seconds", "nan"),
        ("--device", "tpu"),
        ("SOURCE",),
    ],
)
def test_bad_arguments(measured, arguments):
    code, printed, told = measured(*arguments)
    assert (code, printed) == (2, "")
    assert told


def test_a_file_that_cannot_be_written(measured, tmp_path):
    (tmp_path / "file").write_text("")
    code, printed, told = measured(*TINY, "--json", tmp_path / "file" / "rows.json")
    assert (code, printed) == (2, "")
    assert len(told.splitlines()) == 1
