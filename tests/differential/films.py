"""Renders with the product's command, one film after the other in one Blender. A JSON list comes by stdin, of the
arguments of each; the exit code is not 0 where one of them failed."""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy  # noqa: F401 (before all that needs it)

from shutter_addon import blender
from shutter_addon.blender.command import main

blender.register()
failed = [arguments for arguments in json.load(sys.stdin) if main(arguments)]
blender.unregister()
sys.exit(bool(failed))
