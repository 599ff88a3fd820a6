"""Bake an effect: render it to a movie or a folder of EXR pictures, which an ordinary strip can show.

The pictures are the engine's. They bypass the sequencer, which would convert them to its color space and back, so an
EXR has the same bits. `render` makes them immediately, and `start` in a second Blender while the editor works on.
"""

import secrets
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Literal

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ....blender.data import effect_version, preferences, snapshot, source_media, strips, versions
from ....blender.output import film_output
from ....blender.rendering import pictures, sessions
from ....core import atomic_write, stopping
from ....core.farm import job_file
from ....core.messages import EffectError, MediaError, signed
from ....core.stopping import StoppedError
from ....media import files, film_parts, image_writing, rendered_pictures
from ....media.blender_movie import frame_rate
from ....media.derived import own_folder, refuse_link
from ....media.rendered_pictures import is_whole_movie, is_whole_picture

FOLDER = "virtual_shutter_baked"  # beside the .blend file
Kind = Literal["MOVIE", "OPEN_EXR"]
KINDS: dict[str, Kind] = {"movie": "MOVIE", "exr": "OPEN_EXR"}  # by the command's names
_CHANNELS = ["R", "G", "B", "A"]
_ROOT = Path(__file__).parents[4]  # of the extension, or of the checkout
Picture = Callable[[int], np.ndarray]  # gives that of a frame


@dataclass(frozen=True)
class Film:
    """What baking makes, or has made, of an effect strip: its frames and files.

    Attributes:
        kind: "MOVIE" for one H.264 movie, "OPEN_EXR" for a folder of pictures.
        frames: The frames that are baked. 0 is the first frame of the strip's untrimmed content.
        version: A hash of everything that the pictures depend on, 16 hexadecimal digits (effect_version.key).
        place: Path of the movie, or of the folder. The pictures in it are numbered from 1.
    """

    kind: Kind
    frames: range
    version: str
    place: Path

    @property
    def pictures(self) -> list[Path]:
        """The path of each frame's EXR picture."""
        return [self.place / f"{number:04d}.exr" for number in range(1, len(self.frames) + 1)]

    @property
    def parts(self) -> list[tuple[Path, range]]:
        """The path and the frames of each short movie that is rendered and then joined to the movie."""
        folder, length = self.place.with_suffix(".parts"), film_parts.LENGTH
        starts = range(0, len(self.frames), length)
        return [
            (folder / f"{start + 1:04d}{film_parts.ENDING}", self.frames[start : start + length]) for start in starts
        ]

    def is_finished(self) -> bool:
        """Tell whether the whole film exists as complete files. Of each EXR picture, only the last row is decoded."""
        if self.kind == "MOVIE":
            return self.place.is_file() and is_whole_movie(self.place, len(self.frames))
        return all(picture.is_file() and is_whole_picture(picture) for picture in self.pictures)


def film_of(scene: Scene, effect: PropertyGroup, strip: Strip, kind: Kind, folder: Path | None = None) -> Film:
    """Describe the film that baking would make of an effect strip, without making it.

    Its name has the strip's name, and part of a hash of what the pictures depend on, so that a film of a changed effect
    gets another name.

    Args:
        scene: The scene of the edit.
        effect: The effect of the strip.
        strip: The effect strip.
        kind: "MOVIE" or "OPEN_EXR".
        folder: The folder for the film. None: the folder virtual_shutter_baked beside the .blend file.

    Raises:
        EffectError, MediaError: The strip cannot be rendered, or not as such a film (see `_check`); or there is no
            `folder`, and the .blend file was never saved.
    """
    _check(scene, effect, strip, kind)
    if not folder and not bpy.data.filepath:
        raise EffectError(rpt_("baked frames are stored beside the .blend file: save it first"))
    frames = effect_version.frames_of(strip)
    version = effect_version.key(scene, effect, strip, frames)
    name = f"{bpy.path.clean_name(strip.name)}_{version[:8]}"
    if kind == "MOVIE":
        name += film_parts.ENDING
    folder = folder or Path(bpy.data.filepath).parent / FOLDER
    return Film(kind=kind, frames=frames, version=version, place=folder / name)


