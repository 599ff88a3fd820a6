"""Checks that take long and depend on few files, so that they need not run for every commit.

`scripts/test --all` runs them as well, as before a release, and notes in checked.json the hash of the files that each
group of them depends on. Other runs leave a group out while its files are as noted. Each group holds its own tests.
"""

import ast
import hashlib
import json
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
CHECKED = Path(__file__).with_name("checked.json")
_BUILD = "scripts/build.py", "scripts/components.py", "scripts/fetch_model.py", "scripts/without_openssl.py"
_BUILD += "blender_manifest.toml", "pyproject.toml", "third_party/**/*"
_WITHOUT_WHEELS = "tests/window/test_random.py::test_random_operators_of_the_zip_without_wheels"
# By group: how the names of its tests begin, and the files that it depends on.
GROUPS = {
    "packages": (
        ["tests/test_package.py", "tests/test_release.py", "tests/window/test_installed.py", _WITHOUT_WHEELS],
        [*_BUILD, "scripts/release.py", "tests/window/finished_film.py", "tests/window/random_story.py"],
    ),
    "licences": (
        ["tests/test_licences.py", "tests/test_sbom.py"],
        [*_BUILD, "scripts/sbom.py", "REUSE.toml", "LICENSES/*"],
    ),
    "workflows": (
        ["tests/test_github.py", "tests/farm/test_workflows.py", "tests/farm/test_openjd.py"],
        [".github/**/*", "farm/**/*", "scripts/setup", "scripts/test", "shutter_addon/**/*_command.py"],
    ),
    "Slurm": (["tests/farm/test_slurm.py"], ["farm/slurm*", "shutter_addon/blender/commands/*.py"]),
    "set-up": (["tests/test_setup.py"], ["scripts/setup", "scripts/fetch_*.py"]),
    "life of Blender's GPU": (
        [
            "tests/window/test_rendered.py::test_blender_lives_where_its_gpu_is_not_current",
            "tests/window/test_rendered.py::test_films_on_blenders_own_gpu",
            "tests/window/test_rendered.py::test_preview_and_film_take_turns_where_the_gpu_is_small",
        ],
        [
            *("tests/window/gpu_*.py", "tests/window/own_gpu_story.py", "tests/window/memory_story.py"),
            *("shutter_addon/compute/devices/*.py", "shutter_addon/blender/devices/*.py"),
            "shutter_addon/blender/rendering/*.py",
        ],
    ),
    "tracking by mouse": (
        ["tests/window/test_tracked.py::test_one_stroke"],
        [
            "tests/window/one_stroke_story.py",
            *("shutter_addon/features/tracking/tracking.py", "shutter_addon/features/tracking/registration.py"),
            *("shutter_addon/features/tracking/blender/track_*.py", "shutter_addon/blender/editing/motion_keys.py"),
            *("shutter_addon/blender/data/selection.py", "shutter_addon/blender/interface/region_gizmo.py"),
        ],
    ),
    "features": (
        ["tests/blender/test_features.py"],
        ["shutter_addon/features/**/*.py", "shutter_addon/blender/**/*.py"],
    ),
    "Metal": (["tests/compute/test_metal.py"], ["shaders/**/*", "shutter_addon/compute/devices/passes.py"]),
    "planted faults": (["tests/differential/test_planted.py"], ["tests/differential/*.py"]),
    "measures": (
        ["tests/test_measures.py"],
        [
            *("scripts/*.py", "shaders/**/*", "shutter_addon/media/flow.py"),
            *("shutter_addon/core/**/*.py", "shutter_addon/compute/**/*.py"),
        ],
    ),
}


def _content(file: Path) -> bytes:
    """Return what counts of a file: of Python code, neither docstrings nor comments. It differs between Pythons."""
    if file.suffix != ".py":
        return file.read_bytes()
    tree = ast.parse(file.read_bytes())
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body[0] = ast.Pass()
    return ast.dump(tree).encode()


def fingerprint(group: str) -> str:
    """Return the hash of a group's tests and of the files that they depend on."""
    patterns = [pattern.partition("::")[0] for listed in GROUPS[group] for pattern in listed]
    files = {file for pattern in patterns for file in ROOT.glob(pattern) if file.suffix != ".pyc" and file.is_file()}
    found = hashlib.sha256()
    for file in sorted(files):
        found.update(file.relative_to(ROOT).as_posix().encode() + b"\0" + _content(file))
    return found.hexdigest()


def _noted() -> dict[str, str]:
    return json.loads(CHECKED.read_text()) if CHECKED.exists() else {}


@cache  # for the header and for the tests
def unchanged() -> set[str]:
    """Return the groups whose files are as they were when their tests last passed."""
    noted = _noted()
    return {group for group in GROUPS if noted.get(group) == fingerprint(group)}


def left_out(names: list[str]) -> set[str]:
    begins = tuple(begin for group in unchanged() for begin in GROUPS[group][0])
    return {name for name in names if name.startswith(begins)}


def note(outcomes: dict[str, set[str]]) -> None:
    """Note the groups that have passed.

    Args:
        outcomes: By the name of each test that was run, what its steps came to.
    """
    noted = _noted()
    for group, (begins, _) in GROUPS.items():
        of_each = [[found for name, found in outcomes.items() if name.startswith(begin)] for begin in begins]
        if all(found and all(each == {"passed"} for each in found) for found in of_each):
            noted[group] = fingerprint(group)
    CHECKED.write_text(json.dumps(noted, indent=1, sort_keys=True) + "\n")
