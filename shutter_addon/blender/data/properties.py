"""The effect's data: on the scene that has its strips, where it can be keyed (properties nested on a strip cannot).

`scene.virtual_shutter.effects[i]` belongs to the effect scene it points to; the Scene strips that show that scene
are the effect's strips. Frames are timeline frames, as everywhere in Blender.
"""

import sys
from collections.abc import Callable

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)
from bpy.types import Context, PropertyGroup

from ...core import revision, told
from ...core.messages import EffectError
from ...core.model import effect as model
from ...core.model.choices import FOLLOWS, UNKEYED
from ...core.model.frame_state import Options
from ...core.model.limits import MAX_BAR, MAX_FRAME
from . import consistency, selection
from .consistency import changed
from .region_properties import MOVING, ShutterCamera, ShutterRegion, choice, with_fields


def _renamed(shutter: PropertyGroup, new: str, old: str, _is_set: bool) -> str:
    revision.changed()
    return consistency.rename(selection.effect_of_item(shutter), old, new)


def _recolored(shutter: PropertyGroup, _context: Context) -> None:
    revision.changed()
    consistency.color_layers(selection.effect_of_item(shutter), shutter)


def _window_changed(effect: PropertyGroup, context: Context) -> None:
    _fit(consistency.fit_bars, effect, context)


def _fit(change: Callable[[PropertyGroup], None], effect: PropertyGroup, context: Context) -> None:
    """What a change of a property asks for; why it cannot be would only be printed from here."""
    try:
        change(effect)
    except EffectError as error:
        sentence = str(error)
        told.record(sentence)
        if bpy.app.background:
            print(sentence, file=sys.stderr)
        else:
            show = context.window_manager.popup_menu
            show(lambda menu, _context: menu.layout.label(text=sentence, translate=False), icon="ERROR")
    changed(effect, context)


def _chosen(effect: PropertyGroup, context: Context) -> None:
    consistency.choose_region(effect)
    _aimed(effect, context)


def _aimed(effect: PropertyGroup, _context: Context) -> None:
    consistency.aim_pen(effect)


class ShutterBar(PropertyGroup):
    weight: FloatProperty(
        name="Weight",
        description="How much the bar's frame contributes",
        default=1.0,
        min=0.0,
        max=MAX_BAR,
        soft_max=1.0,
        update=changed,
    )


@with_fields(
    model.Shutter,
    name={"set_transform": _renamed},
    color={"update": _recolored},
)
class Shutter(PropertyGroup):
    bars: CollectionProperty(type=ShutterBar)
    follow: choice("Exposure Moves With", "What the exposure moves with", FOLLOWS)
    follow_region: StringProperty(
        name="Moved With", description="Name of the region that the exposure moves with", update=changed
    )
    # The preset that it was given last, and the effect's position then (consistency.preset_of).
    preset: StringProperty(options={"HIDDEN"})
    preset_position: StringProperty(options={"HIDDEN"})


@with_fields(
    model.Effect,
    Options,
    window={"update": _window_changed},
    position={"update": _window_changed},
)
class _Settings:
    """All of an effect but its shutters and regions. Copies get these first, and bars that fit them after that."""

    name: StringProperty(name="Name", description="Name of the effect", default="Shutter")
    scene: PointerProperty(name="Scene", description="Scene that the effect's strips show", type=bpy.types.Scene)
    # Its scene's. Undo may bring the effect back with a pointer to another scene, if its own had been removed.
    identity: StringProperty(options={"HIDDEN"})
    source: StringProperty(name="Source", description="Identity of the source strip")
    start: FloatProperty(name="Start", description="Timeline frame where the effect's content starts", options=UNKEYED)
    camera: PointerProperty(name="Camera", description="How what the camera sees moves", type=ShutterCamera)
    use_source_time: BoolProperty(
        name="Custom Time",
        description="Show the source at the time that is set here, in place of the strip's own timing",
        update=changed,
        options=UNKEYED,
    )
    source_time: FloatProperty(
        name="Source Time",
        description="Source frame that is shown, 1 is the source's first; keyed, it is a speed ramp",
        default=1.0,
        min=-MAX_FRAME,
        max=MAX_FRAME,
        soft_min=1.0,
        update=changed,
    )


class ShutterEffect(_Settings, PropertyGroup):
    shutters: CollectionProperty(type=Shutter)
    regions: CollectionProperty(type=ShutterRegion)
    active_shutter: IntProperty(name="Active Shutter", min=0, update=_chosen, options=UNKEYED)
    active_region: IntProperty(name="Active Region", min=0, update=_aimed, options=UNKEYED)


class ShutterScene(PropertyGroup):
    """Of a scene: its effects, the version of the extension that saved it, and the format of what it saved
    (data_format). Of an effect scene: an identity, by which a copy is known."""

    effects: CollectionProperty(type=ShutterEffect)
    version: StringProperty()
    format: IntProperty()
    identity: StringProperty()


class ShutterBake(PropertyGroup):
    """Of a strip that was baked from an effect strip, and of that strip: `identity` is the same.

    version: of the effect when it was baked (effect_version), over `count` frames from `first`, which count from the
    effect strip's origin
    source: identity of the effect's source, for 0.1.0 alone; channel: that of the effect strip before it made room for
    the film"""

    identity: StringProperty()
    version: StringProperty()
    first: IntProperty()
    count: IntProperty()
    channel: IntProperty()


classes = (ShutterBar, Shutter, *MOVING, ShutterEffect, ShutterScene, ShutterBake)


def register() -> None:
    bpy.types.Scene.virtual_shutter = PointerProperty(type=ShutterScene)
    # A strip cannot be pointed to and may be renamed: the source strip carries the identity that effects look for.
    bpy.types.Strip.virtual_shutter_source = StringProperty(options={"HIDDEN"})
    # And that which mattes look for: apart, as a source that is duplicated and given other files may be one.
    bpy.types.Strip.virtual_shutter_matte = StringProperty(options={"HIDDEN"})
    # The effect strip carries its scene's: Blender's clipboard drops the scene itself.
    bpy.types.Strip.virtual_shutter_effect = StringProperty(options={"HIDDEN"})
    # That the source was muted when the effect was made, and shall show again when it goes.
    bpy.types.Strip.virtual_shutter_muted = BoolProperty(options={"HIDDEN"})
    bpy.types.Strip.virtual_shutter_bake = PointerProperty(type=ShutterBake, options={"HIDDEN"})
    # Of annotations and cameras that were made for an effect: its scene's identity. They go with it.
    # annotations.USERS: the user's own.
    bpy.types.ID.virtual_shutter_made = StringProperty(options={"HIDDEN"})
    # The effect's start that an annotation's drawings are for.
    bpy.types.Annotation.virtual_shutter_start = FloatProperty(options={"HIDDEN"})
    # The names of its drawings that regions go by, a line each.
    bpy.types.Annotation.virtual_shutter_names = StringProperty(options={"HIDDEN"})


def unregister() -> None:
    for name in ("source", "matte", "effect", "muted", "bake"):
        delattr(bpy.types.Strip, f"virtual_shutter_{name}")
    del bpy.types.ID.virtual_shutter_made
    del bpy.types.Annotation.virtual_shutter_start
    del bpy.types.Annotation.virtual_shutter_names
    del bpy.types.Scene.virtual_shutter
