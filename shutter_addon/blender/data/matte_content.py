"""What a matte or ramp region shows, read from Blender as plain data, and the strips that serve as mattes.

A region knows its matte strip by an identity stored on both, so that the strip may be renamed and cut.
"""

import uuid
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Any

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Strip

from ... import features
from ...core.messages import EffectError
from ...core.model import keyframes, mattes
from ...core.model.clip import Clip
from ...core.model.effect import Moves, placed_ramp
from ...core.model.keyframes import Channel
from ...media.derived import MATTES
from ...media.files import stamp
from ...media.opening import MatteFile
from ...media.sequence import sequence_files
from . import source_media, strips, validation
from .external_files import absolute
from .sampled import Sampling

_MOMENTS = 16  # steps from a filmed frame to the next


def content(sampling: Sampling, region: PropertyGroup, moves: Moves) -> Channel:
    """Return the mattes of a matte or ramp region, as a channel: its `at(frame)` gives the matte at a timeline frame.

    Args:
        sampling: Reads the effect's properties.
        region: A region whose kind is "MATTE" or "RAMP".
        moves: The region's motion, by which a gradient is placed.

    Returns:
        By the region's settings: the frames of files or strips, a fixed mask, a gradient, or for a luminance ramp the
        source's own luminance.

    Raises:
        EffectError, MediaError: The region has no matte, or one that cannot be used.
    """
    if region.kind == "RAMP":
        ramp = validation.word(region, "ramp")
        if ramp != "LUMINANCE":
            return placed_ramp(ramp.lower(), moves)
        return mattes.FileFrames(file=_of_strip(_source(sampling), "luminance"))
    matte = validation.word(region, "matte")
    if matte == "STRIP":
        return _strip_frames(sampling, region)
    if matte == "MASK":
        if region.mask is None:
            raise EffectError(rpt_("{place}: it has no mask").format(place=validation.place(region)))
        return keyframes.Constant(features.needed("still_mask")(region.mask))
    first = strips.origin(sampling.strip) if validation.word(region, "timing") == "TIMELINE" else None
    return mattes.FileFrames(file=image_file(region), offset=validation.number(region, "offset"), first=first)


def _source(sampling: Sampling) -> Strip:
    return strips.source_of(sampling.effect.id_data, sampling.effect, sampling.strip)


def tracked(sampling: Sampling) -> dict[str, Any]:
    """Return arguments for a CarriedFile, which makes the mattes of tracked outlines and subjects.

    Args:
        sampling: Reads the effect's properties.

    Returns:
        "footage": the source as SourceSpec. "folder": where mattes are stored, beside the .blend file, or in Blender's
        temporary folder if that was never saved.

    Raises:
        EffectError, MediaError: The effect has no source strip, or one that cannot be used.
    """
    beside = Path(bpy.data.filepath).parent if bpy.data.filepath else Path(bpy.app.tempdir)  # which Blender clears
    return {"footage": source_media.spec(_source(sampling)), "folder": beside / MATTES}


def channel(region: PropertyGroup) -> str:
    """Return which channel of an image a region's matte uses, in the words of recipes.

    Returns:
        "luminance", "red", "green", "blue", "alpha", or the name of a channel of an EXR file.

    Raises:
        EffectError: The region uses a named channel, but the name is empty.
    """
    word = validation.word(region, "channel")
    if word != "NAMED":
        return word.lower()
    if not region.channel_name:
        raise EffectError(rpt_("{place}: its channel has no name").format(place=validation.place(region)))
    return region.channel_name


def image_path(region: PropertyGroup) -> Path:
    """Return the absolute path of a region's matte file.

    Raises:
        EffectError: The region has no image, or the image is not a movie, image sequence or picture on disk.
    """
    place, image = validation.place(region), region.image
    if image is None:
        raise EffectError(rpt_("{place}: it has no matte file").format(place=place))
    if image.source not in ("FILE", "SEQUENCE", "MOVIE") or image.packed_file or not image.filepath:
        sentence = rpt_('{place}: image "{image}" is not a movie, image sequence or picture on disk')
        raise EffectError(sentence.format(place=place, image=image.name))
    return absolute(image, image.filepath)


def image_file(region: PropertyGroup) -> MatteFile:
    """Return a region's image matte as MatteFile: its path, its channel, and a stamp that changes when a file changes.

    If a later file of an image sequence is overwritten, the stamp changes only after source_media.look_again.

    Raises:
        EffectError: The region has no image with a file, or its channel has no name.
        MediaError: The first file of an image sequence is missing, or its folder cannot be listed.
    """
    path = image_path(region)
    is_sequence = region.image.source == "SEQUENCE"
    stamps: tuple = stamp(path), stamp(path.parent if is_sequence else path)
    if is_sequence:
        stamps = *stamps, source_media.stamps((region.image.session_uid, path, stamps), lambda: sequence_files(path))
    files = (path,) if region.image.source == "FILE" else None
    return MatteFile(path=path, channel=channel(region), files=files, stamp=stamps)


