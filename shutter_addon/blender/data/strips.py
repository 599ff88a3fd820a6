"""Effect strips: a Scene strip above its source, and the scene, data and source that belong to it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ...core import revision
from ...core.messages import EffectError

ENGINE = "VIRTUAL_SHUTTER"
CHANNELS = 128  # of Blender's sequencer
SOURCES = ("MOVIE", "IMAGE", "MOVIECLIP")
MATTES = ("MATTE", "RAMP")  # kinds of regions that have no strokes
OUTLINED = ("OUTLINE", "SUBJECT")  # kinds that have outlines, drawn or carried
LAID = (*OUTLINED, *MATTES)  # kinds of mattes, which are laid over what scribbles give
# Where Blender scales or turns a Scene strip, it mixes the light of pixels, and of movies and 8-bit pictures their code
# values. It makes code values first where a strip's colours are multiplied: by this, nothing else changes.
IN_CODE_VALUES = 1 + 2**-23


def is_carried(region: PropertyGroup) -> bool:
    """Whether a region is a subject, or an outline that the footage's own motion carries from drawing to drawing."""
    return region.kind == "SUBJECT" or (region.kind == "OUTLINE" and region.between != "STRAIGHT")


def all_strips(scene: Scene) -> Iterable[Strip]:
    """The scene's strips, those inside meta strips too."""
    return scene.sequence_editor.strips_all if scene.sequence_editor else ()


def effect_strips(scene: Scene) -> list[Strip]:
    """The scene's effect strips, those inside meta strips too."""
    found = [strip for strip in all_strips(scene) if strip.type == "SCENE" and strip.scene]
    return [strip for strip in found if strip.scene.render.engine == ENGINE]


def scene_of_uid(uid: int | None) -> Any:
    """The scene of a session_uid, unless it is gone."""
    return next((scene for scene in bpy.data.scenes if scene.session_uid == uid), None)


def local_scenes() -> list:
    """The scenes that can be changed: linked ones cannot."""
    return [scene for scene in bpy.data.scenes if scene.library is None]


def shown_scenes(scene: Scene) -> list:
    """The scene, and those that its Scene strips show."""
    shown, new = [], [scene]
    while new:
        other = new.pop()
        if other is not None and other not in shown and other.sequence_editor:
            shown.append(other)
            new += [strip.scene for strip in other.sequence_editor.strips_all if strip.type == "SCENE"]
    return shown


def own_strips(scene: Scene) -> list[Strip]:
    """The strips that were made for effects, those too whose scene has another engine or is gone."""
    return [strip for strip in all_strips(scene) if strip.type == "SCENE" and _is_own(strip)]


def _is_own(strip: Strip) -> bool:
    scene, identity = strip.scene, strip.virtual_shutter_effect
    if scene is None:
        return identity != ""
    return scene.render.engine == ENGINE or scene.virtual_shutter.identity == identity != ""


def effect_of(scene: Scene, effect_scene: Scene) -> Any:
    """The scene's effect that an effect scene shows, or None."""
    return next((effect for effect in scene.virtual_shutter.effects if effect.scene == effect_scene), None)


def find_effect(effect_scene: Scene, scene_frame: float | None = None) -> tuple[Scene, PropertyGroup, Strip]:
    """Scene, effect and one of its strips for an effect scene: the part of a cut one that shows a frame of the effect
    scene, or the first. EffectError: nothing uses it any more."""
    for scene in bpy.data.scenes:
        if (effect := effect_of(scene, effect_scene)) is not None:
            parts = [strip for strip in effect_strips(scene) if strip.scene == effect_scene]
            if scene_frame is not None:
                parts.sort(key=lambda part: not is_at(part, timeline_frame(part, scene_frame)))
            if parts:
                return scene, effect, parts[0]
    raise EffectError(rpt_('scene "{scene}" belongs to no Shutter strip').format(scene=effect_scene.name))


def origin(strip: Strip) -> float:
    """Timeline frame at which the strip's untrimmed content would start: the same for all parts of a cut strip."""
    return strip.content_start - strip.content_trim_start


