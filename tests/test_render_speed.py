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


def run(clip, file, **variables):
    command = [sys.executable, "scripts/render_speed.py", str(clip), "--window", "4", "--rounds", "2"]
    environment = os.environ | variables
    return subprocess.run(
        [*command, "--json", str(file)], cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    )


def test_rows(clip, tmp_path):
    done = run(clip, tmp_path / "rows.json")
    rows = {row["way"]: row for row in json.loads((tmp_path / "rows.json").read_text())}
    assert set(rows) == {"ours", "constant"} | ({"average"} if shutil.which("ffmpeg") else set())
    for row in rows.values():
        assert (row["width"], row["height"], row["window"], row["frames"]) == (96, 64, 4, 12)
        assert len(row["all"]) == 2
        assert row["fps"] > 0
    assert rows["ours"]["error"] < 1.5
    assert done.stdout.count("ours is") == len(rows) - 1


def test_without_ffmpeg(clip, tmp_path):
    done = run(clip, tmp_path / "rows.json", PATH=str(tmp_path))
    assert "no ffmpeg on the PATH" in done.stderr
    assert {row["way"] for row in json.loads((tmp_path / "rows.json").read_text())} == {"ours", "constant"}


def test_a_film_that_is_not_there_is_one_sentence():
    command = [sys.executable, "scripts/render_speed.py", "none.mp4"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("render_speed: none.mp4: no such file")
