"""Coefficients that follow edges are quiet where a film stands still, by what scripts/edge_flicker.py measures."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]


def measured(folder, *options) -> list[dict]:
    file = folder / "rows.json"
    command = [sys.executable, "scripts/edge_flicker.py", "--frames", "2", "--aggregate", "4", "--json", str(file)]
    subprocess.run([*command, *options], cwd=ROOT, check=True)
    return json.loads(file.read_text())


def test_they_change_by_less_than_a_level(tmp_path):
    rows = measured(tmp_path, "--noise", "8", "--films", "pedestrians.avi")
    steadied, alone = ({row["guide"]: row for row in rows}[way] for way in ("steadied", "alone"))
    assert steadied["still"] > 0.5
    assert 0 < steadied["mean"] < min(alone["mean"], 1)


def test_a_pixel_stands_still_where_all_around_it_does():
    sys.path.insert(0, str(ROOT / "scripts"))
    import edge_flicker

    first = np.full((60, 80, 4), 100, np.uint8)
    second = first.copy()
    second[30, 40, 1] = 255  # 155 levels, 0.69 on average around it
    second[:15, :15, 2] = 102
    found = edge_flicker.still(first, second, 1)
    assert not found[:7, :7].any()
    assert found[30:, 30:].all()
