"""A film that is baked by a Blender of its own, while the editor goes on working. It reads a copy of the edit as it was
then."""

from __future__ import annotations

import re
import secrets
import shutil
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ...core import atomic_write
from ...core.messages import EffectError, signed
from ..data import preferences
from .baked_film import KINDS, Film

_ZSTD = b"\x28\xb5\x2f\xfd"  # how a compressed file begins
_ROOT = Path(__file__).parents[3]  # of the extension, or of the checkout
_COPY = re.compile(r"[^/\\]+\.bake-[0-9a-f]{8}\.blend")
_MANIFEST = "copy"  # the file of a log that has the name of the copy


@dataclass
class BakeJob:
    """A bake that runs.

    scene: session_uid of the edit's; effect: identity of the effect, strip: name of its strip
    copy: of the edit, which the process removes once it has read it
    log: part folder beside the film with what the process says, and the name of the copy"""

    scene: int
    effect: str
    strip: str
    film: Film
    copy: Path
    log: Path
    process: subprocess.Popen

    def done(self) -> int:
        """How many frames are finished."""
        lines = self._said("out").split("\n")[:-1]
        counts = [line.split()[0] for line in lines[-2:] if line.endswith(f" of {len(self.film.frames)}")]
        return int(counts[-1]) if counts else 0

    def is_over(self) -> bool:
        return self.process.poll() is not None

    def failure(self) -> str | None:
        """Why it failed, as a sentence, once it is over; None: the film is there."""
        if self.film.is_finished():
            return None
        said = [line for line in self._said("err").splitlines() if line.startswith(signed(""))]
        return said[-1].removeprefix(signed("")).strip() if said else rpt_("the bake ended without a word")

    def _said(self, stream: str) -> str:
        return (self.log / stream).read_text(encoding="utf-8", errors="replace")

    def end(self) -> None:
        """Stops it, if it runs, and removes what it needed alone. Frames that are finished stay."""
        if not self.is_over():
            self.process.terminate()
        with suppress(OSError):  # Windows keeps what is open
            self.copy.unlink(missing_ok=True)
        shutil.rmtree(self.log, ignore_errors=True)


def start(scene: Scene, effect: PropertyGroup, strip: Strip, film: Film) -> BakeJob:
    """Begins to bake a film. EffectError, OSError: it cannot be begun."""
    edit = Path(bpy.data.filepath)
    film.place.parent.mkdir(parents=True, exist_ok=True)
    _clear_up(film.place.parent, edit)
    log = atomic_write.new_part(film.place.parent)
    copy = edit.with_name(f"{edit.stem}.bake-{secrets.token_hex(4)}.blend")  # where the paths in it lead to the same
    try:
        (log / _MANIFEST).write_text(copy.name, encoding="utf-8")
        bpy.ops.wm.save_as_mainfile(filepath=str(copy), copy=True, compress=_is_compressed(edit), relative_remap=False)
        words = _words(scene, strip, film)
        with open(log / "out", "wb") as out, open(log / "err", "wb") as err:
            process = subprocess.Popen(
                [*_command(), "bake", str(copy), *words],
                cwd=_ROOT,
                stdin=subprocess.PIPE,  # which ends with this process, and with that the other one
                stdout=out,
                stderr=err,
            )
    except (RuntimeError, OSError) as error:
        copy.unlink(missing_ok=True)
        shutil.rmtree(log, ignore_errors=True)
        raise EffectError(rpt_("the bake cannot begin: {reason}").format(reason=" ".join(str(error).split()))) from None
    return BakeJob(
        scene=scene.session_uid,
        effect=effect.identity,
        strip=strip.name,
        film=film,
        copy=copy,
        log=log,
        process=process,
    )


def _clear_up(folder: Path, edit: Path) -> None:
    """Removes what bakes left behind that were killed: logs, and the copies of an edit that these name."""
    for left in atomic_write.left_behind(folder):
        with suppress(OSError):
            manifest = left / _MANIFEST
            name = manifest.read_text(encoding="utf-8", errors="replace") if manifest.is_file() else ""
            if _COPY.fullmatch(name):
                edit.with_name(name).unlink(missing_ok=True)
    atomic_write.clear_up(folder)


def _words(scene: Scene, strip: Strip, film: Film) -> list[str]:
    """The command's options. Names may begin with a dash."""
    kind = next(name for name, kind in KINDS.items() if kind == film.kind)
    names = [f"--scene={scene.name}", f"--strip={strip.name}", f"--format={kind}", f"--output={film.place.parent}"]
    return [*names, f"--device={preferences.device()}", f"--gpu-memory={preferences.gpu_memory()}", "--attached"]


def _is_compressed(edit: Path) -> bool:
    """Whether a .blend file is: Blender writes the user's own as it was last told to, by a copy as well."""
    try:
        with edit.open("rb") as file:
            return file.read(4) == _ZSTD
    except OSError:
        return False


def _command() -> list[str]:
    """What runs the command `shutter` in a process of its own."""
    if not bpy.app.binary_path:  # Blender as a library
        return [sys.executable, "-m", "shutter_addon"]
    package = __package__.rpartition(".shutter_addon")[0]
    enabled = ["--addons", package] if package else []  # as here, whatever the preferences that are saved say
    return [bpy.app.binary_path, "--background", *enabled, "--command", "shutter"]
