"""What the user sees and works on: the active strip, effect, shutter and region, and the effect in the preview."""

from dataclasses import dataclass
from typing import Any

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Context, PropertyGroup, Scene, Strip

from ...core import revision
from . import strips
from .strips import SOURCES, effect_of, effect_strips


def scene_of(context: Context) -> Any:
    """Return the scene whose sequencer a context shows; None: there is none."""
    return getattr(context, "sequencer_scene", None) or context.scene


def active_strip(context: Context) -> Any:
    """Return the active strip of the context's scene; None: there is none.

    If it is a movie's sound, return the movie, because Blender makes the sound active when it adds both.
    """
    scene = scene_of(context)
    strip = scene.sequence_editor.active_strip if scene and scene.sequence_editor else None
    if strip is None or strip.type != "SOUND":
        return strip
    return next((other for other in strip.connections if other.type in SOURCES), strip)


def active(context: Context) -> Any:
    """Return (scene, effect, effect strip) that panels show and operators change; None: there is none.

    - No strip is active: the effect strip in the preview (`seen`) is returned.
    - The active strip is a baked strip, or an effect strip that was baked: that effect and its effect strip.
    - It is an effect strip or the source of effects: the strip in the preview, if that shows one of these effects, or
      if the active strip is not selected. Otherwise the active strip or, for a source, the nearest that uses it.
    - It is any other strip: None.
    """
    scene, strip = scene_of(context), active_strip(context)
    if strip is not None and (baked := _baked_part(scene, strip)) is not None:
        return baked
    effects = _effects_of(scene, strip)
    if strip is not None and not effects:
        return None
    shown = seen(scene)
    if not effects or (shown is not None and (shown[1] in effects or not strip.select)):
        return shown
    others = [other for other in effect_strips(scene) if effect_of(scene, other.scene) in effects]
    nearest = min(others, key=lambda o: (o != strip, abs(o.left_handle - strip.left_handle)), default=None)
    return (scene, effect_of(scene, nearest.scene), nearest) if nearest else None


def in_picture(context: Context) -> Any:
    """Return what `active` returns, but only if the preview shows that effect strip at the playhead, else None."""
    shown = active(context)
    return shown if shown and seen(shown[0]) == shown else None


def seen(scene: Scene) -> Any:
    """Return (scene, effect, effect strip) that previews of a scene show at the playhead; None: no effect is there.

    Of several effect strips, take the active one, else one whose effect the active strip shows or is the source of,
    else the highest channel.
    """
    scene_strips = [strip for strip in visible(scene) if strip.type == "SCENE" and strip.scene]
    shown = [(strip, effect) for strip in scene_strips if (effect := effect_of(scene, strip.scene))]
    if not shown:
        return None
    active = scene.sequence_editor.active_strip
    related = _effects_of(scene, active)
    strip, effect = max(shown, key=lambda pair: (pair[0] == active, pair[1] in related, pair[0].channel))
    return scene, effect, strip


def visible(scene: Scene) -> list:
    """Return the strips at the playhead that have a picture and are not muted, nor their channel.

    These are the strips directly in the open meta strip or, if none is open, those in no meta strip.
    """
    editor, frame = scene and scene.sequence_editor, scene and scene.frame_current
    if not editor:
        return []
    level = editor.meta_stack[-1] if editor.meta_stack else editor
    here = [strip for strip in level.strips if strips.is_at(strip, frame) and strip.type != "SOUND"]
    return [strip for strip in here if not (strip.mute or level.channels[strip.channel].mute)]


def why_unseen(scene: Scene, strip: Strip) -> str:
    """Return a sentence for the user: why an effect strip is not in the preview's picture, and what to do about it."""
    if not strips.is_at(strip, scene.frame_current):
        return rpt_("Move the playhead onto the Shutter strip")
    if strip.mute and strip.virtual_shutter_bake.identity:
        return rpt_("The effect is baked: unbake it to see changes")
    if strip.mute or (strip.parent_meta() or scene.sequence_editor).channels[strip.channel].mute:
        return rpt_("Unmute the Shutter strip")
    return rpt_("Open the meta strip that the Shutter strip is in")


