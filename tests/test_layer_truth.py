"""Layers beside the truth, as scripts/layer_truth.py measures it, on small frames."""

import json
import subprocess
import sys

from gallery.item import ROOT

# In a process of its own: an empty scene would take the other tests' edits away.
MEASURE = """
import json, sys
from pathlib import Path
sys.path.insert(1, "scripts")
import layer_truth as truth
folder = Path(sys.argv[1])
scene = truth.SCENES[0]
case = truth.render(scene, folder / "parts", (160, 90), samples=8)
print(json.dumps(truth.measure(case, folder)))
"""


def test_layers_are_near_the_truth(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", MEASURE, str(tmp_path)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout.splitlines()[-1])
    found = {(row["picture"], row["way"]): row for row in rows}
    for picture in ("sharp subject", "clean trail"):
        ways = "without the switch", "layer, true matte", "layer, Cryptomatte"
        before, after, cryptomatte = (found[picture, way] for way in ways)
        assert before["ring"] < 30
        assert min(after["ring"], cryptomatte["ring"]) >= 36
        assert after["same bits elsewhere"]
    assert found["clean trail", "layer, true matte"]["plate"] >= 40
