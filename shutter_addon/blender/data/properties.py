"""The effect's data: on the scene that has its strips, where it can be keyed (properties nested on a strip cannot).

`scene.virtual_shutter.effects[i]` belongs to the effect scene it points to; the Scene strips that show that scene
are the effect's strips. Frames are timeline frames, as everywhere in Blender. What the model's fields define
(core/model/fields.py) becomes properties here.
"""

import math
import sys
from collections.abc import Callable, Sequence
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)
from bpy.types import Context, PropertyGroup

from ...core import revision, told
from ...core.messages import EffectError
from ...core.model import effect as model
from ...core.model.choices import CONTEXT, FOLLOWED, FOLLOWS, KINDS, MATTE_SOURCES, MOTIONS, UNKEYED
from ...core.model.fields import Field, fields_of
from ...core.model.frame_state import Options
from ...core.model.limits import MAX_BAR, MAX_CHANNEL, MAX_DEGREES, MAX_DISTANCE, MAX_FRAME, MAX_NAME, MAX_SCALE
from . import consistency, matte_content, selection
from .consistency import changed

KEYED = {"ANIMATABLE"}  # as properties are where nothing else is said


def with_fields(*kinds: type, **more: dict) -> Callable[[type], type]:
    """A decorator: adds to a class, behind its own properties, those of the fields of the model's classes.

    more: for a property of that name in Blender, what is said of it beside its field, such as its `update`"""

    def added(group: type) -> type:
        for field in fields_of(*kinds).values():
            group.__annotations__[field.blender] = _property(field, **more.get(field.blender, {}))
        return group

    return added


def _property(field: Field, **more: Any) -> object:
    """A field as Blender's property: of what pictures are made by, unless it is a text, which is a name."""
    kind, default = type(field.default), field.default
    said: dict = {"name": field.label, "description": field.description, "translation_context": field.context}
    if kind is str and not field.choices:
        return StringProperty(**said, default=default, **more)
    said |= {"update": changed, "options": KEYED if field.keyed else UNKEYED} | more
    if field.choices:
        return EnumProperty(**said, items=field.choices, default=str(default).upper())
    said["default"] = default
    if kind is bool:
        return BoolProperty(**said)
    if kind is tuple:
        return FloatVectorProperty(**said, size=len(default), min=field.least, max=field.most, subtype=field.subtype)
    most = kind(field.most)
    said |= {"min": kind(field.least), "max": most, "soft_max": kind(field.soft_most or most), "subtype": field.subtype}
    if kind is int:
        return IntProperty(**said)
    return FloatProperty(**said, precision=field.precision, step=1 if field.precision > 2 else 3)


def _shortened(region: PropertyGroup, new: str, old: str, is_set: bool) -> str:
    """As recipes have names. Blender's own `maxlen` counts bytes, of which a character takes up to four."""
    new = new[:MAX_NAME]
    # Blender takes long to find an item's place among many: only where the name counts. The default name of a region
    # that has none yet is nobody's.
    effects = region.id_data.virtual_shutter.effects
    if is_set and any(shutter.follow_region == old for effect in effects for shutter in effect.shutters):
        consistency.rename_followed(selection.effect_of_item(region), old, new)
    return new


def choice(
    name: str,
    description: str,
    items: Sequence[tuple[str, str, str]],
    *,
    update: Callable | None = changed,
    **more: str,
) -> object:
    """An enum; as most are, of what pictures are made by, and without keys."""
    return EnumProperty(name=name, description=description, items=items, update=update, options=UNKEYED, **more)


class TrackStop(PropertyGroup):
    """Where tracking of a region stopped before it was to.

    frame: counts from the effect's start, so that it moves with its strips"""

    frame: FloatProperty(min=-2 * MAX_FRAME, max=2 * MAX_FRAME)
    forward: BoolProperty()
    fault: StringProperty()


class DrawnPlace(PropertyGroup):
    """Where a region was as its drawing at a frame was made, which is seen there; frame: as that of a TrackStop."""

    frame: FloatProperty()
    location: FloatVectorProperty(size=2)
    rotation: FloatProperty()
    scale: FloatProperty(default=1.0)


class _Tracked:
    """What tracking has found of a region or of the camera, and how it is tracked."""

    confidence: FloatProperty(
        name="Confidence",
        description="How sure tracking was of where it is",
        subtype="PERCENTAGE",
        default=100.0,
        min=0.0,
        max=100.0,
    )
    stops: CollectionProperty(type=TrackStop)
    motion: choice(
        "Motion",
        "Which channels Track and Follow key",
        MOTIONS,
        update=None,
        default="SCALE",
        translation_context=CONTEXT,
    )
    track_until: IntProperty(
        name="Until",
        description="Timeline frame at which tracking stops; 0 is the end of the strip",
        options=UNKEYED,
        translation_context=CONTEXT,
    )
    track_all_keys: BoolProperty(
        name="All Keys",
        description="Keep a key at every tracked frame, in place of those that the motion needs within a pixel",
        options=UNKEYED,
    )
    track_ends: BoolProperty(
        name="Fade Out When Lost",
        description="Track keys a region's opacity, or the camera's influence, so that it fades where the track ends; "
        "a region ends with its shot",
        default=True,
        options=UNKEYED,
    )
    follow_clip: PointerProperty(
        name="Clip",
        description="Movie clip of the source's footage, in which something is tracked",
        type=bpy.types.MovieClip,
    )


