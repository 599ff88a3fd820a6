"""Baked strips: an ordinary strip that shows an effect's film, above the effect strip, which is muted.

Both have the same identity, and keep it where they are cut or copied.
"""

from __future__ import annotations

import uuid
from contextlib import suppress
from pathlib import Path
from typing import Any

import bpy

from ...core.revision import UntilChange
from ..data import effect_version, fcurves, selection, strips
from ..output.baked_film import Film
from ..rendering.effect_source import FAULTS
from . import add_effect

_LOOK = ("blend_type", "blend_alpha")
_CURVES = "transform.", "crop.", "blend_alpha", "color_multiply", "color_saturation"
_states = UntilChange()


def lay(scene: Any, strip: Any, film: Film) -> Any:
    """Puts a finished film above the effect strip that it was baked of, and mutes that; the new strip. That of an older
    bake goes."""
    _remove_baked(scene, strip)
    level = (strip.parent_meta() or scene.sequence_editor).strips
    taken = {other.channel for other in level if selection.overlap(other, strip)}
    channel = next(c for c in range(strip.channel + 1, strip.channel + len(taken) + 2) if c not in taken)
    start = round(strips.origin(strip)) + film.frames.start
    baked = _new_strip(level, f"{strip.name} Baked", film, channel, start)
    baked.left_handle, baked.right_handle = strip.left_handle, strip.right_handle
    add_effect.copy_look(strip, baked)
    for name in _LOOK:
        setattr(baked, name, getattr(strip, name))
    _copy_curves(scene, strip, baked)
    _note(strip, baked, film)
    strip.mute = True
    baked.color_tag = strip.color_tag
    add_effect.connect(scene, [baked, strip, *strip.connections])
    return baked


def _new_strip(level: Any, name: str, film: Film, channel: int, start: int) -> Any:
    if film.kind == "MOVIE":
        return level.new_movie(name, _relative(film.place), channel, start)
    first, *others = film.pictures
    baked = level.new_image(name, _relative(first), channel, start)
    for picture in others:
        baked.elements.append(picture.name)
    return baked


def _relative(path: Path) -> str:
    """As the edit names a file, so that both may be moved together."""
    with suppress(ValueError):  # another drive
        return bpy.path.relpath(str(path))
    return str(path)


def _copy_curves(scene: Any, strip: Any, baked: Any) -> None:
    old, new = strip.path_from_id(), baked.path_from_id()
    for end in _CURVES:
        fcurves.copy_curves(scene, f"{old}.{end}", scene, f"{new}.{end}")


def _note(strip: Any, baked: Any, film: Film) -> None:
    """Says of both strips that they belong together, and of which version the film is."""
    identity = uuid.uuid4().hex
    for each in (strip, baked):
        bake = each.virtual_shutter_bake
        bake.identity, bake.version = identity, film.version
        bake.first, bake.count = film.frames.start, len(film.frames)


def baked_of(scene: Any, strip: Any) -> list:
    """The baked strips, or their parts, above an effect strip and all that it was cut into. Copies that were moved
    elsewhere are none of them."""
    below = effect_parts(scene, strip)
    parts = [other for other in selection.of_bake(scene, strip) if other.type in strips.SOURCES]
    return [part for part in parts if any(selection.overlap(part, other) for other in below)]


def effect_parts(scene: Any, strip: Any) -> list:
    """What an effect strip that was baked has been cut into; none, if it was not."""
    return [other for other in selection.of_bake(scene, strip) if other.type == "SCENE" and other.scene == strip.scene]


def unbake(scene: Any, strip: Any) -> None:
    """Removes what is baked of an effect strip, and shows the effect again. Files stay."""
    _remove_baked(scene, strip)
    for part in effect_parts(scene, strip):
        part.mute = False
        for name in ("version", "first", "count", "identity"):
            part.virtual_shutter_bake.property_unset(name)


def _remove_baked(scene: Any, strip: Any) -> None:
    for baked in baked_of(scene, strip):
        (baked.parent_meta() or scene.sequence_editor).strips.remove(baked)


def is_stale(scene: Any, effect: Any, strip: Any) -> bool:
    """Whether an effect has changed since its strip was baked: its pictures would be others. True as well where it has
    none any more."""
    bake = strip.virtual_shutter_bake
    return _states.get((scene.session_uid, bake.identity), lambda: _current(scene, effect, strip) != bake.version)


def _current(scene: Any, effect: Any, strip: Any) -> str | None:
    bake = strip.virtual_shutter_bake
    try:
        return effect_version.key(scene, effect, strip, range(bake.first, bake.first + bake.count))
    except FAULTS:
        return None