def _effects_of(scene: Scene, strip: Strip | None) -> list:
    """Return the effect that an effect strip shows, in a list, or all effects that have the strip as their source."""
    if strip is None:
        return []
    if strip.type == "SCENE" and (own := effect_of(scene, strip.scene)):
        return [own]
    identity = strip.virtual_shutter_source
    return [effect for effect in scene.virtual_shutter.effects if effect.source == identity != ""]


def _baked_part(scene: Scene, strip: Strip) -> Any:
    """Return (scene, effect, effect strip) of the bake that a strip belongs to.

    None: the strip is no part of a bake, or the bake has no effect strip any more.

    A bake consists of the effect strip and the baked strip that replaces it. Copies of them share the bake's identity.
    Of several effect strips, `strip` itself comes first, then one that overlaps it in time, then any.
    """
    parts = [part for part in of_bake(scene, strip) if part.type == "SCENE" and part.scene]
    parts.sort(key=lambda part: (part != strip, not strips.overlap(part, strip)))
    shown = ((effect_of(scene, part.scene), part) for part in parts)
    return next(((scene, effect, part) for effect, part in shown if effect), None)


def of_bake(scene: Scene, strip: Strip) -> list:
    """Return all effect strips and baked strips of the bake that a strip belongs to, itself too; []: it has no bake."""
    identity = strip.virtual_shutter_bake.identity
    found = scene.sequence_editor.strips_all if identity else ()
    return [other for other in found if other.virtual_shutter_bake.identity == identity]


def choose(scene: Scene, strip: Strip) -> None:
    """Make a strip the active one, and select it alone."""
    for other in scene.sequence_editor.strips_all:
        other.select = other == strip
    scene.sequence_editor.active_strip = strip


def effect_of_item(item: PropertyGroup) -> PropertyGroup:
    """Return the effect that a shutter or a region belongs to."""
    path = item.path_from_id()
    return item.id_data.path_resolve(path[: path.index("]") + 1])


def moving(effect: PropertyGroup, index: int | None) -> PropertyGroup:
    """Return the effect's region with this index or, for None, its camera. Both have location, rotation and scale."""
    return effect.camera if index is None else effect.regions[index]


def active_shutter(effect: PropertyGroup) -> Any:
    """Return the shutter that is active in the list of shutters; None: there is none."""
    return effect.shutters[effect.active_shutter] if 0 <= effect.active_shutter < len(effect.shutters) else None


def own_regions(effect: PropertyGroup) -> list[int]:
    """Return the indices of the regions that use the active shutter. The list of regions shows only these."""
    shutter = active_shutter(effect)
    return [i for i, region in enumerate(effect.regions) if shutter and region.shutter == shutter.name]


def active_region(effect: PropertyGroup) -> Any:
    """Return the region that is active in the list of regions; None: there is none, or it uses another shutter."""
    region = effect.regions[effect.active_region] if 0 <= effect.active_region < len(effect.regions) else None
    shutter = active_shutter(effect)
    return region if region and shutter and region.shutter == shutter.name else None


@dataclass(frozen=True)
class Target:
    """What a longer task such as tracking works on: a region or the camera, found again before each step of the task.

    A reference to it would not do, because Blender's data may be moved in memory or removed between two steps.

    Attributes:
        scene: session_uid of the effect scene.
        index: Index of the region in the effect; None: the camera.
        known: State of the data when the task began, from _known. If it differs later, the target is given up.
    """

    scene: int
    index: Any
    known: tuple

    @classmethod
    def of(cls, effect: PropertyGroup, index: int | None) -> "Target":
        return cls(effect.scene.session_uid, index, cls._known(effect, index))

    def effect(self) -> PropertyGroup | None:
        """Return the effect that has the target, looked up in Blender's data.

        Returns:
            None if the effect was removed or moved in time, if undo or loading replaced Blender's data, or if
            no region, or one with another annotation layer, has the index now.
        """
        effects = (effect for scene in bpy.data.scenes for effect in scene.virtual_shutter.effects if effect.scene)
        effect = next((effect for effect in effects if effect.scene.session_uid == self.scene), None)
        is_there = effect is not None and (self.index is None or self.index < len(effect.regions))
        return effect if is_there and self._known(effect, self.index) == self.known else None

    @staticmethod
    def _known(effect: PropertyGroup, index: int | None) -> tuple:
        layer = None if index is None else effect.regions[index].layer
        return revision.edit.replaced, effect.id_data.session_uid, effect.start, layer
