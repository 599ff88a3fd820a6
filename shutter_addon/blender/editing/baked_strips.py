"""Baked strips: an ordinary strip that shows an effect's film, above the effect strip, which is muted.

Both have the same identity, and keep it where they are cut or copied.
"""

from __future__ import annotations

import uuid
from contextlib import suppress
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import MetaStrip, PropertyGroup, Scene, SequenceEditor, Strip

from ...core import revision
from ...core.messages import EffectError
from ..data import effect_version, fcurves, selection, strips
from ..output.baked_film import Film
from . import add_effect, match_source

_LOOK = ("blend_type", "blend_alpha")


def check(scene: Scene, strip: Strip) -> None:
    """EffectError: no film could stand in for an effect strip, and why."""
    if match_source.effects_on(scene, strip):
        sentence = rpt_('"{strip}" is the input of another strip, which would not show the baked one')
        raise EffectError(sentence.format(strip=strip.name))
    _channel(scene, strip)


def lay(scene: Scene, strip: Strip, film: Film) -> Strip:
    """Puts a finished film in the place of the effect strip that it was baked of, and mutes that; the new strip. That
    of an older bake goes. EffectError: there is no room for it."""
    owner = strip.parent_meta() or scene.sequence_editor
    older = [baked for baked in baked_of(scene, strip) if strips.overlap(baked, strip)]
    home = strip.virtual_shutter_bake.channel if older else strip.channel
    name, start = data_("{strip} Baked").format(strip=strip.name), round(strips.origin(strip)) + film.frames.start
    is_movie = film.kind == "MOVIE"
    files = [_relative(path) for path in ([film.place] if is_movie else film.pictures)]
    baked = add_effect.new_footage(owner.strips, name, files, _channel(scene, strip), start, is_movie)
    baked.left_handle, baked.right_handle = strip.left_handle, strip.right_handle
    if older:
        channel = older[0].channel
        for other in older:
            owner.strips.remove(other)
        _move(owner, baked, channel)
    elif any(home < each.channel < baked.channel and strips.overlap(each, strip) for each in owner.strips):
        # What lies above the effect has to lie above its film.
        spare = baked.channel
        _move(owner, strip, _channel(scene, strip))
        _move(owner, baked, home)
        _move(owner, strip, spare)
    add_effect.copy_look(strip, baked, keys=True)
    if baked.color_multiply == strips.IN_CODE_VALUES:  # a film is mixed so by itself
        baked.color_multiply = 1
    for look in _LOOK:
        setattr(baked, look, getattr(strip, look))
    alpha = [f"{each.path_from_id()}.blend_alpha" for each in (strip, baked)]
    fcurves.copy_curves(scene, alpha[0], scene, alpha[1])
    match_source.append_modifiers(scene, strip, baked)
    strip.mute = True
    _note(strip, baked, film, home)
    baked.color_tag = strip.color_tag
    add_effect.connect(scene, [baked, strip, *strip.connections])
    return baked


def _channel(scene: Scene, strip: Strip) -> int:
    """The first channel above an effect strip that has room beside it, and is not muted. EffectError: there is none."""
    owner = strip.parent_meta() or scene.sequence_editor
    for channel in range(strip.channel + 1, strips.CHANNELS + 1):
        if _is_free(owner, strip, channel) and not owner.channels[channel].mute:
            return channel
    sentence = rpt_('above "{strip}" there is no channel with room for the baked strip')
    raise EffectError(sentence.format(strip=strip.name))


def _is_free(owner: SequenceEditor | MetaStrip, strip: Strip, channel: int) -> bool:
    return not any(other.channel == channel and strips.overlap(other, strip) for other in owner.strips)


def _move(owner: SequenceEditor | MetaStrip, strip: Strip, channel: int) -> None:
    """Moves a strip to a channel, where there is room: Blender would shift it in time."""
    if _is_free(owner, strip, channel):
        strip.channel = channel


def _relative(path: Path) -> str:
    """As the edit names a file, so that both may be moved together."""
    with suppress(ValueError):  # another drive
        return bpy.path.relpath(str(path))
    return str(path)


def _note(strip: Strip, baked: Strip, film: Film, channel: int) -> None:
    """Says of both strips that they belong together, and of which version the film is. channel: the effect strip's
    own"""
    identity = uuid.uuid4().hex
    for each in (strip, baked):
        bake = each.virtual_shutter_bake
        bake.identity, bake.version = identity, film.version
        bake.first, bake.count, bake.channel = film.frames.start, len(film.frames), channel


def baked_of(scene: Scene, strip: Strip) -> list:
    """The baked strips, or their parts, of an effect strip and all that it was cut into: those that begin with it.
    Copies that were moved elsewhere are none of them."""
    start = round(strips.origin(strip))
    parts = [other for other in selection.of_bake(scene, strip) if other.type in strips.SOURCES]
    return [part for part in parts if round(strips.origin(part)) - part.virtual_shutter_bake.first == start]


def effect_parts(scene: Scene, strip: Strip) -> list:
    """What an effect strip that was baked has been cut into; none, if it was not."""
    start = round(strips.origin(strip))
    parts = (other for other in selection.of_bake(scene, strip) if round(strips.origin(other)) == start)
    return [part for part in parts if part.type == "SCENE"]


def unbake(scene: Scene, strip: Strip) -> None:
    """Removes what is baked of an effect strip, and shows the effect again. Files stay."""
    parts = effect_parts(scene, strip)
    for baked in baked_of(scene, strip):
        (baked.parent_meta() or scene.sequence_editor).strips.remove(baked)
    for part in parts:
        _move(part.parent_meta() or scene.sequence_editor, part, part.virtual_shutter_bake.channel)
        part.mute = False
        part.property_unset("virtual_shutter_bake")


def is_stale(scene: Scene, effect: PropertyGroup, strip: Strip) -> bool:
    """Whether an effect has changed since its strip was baked: its pictures would be others. True as well where it has
    none any more."""
    place = _place(scene, effect, strip)
    return revision.until_change("bake", place, lambda: effect_version.is_changed(scene, effect, strip))


def known_stale(scene: Scene, effect: PropertyGroup, strip: Strip) -> bool | None:
    """As is_stale, where that has been asked since something changed; None: it has not."""
    return revision.known("bake", _place(scene, effect, strip))


def _place(scene: Scene, effect: PropertyGroup, strip: Strip) -> tuple:
    return scene.session_uid, effect.identity, strip.name
