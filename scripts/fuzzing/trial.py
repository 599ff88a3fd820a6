"""One input in a process of its own, with limits of memory and time; and what the process did, judged from outside."""

import contextlib
import faulthandler
import hashlib
import json
import math
import multiprocessing
import multiprocessing.connection
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from importlib import import_module
from multiprocessing import forkserver
from pathlib import Path

from . import WRITTEN

MEMORY = 3 << 30  # bytes beyond what Python and Blender take before they begin; Mesa's threads reserve half a gigabyte
PATIENCE = 4  # times the seconds that an input may compute, for one that waits
LOG = "said.txt"

_TRACE = "Traceback (most recent call last)"
_STACK = "(most recent call first)"
_OWN = re.compile(r'File ".*?((?:shutter_addon|scripts|tests)/[^"]+)", line (\d+)')
_seconds = math.inf


class Fault(AssertionError):  # noqa: N818
    """What the product did wrong."""


# From outside


def attempts(inputs, seconds: float):
    """(folder, faults) of each input, as many at a time as there are processors. inputs: (folder, name of the kind's
    module). Folders are removed where there is no fault."""
    context, inputs, running = _context(), iter(inputs), {}
    while True:
        while len(running) < (os.process_cpu_count() or 1) and (given := next(inputs, None)):
            shutil.rmtree(given[0], ignore_errors=True)
            running[given[0]] = _start(context, *given, seconds)
        if not running:
            return
        patience = min(end for _process, end in running.values()) - time.monotonic()
        multiprocessing.connection.wait([process.sentinel for process, _end in running.values()], max(patience, 0))
        for folder, (process, end) in list(running.items()):
            if process.exitcode is None and time.monotonic() < end:
                continue
            del running[folder]
            if not (faults := _faults(folder, process)):
                shutil.rmtree(folder)
            yield folder, faults


def repeat(folder: Path, module: str, seconds: float) -> list[str]:
    """The faults of an input that is there already."""
    process, end = _start(_context(), folder, module, seconds)
    process.join(end - time.monotonic())
    return _faults(folder, process)


def gist(fault: str) -> str:
    """What faults of one cause have in common: without the numbers and names of one input."""
    text, place = re.fullmatch(r"(.*?)( \(\S+:\d+\))?", fault, re.DOTALL).groups()
    return re.sub(r"\d[\d.e+-]*", "#", re.sub(r"'[^']*'|\"[^\"]*\"", "…", text))[:150] + (place or "")


def _context():
    """What starts processes, from one that has everything loaded."""
    context, before = multiprocessing.get_context("forkserver"), dict(os.environ)
    context.set_forkserver_preload(["fuzzing.warm"])
    # There alone it looks for modules; and the order of sets is part of what shall be the same again.
    os.environ |= {"PYTHONPATH": str(Path(__file__).parents[1]), "PYTHONHASHSEED": "0"}
    try:
        forkserver.ensure_running()
    finally:
        os.environ.clear()
        os.environ |= before
    return context


def _start(context, folder: Path, module: str, seconds: float):
    folder.mkdir(parents=True, exist_ok=True)
    process = context.Process(target=attempt, args=(folder, module, seconds))
    process.start()
    return process, time.monotonic() + 4 * PATIENCE * seconds + 10  # all its forks end by themselves before


def _faults(folder: Path, process) -> list[str]:
    """What was wrong with an attempt, worst first; its working folder is removed."""
    if process.exitcode is None:
        process.kill()
    process.join()
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)  # its forks
    said = (folder / LOG).read_text(errors="replace") if (folder / LOG).exists() else ""
    faults = [_reason(said, process.exitcode)] if process.exitcode or _TRACE in said else []
    before = json.loads((folder / "before.json").read_text()) if (folder / "before.json").exists() else {}
    after = listing(folder / "work")
    for name in sorted(before.keys() | after.keys()):
        if name.split("/")[0] not in WRITTEN and before.get(name) != after.get(name):
            faults.append(f"changed: {name}")
    if not faults:
        faults += [f"left behind: {name}" for name in sorted(after.keys() - before.keys()) if ".part" in name]
    shutil.rmtree(folder / "work", ignore_errors=True)
    return faults


def _reason(said: str, code: int | None) -> str:
    """What was raised, with the last line on the way there that is ours."""
    if _STACK in said:
        ended = re.search(r"^Fatal Python error: .*", said, re.MULTILINE)
        what = ended[0] if ended else "it waits" if "Timeout (" in said else "it computes for too long"
        place = _OWN.search(said.split(_STACK)[1 if ended else -1])
    elif _TRACE in said:
        raised = said[said.rindex(_TRACE) :]
        named = re.search(r"^(?:fuzzing\.trial\.)?([A-Za-z_][\w.]*(?::.*)?)$", raised, re.MULTILINE)
        what, place = named[1] if named else "an exception", next(reversed(list(_OWN.finditer(raised))), None)
    else:
        what, place = f"exit code {code}: {said.strip()[-200:]}", None
    return what[:300] + (f" ({place[1]}:{place[2]})" if place else "")


