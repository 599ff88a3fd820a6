"""Features can be removed: each by its folder and its name in FEATURES. The tests of the core then still pass."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from shutter_addon.features import FEATURES

ROOT = Path(__file__).parents[2]
KEPT = "shutter_addon", "shaders", "tests", "models", "pyproject.toml", "blender_manifest.toml"
CORE = "test_editing", "test_snapshot", "test_timing"


@pytest.mark.parametrize("feature", FEATURES)
def test_the_core_works_without_it(tmp_path, feature):
    for name in KEPT:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, tmp_path / name)
    listed = tmp_path / "shutter_addon" / "features" / "__init__.py"
    shutil.rmtree(listed.parent / feature)
    listed.write_text(re.sub(rf'    "{feature}",\n', "", listed.read_text(encoding="utf-8")), encoding="utf-8")
    tests = [f"tests/blender/{name}.py" for name in CORE]
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--tb=short", *tests]
    done = subprocess.run(
        command, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-4000:]
