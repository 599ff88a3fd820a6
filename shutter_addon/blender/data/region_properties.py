"""What a region and the camera are in Blender: properties of the scene."""

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
from bpy.types import PropertyGroup

from ...core.model import effect as model
from ...core.model.choices import CONTEXT, FOLLOWED, KINDS, MATTE_SOURCES, MOTIONS, UNKEYED
from ...core.model.limits import MAX_CHANNEL, MAX_DEGREES, MAX_DISTANCE, MAX_FRAME, MAX_NAME, MAX_SCALE
from . import consistency, matte_strips, selection
from .consistency import changed
from .field_properties import with_fields


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
        get=matte_strips.strip_name,
        set=matte_strips.choose_strip,
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


MOVING = TrackStop, DrawnPlace, ShutterRegion, ShutterCamera  # in the order in which Blender gets to know them
