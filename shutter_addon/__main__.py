"""`python -m shutter_addon render …` with the bpy wheel; see blender/command.py."""

import os
import sys
from contextlib import suppress

STOPPED = 130


def main() -> int:
    _open_streams()
    try:
        import bpy  # noqa: F401

        from . import blender
        from .blender.command import main as command

        blender.register()
    except KeyboardInterrupt:
        return STOPPED
    except ImportError as error:
        missing = "Blender as a library is needed (Python 3.13: pip install bpy); or run scripts/setup"
        return _refuse(missing if error.name == "bpy" else f"Blender as a library cannot be used: {error}")
    except Exception as error:  # any other module of that name
        return _refuse(f"Blender as a library cannot be used: {error!r}")
    try:
        return command(sys.argv[1:])
    finally:
        blender.unregister()  # else OpenImageIO reports open sources as leaks
        _flush()


def _refuse(sentence: str) -> int:
    from .core.messages import signed

    print(signed(sentence), file=sys.stderr)
    return 2


def _open_streams() -> None:
    """Open closed standard streams on the null device, so that no file gets their numbers and Blender's output."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 (stays open)


def _flush() -> None:
    """Flush stdout. A closed pipe is not an error of the film."""
    try:
        sys.stdout.flush()
    except OSError:
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


if __name__ == "__main__":
    sys.exit(main())
