"""The film of an effect by itself, as files that an ordinary strip shows: a movie, or a folder of EXR pictures.

The pictures are those that the engine gives to Blender. They are written past the sequencer, which would put them
through its own colour space and back: an EXR has their very bits.
"""

from __future__ import annotations

import shutil
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

from ...core import atomic_write, stopping
from ...core.farm import job_file
from ...core.messages import EffectError
from ...core.stopping import StoppedError
from ...media import files, film_parts, image_writing, rendered_pictures
from ...media.blender_movie import frame_rate
from ...media.derived import own_folder, refuse_link
from ...media.errors import MediaError
from ...media.rendered_pictures import is_whole_movie, is_whole_picture
from ..data import effect_version, snapshot, source_media, strips, versions
from ..rendering import pictures, sessions
from . import film_output

FOLDER = "virtual_shutter_baked"  # beside the .blend file
Kind = Literal["MOVIE", "OPEN_EXR"]
KINDS: dict[str, Kind] = {"movie": "MOVIE", "exr": "OPEN_EXR"}  # as the command calls them
_CHANNELS = ["R", "G", "B", "A"]
Picture = Callable[[int], np.ndarray]  # that of a frame


@dataclass(frozen=True)
class Film:
    """What is baked of an effect strip.

    frames: counted from the strip's origin (effect_version.frames_of); version: the key of the effect there
    place: the movie, or the folder of pictures, numbered from 1"""

    kind: Kind
    frames: range
    version: str
    place: Path

    @property
    def pictures(self) -> list[Path]:
        """The EXR picture of each frame."""
        return [self.place / f"{number:04d}.exr" for number in range(1, len(self.frames) + 1)]

    @property
    def parts(self) -> list[tuple[Path, range]]:
        """The parts of the movie that are there before all of it is, and the frames of each."""
        folder, length = self.place.with_suffix(".parts"), film_parts.LENGTH
        starts = range(0, len(self.frames), length)
        return [
            (folder / f"{start + 1:04d}{film_parts.ENDING}", self.frames[start : start + length]) for start in starts
        ]

    def is_finished(self) -> bool:
        """Whether all of it is there; pictures are not decoded for that."""
        if self.kind == "MOVIE":
            return self.place.is_file() and is_whole_movie(self.place, len(self.frames))
        return all(picture.is_file() and is_whole_picture(picture) for picture in self.pictures)


def film_of(scene: Scene, effect: PropertyGroup, strip: Strip, kind: Kind, folder: Path | None = None) -> Film:
    """What would be baked of an effect strip as it is now. folder: where; None: beside the .blend file.

    EffectError, MediaError: it cannot be."""
    _check(scene, effect, strip, kind)
    frames = effect_version.frames_of(strip)
    version = effect_version.key(scene, effect, strip, frames)
    name = f"{bpy.path.clean_name(strip.name)}_{version[:8]}"
    if kind == "MOVIE":
        name += film_parts.ENDING
    return Film(kind=kind, frames=frames, version=version, place=(folder or default_folder()) / name)


def default_folder() -> Path:
    """EffectError: there is none, beside a file that is not saved."""
    if not bpy.data.filepath:
        raise EffectError(rpt_("baked frames lie beside the .blend file: save it first"))
    return Path(bpy.data.filepath).parent / FOLDER


def _check(scene: Scene, effect: PropertyGroup, strip: Strip, kind: Kind) -> None:
    """EffectError: the strip's film would not be its picture."""
    if getattr(strip, "retiming_keys", ()) or strip.strobe > 1 or strip.use_reverse_frames:
        raise EffectError(
            rpt_('"{strip}" is retimed, strobed or reversed itself: do that to its source').format(strip=strip.name)
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
    with source_media.open_media(strips.source_of(scene, effect, strip)) as medium:
        if medium.alpha != "opaque":
            raise EffectError(rpt_("a movie has no transparency: bake to OpenEXR"))
        if medium.transfer == "linear":
            raise EffectError(rpt_("a movie has no light above white: bake to OpenEXR"))


def render(scene: Scene, effect: PropertyGroup, strip: Strip, film: Film, told: Callable[[int], object]) -> None:
    """Renders what is missing of a film. told: called with the number of frames that are there, and may raise.

    One of FAULTS, OutputError, OSError: it cannot be made. InterruptedRenderError: it was stopped. What is finished
    stays, and the next call goes on from there."""
    if film.kind == "MOVIE" and film.is_finished():
        _remove_parts(film)
        told(len(film.frames))
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
                _make_movie(film, picture, frame_rate(scene.render.fps / scene.render.fps_base), told)
            else:
                _make_pictures(film, picture, film_output.size(effect.scene), told)
        except StoppedError:
            raise film_output.InterruptedRenderError(f"{film.place}: stopped") from None
        except (MediaError, OSError):
            if not film.is_finished():  # by another process, which has removed the parts
                raise
            told(len(film.frames))


def _make_pictures(film: Film, picture: Picture, size: tuple[int, int], told: Callable[[int], object]) -> None:
    _prepare(film.place)
    note = job_file.note(film.version)
    for number, (path, frame) in enumerate(zip(film.pictures, film.frames, strict=True), start=1):
        there = rendered_pictures.read(path, film.version)
        if there is None or there.size != size:
            made = pictures.resized(picture(frame), *size)
            channels = 3 if (made[..., 3] == 1).all() else 4
            image_writing.write_exr(path, made[..., :channels], _CHANNELS[:channels], note)
        told(number)


def _make_movie(film: Film, picture: Picture, fps: Fraction, told: Callable[[int], object]) -> None:
    done = 0
    for path, frames in film.parts:
        if path.is_file() and is_whole_movie(path, len(frames)):
            told(done + len(frames))
        else:
            _prepare(path.parent)
            film_parts.write_part(path, _counted(map(picture, frames), done, told), fps)
        done += len(frames)
    if not film.is_finished():  # by another process, say
        film_parts.join([path for path, _frames in film.parts], film.place, fps)
    _remove_parts(film)


def _prepare(place: Path) -> None:
    """OSError: it cannot be made, or is a link, which a stranger may have put there."""
    own_folder(place)
    atomic_write.clear_up(place)


def _remove_parts(film: Film) -> None:
    """Removes the parts of a movie that is finished, and what killed processes left there, and no other file."""
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


def _counted(shown: Iterator[np.ndarray], done: int, told: Callable[[int], object]) -> Iterator[np.ndarray]:
    for number, picture in enumerate(shown, start=done + 1):
        yield picture
        told(number)
