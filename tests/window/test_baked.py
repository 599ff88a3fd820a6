"""An effect is baked beside Blender, in a real window."""

import json
import shutil

import numpy as np
import pytest
from screens import pixels
from telling import ROOT, backends, linked, needs_window, tell

pytestmark = needs_window


@pytest.mark.parametrize("backend", backends("vulkan"))
def test_an_effect_is_baked_and_brought_back(backend, tmp_path):
    line = {"shutter": "Sharp", "kind": "line", "width": 0.03, "strokes": [[[0.462, 0.65], [0.468, 0.565]]]}
    shutters = [{"name": "Long", "bars": [1] * 16}, {"name": "Sharp", "bars": [0] * 8 + [1] + [0] * 7}]
    recipe = tmp_path / "recipe.json"
    recipe.write_text(json.dumps({"version": 2, "window": 16, "border": True, "shutters": shutters, "regions": [line]}))
    footage = shutil.copy(ROOT / "assets" / "walkers.mp4", tmp_path)
    seen, console = tell("bake_story.py", backend, linked(tmp_path), footage=footage, recipe=recipe)
    assert "Traceback" not in console
    facts = {name: value for entry in seen for name, value in entry.items()}
    expected = {"muted": True, "handles": [1, 41], "unbaked": True, "undone": True, "stopped": True, "resumed": True}
    assert facts == expected
    apart = np.abs(pixels(tmp_path / "baked.png").astype(int) - pixels(tmp_path / "effect.png"))
    assert np.percentile(apart, 99) <= 4
    assert apart.mean() <= 0.8
    assert not list(tmp_path.glob("*.bake-*.blend")), "copies of the edit are gone"
