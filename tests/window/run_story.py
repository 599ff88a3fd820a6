"""Run a story in a Blender with a window: the generator function `steps` of the module that SHUTTER_STORY names.

SHUTTER_PICTURES is the folder for pictures and facts, SHUTTER_PACKAGES one of packages that a Blender of a distribution
need not have; SHUTTER_HIDDEN has the names of packages that this Blender shall lack.
"""

import os
import sys
from importlib import import_module
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "blender")]
sys.path += filter(None, [os.environ.get("SHUTTER_PACKAGES")])
sys.modules |= dict.fromkeys(os.environ.get("SHUTTER_HIDDEN", "").split())  # None: there is no such module

import driver  # noqa: E402 - Blender finds it now

driver.play(import_module(os.environ["SHUTTER_STORY"]).steps)
