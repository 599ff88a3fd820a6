"""The effect's Blender properties, most of them made from the model's fields (core/model/fields.py).

They lie on the scene whose sequencer has the effect's strips, because properties nested on a strip cannot be keyed.
`scene.virtual_shutter.effects[i].scene` is the effect scene. The Scene strips that show it are the effect's strips.
Frames are timeline frames.
"""

import math
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

from ...core import revision
from ...core.model import effect as model
from ...core.model.choices import CONTEXT, FOLLOWED, FOLLOWS, KINDS, MATTE_SOURCES, MOTIONS
from ...core.model.fields import Field, fields_of
from ...core.model.frame_state import Options
from ...core.model.limits import MAX_BAR, MAX_CHANNEL, MAX_DEGREES, MAX_DISTANCE, MAX_FRAME, MAX_NAME, MAX_SCALE
from . import consistency, selection
from .consistency import changed
from .matte_content import choose_strip, strip_name

KEYED = {"ANIMATABLE"}  # Blender's default
_FAR, _TURN = {"min": -MAX_DISTANCE, "max": MAX_DISTANCE}, math.radians(MAX_DEGREES)


def with_fields(*kinds: type, **more: dict) -> Callable[[type], type]:
    """Return a class decorator that gives a Blender class the properties that fields of some dataclasses declare.

    Each Blender property takes its name, label, range and default from its field. Other fields are left out.

    Args:
        kinds: Dataclasses of the model, such as core.model.effect.Shutter.
        more: Further arguments of Blender properties, by property name, such as {"update": callback}.
    """

    def added(group: type) -> type:
        for field in fields_of(*kinds).values():
            group.__annotations__[field.blender] = _property(field, **more.get(field.blender, {}))
        return group

    return added


def _property(field: Field, **more: Any) -> object:
    """Return the Blender property for a dataclass field of the model, with its label, range and default.

    Args:
        field: Describes the field.
        more: Further arguments of the Blender property. Without an `update`, a change calls consistency.changed; but a
            change of a text calls nothing.
    """
    kind, default = type(field.default), field.default
    said: dict = {"name": field.label, "description": field.description, "translation_context": field.context}
    if kind is str and not field.choices:
        return StringProperty(**said, default=default, **more)
    said |= {"update": changed, "options": KEYED if field.keyed else set()} | more
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


def _region_renamed(region: PropertyGroup, new: str, old: str, is_set: bool) -> str:
    """Return the name to store for a renamed region: the new name, cut to MAX_NAME characters.

    Shutters that follow the region get the new name, too. Blender calls this as the `set_transform` of the property
    `name`. Blender's own `maxlen` would count bytes, not characters.

    Args:
        new: The new name.
        old: The name until now.
        is_set: Whether the region had a name until now; if not, no shutter follows it.
    """
    new = new[:MAX_NAME]
    if is_set:  # otherwise it has no old name
        consistency.refollow(selection.effect_of_item(region), old, new)
    return new


def labelled(kind: Callable, name: str, description: str, **more: Any) -> object:
    """Return a Blender property with a label and a tooltip. When it changes, the effects' frames are made again.

    Args:
        kind: A function of bpy.props, such as FloatProperty.
        name: The label.
        description: The tooltip.
        more: Further arguments of the property. `update` replaces the callback that has the frames made again.
    """
    return kind(name=name, description=description, **({"update": changed} | more))


def choice(name: str, description: str, items: Sequence[tuple[str, str, str]], **more: Any) -> object:
    """Return an enum property that cannot be keyed. By default, a change has pictures made again."""
    return labelled(EnumProperty, name, description, items=items, options=set(), **more)


def setting(kind: Callable, name: str, description: str, **more: Any) -> object:
    """Return a Blender property that cannot be keyed, and whose change does not alter the effect's pictures.

    The extension translates its label in a context of its own (CONTEXT), apart from Blender's translations.

    Args:
        kind: A function of bpy.props, such as FloatProperty.
        name: The label.
        description: The tooltip.
        more: Further arguments of the property.
    """
    return kind(name=name, description=description, options=set(), translation_context=CONTEXT, **more)


