"""Copies of effect strips: each gets a scene, an effect and keys of its own."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from support import write_frames

SCRIPT = """
import bpy
from shutter_addon import blender
from shutter_addon.blender.data import strips
from shutter_addon.blender.editing import add_effect, copies, shutter_edits
from shutter_addon.blender.editing import add_effect

blender.register()
edit = bpy.context.scene
source = edit.sequence_editor_create().strips.new_image("images", {path!r}, 1, 1)
strip, effect = add_effect.add_effect(edit, source)
shutter_edits.start(effect)
for i in range({count}):
    edit.sequence_editor.strips.new_scene("copy", effect.scene, 5, 200 + 100 * i)
copies.adopt()
effects = edit.virtual_shutter.effects
print("EFFECTS", [effect.start for effect in effects], len({{effect.scene.name for effect in effects}}))
"""


def test_many_copies_at_once(tmp_path):
    """Blender moves the items of a collection that grows; what is freed is filled here, so that no one reads on."""
    first = write_frames(tmp_path / "in", np.zeros((1, 24, 40, 3), dtype=np.uint8))
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(path=str(first), count=6)],
        env=os.environ | {"MALLOC_PERTURB_": "165"},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert "EFFECTS [1.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0] 7" in done.stdout, (done.returncode, done.stderr)