def skipped(strip: Strip) -> int:
    """How many frames of its content a strip leaves out before the first that it shows."""
    return math.floor(strip.left_handle - origin(strip))


def overlap(a: Strip, b: Strip) -> bool:
    """Whether two strips share timeline frames."""
    return a.left_handle < b.right_handle and b.left_handle < a.right_handle


def is_at(strip: Strip, frame: float) -> bool:
    """Whether a strip lies at a timeline frame."""
    return strip.left_handle <= frame < strip.right_handle


def timeline_frame(strip: Strip, scene_frame: float) -> float:
    """The timeline frame at which an effect strip shows a frame of its scene."""
    return origin(strip) + scene_frame - strip.scene.frame_start


def source_of(scene: Scene, effect: PropertyGroup, strip: Strip) -> Strip:
    """The effect's source strip: of those with its identity (parts of a cut strip, copies) the nearest in time, then
    that in the same meta strip, the connected one, the nearest below. EffectError: there is none any more, or none that
    has frames."""
    if (source := nearest_source(scene, effect, strip)) is None:
        if others := _with_identity(scene, effect.source):
            sentence = rpt_('the source of "{strip}", "{source}", is not a movie, image or clip strip')
            raise EffectError(sentence.format(strip=strip.name, source=others[0].name))
        raise EffectError(rpt_('the source strip of "{strip}" was deleted').format(strip=strip.name))
    return source


class Shown(NamedTuple):
    """An effect, its strip, and its source; None: it has none."""

    effect: PropertyGroup
    strip: Strip
    source: Strip | None


def shown_effects(scene: Scene) -> list[Shown]:
    """The effects that the scene's strips show."""
    pairs = [(effect, strip) for strip in effect_strips(scene) if (effect := effect_of(scene, strip.scene))]
    return [Shown(effect, strip, nearest_source(scene, effect, strip)) for effect, strip in pairs]


def with_sources(scene: Scene) -> list[Shown]:
    """The effects that the scene's strips show, without those that lack a source."""
    return [each for each in shown_effects(scene) if each.source is not None]


def shown_sources(scene: Scene) -> set[str]:
    """Names of the strips that are sources of the scene's effect strips."""
    return {each.source.name for each in shown_effects(scene) if each.source}


def nearest_source(scene: Scene, effect: PropertyGroup, strip: Strip) -> Any:
    """What source_of finds, or None."""
    connected = list(strip.connections)  # as a pair stays that is duplicated

    def distance(other: Strip) -> tuple:
        apart = max(other.left_handle - strip.right_handle + 1, strip.left_handle - other.right_handle + 1, 0)
        elsewhere = other.parent_meta() != strip.parent_meta()
        return (
            apart,
            elsewhere,
            other not in connected,
            other.channel > strip.channel,
            abs(strip.channel - other.channel),
        )

    candidates = [other for other in _with_identity(scene, effect.source) if other.type in SOURCES]
    return min(candidates, key=distance, default=None)


def _with_identity(scene: Scene, identity: str) -> list:
    """The scene's strips that an effect with this source is for, whatever they are."""
    return [strip for strip in scene.sequence_editor.strips_all if strip.virtual_shutter_source == identity != ""]


def invalidate(scene: Scene, effect_scene: Scene | None = None) -> None:
    """Drops the finished frames of a scene's effect strips; of those that show one effect scene, if given."""
    revision.changed()
    for strip in effect_strips(scene):
        if effect_scene is None or strip.scene == effect_scene:
            strip.invalidate_cache("RAW")  # and with them all that was composed of them


def drawn_regions(effect: PropertyGroup) -> list:
    """The regions of strokes that have a shutter, in order: those that an effect's state has shapes of."""
    names = {shutter.name for shutter in effect.shutters}
    return [region for region in effect.regions if region.shutter in names and region.kind not in MATTES]


def matte_regions(effect: PropertyGroup) -> list:
    """The regions of mattes and ramps that have a shutter, in order: those that lie over the others."""
    names = {shutter.name for shutter in effect.shutters}
    return [region for region in effect.regions if region.shutter in names and region.kind in MATTES]