def location_property(description: str, **more: Any) -> object:
    return FloatVectorProperty(
        name="Location",
        description=description,
        subtype="XYZ",
        size=2,
        min=-MAX_DISTANCE,
        max=MAX_DISTANCE,
        **more,
    )


def rotation_property(description: str, **more: Any) -> object:
    limit = math.radians(MAX_DEGREES)
    return FloatProperty(name="Rotation", description=description, subtype="ANGLE", min=-limit, max=limit, **more)


def scale_property(description: str, **more: Any) -> object:
    return FloatProperty(name="Scale", description=description, default=1.0, min=-MAX_SCALE, max=MAX_SCALE, **more)


@with_fields(
    model.Region,
    model.OutlineRegion,
    model.FileContent,
    model.RampContent,
    name={"set_transform": _shortened},
)
class ShutterRegion(_Tracked, PropertyGroup):
    shutter: StringProperty(name="Shutter", description="Name of the shutter that holds in the region", update=changed)
    layer: StringProperty(name="Layer", description="Annotation layer that holds the strokes", update=changed)
    # Where there is any, drawings without one are seen where they were drawn as well; else, where it has not moved.
    drawn: CollectionProperty(type=DrawnPlace)
    kind: choice("Type", "What says where the shutter holds", KINDS, translation_context=CONTEXT)
    matte: choice("From", "What the matte is", MATTE_SOURCES)
    image: PointerProperty(
        name="File",
        description="Movie, image sequence or picture that is the matte",
        type=bpy.types.Image,
        update=changed,
    )
    strip: StringProperty(name="Strip", description="Identity of the strip that is the matte", update=changed)
    strip_name: StringProperty(
        name="Strip",
        description="Strip that is the matte",
        get=matte_content.strip_name,
        set=matte_content.choose_strip,
        options={"SKIP_SAVE"},
    )
    mask: PointerProperty(name="Mask", description="Mask that is the matte", type=bpy.types.Mask, update=changed)
    channel_name: StringProperty(
        name="Channel Name", description="Name of the channel in the EXR file", maxlen=MAX_CHANNEL, update=changed
    )
    location: location_property(
        "Distance from where the region was drawn, as a fraction of the picture", update=changed
    )
    rotation: rotation_property("Rotation about the region's center", update=changed)
    scale: scale_property("Scale about the region's center", update=changed)
    follow_kind: choice("Follow Track", "What the region follows", FOLLOWED, update=None, default="TRACK")
    follow_object: StringProperty(
        name="Object", description="Tracking object that has the tracks; without one, the camera"
    )
    follow_track: StringProperty(name="Track", description="Name of the track or plane track that is followed")
    # The frame, from the effect's start, at which the editor has put the region; and a digest of the markers that its
    # keys were made from.
    follow_frame: FloatProperty(name="Follow From", min=-2 * MAX_FRAME, max=2 * MAX_FRAME, options={"HIDDEN"})
    follow_stamp: StringProperty(options={"HIDDEN"})


@with_fields(model.Camera)
class ShutterCamera(_Tracked, PropertyGroup):
    name: StringProperty(name="Name", description="Name of the camera's animation channels", default="Camera")
    location: location_property("Where what the camera sees has moved to, as a fraction of the picture", update=changed)
    rotation: rotation_property("Rotation of what the camera sees, about the picture's center", update=changed)
    scale: scale_property("Scale of what the camera sees, about the picture's center", update=changed)


def _renamed(shutter: PropertyGroup, new: str, old: str, _is_set: bool) -> str:
    revision.changed()
    return consistency.rename(selection.effect_of_item(shutter), old, new)


def _recolored(shutter: PropertyGroup, _context: Context) -> None:
    revision.changed()
    consistency.color_layers(selection.effect_of_item(shutter), shutter)


def _window_changed(effect: PropertyGroup, context: Context) -> None:
    """Why bars cannot follow would only be printed from here."""
    try:
        consistency.fit_bars(effect)
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
        description="Contribution of the bar's frame",
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


# In the order in which Blender gets to know them.
_MOVING = TrackStop, DrawnPlace, ShutterRegion, ShutterCamera
classes = (ShutterBar, Shutter, *_MOVING, ShutterEffect, ShutterScene, ShutterBake)


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
