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
    except Exception as error:  # whatever stands there by that name
        return _refuse(f"Blender as a library cannot be used: {error!r}")
    try:
        return command(sys.argv[1:])
    finally:
        blender.unregister()  # what sources still hold then, OpenImageIO reports as leaked
        _flush()


def _refuse(sentence: str) -> int:
    from .core.messages import signed

    print(signed(sentence), file=sys.stderr)
    return 2


def _open_streams() -> None:
    """A stream that is closed gets the null device: else the next file gets its number, and what Blender prints."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 (as long as the process lives)


def _flush() -> None:
    """Where nobody reads what was printed (a pipe's end that is closed), it is no fault of the film."""
    try:
        sys.stdout.flush()
    except OSError:
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


if __name__ == "__main__":
    sys.exit(main())
