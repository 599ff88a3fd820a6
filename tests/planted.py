"""A kind of input for scripts/fuzz.py whose faults are known: each input does what its file says."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

FAULTS = {
    "nothing": lambda: None,
    "computes": lambda: all(iter(lambda: True, None)),
    "waits": lambda: time.sleep(1000),
    "dies": lambda: os.kill(os.getpid(), signal.SIGSEGV),
    "killed": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "raises": lambda: int("five"),
    "leaves": lambda: os._exit(3),
    "takes memory": lambda: bytearray(1 << 32),
    "prints a trace": lambda: print("Traceback (most recent call last):\n  …\nOSError: no", file=sys.stderr),
    "changes the source": lambda: Path("in/film").write_text("another"),
    "removes through a link": lambda: Path("cache/link/keep").unlink(),
    "leaves a part": lambda: Path("out/.part-1").mkdir(parents=True),
    "leaves a process": lambda: subprocess.Popen(["sleep", "1000"]) and None,
}


def make(random, folder):
    number = int(folder.parent.name.rpartition("-")[2])
    (folder / "in").mkdir()
    (folder / "in" / "film").write_text(str(random.random()))
    (folder / "outside").mkdir()
    (folder / "outside" / "keep").touch()
    (folder / "cache").mkdir()
    (folder / "cache" / "link").symlink_to("../outside")
    (folder / "does").write_text(list(FAULTS)[number])


def run(folder):
    FAULTS[(folder / "does").read_text()]()