def filmed_frames(sampling: Sampling) -> dict[float, int]:
    """Return the footage's frame that the source shows at each sampled timeline frame.

    With *Smooth*, a time between two frames of the footage gives the earlier one.

    Args:
        sampling: Reads the effect's properties, and gives the timeline frames.

    Returns:
        By timeline frame, the index of the frame in the footage, from 0.

    Raises:
        EffectError, MediaError: The effect has no source strip, or its movie cannot be read.
    """
    source = _source(sampling)
    spec, timing = source_media.spec(source), sampling.time or source_media.timing_of(source)
    filmed, fps = (len(spec.files), None) if spec.files else _movie(spec)
    # Timing does not depend on the picture's size.
    clip = Clip(0, 0, filmed, fps=fps, timing=timing).stepped(_MOMENTS if sampling.effect.inbetween != "1" else 1)
    return {frame: clip.shown(frame).source_frame // clip.step for frame in sampling.frames}


@lru_cache(64)
def _movie(spec: source_media.SourceSpec) -> tuple[int, Fraction | None]:
    """Return a movie's number of frames and its frame rate (None: unknown), read from the file.

    The strip does not tell: retiming changes its length.

    Args:
        spec: The footage, a movie.

    Raises:
        MediaError: The movie cannot be read.
    """
    with spec.open() as movie:
        return movie.count, movie.fps


def _strip_frames(sampling: Sampling, region: PropertyGroup) -> Channel:
    parts, word = parts_for(region, sampling.strip), channel(region)
    shown = {
        part.name: mattes.FileFrames(file=_of_strip(part, word), timing=source_media.timing_of(part)) for part in parts
    }
    if len(parts) == 1:
        return shown[parts[0].name]
    return keyframes.Samples({f: shown[part_at(parts, f).name].at(f) for f in sampling.frames})


def _of_strip(strip: Strip, word: str) -> MatteFile:
    """Return a MatteFile that reads the footage of a movie, image or clip strip.

    Args:
        word: The channel that is the matte, as in `channel`.

    Raises:
        MediaError: The strip has no files, or is a clip strip that is undistorted or stabilized.
    """
    spec = source_media.spec(strip)
    return MatteFile(path=spec.path, channel=word, files=spec.files, stream=spec.options["stream"], stamp=spec.key)


def strip_name(region: PropertyGroup) -> str:
    """Return the name of the strip that is a region's matte, the first of several; "": there is none."""
    return next((strip.name for strip in _with_identity(region)), "")


def choose_strip(region: PropertyGroup, name: str) -> None:
    """Make the strip with this name a region's matte, with the other parts if it was cut since it first was a matte.

    A region stores an identity, which its matte strips have, too. Copies of the strip get no part in it. If there is no
    such strip, the region has no matte strip any more.

    Args:
        name: The strip's name.
    """
    editor = region.id_data.sequence_editor
    strip = editor and editor.strips_all.get(name)
    if strip is None:
        region.strip = ""
        return
    same = strips.identified(region.id_data, "virtual_shutter_matte", strip.virtual_shutter_matte)
    cut = [other for other in same if strips.origin(other) == strips.origin(strip) and not strips.overlap(other, strip)]
    parts = [strip, *cut]
    if len(parts) != len(same):  # it has no identity, or that of the strip that it was copied from
        identity = uuid.uuid4().hex
        for part in parts:
            part.virtual_shutter_matte = identity
    region.strip = strip.virtual_shutter_matte


def strips_of(region: PropertyGroup) -> list:
    """Return the movie, image and clip strips that are a region's matte: several if the strip was cut or copied.

    Raises:
        EffectError: There are none.
    """
    matching = _with_identity(region)
    if not matching:
        words = rpt_("{place}: its matte strip was deleted") if region.strip else rpt_("{place}: it has no matte strip")
        raise EffectError(words.format(place=validation.place(region)))
    shown = [strip for strip in matching if strip.type in strips.SOURCES]
    if not shown:
        sentence = rpt_('{place}: its matte strip "{strip}" is not a movie, image or clip strip')
        raise EffectError(sentence.format(place=validation.place(region), strip=matching[0].name))
    return shown


def parts_for(region: PropertyGroup, effect_strip: Strip) -> list:
    """Return those of a region's matte strips (several if one was cut or copied) that overlap the effect strip in time.

    If none does, return only the one nearest to the effect strip's first frame. The result is sorted by distance from
    that frame to their first frame.

    Raises:
        EffectError: The region has no matte strip.
    """
    parts = sorted(strips_of(region), key=lambda part: abs(part.left_handle - effect_strip.left_handle))
    beside = [part for part in parts if strips.overlap(part, effect_strip)]
    return beside or [part_at(parts, effect_strip.left_handle)]


def part_at(parts: list, frame: float) -> Strip:
    """Return the strip that shows a timeline frame; if none does, the one nearest in time.

    Args:
        parts: The strips, at least one. Of several that qualify, the first one counts.
        frame: The timeline frame. A strip shows the frames from its left handle to the one before its right handle.
    """
    return min(parts, key=lambda part: max(part.left_handle - frame, frame - part.right_handle + 1, 0))


def _with_identity(region: PropertyGroup) -> list:
    """Return the strips that a region's matte is read from, by identity."""
    return strips.identified(region.id_data, "virtual_shutter_matte", region.strip)
