"""Let the media layer decode movies by a second Blender, where PyAV is missing."""

import sys
from pathlib import Path

import bpy

from ...media import blender_movie

_SCRIPT = Path(__file__).with_name("decoding_process.py")


# Options of a Blender without user settings and network.
_ALONE = "--background", "--factory-startup", "--offline-mode", "-noaudio"


def register() -> None:
    if bpy.app.binary_path:
        blender_movie.lend([bpy.app.binary_path, *_ALONE, "--python", str(_SCRIPT), "--"])
    else:  # Blender as a library
        blender_movie.lend([sys.executable, str(_SCRIPT)])


def unregister() -> None:
    blender_movie.lend(None)
