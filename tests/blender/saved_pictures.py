"""Pictures of what a version has saved (tests/saved): of its edit, and of its footage by its recipes."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from support import read_picture, write_frames

from shutter_addon.blender import command


def rendered(folder: Path, name: str, frame: int, out: Path) -> np.ndarray:
    """A frame as the command renders it now (H, W, 3 or 4) uint8. name: the edit's or a recipe's; out: a new folder"""
    footage, recipe = folder / "footage" / "f0001.png", folder / f"{name}.json"
    what = [folder / "edit.blend"] if name == "edit" else [footage, "--recipe", recipe]
    assert command.main(["render", *map(str, what), "--frames", str(frame), "--output", str(out)]) == 0
    (picture,) = out.glob("*.png")
    return np.round(read_picture(picture)).astype(np.uint8)


def keep(folder: Path, name: str, frame: int, picture: np.ndarray) -> None:
    write_frames(folder / "pictures", [picture], f"{name}-{frame}-")


def kept(folder: Path) -> Iterator[tuple[str, int, np.ndarray]]:
    """Name, frame and picture of all that were kept."""
    for path in sorted((folder / "pictures").iterdir()):
        name, frame, _ = path.name.split("-")
        yield name, int(frame), read_picture(path)
