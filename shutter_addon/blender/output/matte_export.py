"""Write an effect's mattes as pictures: for its recipe, which needs files of them, or for other programs."""

import os
import re
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ...core import atomic_write
from ...core.messages import EffectError, translated
from ...core.model import mattes
from ...core.model.effect import Effect, FileContent, RampContent
from ...core.recipes import recipe
from ...media.image_writing import write_exr, write_grey
from ...media.matte_values import MatteValues
from ...media.sequence import sequence_files
from ..data import matte_content, snapshot, source_media, strips, validation
from ..rendering import effect_source

EffectStrip = tuple[Scene, PropertyGroup, Strip]


def recipe_for(scene: Scene, effect: PropertyGroup, strip: Strip, path: Path) -> Effect:
    """Return an effect as a recipe that will be saved at `path`. Write mattes that it cannot name by their own file.

    Their pictures are written into folders in "NAME mattes" beside the recipe.

    Raises:
        effect_source.FAULTS: The effect cannot be rendered, or a matte cannot be read or written.
        OSError: The folder cannot be made or written to.
    """
    regions, shown = _mattes(effect), (scene, effect, strip)
    # Find faults before anything is written.
    snapshot.recipe_of(*shown, [_ramp(region) for region in regions])
    folders = [_folder(region, path, number) for number, region in enumerate(regions, 1)]
    _refuse_overwriting(folders, *shown)
    return snapshot.recipe_of(*shown, [_content(shown, *both, path) for both in zip(regions, folders, strict=True)])


def save(scene: Scene, effect: PropertyGroup, strip: Strip, region: PropertyGroup, folder: Path, suffix: str) -> int:
    """Write a matte, ramp or outline as a picture for each timeline frame of the effect strip, all or none.

    Args:
        region: The matte, ramp, outline or subject.
        folder: Where pictures are written, named by timeline frame.
        suffix: "png" for 16-bit grey, or "exr" for float with the channel Y.

    Returns:
        The number of pictures.

    Raises:
        effect_source.FAULTS: The matte cannot be read, or the pictures cannot be written.
        OSError: Their folder cannot be written to.
    """
    _refuse_overwriting([folder], scene, effect, strip)
    return _write((scene, effect, strip), region, folder, strip.left_handle, suffix)


def _mattes(effect: PropertyGroup) -> list:
    return [region for region in strips.used_regions(effect) if region.kind in strips.MATTES]


def _ramp(region: PropertyGroup) -> RampContent:
    ramp: Any = validation.word(region, "ramp").lower() if region.kind == "RAMP" else "linear"
    return RampContent(ramp)


def _folder(region: PropertyGroup, path: Path, number: int) -> Path | None:
    """Return the folder into which the pictures of a region's matte are to be written.

    Args:
        path: Path of the recipe.
        number: Number of the region in the effect's list of mattes, from 1, for the folder's name.

    Returns:
        The folder; None for ramps and mattes from a file, since the recipe names these. A single picture that a recipe
        would take for the first of an image sequence gets a folder, too.
    """
    if region.kind == "RAMP" or (region.matte == "IMAGE" and not _is_one_of_many(region)):
        return None
    name = re.sub(r"[^\w. -]", "_", region.name).strip(". ") or "Matte"
    return path.with_name(f"{path.stem} mattes") / f"{number} {name}"


def _is_one_of_many(region: PropertyGroup) -> bool:
    """Tell whether a matte is a single picture that a recipe would take for the first of an image sequence."""
    path = matte_content.image_path(region)
    return region.image.source == "FILE" and path.exists() and len(sequence_files(path)) > 1


def _read_files(scene: Scene, effect: PropertyGroup, strip: Strip) -> Iterator[Path]:
    """Yield one file of each movie or image sequence that the effect's mattes and source read."""
    yield source_media.spec(strips.source_of(scene, effect, strip)).path
    for region in _mattes(effect):
        if region.kind == "MATTE" and region.matte == "IMAGE":
            yield matte_content.image_path(region)
        elif region.kind == "MATTE" and region.matte == "STRIP":
            yield from (source_media.spec(part).path for part in matte_content.parts_for(region, strip))


def _refuse_overwriting(folders: list[Path | None], *shown: Any) -> None:
    """Check that pictures are not written into a folder from which the effect reads a file.

    Args:
        folders: Where pictures will be written; None entries are ignored.
        shown: Scene, effect and effect strip, the arguments of _read_files.

    Raises:
        EffectError, MediaError: The effect reads a file from one of the folders, or its files are not known.
    """
    taken = {file.parent.resolve() for file in _read_files(*shown)}
    for folder in folders:
        if folder is not None and folder.resolve() in taken:
            sentence = rpt_("{folder}: its pictures are read by the effect; choose another name for the recipe")
            raise EffectError(sentence.format(folder=folder))


def _content(shown: EffectStrip, region: PropertyGroup, folder: Path | None, path: Path) -> FileContent | RampContent:
    if region.kind == "RAMP":
        return _ramp(region)
    if folder is not None:
        _write(shown, region, folder, 1)
        return FileContent(path=recipe.relative(folder / "0001.png", path.parent), timing="timeline")
    file, channel = matte_content.image_path(region), matte_content.channel(region)
    # A recipe's timeline begins with the trimmed strip.
    offset = region.offset + (strips.skipped(shown[2]) if region.timing == "TIMELINE" else 0)
    named = recipe.relative(file, path.parent)
    return FileContent(path=named, channel=channel, offset=offset, timing=region.timing.lower())


def _write(shown: EffectStrip, region: PropertyGroup, folder: Path, first: int, suffix: str = "png") -> int:
    """Write a matte as a picture for each timeline frame of the effect strip, all or none.

    Args:
        shown: Scene, effect and effect strip.
        region: The region that has the matte.
        first: Number in the first picture's name; the others count on from it.
        suffix: "png" or "exr".

    Returns:
        The number of pictures.

    Raises:
        effect_source.FAULTS, OSError: As in `save`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    frames = range(shown[2].left_handle, shown[2].right_handle)
    taken = snapshot.take(*shown, frames)
    written: Any = taken.effect.regions[strips.used_regions(shown[1]).index(region)]
    with (
        atomic_write.part_folder(folder) as part,
        closing(effect_source.open_source(taken)) as source,
        closing(MatteValues(source.width, source.height, source.step)) as values,
    ):
        clip = effect_source.clip_of(taken, source)
        for number, frame in enumerate(frames, first):
            with translated(rpt_):
                matte = mattes.Matte(shutter=0, content=written.content.at(frame))
            ((_key, array),) = values.values((matte,), clip.shown(frame).source_frame, 1)
            place = part / f"{number:04d}.{suffix}"
            if suffix == "exr":
                write_exr(place, array[..., None], ["Y"])
            else:
                write_grey(place, array)
        for place in sorted(part.iterdir()):
            os.replace(place, folder / place.name)
    return len(frames)
