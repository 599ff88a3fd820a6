"""`python -m shutter_addon render …` with the bpy wheel; see blender/commands.py."""

import sys


def main() -> int:
    try:
        import bpy  # noqa: F401
    except ImportError:
        print(
            "Virtual Shutter: Blender as a library is needed (Python 3.13: pip install bpy); or run scripts/setup",
            file=sys.stderr,
        )
        return 2
    from . import blender
    from .blender.commands import main as command

    blender.register()
    try:
        return command(sys.argv[1:])
    finally:
        blender.unregister()  # what sources still hold then, OpenImageIO reports as leaked


if __name__ == "__main__":
    sys.exit(main())
