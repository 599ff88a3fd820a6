"""Rolling Shutter Repair beside Cycles' camera that reads all rows at once, as scripts/rolling_truth.py measures it, on
small pictures of one readout."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def test_the_repair_is_cycles_own_picture(tmp_path):
    pytest.importorskip("bpy")
    command = [sys.executable, "scripts/rolling_truth.py", "--output", str(tmp_path / "out"), "--readouts", "50"]
    command += ["--json", str(tmp_path / "rows.json"), "--size", "240x136", "--samples", "32"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert len(rows) == 3
    for row in rows:
        assert row["psnr"] >= 32
        assert row["psnr"] >= row["unrepaired"] + 3
        assert row["bent"] <= 0.5 < row["skewed"]
        assert float(row["found"].removesuffix(" %")) == pytest.approx(50, rel=0.1)
    assert (tmp_path / "out" / "rolling_truth.png").exists()
