"""Find effect strips, and the scene, effect and source strip that belong to them.

An effect strip is a Scene strip above a movie, image or clip strip, its source. The effect scene that it shows is
rendered by our engine.
"""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Context, PropertyGroup, Scene, Strip

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
    """Tell whether a region is a subject, or an outline that is tracked from drawing to drawing through the footage."""
    return region.kind == "SUBJECT" or (region.kind == "OUTLINE" and region.between != "STRAIGHT")


def all_strips(scene: Scene) -> Iterable[Strip]:
    """Return a scene's strips, including those inside meta strips."""
    return scene.sequence_editor.strips_all if scene.sequence_editor else ()


def effect_strips(scene: Scene) -> list[Strip]:
    """Return a scene's strips that show effects, including those inside meta strips."""
    found = [strip for strip in all_strips(scene) if strip.type == "SCENE" and strip.scene]
    return [strip for strip in found if strip.scene.render.engine == ENGINE]


def scene_of_uid(uid: int | None) -> Any:
    """Return the scene with a session_uid; None: there is none."""
    return next((scene for scene in bpy.data.scenes if scene.session_uid == uid), None)


def local_scenes() -> list:
    """Return the scenes that can be changed: those that are not linked from another file."""
    return [scene for scene in bpy.data.scenes if scene.library is None]


def own_strips(scene: Scene) -> list[Strip]:
    """Return a scene's strips that were made for effects, even if their effect scene is gone or has another engine."""
    return [strip for strip in all_strips(scene) if strip.type == "SCENE" and _is_own(strip)]


def _is_own(strip: Strip) -> bool:
    scene, identity = strip.scene, strip.virtual_shutter_effect
    if scene is None:
        return identity != ""
    return scene.render.engine == ENGINE or scene.virtual_shutter.identity == identity != ""


def effect_of(scene: Scene, effect_scene: Scene) -> Any:
    """Return the effect of `scene` that belongs to an effect scene; None: there is none."""
    return next((effect for effect in scene.virtual_shutter.effects if effect.scene == effect_scene), None)


def find_effect(effect_scene: Scene, scene_frame: float = 0) -> tuple[Scene, PropertyGroup, Strip]:
    """Return the scene that has an effect, the effect, and a strip that shows it, given the effect scene.

    Args:
        scene_frame: Frame of the effect scene. If an effect strip was cut into parts, the part that shows this frame is
            returned; if none does, the first part.

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
    """Return the timeline frame at which a strip's content would start if it were not trimmed.

    It is the same for all parts of a cut strip.
    """
    return strip.content_start - strip.content_trim_start


def skipped(strip: Strip) -> int:
    """Return how many frames of its content are trimmed from a strip's beginning."""
    return math.floor(strip.left_handle - origin(strip))


def overlap(a: Strip, b: Strip) -> bool:
    """Tell whether two strips share timeline frames."""
    return a.left_handle < b.right_handle and b.left_handle < a.right_handle


def is_at(strip: Strip, frame: float) -> bool:
    """Tell whether a strip lies at a timeline frame."""
    return strip.left_handle <= frame < strip.right_handle


def timeline_frame(strip: Strip, scene_frame: float) -> float:
    """Return the timeline frame at which an effect strip shows a frame of its effect scene."""
    return origin(strip) + scene_frame - strip.scene.frame_start


def source_of(scene: Scene, effect: PropertyGroup, strip: Strip) -> Strip:
    """Return the source strip of an effect strip.

    Copies of a source and the parts of a cut source share an identity. Of several such strips, the nearest in time is
    taken. Among equally near ones, one in the same meta strip comes first, then one that Blender has connected to the
    effect strip, then one in a channel below, then the nearest channel.

    Args:
        scene: The scene that has the strip.
        effect: The effect that the strip shows.
        strip: The effect strip.

    Raises:
        EffectError: The source was deleted, or is not a movie, image or clip strip.
    """
    if (source := nearest_source(scene, effect, strip)) is None:
        if others := identified(scene, "virtual_shutter_source", effect.source):
            sentence = rpt_('the source of "{strip}", "{source}", is not a movie, image or clip strip')
            raise EffectError(sentence.format(strip=strip.name, source=others[0].name))
        raise EffectError(rpt_('the source strip of "{strip}" was deleted').format(strip=strip.name))
    return source


class ShownEffect(NamedTuple):
    """An effect, an effect strip that shows it, and that strip's source (None: it is missing)."""

    effect: PropertyGroup
    strip: Strip
    source: Strip | None


def shown_effects(scene: Scene) -> list[ShownEffect]:
    """Return a scene's effect strips, each with its effect and its source."""
    pairs = [(effect, strip) for strip in effect_strips(scene) if (effect := effect_of(scene, strip.scene))]
    return [ShownEffect(effect, strip, nearest_source(scene, effect, strip)) for effect, strip in pairs]


def with_sources(scene: Scene) -> list[Any]:
    """Return a scene's effect strips that have a source, each with its effect and its source."""
    return [each for each in shown_effects(scene) if each.source is not None]


def nearest_source(scene: Scene, effect: PropertyGroup, strip: Strip) -> Any:
    """Return the source strip that source_of finds; None: there is none."""
    connected = list(strip.connections)  # a duplicated pair stays connected

    def distance(other: Strip) -> tuple:
        apart = max(other.left_handle - strip.right_handle + 1, strip.left_handle - other.right_handle + 1, 0)
        elsewhere = other.parent_meta() != strip.parent_meta()
        channels = other.channel - strip.channel
        return apart, elsewhere, other not in connected, channels > 0, abs(channels)

    found = [other for other in identified(scene, "virtual_shutter_source", effect.source) if other.type in SOURCES]
    return min(found, key=distance, default=None)


def identified(scene: Scene, name: str, identity: str) -> list:
    """Return a scene's strips, of any type, whose property `name` has this identity. The identity "" finds none."""
    return [strip for strip in all_strips(scene) if getattr(strip, name) == identity != ""]


def invalidate(scene: Scene, effect_scene: Scene | None = None) -> None:
    """Drop the pictures of a scene's effect strips that Blender's sequencer caches, so that they are made again.

    It also counts as a change of the edit (core.revision).

    Args:
        scene: The scene that has the strips.
        effect_scene: Drop only those of strips that show this effect scene; None: those of all effect strips.
    """
    revision.changed()
    for strip in effect_strips(scene):
        if effect_scene is None or strip.scene == effect_scene:
            strip.invalidate_cache("RAW")  # drops what was composed from it, too


def invalidate_all(_owner: object = None, _context: Context | None = None) -> None:
    """Drop the frames that Blender's sequencer keeps of all effects, so that they are made again."""
    for scene in bpy.data.scenes:
        invalidate(scene)


def used_regions(effect: PropertyGroup) -> list:
    """Return an effect's regions whose shutter exists, in order."""
    names = {shutter.name for shutter in effect.shutters}
    return [region for region in effect.regions if region.shutter in names]