def _check(scene: Scene, effect: PropertyGroup, strip: Strip, kind: Kind) -> None:
    """Check that the film would look like the effect strip.

    Args:
        scene: The scene of the edit.
        effect: The effect of the strip.
        strip: The effect strip.
        kind: "MOVIE" or "OPEN_EXR".

    Raises:
        EffectError: It would not. The strip is retimed, strobed or reversed. Or a movie cannot do it: the package av is
            missing, Blender uses another color configuration, or the source is transparent, has light above white, or
            was deleted.
        MediaError: A movie is wanted, and the source cannot be read.
    """
    if getattr(strip, "retiming_keys", ()) or strip.strobe > 1 or strip.use_reverse_frames:
        raise EffectError(
            rpt_('"{strip}" is retimed, strobed or reversed: do that to its source instead').format(strip=strip.name)
        )
    if kind != "MOVIE":
        return
    if files.pyav_missing():
        sentence = rpt_("the Python package {package} is missing, which movies need: bake to OpenEXR")
        raise EffectError(sentence.format(package="av"))
    if versions.colours():
        raise EffectError(
            rpt_("movies are baked in Blender's own colours: with another configuration, bake to OpenEXR")
        )
    with source_media.spec(strips.source_of(scene, effect, strip)).open() as medium:
        if medium.alpha != "opaque":
            raise EffectError(rpt_("a movie has no transparency: bake to OpenEXR"))
        if medium.transfer == "linear":
            raise EffectError(rpt_("a movie has no light above white: bake to OpenEXR"))


def render(scene: Scene, effect: PropertyGroup, strip: Strip, film: Film, report: Callable[[], object]) -> None:
    """Render those frames of a film that are not finished yet.

    If it ends early, finished frames stay and are not rendered again the next time. Of a movie, frames are kept in
    parts of film_parts.LENGTH frames, so an unfinished part is rendered again.

    Args:
        scene: The scene of the edit.
        effect: The effect of the strip.
        strip: The effect strip.
        film: What to render (`film_of`).
        report: Called once for each frame, also for frames that an earlier run finished. Not called if the whole movie
            is there already. It may raise an exception to stop.

    Raises:
        effect_source.FAULTS, OSError: The film cannot be made.
        InterruptedRenderError: It was stopped by Ctrl-C or a signal.
    """
    if film.kind == "MOVIE" and film.is_finished():
        _remove_parts(film)
        return
    start = round(strips.origin(strip))
    taken = snapshot.take(scene, effect, strip, [start + frame for frame in film.frames])
    with film_output.stoppable() as stopped, stopping.once(lambda: bool(stopped)):

        def picture(frame: int) -> np.ndarray:
            context = sessions.of_render(levels=film.kind == "MOVIE")
            made = pictures.picture(context, taken, start + frame)
            context.session.begin_next(taken, start + frame, context)
            return made

        try:
            if film.kind == "MOVIE":
                _make_movie(film, picture, frame_rate(scene.render.fps / scene.render.fps_base), report)
            else:
                _make_pictures(film, picture, film_output.size(effect.scene), report)
        except StoppedError:
            raise film_output.InterruptedRenderError(f"{film.place}: stopped") from None
        except (MediaError, OSError):
            if not film.is_finished():  # another process may have finished it and removed the parts
                raise


def _make_pictures(film: Film, picture: Picture, size: tuple[int, int], report: Callable[[], object]) -> None:
    _prepare(film.place)
    note = job_file.note(film.version)
    for path, frame in zip(film.pictures, film.frames, strict=True):
        there = rendered_pictures.read(path, film.version)
        if there is None or there.size != size:
            made = pictures.resized(picture(frame), *size)
            channels = 3 if (made[..., 3] == 1).all() else 4
            image_writing.write_exr(path, made[..., :channels], _CHANNELS[:channels], note)
        report()


def _make_movie(film: Film, picture: Picture, fps: Fraction, report: Callable[[], object]) -> None:
    for path, frames in film.parts:
        if path.is_file() and is_whole_movie(path, len(frames)):
            for _ in frames:
                report()
        else:
            _prepare(path.parent)
            film_parts.write_part(path, _reported(map(picture, frames), report), fps)
    if not film.is_finished():  # another process may have finished it
        film_parts.join([path for path, _frames in film.parts], film.place, fps)
    _remove_parts(film)


def _prepare(place: Path) -> None:
    """Make a folder for a film if it is missing, and remove old temporary folders that killed processes left in it.

    Raises:
        OSError: It cannot be made, or is a link, which could lead to files of other users.
    """
    own_folder(place)
    atomic_write.clear_up(place)


def _remove_parts(film: Film) -> None:
    """Remove the short movies that a finished movie was joined from, and what killed processes left there."""
    parts = [path for path, _frames in film.parts]
    place = parts[0].parent
    with suppress(OSError):
        refuse_link(place)
        for path in parts:
            path.unlink(missing_ok=True)
        for path in place.iterdir():
            if atomic_write.is_part(path.name):
                shutil.rmtree(path, ignore_errors=True)
        place.rmdir()


