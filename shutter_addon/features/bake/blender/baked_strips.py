"""Baked strips: movie or image strips with a rendered effect, above the muted effect strip.

Both strips have the same bake identity, which cuts and copies keep.
"""

from __future__ import annotations

import uuid
from contextlib import suppress
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import MetaStrip, PropertyGroup, Scene, SequenceEditor, Strip

from ....blender.data import effect_version, fcurves, selection, strips
from ....blender.editing import add_effect, match_source
from ....core import revision
from ....core.messages import EffectError
from .baked_film import Film


def check(scene: Scene, strip: Strip) -> None:
    """Check that a baked strip could replace an effect strip.

    Raises:
        EffectError: it could not.
    """
    if match_source.effects_on(scene, strip):
        sentence = rpt_('"{strip}" is the input of another strip, which would not show the baked one')
        raise EffectError(sentence.format(strip=strip.name))
    _channel(scene, strip)


def add_strip(scene: Scene, strip: Strip, film: Film) -> Strip:
    """Add the baked strip of a finished film above its effect strip, which is muted, and return it.

    It replaces the strip of an older bake.

    Raises:
        EffectError: no channel has room.
    """
    owner = strip.parent_meta() or scene.sequence_editor
    for older in [baked for baked in baked_of(scene, strip) if strips.overlap(baked, strip)]:
        owner.strips.remove(older)
        _move(owner, strip, strip.virtual_shutter_bake.channel)
    home = strip.channel
    name, start = data_("{strip} Baked").format(strip=strip.name), round(strips.origin(strip)) + film.frames.start
    is_movie = film.kind == "MOVIE"
    files = [_relative(path) for path in ([film.place] if is_movie else film.pictures)]
    baked = add_effect.new_footage(owner.strips, name, files, _channel(scene, strip), start, is_movie)
    baked.left_handle, baked.right_handle = strip.left_handle, strip.right_handle
    if any(home < each.channel < baked.channel and strips.overlap(each, strip) for each in owner.strips):
        # Strips above the effect have to stay above its film.
        spare = baked.channel
        _move(owner, strip, _channel(scene, strip))
        _move(owner, baked, home)
        _move(owner, strip, spare)
    add_effect.copy_look(strip, baked, keys=True)
    if baked.color_multiply == strips.IN_CODE_VALUES:  # films do not need it
        baked.color_multiply = 1
    baked.blend_type, baked.blend_alpha = strip.blend_type, strip.blend_alpha
    alpha = [f"{each.path_from_id()}.blend_alpha" for each in (strip, baked)]
    fcurves.copy_curves(scene, alpha[0], scene, alpha[1])
    match_source.append_modifiers(scene, strip, baked)
    strip.mute = True
    _note(strip, baked, film, home)
    baked.color_tag = strip.color_tag
    add_effect.connect(scene, [baked, strip, *strip.connections])
    return baked


def _channel(scene: Scene, strip: Strip) -> int:
    """Return the first unmuted channel with room above an effect strip.

    Raises:
        EffectError: there is none.
    """
    owner = strip.parent_meta() or scene.sequence_editor
    for channel in range(strip.channel + 1, strips.CHANNELS + 1):
        if _is_free(owner, strip, channel) and not owner.channels[channel].mute:
            return channel
    sentence = rpt_('no channel above "{strip}" has room for the baked strip')
    raise EffectError(sentence.format(strip=strip.name))


def _is_free(owner: SequenceEditor | MetaStrip, strip: Strip, channel: int) -> bool:
    return not any(other.channel == channel and strips.overlap(other, strip) for other in owner.strips)


def _move(owner: SequenceEditor | MetaStrip, strip: Strip, channel: int) -> None:
    """Move a strip to a channel if there is room. Otherwise Blender would shift it in time."""
    if _is_free(owner, strip, channel):
        strip.channel = channel


def _relative(path: Path) -> str:
    """Return a path relative to the .blend file, so that both can be moved together."""
    with suppress(ValueError):  # on another drive
        return bpy.path.relpath(str(path))
    return str(path)


def _note(strip: Strip, baked: Strip, film: Film, channel: int) -> None:
    """Mark both strips as belonging to a bake, with the version of the effect.

    Args:
        channel: original channel of the effect strip.
    """
    identity = uuid.uuid4().hex
    for each in (strip, baked):
        bake = each.virtual_shutter_bake
        bake.identity, bake.version = identity, film.version
        bake.first, bake.count, bake.channel = film.frames.start, len(film.frames), channel


def baked_of(scene: Scene, strip: Strip) -> list:
    """Return the baked strips of an effect strip that begin with it. Copies that were moved elsewhere do not count."""
    start = round(strips.origin(strip))
    parts = [other for other in selection.of_bake(scene, strip) if other.type in strips.SOURCES]
    return [part for part in parts if round(strips.origin(part)) - part.virtual_shutter_bake.first == start]


def effect_parts(scene: Scene, strip: Strip) -> list:
    """Return the parts that a baked effect strip was cut into, with itself; []: it is not baked."""
    start = round(strips.origin(strip))
    parts = (other for other in selection.of_bake(scene, strip) if round(strips.origin(other)) == start)
    return [part for part in parts if part.type == "SCENE"]


def unbake(scene: Scene, strip: Strip) -> None:
    """Remove the baked strips of an effect strip and show the effect again. Files stay."""
    parts = effect_parts(scene, strip)
    for baked in baked_of(scene, strip):
        (baked.parent_meta() or scene.sequence_editor).strips.remove(baked)
    for part in parts:
        _move(part.parent_meta() or scene.sequence_editor, part, part.virtual_shutter_bake.channel)
        part.mute = False
        part.property_unset("virtual_shutter_bake")


def is_stale(scene: Scene, effect: PropertyGroup, strip: Strip) -> bool:
    """Return whether the baked film is outdated or gone."""
    place = _place(scene, effect, strip)
    return revision.until_change("bake", place, lambda: effect_version.is_changed(scene, effect, strip))


def known_stale(scene: Scene, effect: PropertyGroup, strip: Strip) -> bool | None:
    """Return `is_stale` if it was called since the last change; None: it was not."""
    return revision.known("bake", _place(scene, effect, strip))


def _place(scene: Scene, effect: PropertyGroup, strip: Strip) -> tuple:
    return scene.session_uid, effect.identity, strip.name
