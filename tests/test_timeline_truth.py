"""Sped-up footage with Length: Timeline beside what Cycles films of a scene that runs as fast, as
scripts/timeline_truth.py measures it, on one small frame of each case."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def test_it_is_blurred_as_cycles_own(tmp_path):
    pytest.importorskip("bpy")
    command = [sys.executable, "scripts/timeline_truth.py", "--output", str(tmp_path / "out"), "--frames", "1"]
    command += ["--json", str(tmp_path / "rows.json"), "--size", "320x180", "--samples", "128"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = {(row["case"], row["picture"]): row for row in json.loads((tmp_path / "rows.json").read_text())}
    for case in ("eight times", "ramp"):
        assert rows[case, "timeline"]["similarity"] >= 0.97
        assert rows[case, "timeline"]["length"] == pytest.approx(rows[case, "timeline"]["truth"], rel=0.02)
    assert rows["ramp", "bars"]["similarity"] < 0.95
    assert rows["ramp", "bars"]["length"] > 2 * rows["ramp", "bars"]["truth"]
    assert (tmp_path / "out" / "timeline_truth.png").exists()
