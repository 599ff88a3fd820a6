"""The OpenColorIO configuration that Blender has taken, where it is not its own."""

import hashlib
import os
from functools import cache
from pathlib import Path

import bpy


def name() -> str:
    """Of one that OpenColorIO brings, its name; of a file, its SHA-256 in hexadecimal; "": Blender's own, wherever it
    is installed. Of the tables that a file names, only the names count."""
    # Blender itself sets OCIO to its own file as it starts, and what it starts inherits that.
    path = os.environ.get("BLENDER_OCIO", os.environ.get("OCIO", ""))
    if path.startswith("ocio://"):
        return path
    digest = _digest(Path(path))
    return "" if digest == _own() else digest


@cache
def _own() -> str:
    return _digest(Path(bpy.utils.system_resource("DATAFILES", path="colormanagement")) / "config.ocio")


def _digest(path: Path) -> str:
    """ "": there is no such file; Blender then takes its own."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""