class TrackStop(PropertyGroup):
    """Where and why tracking a region or the camera ended early.

    Attributes:
        frame: The first frame not reached, counted from the effect's start, so that it moves with the effect's strips.
        forward: Whether tracking went forward in time.
        fault: The reason, in English, for the user.
    """

    frame: FloatProperty(min=-2 * MAX_FRAME, max=2 * MAX_FRAME)
    forward: BoolProperty()
    fault: StringProperty()


class DrawnPlace(PropertyGroup):
    """Where a region was when one of its drawings was made. Its strokes move along with the region from there.

    Attributes:
        frame: The frame of the drawing, counted from the effect's start, so that it moves with the effect's strips.
        location, rotation, scale: The values of the region's properties of these names when the drawing was made.
    """

    frame: FloatProperty()
    location: FloatVectorProperty(size=2)
    rotation: FloatProperty()
    scale: FloatProperty(default=1.0)


class _Moving:
    """Place of a region or the camera over time, with the settings and results of tracking it.

    Attributes:
        location: Movement from the initial place, in fractions of the picture's width and height.
        rotation: About the center, in radians.
        scale: About the center; 1 is unchanged.
        confidence: How certain tracking is of the place at a frame, in percent; keyed by tracking.
        stops: Where tracking ended early.
        motion: Which of location, rotation and scale the operators Track and Follow key.
        track_until: Timeline frame where tracking ends; 0: at the strip's end.
        track_all_keys: Whether to key each tracked frame, not only those that the motion needs.
        track_ends: Whether tracking fades out the region, or the camera's influence, where it ends.
    """

    location: labelled(
        FloatVectorProperty, "Location", "Movement, in fractions of the picture", size=2, subtype="XYZ", **_FAR
    )
    rotation: labelled(FloatProperty, "Rotation", "Rotation about the center", subtype="ANGLE", min=-_TURN, max=_TURN)
    scale: labelled(FloatProperty, "Scale", "Scale about the center", default=1.0, min=-MAX_SCALE, max=MAX_SCALE)
    confidence: FloatProperty(
        name="Confidence", description="How certain the position is", subtype="PERCENTAGE", default=100, min=0, max=100
    )
    stops: CollectionProperty(type=TrackStop)
    motion: setting(EnumProperty, "Motion", "Which channels Track and Follow key", items=MOTIONS, default="SCALE")
    track_until: setting(IntProperty, "Until", "Timeline frame at which tracking stops; 0 is the end of the strip")
    track_all_keys: setting(BoolProperty, "All Keys", "Key every tracked frame, not only where the motion needs it")
    track_ends: setting(
        BoolProperty,
        "Fade Out When Lost",
        "Fade out a region, or the camera's influence, where the track ends",
        default=True,
    )


