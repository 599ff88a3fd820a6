"""The script that times whole renders runs, checks its films, and gives a row for each way."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
PARTS = ("encoder", "composition", "decoding", "device", "engine", "blender")


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """A bright square that moves over noise: 12 frames, 96×64."""
    path = tmp_path_factory.mktemp("clip") / "clip.mp4"
    noise = np.random.default_rng(0).integers(40, 90, (8, 12, 3), dtype=np.uint8).repeat(8, 0).repeat(8, 1)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25, options={"qp": "5"})
        stream.width, stream.height, stream.pix_fmt = 96, 64, "yuv420p"
        for i in range(12):
            picture = noise.copy()
            picture[16:48, 4 * i : 4 * i + 32] = 220
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    return path


def run(clip, file, rounds=2, **variables):
    command = [sys.executable, "scripts/render_speed.py", str(clip), "--window", "4", "--rounds", str(rounds)]
    environment = os.environ | variables
    return subprocess.run(
        [*command, "--json", str(file)], cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    )


@pytest.fixture(scope="module")
def done(clip, tmp_path_factory):
    """(the script's output, its rows by way)."""
    file = tmp_path_factory.mktemp("rows") / "rows.json"
    output = run(clip, file).stdout
    return output, {row["way"]: row for row in json.loads(file.read_text())}


def test_rows(done):
    output, rows = done
    assert set(rows) == {"ours", "saved", "plain", "echo"} | ({"tmix"} if shutil.which("ffmpeg") else set())
    for row in rows.values():
        assert (row["film"], row["width"], row["height"], row["window"], row["frames"]) == ("clip.mp4", 96, 64, 4, 12)
        assert row["fps"] > 0
        assert row["cpu_ms"] > 0
    for way in {"ours", "saved", "plain", "echo"}:
        assert rows[way]["error"] < 1.5
    assert "ours is 1.00 of ours" in output


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="the system does not tell time by thread")
def test_parts_make_the_whole(done):
    _, rows = done
    for way in ("ours", "plain", "echo"):
        row = rows[way]
        parts = {name: row[f"{name}_ms"] for name in PARTS}
        assert min(parts.values()) > -5, parts  # two clocks, one of hundredths of a second
        outside = row["cpu_ms"] - row["encoder_ms"] - row["composition_ms"]
        assert row["outside_ms"] == pytest.approx(outside, abs=0.1 * row["cpu_ms"])
    assert rows["ours"]["composition_ms"] > 0
    assert rows["ours"]["engine_ms"] > 0
    assert rows["plain"]["composition_ms"] == rows["plain"]["engine_ms"] == 0


def test_without_ffmpeg(clip, tmp_path):
    done = run(clip, tmp_path / "rows.json", rounds=1, PATH=str(tmp_path))
    assert "no ffmpeg on the PATH" in done.stderr
    assert {row["way"] for row in json.loads((tmp_path / "rows.json").read_text())} == {
        "ours",
        "saved",
        "plain",
        "echo",
    }
