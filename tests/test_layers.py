"""The layers: core, media and compute never import bpy, and core needs no GL and no media libraries."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "shutter_addon"


@cache
def parsed(path):
    return list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


@cache
def imported(path):
    found = set()
    for node in parsed(path):
        if isinstance(node, ast.Import):
            found.update(name.name.split(".")[0] for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            dots = "." * node.level
            found.update([dots + node.module] if node.module else [dots + name.name for name in node.names])
    return found


BLENDER = {"bpy", "bpy_extras", "gpu", "mathutils", "bl_ui", "addon_utils"}
FORBIDDEN = {
    "core": BLENDER | {"moderngl", "av", "OpenImageIO", "media", "compute", "blender", "features"},
    "media": BLENDER | {"moderngl", "compute", "blender", "features"},
    "compute": BLENDER | {"av", "OpenImageIO", "media", "blender", "features"},
}


@pytest.mark.parametrize("layer", FORBIDDEN)
def test_no_leak(layer):
    files = list((PACKAGE / layer).rglob("*.py"))
    assert files
    for path in files:
        used = {name.split(".")[0] for name in imported(path) if name[0] != "."} | above(path, PACKAGE)
        assert not used & FORBIDDEN[layer], f"{path.name} imports {used & FORBIDDEN[layer]}"


def above(path, folder):
    """What a file imports from the top of a folder that it lies in, by its first name."""
    up = "." * len(path.relative_to(folder).parts)
    return {name.lstrip(".").split(".")[0] for name in imported(path) if re.match(re.escape(up) + r"\w", name)}


# The rooms of a layer, and what of their layer each may use. Beside those of core lies what all rooms use, beside those
# of the others what uses all rooms.
BASICS = {"atomic_write", "caches", "messages", "recent_errors", "revision", "scanlines", "stopping", "threads"}
ROOMS = {
    "core": {
        "frames": BASICS,
        "model": {"frames", *BASICS},
        "pixels": {"frames", "model", *BASICS},
        "recipes": {"frames", "model", *BASICS},
        "farm": BASICS,
    },
    "compute": {"devices": set()},
    "blender": {
        "data": set(),
        "devices": {"data"},
        "rendering": {"data", "devices"},
        "output": {"data", "devices", "rendering"},
        "editing": {"data", "rendering", "output"},
        "interface": {"data", "devices", "rendering", "output", "editing"},
        "commands": {"data", "devices", "rendering", "output", "editing"},
    },
}


@pytest.mark.parametrize("layer", ROOMS)
def test_rooms_use_those_below_them_alone(layer):
    folders = {path.name for path in (PACKAGE / layer).iterdir() if path.is_dir() and path.name != "__pycache__"}
    assert folders == ROOMS[layer].keys()
    for room, below in ROOMS[layer].items():
        for path in (PACKAGE / layer / room).rglob("*.py"):
            used = above(path, PACKAGE / layer)
            assert used <= below, f"{room}/{path.name} uses {used - below}"


def test_features_stand_alone():
    """What is outside of them asks for them by name; they use no other one, and bpy only in their folder `blender`."""
    for path in PACKAGE.rglob("*.py"):
        if not path.is_relative_to(PACKAGE / "features"):
            assert not any(re.search(r"\.features\.", name) for name in imported(path)), path
    for folder in (PACKAGE / "features").glob("*/"):
        for path in folder.rglob("*.py"):
            assert above(path, folder.parent) == set(), path
            if path.parent == folder:
                assert (imported(path) | above(path, PACKAGE)) & (BLENDER | {"blender"}) == set(), path


def test_what_all_rooms_of_core_use_needs_none():
    assert {path.stem for path in (PACKAGE / "core").glob("*.py")} == {"__init__", *BASICS}
    for name in BASICS:
        assert above(PACKAGE / "core" / f"{name}.py", PACKAGE / "core") <= BASICS


def test_only_the_gl_device_imports_moderngl():
    assert [path.name for path in PACKAGE.rglob("*.py") if "moderngl" in imported(path)] == ["gl.py"]


def test_no_two_modules_have_the_same_name():
    names = [path.stem for path in PACKAGE.rglob("*.py") if path.stem != "__init__"]
    assert sorted({name for name in names if names.count(name) > 1}) == []


def test_no_absolute_import_of_the_package():
    """An installed extension has another name."""
    for path in PACKAGE.rglob("*.py"):
        assert "shutter_addon" not in imported(path), path


def test_the_extensions_root_imports_lazily():
    root = ast.parse((PACKAGE.parent / "__init__.py").read_text(encoding="utf-8"))
    assert not any(isinstance(node, ast.Import | ast.ImportFrom) for node in root.body)


STARTERS = {"Thread", "Timer", "ThreadPoolExecutor", "ProcessPoolExecutor", "start_new_thread", "to_thread", "Process"}


def test_one_module_starts_threads():
    """Locks, events and futures may be anywhere; a thread's type may be told, from `threading` by its name."""
    found = []
    for path in PACKAGE.rglob("*.py"):
        called = [node.func for node in parsed(path) if isinstance(node, ast.Call)]
        made = {getattr(function, "attr", getattr(function, "id", "")) for function in called}
        taken = {name.name for node in parsed(path) if isinstance(node, ast.ImportFrom) for name in node.names}
        if (made | taken) & STARTERS or {"multiprocessing", "asyncio", "_thread"} & imported(path):
            found.append(path.relative_to(PACKAGE).as_posix())
    assert found == ["core/threads.py"]


def test_the_page_has_every_use_of_threads():
    """The table of docs/internals.md, by its first column."""
    page = (PACKAGE.parent / "docs" / "internals.md").read_text(encoding="utf-8")
    section = page.partition("\n## Threads\n")[2].partition("\n## ")[0]
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
    told = {place for row in rows for place in re.findall(r"`([\w/]+\.py)`", row)}
    uses = re.compile(r"\bthreads\.(start|pool|daemon|beside)\(")
    files = {path.relative_to(PACKAGE).as_posix(): path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")}
    assert told == {place for place, text in files.items() if uses.search(text)}