@with_fields(
    model.Region, model.OutlineRegion, model.FileContent, model.RampContent, name={"set_transform": _region_renamed}
)
class ShutterRegion(_Moving, PropertyGroup):
    shutter: labelled(StringProperty, "Shutter", "Name of the shutter that holds in the region")
    layer: labelled(StringProperty, "Layer", "Annotation layer that holds the strokes")
    not_layer: labelled(StringProperty, "Not This", "Annotation layer of strokes on what the subject is not")
    outline_layer: labelled(StringProperty, "Outlines", "Annotation layer of outlines that overrule the model")
    # The first stroke makes it a subject, if a model finds one there.
    finds_subject: BoolProperty(options={"HIDDEN"})
    # Empty: drawings lie where the region has not moved. Otherwise, each lies where it was drawn.
    drawn: CollectionProperty(type=DrawnPlace)
    kind: choice("Type", "What says where the shutter holds", KINDS, translation_context=CONTEXT)
    matte: choice("From", "What the matte is", MATTE_SOURCES)
    image: labelled(PointerProperty, "File", "Movie, image sequence or picture that is the matte", type=bpy.types.Image)
    strip: labelled(StringProperty, "Strip", "Identity of the strip that is the matte")
    strip_name: StringProperty(
        name="Strip", description="Strip that is the matte", get=strip_name, set=choose_strip, options={"SKIP_SAVE"}
    )
    mask: labelled(PointerProperty, "Mask", "Mask that is the matte", type=bpy.types.Mask)
    channel_name: labelled(StringProperty, "Channel Name", "Name of the channel in the EXR file", maxlen=MAX_CHANNEL)
    follow_clip: PointerProperty(name="Clip", description="Movie clip that has the track", type=bpy.types.MovieClip)
    follow_kind: choice("Follow Track", "What the region follows", FOLLOWED, update=None, default="TRACK")
    follow_object: StringProperty(name="Object", description="Tracking object that has the tracks; empty: the camera")
    follow_track: StringProperty(name="Track", description="Name of the track or plane track that is followed")


@with_fields(model.Camera)
class ShutterCamera(_Moving, PropertyGroup):
    name: StringProperty(name="Name", description="Name of the camera's animation channels", default="Camera")


def _shutter_renamed(shutter: PropertyGroup, new: str, old: str, _is_set: bool) -> str:
    revision.changed()
    return consistency.rename(selection.effect_of_item(shutter), old, new)


def _shutter_recolored(shutter: PropertyGroup, _context: Context) -> None:
    revision.changed()
    consistency.color_layers(selection.effect_of_item(shutter), shutter)


def _window_changed(effect: PropertyGroup, context: Context) -> None:
    consistency.fit_bars(effect)
    changed(effect, context)


def _shutter_selected(effect: PropertyGroup, context: Context) -> None:
    consistency.choose_region(effect)
    _region_selected(effect, context)


def _region_selected(effect: PropertyGroup, _context: Context) -> None:
    consistency.aim_pen(effect)


class ShutterBar(PropertyGroup):
    weight: labelled(FloatProperty, "Weight", "How much the frame counts", default=1, min=0, max=MAX_BAR, soft_max=1)


@with_fields(model.Shutter, name={"set_transform": _shutter_renamed}, color={"update": _shutter_recolored})
class Shutter(PropertyGroup):
    bars: CollectionProperty(type=ShutterBar)
    follow: choice("Exposure Moves With", "What the exposure moves with", FOLLOWS)
    follow_region: labelled(StringProperty, "Moved With", "Name of the region that the exposure moves with")
    # The last preset, and the effect's position when it was set (consistency.preset_of).
    preset: StringProperty(options={"HIDDEN"})
    preset_position: StringProperty(options={"HIDDEN"})


@with_fields(model.Effect, Options, window={"update": _window_changed}, position={"update": _window_changed})
class _Settings:
    """The properties of an effect that come before its shutters and regions (ShutterEffect).

    Blender lists the properties of a base class first. So code that copies an effect's properties in order sets the
    window before the shutters' bars, and changing the window does not resample them.
    """

    name: StringProperty(name="Name", description="Name of the effect", default="Shutter")
    scene: PointerProperty(name="Scene", description="Scene that the effect's strips show", type=bpy.types.Scene)
    # Its scene's. If that was removed, undo may bring the effect back with a pointer to another scene.
    identity: StringProperty(options={"HIDDEN"})
    source: StringProperty(name="Source", description="Identity of the source strip")
    start: FloatProperty(name="Start", description="Timeline frame where the effect's content starts", options=set())
    camera: PointerProperty(name="Camera", description="Motion of what the camera sees", type=ShutterCamera)
    use_source_time: labelled(BoolProperty, "Custom Time", "Show the source at the time set here", options=set())
    source_time: labelled(
        FloatProperty,
        "Source Time",
        "Source frame that is shown, 1 is the source's first; keyed, it is a speed ramp",
        default=1.0,
        min=-MAX_FRAME,
        max=MAX_FRAME,
        soft_min=1.0,
    )


