"""Let the media layer decode movies by a second Blender, where PyAV is missing."""

import sys
from pathlib import Path

import bpy

from ...media import blender_movie

_SCRIPT = Path(__file__).with_name("decoding_process.py")


def _command() -> list[str]:
    """Return the command that runs the script in a Blender without user settings and network."""
    if not bpy.app.binary_path:  # Blender as a library
        return [sys.executable, str(_SCRIPT)]
    alone = ["--background", "--factory-startup", "--offline-mode", "-noaudio"]
    return [bpy.app.binary_path, *alone, "--python", str(_SCRIPT), "--"]


def register() -> None:
    blender_movie.lend(_command())


def unregister() -> None:
    blender_movie.lend(None)
