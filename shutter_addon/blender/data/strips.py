"""Effect strips: Scene strips above their source, and the scene, effect and source that belong to them."""

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
MATTES = ("MATTE", "RAMP")  # kinds of regions without strokes
OUTLINED = ("OUTLINE", "SUBJECT")  # kinds of regions with outlines, drawn or tracked
LAID = (*OUTLINED, *MATTES)  # kinds of regions that are mattes, laid over what scribbles give
# Where Blender scales or turns a Scene strip, it mixes light; in movies and 8-bit pictures, it mixes code values. It
# makes code values first where a strip's colors are multiplied. This factor causes that, and changes no color.
IN_CODE_VALUES = 1 + 2**-23


def is_carried(region: PropertyGroup) -> bool:
    """Tell whether a region is a subject, or an outline that is tracked from drawing to drawing."""
    return region.kind == "SUBJECT" or (region.kind == "OUTLINE" and region.between != "STRAIGHT")


def all_strips(scene: Scene) -> Iterable[Strip]:
    """Return the scene's strips, with those in meta strips."""
    return scene.sequence_editor.strips_all if scene.sequence_editor else ()


def effect_strips(scene: Scene) -> list[Strip]:
    """Return the scene's effect strips, with those in meta strips."""
    found = [strip for strip in all_strips(scene) if strip.type == "SCENE" and strip.scene]
    return [strip for strip in found if strip.scene.render.engine == ENGINE]


def scene_of_uid(uid: int | None) -> Any:
    """Return the scene of a session_uid, or None."""
    return next((scene for scene in bpy.data.scenes if scene.session_uid == uid), None)


def local_scenes() -> list:
    """Return the scenes that can be changed; linked ones cannot."""
    return [scene for scene in bpy.data.scenes if scene.library is None]


def own_strips(scene: Scene) -> list[Strip]:
    """Return the strips that were made for effects, even if their scene has another engine or was deleted."""
    return [strip for strip in all_strips(scene) if strip.type == "SCENE" and _is_own(strip)]


def _is_own(strip: Strip) -> bool:
    scene, identity = strip.scene, strip.virtual_shutter_effect
    if scene is None:
        return identity != ""
    return scene.render.engine == ENGINE or scene.virtual_shutter.identity == identity != ""


def effect_of(scene: Scene, effect_scene: Scene) -> Any:
    """Return the scene's effect that an effect scene shows, or None."""
    return next((effect for effect in scene.virtual_shutter.effects if effect.scene == effect_scene), None)


def find_effect(effect_scene: Scene, scene_frame: float = 0) -> tuple[Scene, PropertyGroup, Strip]:
    """Return the scene, the effect and an effect strip of an effect scene.

    Of the parts of a cut strip, the one counts that shows the frame of the effect scene, else the first.

    Raises:
        EffectError: No strip shows the effect scene.
    """
    for scene in bpy.data.scenes:
        if (effect := effect_of(scene, effect_scene)) is not None:
            parts = [strip for strip in effect_strips(scene) if strip.scene == effect_scene]
            parts.sort(key=lambda part: not is_at(part, timeline_frame(part, scene_frame)))
            if parts:
                return scene, effect, parts[0]
    raise EffectError(rpt_('scene "{scene}" belongs to no Shutter strip').format(scene=effect_scene.name))


def origin(strip: Strip) -> float:
    """Return the timeline frame at which untrimmed content would start: the same for all parts of a cut strip."""
    return strip.content_start - strip.content_trim_start


def skipped(strip: Strip) -> int:
    """Return the number of frames of its content that a strip skips before the first that it shows."""
    return math.floor(strip.left_handle - origin(strip))


def overlap(a: Strip, b: Strip) -> bool:
    """Tell whether two strips share timeline frames."""
    return a.left_handle < b.right_handle and b.left_handle < a.right_handle


def is_at(strip: Strip, frame: float) -> bool:
    """Tell whether a strip lies at a timeline frame."""
    return strip.left_handle <= frame < strip.right_handle


def timeline_frame(strip: Strip, scene_frame: float) -> float:
    """Return the timeline frame at which an effect strip shows a frame of its scene."""
    return origin(strip) + scene_frame - strip.scene.frame_start


def source_of(scene: Scene, effect: PropertyGroup, strip: Strip) -> Strip:
    """Return the source strip of an effect strip.

    Parts of a cut strip and copies share the source identity of an effect. The nearest in time counts, then
    one in the same meta strip, a connected one, and the nearest channel, below first.

    Raises:
        EffectError: It was deleted, or is not a movie, image or clip strip.
    """
    if (source := nearest_source(scene, effect, strip)) is None:
        if others := identified(scene, "virtual_shutter_source", effect.source):
            sentence = rpt_('the source of "{strip}", "{source}", is not a movie, image or clip strip')
            raise EffectError(sentence.format(strip=strip.name, source=others[0].name))
        raise EffectError(rpt_('the source strip of "{strip}" was deleted').format(strip=strip.name))
    return source


class Shown(NamedTuple):
    """An effect, its strip, and its source strip, or None."""

    effect: PropertyGroup
    strip: Strip
    source: Strip | None


def shown_effects(scene: Scene) -> list[Shown]:
    """Return the effects that the scene's strips show."""
    pairs = [(effect, strip) for strip in effect_strips(scene) if (effect := effect_of(scene, strip.scene))]
    return [Shown(effect, strip, nearest_source(scene, effect, strip)) for effect, strip in pairs]


def with_sources(scene: Scene) -> list[Any]:
    """Return the effects that the scene's strips show and that have a source."""
    return [each for each in shown_effects(scene) if each.source is not None]


def nearest_source(scene: Scene, effect: PropertyGroup, strip: Strip) -> Any:
    """Return the source strip as source_of finds it, or None."""
    connected = list(strip.connections)  # a duplicated pair stays connected

    def distance(other: Strip) -> tuple:
        apart = max(other.left_handle - strip.right_handle + 1, strip.left_handle - other.right_handle + 1, 0)
        elsewhere = other.parent_meta() != strip.parent_meta()
        channels = other.channel - strip.channel
        return apart, elsewhere, other not in connected, channels > 0, abs(channels)

    found = [other for other in identified(scene, "virtual_shutter_source", effect.source) if other.type in SOURCES]
    return min(found, key=distance, default=None)


def identified(scene: Scene, name: str, identity: str) -> list:
    """Return the scene's strips with an identity in a property, whatever their type; "" identifies none."""
    return [strip for strip in all_strips(scene) if getattr(strip, name) == identity != ""]


def invalidate(scene: Scene, effect_scene: Scene | None = None) -> None:
    """Drop the sequencer's finished frames of a scene's effect strips, or only of those that show one effect scene."""
    revision.changed()
    for strip in effect_strips(scene):
        if effect_scene is None or strip.scene == effect_scene:
            strip.invalidate_cache("RAW")  # drops what was composed from it, too


def used_regions(effect: PropertyGroup) -> list:
    """Return the regions with a shutter, in order."""
    names = {shutter.name for shutter in effect.shutters}
    return [region for region in effect.regions if region.shutter in names]