class ShutterEffect(_Settings, PropertyGroup):
    shutters: CollectionProperty(type=Shutter)
    regions: CollectionProperty(type=ShutterRegion)
    # The names of the annotation's layers when regions last followed them, a line each.
    layer_names: StringProperty(options={"HIDDEN"})
    active_shutter: IntProperty(name="Active Shutter", min=0, update=_shutter_selected, options=set())
    active_region: IntProperty(name="Active Region", min=0, update=_region_selected, options=set())


class ShutterScene(PropertyGroup):
    """What the extension stores on a scene: on the scene of an edit its effects, on an effect scene its identity.

    An effect scene is a scene that the extension adds for an effect. Scene strips show it.

    Attributes:
        effects: The effects of the scene's sequencer.
        version: The version of the extension that saved them.
        format: The format of their data (data_format).
        identity: Identifies an effect scene; "" on other scenes. The effect, its strip and its annotation store it,
            too, so that they find the scene. A copied scene gets a new identity (editing/reconcile.py).
    """

    effects: CollectionProperty(type=ShutterEffect)
    version: StringProperty()
    format: IntProperty()
    identity: StringProperty()


class ShutterBake(PropertyGroup):
    """Link between a baked strip and the effect strip that it was made from. It is stored on both.

    Attributes:
        identity: The same on both strips; "": the strip has no bake.
        version: Result of effect_version.key when the effect was baked. If the key differs now, the bake is out of
            date.
        first: Number of the first baked frame, counted from the effect strip's origin.
        count: How many frames were baked.
        channel: Sequencer channel that the effect strip had before it made room for the baked strip.
    """

    identity: StringProperty()
    version: StringProperty()
    first: IntProperty()
    count: IntProperty()
    channel: IntProperty()


# In the order of registration.
_MOVING = TrackStop, DrawnPlace, ShutterRegion, ShutterCamera
classes = (ShutterBar, Shutter, *_MOVING, ShutterEffect, ShutterScene, ShutterBake)


def register() -> None:
    bpy.types.Scene.virtual_shutter = PointerProperty(type=ShutterScene)
    # Strips cannot be pointed to, and may be renamed. So a source strip has an identity that its effects know.
    bpy.types.Strip.virtual_shutter_source = StringProperty(options={"HIDDEN"})
    # Another identity for mattes: a duplicated source with other files may be a matte.
    bpy.types.Strip.virtual_shutter_matte = StringProperty(options={"HIDDEN"})
    # On an effect strip, the identity of its scene, which Blender's clipboard drops.
    bpy.types.Strip.virtual_shutter_effect = StringProperty(options={"HIDDEN"})
    # On a source that was muted for an effect, and shows again when that is removed.
    bpy.types.Strip.virtual_shutter_muted = BoolProperty(options={"HIDDEN"})
    bpy.types.Strip.virtual_shutter_bake = PointerProperty(type=ShutterBake, options={"HIDDEN"})
    # On annotations and cameras made for an effect, which are removed with it: its scene's identity. On the user's own
    # annotations: annotations.USERS.
    bpy.types.ID.virtual_shutter_made = StringProperty(options={"HIDDEN"})
    # The effect's start to which an annotation's drawings belong.
    bpy.types.Annotation.virtual_shutter_start = FloatProperty(options={"HIDDEN"})


def unregister() -> None:
    for name in ("source", "matte", "effect", "muted", "bake"):
        delattr(bpy.types.Strip, f"virtual_shutter_{name}")
    del bpy.types.ID.virtual_shutter_made
    del bpy.types.Annotation.virtual_shutter_start
    del bpy.types.Scene.virtual_shutter