def _reported(shown: Iterator[np.ndarray], report: Callable[[], object]) -> Iterator[np.ndarray]:
    for picture in shown:
        yield picture
        report()


@dataclass
class BakeJob:
    """A bake that runs in a second Blender, which reads a copy of the edit.

    Attributes:
        scene: The session_uid of the scene of the edit.
        effect: Identity of the effect that is baked.
        strip: Name of the effect strip.
        film: The film that is made.
        copy: Path of the copied .blend file, which the second Blender removes after reading it.
        log: A temporary folder, beside the film, with the second Blender's output: the files "out" and "err".
        process: The second Blender's process.
    """

    scene: int
    effect: str
    strip: str
    film: Film
    copy: Path
    log: Path
    process: subprocess.Popen

    def done(self) -> int:
        """Return how many frames are finished, also by earlier bakes, as the process printed last; 0: none yet."""
        lines = self._said("out").split("\n")[:-1]
        counts = [line.split()[0] for line in lines[-2:] if line.endswith(f" of {len(self.film.frames)}")]
        return int(counts[-1]) if counts else 0

    def is_over(self) -> bool:
        return self.process.poll() is not None

    def failure(self) -> str | None:
        """Return why the bake has failed; None: the film is finished. To be called once the process has ended."""
        if self.film.is_finished():
            return None
        said = [line for line in self._said("err").splitlines() if line.startswith(signed(""))]
        return said[-1].removeprefix(signed("")).strip() if said else rpt_("the bake ended without a message")

    def _said(self, stream: str) -> str:
        return (self.log / stream).read_text(encoding="utf-8", errors="replace")

    def end(self) -> None:
        """Stop the process if it runs, and remove temporary files. Finished frames stay."""
        if not self.is_over():
            self.process.terminate()
        with suppress(OSError):  # Windows keeps open files
            self.copy.unlink(missing_ok=True)
        shutil.rmtree(self.log, ignore_errors=True)


def start(scene: Scene, effect: PropertyGroup, strip: Strip, film: Film) -> BakeJob:
    """Start a second Blender that bakes a film, and return at once.

    It works on a copy of the current edit, and ends when this process ends.

    Args:
        scene: The scene of the edit.
        effect: The effect of the strip.
        strip: The effect strip.
        film: What to bake (`film_of`).

    Returns:
        The job, by which the bake can be watched and ended.

    Raises:
        EffectError, OSError: The bake cannot start.
    """
    edit = Path(bpy.data.filepath)
    film.place.parent.mkdir(parents=True, exist_ok=True)
    atomic_write.clear_up(film.place.parent)
    log = atomic_write.new_part(film.place.parent)
    copy = edit.with_name(f"{edit.stem}.bake-{secrets.token_hex(4)}.blend")  # relative paths stay valid there
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(copy), copy=True, relative_remap=False)
        with open(log / "out", "wb") as out, open(log / "err", "wb") as err:
            process = subprocess.Popen(
                _command(scene, strip, film, copy),
                cwd=_ROOT,
                stdin=subprocess.PIPE,  # closes with this process, which ends the other one
                stdout=out,
                stderr=err,
            )
    except (RuntimeError, OSError) as error:
        copy.unlink(missing_ok=True)
        shutil.rmtree(log, ignore_errors=True)
        raise EffectError(rpt_("the bake cannot begin: {reason}").format(reason=" ".join(str(error).split()))) from None
    return BakeJob(scene.session_uid, effect.identity, strip.name, film, copy, log, process)


def _command(scene: Scene, strip: Strip, film: Film, copy: Path) -> list[str]:
    """Return the command line of the process that bakes a film from a copy of the edit.

    Options have the form --name=value, because names in the edit can begin with a dash.

    Args:
        scene: The scene of the edit.
        strip: The effect strip.
        film: What to bake.
        copy: Path of the edit's copy.
    """
    program = [sys.executable, "-m", "shutter_addon"]  # with Blender as a library
    if bpy.app.binary_path:
        package = __package__.rpartition(".shutter_addon")[0]
        enabled = ["--addons", package] if package else []  # as here, regardless of saved preferences
        program = [bpy.app.binary_path, "--background", *enabled, "--command", "shutter"]
    kind = next(name for name, kind in KINDS.items() if kind == film.kind)
    names = [f"--scene={scene.name}", f"--strip={strip.name}", f"--format={kind}", f"--output={film.place.parent}"]
    device = [f"--device={preferences.device()}", f"--gpu-memory={preferences.gpu_memory()}"]
    return [*program, "bake", str(copy), *names, *device, "--attached"]