def listing(folder: Path) -> dict[str, str]:
    """All that lies in a folder by its path within: what it is, and a hash of what it holds. No link is followed."""
    found = {}
    for path in folder.rglob("*"):
        name = os.fsencode(path.relative_to(folder)).decode("ascii", "backslashreplace")
        if path.is_symlink():
            found[name] = f"link to {os.readlink(path)!a}"
        elif path.is_file():
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        else:
            found[name] = "folder" if path.is_dir() else "neither file nor folder"
    return found


# Inside


def attempt(folder: Path, module: str, seconds: float) -> None:
    """The process of an input: makes it, unless it is there, and runs the product on a copy of it."""
    log = os.open(folder / LOG, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    for stream in (1, 2):
        os.dup2(log, stream)
    os.setpgid(0, 0)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    _watch(seconds)
    sys.path[:0] = import_module("fuzzing.warm").PATH
    kind, given, work = import_module(module), folder / "input", folder / "work"
    if not given.exists():
        given.mkdir()
        forked(lambda: kind.make(random.Random(folder.name), given))
    shutil.rmtree(work, ignore_errors=True)
    subprocess.run(["cp", "-a", given, work], check=True)
    (work / "tmp").mkdir()
    tempfile.tempdir = str(work / "tmp")
    (folder / "before.json").write_text(json.dumps(listing(work)))
    os.chdir(work)
    limit = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    kind.run(work)


def _watch(seconds: float) -> None:
    """Ends this process after so many seconds of computing, or when it waits; it prints its stacks then, or if it
    crashes."""
    global _seconds
    _seconds = seconds
    faulthandler.enable(file=2)
    faulthandler.register(signal.SIGXCPU, file=2)
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 2))
    faulthandler.dump_traceback_later(PATIENCE * seconds, exit=True, file=2)


def forked(function) -> tuple[int, str]:
    """Runs a function in a fork: its exit code, and what it said. For a render may end the process, and one that has
    used threads can no longer be forked.

    The function gives the exit code. Whatever is no ordinary end, exit code 0 or 2 without a traceback, is a fault."""
    sys.stdout.flush()
    faulthandler.cancel_dump_traceback_later()  # its thread would be missing from the fork
    read, write = os.pipe()
    if (child := os.fork()) == 0:
        code = 1
        try:
            for stream in (1, 2):
                os.dup2(write, stream)
            _watch(_seconds)
            code = function() or 0
        except BaseException:
            traceback.print_exc()
        finally:
            with contextlib.suppress(OSError):
                sys.stdout.flush()
            os._exit(code)
    os.close(write)
    with open(read, errors="replace") as pipe:
        said = pipe.read()
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    _watch(_seconds)
    if _TRACE in said or _STACK in said:
        print(said, file=sys.stderr)
        raise SystemExit(1)
    if code not in (0, 2):
        raise Fault(f"ended with {signal.Signals(-code).name if code < 0 else code}: {said.strip()[-200:]}")
    return code, said


def anew(*arguments):
    """Goes on in a Python that starts anew with these arguments: in a fork, Blender waits for ever for threads that
    read OpenEXR."""
    signal.alarm(math.ceil(PATIENCE * _seconds))
    os.execv(sys.executable, [sys.executable, "-X", "faulthandler", *arguments])


def is_refusal(said: str) -> None:
    """Fault, unless the command said why in one sentence, perhaps after a note, and both are whole."""
    sentences = [line for line in said.splitlines() if line.startswith("Virtual Shutter: ")]
    if len(sentences) not in (1, 2) or max(map(len, sentences)) > 300:
        raise Fault(f"no single sentence of 300 characters: {said.strip()[:300]}")
    for text in sentences:
        is_whole(text.removeprefix("Virtual Shutter: "))


def is_whole(text: str) -> None:
    """Fault, unless a sentence for users ends in something."""
    from shutter_addon.core.messages import sentence

    if re.search(r"(^|[\s:(]|\(\s*\)|\(None\))$", sentence(text)):
        raise Fault(f"a sentence that ends in nothing: {sentence(text)}")


@contextlib.contextmanager
def only(*errors):
    """Lets these errors pass, whose sentences are meant for users."""
    try:
        yield
    except errors as error:
        is_whole(str(error))
