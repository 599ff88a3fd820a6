"""Run the extension's commands with Blender as a Python library: `python -m shutter_addon render …`.

blender/command.py has the commands. They need the package bpy.
"""

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
    """Print an error message to stderr and return the exit status 2."""
    from .core.messages import signed

    print(signed(sentence), file=sys.stderr)
    return 2


def _open_streams() -> None:
    """Open standard streams that are closed on the null device.

    Otherwise the next file that is opened would get a stream's descriptor, and Blender would print into that file.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 (stays open)


def _flush() -> None:
    """Flush stdout, and ignore that its reader may have gone: the film is written all the same."""
    try:
        sys.stdout.flush()
    except OSError:
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


if __name__ == "__main__":
    sys.exit(main())
