"""Keep files of this version, which every later one has to open: tests/saved/VERSION.

    .venv/bin/python scripts/save_version.py

Run it before each release. It never writes over a folder. A folder has an edit with everything that the extension
stores, recipes with every kind of part, frames of both as this version renders them, and all stored values and names.
"""

from __future__ import annotations

import json
import sys
import tempfile
import tomllib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "blender"))

import bpy
import saved_edit
import saved_pictures
import stored

from shutter_addon import blender

ROOT = Path(__file__).resolve().parents[1]
SAVED = ROOT / "tests" / "saved"


def main() -> None:
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    folder = SAVED / manifest["version"]
    if folder.exists():
        _fail(f"{folder.relative_to(ROOT)}: is there already, and stays what that version has saved")
    blender.register()
    bpy.context.preferences.filepaths.save_version = 0  # no edit.blend1
    SAVED.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".", dir=SAVED) as temporary:
        made = Path(temporary) / "saved"
        make(made)
        made.rename(folder)
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    print(f"{folder.relative_to(ROOT)}: {size / 1000:.0f} kB")


def make(folder: Path) -> None:
    """Makes the folder of a version, but for its name."""
    saved_edit.write_footage(folder / "footage")
    saved_edit.make(folder / "edit.blend")
    bpy.ops.wm.open_mainfile(filepath=str(folder / "edit.blend"))
    if unused := stored.unused():
        _fail(f"scripts/saved_edit.py gives no value to {', '.join(sorted(unused))}")
    _write(folder / "values.json", stored.values())
    _write(folder / "names.json", stored.names())
    for name in saved_edit.RECIPES:
        _write(folder / f"{name}.json", getattr(saved_edit, name)())
    shown = [("edit", frame) for frame in saved_edit.SHOWN] + list(saved_edit.RECIPES.items())
    for name, frame in shown:
        picture = saved_pictures.rendered(folder, name, frame, folder.with_name(f"{name}{frame}"))
        saved_pictures.keep(folder, name, frame, picture)


def _write(path: Path, data: dict) -> None:
    path.write_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _fail(reason: str) -> None:
    sys.exit(f"save_version: {reason}")


if __name__ == "__main__":
    main()
