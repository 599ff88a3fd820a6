"""The command line: `python -m shutter_addon render …`, or `blender -c shutter render …` in an installed Blender.

Each command, such as `render`, is a module `NAME_command` in commands/ or in a feature. The module has HELP (a sentence
for `--help`), `add(parser)` (adds its options) and `run(arguments)`.
"""

import argparse
import traceback
from importlib import import_module
from pathlib import Path

from .. import features
from ..compute.devices.device import NoDeviceError
from ..core.messages import UserError, of_file
from ..media.files import check_name
from .output import film_output
from .rendering import render_job, render_settings

PLACES = ("output", "save", "json", "source", "edit")  # options to name where an OSError names no file
COMMANDS = "render", "check"


def main(argv: list[str]) -> int:
    """Parse the arguments, run the command that they name, and return the process's exit code.

    Args:
        argv: The arguments after the program's name, such as ["render", "a.mp4", "--output", "out"].

    Returns:
        0 if it succeeded, and after --help. 2 if it failed: stderr then has the reason, in one sentence, or for `check`
        a sentence for each fault. film_output.INTERRUPTED (130) if it was interrupted, as by Ctrl-C.
    """
    parser, arguments = _parser(), None
    try:
        arguments = parser.parse_args(argv)
        for path in vars(arguments).values():
            if isinstance(path, Path):
                check_name(path)
        names = "device", "weights", "gpu_memory"
        with render_settings.using(**{name: getattr(arguments, name, None) for name in names}):
            arguments.run(arguments)
    except SystemExit as stop:  # argparse, after --help or a message on stderr
        return int(stop.code or 0)
    except KeyboardInterrupt:  # between the frames of a render; finished ones stay
        return film_output.INTERRUPTED
    except film_output.InterruptedRenderError as stopped:
        return _refuse(str(stopped), film_output.INTERRUPTED)
    except (UserError, NoDeviceError, MemoryError) as error:
        return _refuse(str(error) or "not enough memory")
    except OSError as error:
        places = (getattr(arguments, name, None) for name in PLACES)
        place = next((place for place in places if isinstance(place, Path)), "")
        return _refuse(of_file(error, place))
    except RuntimeError as error:  # from Blender
        return _refuse(film_output.message(error))
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        return _refuse(f"internal error: {error!r} in {Path(last.filename).name}, line {last.lineno}")
    return 0


def _refuse(reason: str, code: int = render_job.BAD_INPUT) -> int:
    render_job.say(reason)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("shutter", description="Every pixel its own exposure.")
    commands = parser.add_subparsers(dest="command", required=True)
    own = [import_module(f".commands.{name}_command", __package__) for name in COMMANDS]
    for command in (*own, *(module for module in features.modules() if module.__name__.endswith("_command"))):
        name = command.__name__.rpartition(".")[2].removesuffix("_command")
        options = commands.add_parser(name, help=command.HELP)
        command.add(options)
        options.set_defaults(run=command.run)
    return parser
