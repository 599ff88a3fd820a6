"""Checks that take long and depend on few files, so that they need not run for every commit.

`scripts/test --all` runs them as well, as before a release, and notes in checked.json the hash of the files that each
group of them depends on. Other runs leave a group out while its files are as noted. Each group holds its own tests.
"""

import hashlib
import json
from pathlib import Path

ROOT = Path(__file__).parents[1]
CHECKED = Path(__file__).with_name("checked.json")
_BUILD = "scripts/build.py", "scripts/components.py", "scripts/fetch_model.py", "scripts/without_openssl.py"
_BUILD += "blender_manifest.toml", "pyproject.toml", "third_party/**/*"
# By group: its files of tests, and the files that it depends on.
GROUPS = {
    "packages": (
        ["tests/test_package.py", "tests/test_release.py", "tests/window/test_installed.py"],
        [*_BUILD, "scripts/release.py", "tests/window/without_wheels.py"],
    ),
    "licences": (
        ["tests/test_licences.py", "tests/test_sbom.py"],
        [*_BUILD, "scripts/sbom.py", "REUSE.toml", "LICENSES/*"],
    ),
    "workflows": (
        ["tests/test_github.py", "tests/farm/test_workflows.py", "tests/farm/test_openjd.py"],
        [".github/**/*", "farm/**/*", "scripts/setup", "scripts/test", "shutter_addon/blender/commands/*.py"],
    ),
    "Slurm": (["tests/farm/test_slurm.py"], ["farm/slurm*", "shutter_addon/blender/commands/*.py"]),
    "set-up": (["tests/test_setup.py"], ["scripts/setup", "scripts/fetch_*.py"]),
    "Metal": (["tests/compute/test_metal.py"], ["shaders/**/*", "shutter_addon/devices/passes.py"]),
    "measures": (
        ["tests/test_measures.py"],
        ["scripts/*.py", "shaders/**/*", "shutter_addon/core/**/*.py", "shutter_addon/media/flow.py"],
    ),
}


def fingerprint(group: str) -> str:
    """Return the hash of a group's tests and of the files that they depend on."""
    patterns = [pattern for listed in GROUPS[group] for pattern in listed]
    files = {file for pattern in patterns for file in ROOT.glob(pattern) if file.suffix != ".pyc" and file.is_file()}
    found = hashlib.sha256()
    for file in sorted(files):
        found.update(file.relative_to(ROOT).as_posix().encode() + b"\0" + file.read_bytes())
    return found.hexdigest()


def unchanged() -> set[str]:
    """Return the groups whose files are as they were when their tests last passed."""
    noted = json.loads(CHECKED.read_text()) if CHECKED.exists() else {}
    return {group for group in GROUPS if noted.get(group) == fingerprint(group)}


def left_out(items: list) -> list:
    """Return the tests, of all that were collected, that belong to unchanged groups."""
    files = {ROOT / name for group in unchanged() for name in GROUPS[group][0]}
    return [item for item in items if item.path in files]


def note(passed: set[str]) -> None:
    """Note groups all of whose files of tests were run and passed. passed: their paths, from the root"""
    noted = json.loads(CHECKED.read_text()) if CHECKED.exists() else {}
    noted |= {group: fingerprint(group) for group, (tests, _) in GROUPS.items() if passed.issuperset(tests)}
    CHECKED.write_text(json.dumps(noted, indent=1, sort_keys=True) + "\n")
