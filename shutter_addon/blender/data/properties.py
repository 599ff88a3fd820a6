"""The effect's data: on the edit's Scene, where it can be keyed (properties nested on a strip cannot).

`scene.virtual_shutter.effects[i]` belongs to the effect scene it points to; the Scene strips that show that scene
are the effect's strips. Frames are timeline frames of the edit, as everywhere in Blender.
"""

import math
import sys

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

from ...core.model.limits import (
    MAX_BAR,
    MAX_CHANNEL,
    MAX_DEGREES,
    MAX_DISTANCE,
    MAX_FRAME,
    MAX_NAME,
    MAX_SCALE,
    MAX_SMOOTH,
)
from ...core.model.shutters import MAX_WINDOW
from . import consistency, matte_strips, revision, selection, strips, validation

# Of labels that Blender translates in another sense ("Frames" is one on the screen). Operators have a context anyway.
CONTEXT = "Virtual Shutter"

# Enum identifiers are the recipe's words in capitals.
POSITIONS = (
    ("START", "Start", "The shown frame is the first of them"),
    ("CENTER", "Center", "The shown frame lies in their middle"),
    ("END", "End", "The shown frame is the last of them"),
)
INTERPOLATIONS = (
    ("DISPLACEMENT", "Displacement", "Move times between shutters and between keyframes"),
    ("VALUE", "Value", "Cross-fade pictures between shutters, and fade every bar by itself between keyframes"),
)
LIGHTS = (
    ("LINEAR", "Linear", "Sum light as a camera does, so that bright streaks stay bright"),
    ("ENCODED", "Encoded", "Sum the values that the footage is encoded with, which dims bright streaks"),
)
EXPOSURES = (
    ("NORMALIZED", "Normalized", "Every shutter gives the same brightness"),
    (
        "WEIGHTED",
        "Weighted",
        "A shutter that is open for less time than the default is darker, in linear light whatever is summed",
    ),
)
EDGES = (
    ("HOLD", "Hold", "Repeat the first or last frame beyond the clip's ends"),
    ("MIRROR", "Mirror", "Play the clip backward beyond its ends"),
    ("SHORTEN", "Shorten", "Leave out what lies beyond the clip's ends"),
)
AGGREGATES = (
    ("1", "Full", "Every pixel has its own shutter"),
    ("2", "Half", "Blocks of 2×2 pixels share a shutter"),
    ("4", "Quarter", "Blocks of 4×4 pixels share a shutter"),
)
INBETWEENS = (
    ("1", "Off", "The source's own frames alone"),
    ("2", "2×", "One frame between two of the source"),
    ("4", "4×", "Three frames between two of the source"),
    ("8", "8×", "Seven frames between two of the source"),
    ("16", "16×", "Fifteen frames between two of the source"),
)
METHODS = (
    ("QUICK", "Quick", "Optical flow by DIS"),
    ("GOOD", "Good", "Optical flow that takes longer, and is better"),
)
PLACES = (
    ("FILE", "Beside the File", "A folder beside the .blend file"),
    ("USER", "Extension", "The extension's own folder"),
)
STROKES = (
    ("LINE", "Line", "The strokes themselves, as wide as the region's width"),
    ("LASSO", "Lasso", "All that the strokes enclose"),
)
KINDS = (
    *STROKES,
    ("MATTE", "Matte", "What a file, a strip or a mask says for every pixel"),
    ("RAMP", "Ramp", "From none of the shutter to all of it, across the picture"),
)
MATTE_SOURCES = (
    ("IMAGE", "File", "A movie, an image sequence or a picture"),
    ("STRIP", "Strip", "A movie, image or clip strip of the edit, as it is trimmed and retimed, muted or not"),
    ("MASK", "Mask", "A mask, as a Mask strip on the footage shows it"),
)
CHANNELS = (
    ("LUMINANCE", "Luminance", "How bright the matte is"),
    ("RED", "Red", "The matte's red"),
    ("GREEN", "Green", "The matte's green"),
    ("BLUE", "Blue", "The matte's blue"),
    ("ALPHA", "Alpha", "How opaque the matte is"),
    ("NAMED", "Named", "A channel of an EXR file, by its name"),
)
TIMINGS = (
    ("SOURCE", "Footage", "The matte's frames belong to those of the footage, however that is trimmed and retimed"),
    ("TIMELINE", "Timeline", "The matte plays along the timeline, from where the Shutter strip starts untrimmed"),
)
BLENDS = (
    ("OVER", "Over", "What is beneath shares what the matte leaves"),
    ("ADD", "Add", "What the matte takes comes from the default shutter alone, so that mattes stand side by side"),
)
RAMPS = (
    ("LINEAR", "Linear", "From the left to the right; its rotation turns it"),
    ("RADIAL", "Radial", "From the center to the farthest corner"),
    ("ANGLE", "Angle", "Once around the center, clockwise from the top"),
    ("LUMINANCE", "Luminance", "How bright the shown frame is"),
)

MOTIONS = (
    ("LOCATION", "Location", "It is moved"),
    ("ROTATION", "Location, Rotation", "It is moved and turned"),
    ("SCALE", "Location, Rotation, Scale", "It is moved, turned and scaled"),
)
FOLLOWED = (
    ("TRACK", "Track", "A single track, which moves the region and does not turn it"),
    ("PLANE", "Plane Track", "The corners of a plane track"),
    ("OBJECT", "Object", "All tracks of an object, or of the camera"),
)

FOLLOWS = (
    ("NOTHING", "Nothing", "The exposure stays where it is in the picture"),
    ("REGION", "Region", "The exposure moves with a region: what the region moves with stays sharp"),
    ("CAMERA", "Camera", "The exposure moves with what the camera sees, as if the camera had stood still"),
)

LENGTHS = (
    ("FRAMES", "Bars", "The bars say for how many frames the shutter is open"),
    ("MOTION", "Motion", "The shutter is open while what it follows moves by a set length; the bars are the shape"),
)

# The renderer asks the F-curves itself: keys on these would show, and not render.
_UNKEYED = set()


def _changed(group, _context):
    """The sequencer keeps finished frames, and knows nothing of what the effect's strips depend on."""
    strips.invalidate(group.id_data)


def _renamed(shutter, new: str, old: str, _is_set) -> str:
    revision.changed()
    return consistency.rename(selection.effect_of_item(shutter), old, new)


def _shortened(region, new: str, old: str, is_set) -> str:
    """As recipes have names. Blender's own `maxlen` counts bytes, of which a character takes up to four."""
    new = new[:MAX_NAME]
    # Blender takes long to find an item's place among many: only where the name counts. The default name of a region
    # that has none yet is nobody's.
    effects = region.id_data.virtual_shutter.effects
    if is_set and any(shutter.follow_region == old for effect in effects for shutter in effect.shutters):
        consistency.rename_followed(selection.effect_of_item(region), old, new)
    return new


def _recolored(shutter, _context):
    revision.changed()
    consistency.color_layers(selection.effect_of_item(shutter), shutter)


def _lengthened(effect, context):
    _fit(consistency.fit_bars, effect, context)


def _multiplied(effect, context):
    _fit(consistency.fit_factor, effect, context)


def _fit(change, effect, context):
    """What a change of a property asks for; why it cannot be would only be printed from here."""
    try:
        change(effect)
    except validation.EffectError as error:
        sentence = str(error)
        if bpy.app.background:
            print(sentence, file=sys.stderr)
        else:
            show = context.window_manager.popup_menu
            show(lambda menu, _context: menu.layout.label(text=sentence, translate=False), icon="ERROR")
    _changed(effect, context)


def _chosen(effect, context):
    consistency.choose_region(effect)
    _aimed(effect, context)


def _aimed(effect, _context):
    consistency.aim_pen(effect)


class ShutterBar(PropertyGroup):
    weight: FloatProperty(
        name="Weight",
        description="How much the bar's frame contributes",
        default=1.0,
        min=0.0,
        max=MAX_BAR,
        soft_max=1.0,
        update=_changed,
    )


class Shutter(PropertyGroup):
    name: StringProperty(name="Name", description="Name of the shutter", default="Shutter", set_transform=_renamed)
    color: FloatVectorProperty(
        name="Color",
        description="Color of the shutter's bars, scribbles and matte",
        subtype="COLOR_GAMMA",
        size=3,
        min=0.0,
        max=1.0,
        default=(0.8, 0.8, 0.8),
        update=_recolored,
        options=_UNKEYED,
    )
    bars: CollectionProperty(type=ShutterBar)
    follow: EnumProperty(
        name="Move With",
        description="What the exposure moves with",
        items=FOLLOWS,
        update=_changed,
        options=_UNKEYED,
    )
    follow_region: StringProperty(
        name="Moved With", description="Name of the region that the exposure moves with", update=_changed
    )
    follow_motion: EnumProperty(
        name="Motion",
        description="What of its motion is followed",
        items=MOTIONS,
        default="SCALE",
        update=_changed,
        options=_UNKEYED,
        translation_context=CONTEXT,
    )
    follow_smooth: IntProperty(
        name="Smoothness",
        description="Frames before and after each over which the motion is averaged, as the mass of a camera does: "
        "at 0 it is followed as it is",
        min=0,
        max=MAX_SMOOTH,
        soft_max=24,
        update=_changed,
        options=_UNKEYED,
    )
    length: EnumProperty(
        name="Length",
        description="What says how long the exposure is",
        items=LENGTHS,
        update=_changed,
        options=_UNKEYED,
    )
    trail: FloatProperty(
        name="Trail Length",
        description="How far what is followed moves while the shutter is open, as a fraction of the picture's height",
        default=0.1,
        min=0.0,
        max=MAX_DISTANCE,
        soft_max=1.0,
        precision=3,
        step=1,
        update=_changed,
    )


class TrackStop(PropertyGroup):
    """Where tracking of a region stopped before it was to.

    frame: counts from the effect's start, so that it moves with its strips"""

    frame: FloatProperty(min=-2 * MAX_FRAME, max=2 * MAX_FRAME)
    forward: BoolProperty()
    fault: StringProperty()


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
    motion: EnumProperty(
        name="Motion",
        description="Which channels Track and Follow key",
        items=MOTIONS,
        default="SCALE",
        options=_UNKEYED,
        translation_context=CONTEXT,
    )
    track_until: IntProperty(
        name="Until",
        description="Timeline frame at which tracking stops; 0 is the end of the strip",
        options=_UNKEYED,
        translation_context=CONTEXT,
    )
    track_all_keys: BoolProperty(
        name="All Keys",
        description="Keep a key at every tracked frame, in place of those that the motion needs within a pixel",
        options=_UNKEYED,
    )
    track_ends: BoolProperty(
        name="End with Track",
        description="Track keys a region's opacity, or the camera's influence, so that it fades where the track ends; "
        "a region ends with its shot",
        default=True,
        options=_UNKEYED,
    )
    follow_clip: PointerProperty(
        name="Clip",
        description="Movie clip of the source's footage, in which something is tracked",
        type=bpy.types.MovieClip,
    )


def _location(description: str):
    return FloatVectorProperty(
        name="Location",
        description=description,
        subtype="XYZ",
        size=2,
        min=-MAX_DISTANCE,
        max=MAX_DISTANCE,
        update=_changed,
    )


def _rotation(description: str):
    limit = math.radians(MAX_DEGREES)
    return FloatProperty(
        name="Rotation", description=description, subtype="ANGLE", min=-limit, max=limit, update=_changed
    )


def _scale(description: str):
    return FloatProperty(
        name="Scale", description=description, default=1.0, min=-MAX_SCALE, max=MAX_SCALE, update=_changed
    )


class ShutterRegion(_Tracked, PropertyGroup):
    name: StringProperty(name="Name", description="Name of the region", default="Region", set_transform=_shortened)
    shutter: StringProperty(name="Shutter", description="Name of the shutter that holds in the region", update=_changed)
    layer: StringProperty(name="Layer", description="Annotation layer that holds the strokes", update=_changed)
    kind: EnumProperty(
        name="Type",
        description="What says where the shutter holds",
        items=KINDS,
        update=_changed,
        options=_UNKEYED,
        translation_context=CONTEXT,
    )
    matte: EnumProperty(
        name="From", description="What the matte is", items=MATTE_SOURCES, update=_changed, options=_UNKEYED
    )
    image: PointerProperty(
        name="File",
        description="Movie, image sequence or picture that is the matte",
        type=bpy.types.Image,
        update=_changed,
    )
    strip: StringProperty(name="Strip", description="Identity of the strip that is the matte", update=_changed)
    strip_name: StringProperty(
        name="Strip",
        description="Strip that is the matte",
        get=matte_strips.strip_name,
        set=matte_strips.choose_strip,
        options={"SKIP_SAVE"},
    )
    mask: PointerProperty(name="Mask", description="Mask that is the matte", type=bpy.types.Mask, update=_changed)
    channel: EnumProperty(
        name="Channel",
        description="What of the matte says how much of the shutter a pixel gets",
        items=CHANNELS,
        update=_changed,
        options=_UNKEYED,
    )
    channel_name: StringProperty(
        name="Channel Name", description="Name of the channel in the EXR file", maxlen=MAX_CHANNEL, update=_changed
    )
    invert: BoolProperty(
        name="Invert", description="The shutter gets what the matte leaves", update=_changed, options=_UNKEYED
    )
    timing: EnumProperty(
        name="Frames Of",
        description="What the matte's frames belong to",
        items=TIMINGS,
        update=_changed,
        options=_UNKEYED,
    )
    offset: IntProperty(
        name="Offset",
        description="Frames by which the matte is ahead",
        min=-MAX_FRAME,
        max=MAX_FRAME,
        update=_changed,
        options=_UNKEYED,
    )
    blend: EnumProperty(
        name="Blend",
        description="How the matte lies over other regions",
        items=BLENDS,
        update=_changed,
        options=_UNKEYED,
        translation_context=CONTEXT,
    )
    opacity: FloatProperty(
        name="Opacity",
        description="How much of the region counts: at 0 the picture is as without it",
        subtype="FACTOR",
        default=1.0,
        min=0.0,
        max=1.0,
        update=_changed,
    )
    feather: FloatProperty(
        name="Feather",
        description="How wide a hard edge of the matte becomes, as a fraction of the picture's height",
        min=0.0,
        max=MAX_DISTANCE,
        soft_max=0.2,
        precision=3,
        step=1,
        update=_changed,
        translation_context=CONTEXT,
    )
    ramp: EnumProperty(name="Ramp", description="How the ramp runs", items=RAMPS, update=_changed, options=_UNKEYED)
    width: FloatProperty(
        name="Width",
        description="Width of the lines as a fraction of the picture's height",
        default=0.02,
        min=0.0,
        max=MAX_DISTANCE,
        soft_max=0.5,
        update=_changed,
    )
    location: _location("Distance from where the region was drawn, as a fraction of the picture")
    rotation: _rotation("Rotation about the region's center")
    scale: _scale("Scale about the region's center")
    follow_kind: EnumProperty(
        name="Follow Track", description="What the region follows", items=FOLLOWED, default="TRACK", options=_UNKEYED
    )
    follow_object: StringProperty(
        name="Object", description="Tracking object that has the tracks; without one, the camera"
    )
    follow_track: StringProperty(name="Track", description="Name of the track or plane track that is followed")
    # The frame, from the effect's start, at which the editor has put the region; and a digest of the markers that its
    # keys were made from.
    follow_frame: FloatProperty(name="Follow From", min=-2 * MAX_FRAME, max=2 * MAX_FRAME, options={"HIDDEN"})
    follow_stamp: StringProperty(options={"HIDDEN"})


class ShutterCamera(_Tracked, PropertyGroup):
    name: StringProperty(name="Name", description="Name of the camera's animation channels", default="Camera")
    influence: FloatProperty(
        name="Influence",
        description="How much is left of exposures that follow the camera: at 0 the shown frame alone",
        subtype="FACTOR",
        default=1.0,
        min=0.0,
        max=1.0,
        update=_changed,
    )
    location: _location("Where what the camera sees has moved to, as a fraction of the picture")
    rotation: _rotation("Rotation of what the camera sees, about the picture's center")
    scale: _scale("Scale of what the camera sees, about the picture's center")


class ShutterEffect(PropertyGroup):
    name: StringProperty(name="Name", description="Name of the effect", default="Shutter")
    scene: PointerProperty(name="Scene", description="Scene that the effect's strips show", type=bpy.types.Scene)
    source: StringProperty(name="Source", description="Identity of the source strip")
    start: FloatProperty(name="Start", description="Timeline frame where the effect's content starts", options=_UNKEYED)
    window: IntProperty(
        name="Frames",
        description="Number of source frames that a shutter can expose",
        default=8,
        min=1,
        max=MAX_WINDOW,
        update=_lengthened,
        options=_UNKEYED,
        translation_context=CONTEXT,
    )
    position: EnumProperty(
        name="Position",
        description="Where the frames that are exposed lie around the shown one",
        items=POSITIONS,
        update=_changed,
    )
    interpolation: EnumProperty(
        name="Interpolation",
        description="How shutters blend, in the picture and between keyframes",
        items=INTERPOLATIONS,
        update=_changed,
    )
    light: EnumProperty(
        name="Light", description="How the frames that are exposed are summed", items=LIGHTS, update=_changed
    )
    exposure: EnumProperty(
        name="Exposure",
        description="How bright shutters are that are open for different times",
        items=EXPOSURES,
        update=_changed,
        translation_context=CONTEXT,
    )
    edges: EnumProperty(
        name="Clip Ends",
        description="What an exposure gets that reaches beyond the ends of the clip, or of the shot",
        items=EDGES,
        update=_changed,
        translation_context=CONTEXT,
    )
    aggregate: EnumProperty(
        name="Matte Resolution",
        description="Pixels that share a shutter (larger blocks are quicker)",
        items=AGGREGATES,
        update=_changed,
    )
    stop_at_cuts: BoolProperty(
        name="Stop at Cuts",
        description="Exposures end at the source's cuts as they do at the clip's ends",
        default=True,
        update=_changed,
    )
    border: BoolProperty(
        name="Default at Edge",
        description="Make the picture's edge a scribble of the default shutter, so that a stroke alone acts locally",
        update=_changed,
    )
    edge_aware: FloatProperty(
        name="Follow Edges",
        description="How much shutters keep to the edges of the shown frame: at 1 a scribble fills what it lies in",
        subtype="FACTOR",
        min=0.0,
        max=1.0,
        update=_changed,
    )
    camera: PointerProperty(name="Camera", description="How what the camera sees moves", type=ShutterCamera)
    bars_per_frame: IntProperty(
        name="Bars per Frame",
        description="How many bars stand for a source frame",
        default=1,
        options={"HIDDEN"},
    )
    inbetween: EnumProperty(
        name="In-Between Frames",
        description="Frames between those of the source, by optical flow: bars count them all, "
        "and a still frame becomes as many equal bars",
        items=INBETWEENS,
        update=_multiplied,
        options=_UNKEYED,
    )
    inbetween_method: EnumProperty(
        name="Method", description="How in-between frames are made", items=METHODS, update=_changed, options=_UNKEYED
    )
    inbetween_place: EnumProperty(
        name="Place", description="Where in-between frames lie", items=PLACES, update=_changed, options=_UNKEYED
    )
    use_source_time: BoolProperty(
        name="Use Source Time",
        description="Show the source at the time that is set here, in place of the strip's own timing",
        update=_changed,
        options=_UNKEYED,
    )
    source_time: FloatProperty(
        name="Source Time",
        description="Source frame that is shown, 1 is the source's first; keyed, it is a speed ramp",
        default=1.0,
        min=-MAX_FRAME,
        max=MAX_FRAME,
        soft_min=1.0,
        update=_changed,
    )
    shutters: CollectionProperty(type=Shutter)
    regions: CollectionProperty(type=ShutterRegion)
    active_shutter: IntProperty(name="Active Shutter", min=0, update=_chosen, options=_UNKEYED)
    active_region: IntProperty(name="Active Region", min=0, update=_aimed, options=_UNKEYED)


class ShutterScene(PropertyGroup):
    """Of an edit: its effects, and the version of the extension that saved it. Of an effect's scene: an identity, by
    which a copy is known."""

    effects: CollectionProperty(type=ShutterEffect)
    version: StringProperty()
    identity: StringProperty()


classes = (ShutterBar, Shutter, TrackStop, ShutterRegion, ShutterCamera, ShutterEffect, ShutterScene)


def register():
    for cls in classes:
        bpy.utils.register_class(cls)
    bpy.types.Scene.virtual_shutter = PointerProperty(type=ShutterScene)
    # A strip cannot be pointed to and may be renamed: the source strip carries the identity that effects look for.
    bpy.types.Strip.virtual_shutter_source = StringProperty(options={"HIDDEN"})
    # And that which mattes look for: apart, as a source that is duplicated and given other files may be one.
    bpy.types.Strip.virtual_shutter_matte = StringProperty(options={"HIDDEN"})
    # The effect strip carries its scene's: Blender's clipboard drops the scene itself.
    bpy.types.Strip.virtual_shutter_effect = StringProperty(options={"HIDDEN"})
    # That the source was muted when the effect was made, and shall show again when it goes.
    bpy.types.Strip.virtual_shutter_muted = BoolProperty(options={"HIDDEN"})
    # Of annotations and cameras that were made for an effect: its scene's identity. They go with it.
    # annotations.USERS: the user's own.
    bpy.types.ID.virtual_shutter_made = StringProperty(options={"HIDDEN"})


def unregister():
    for name in ("source", "matte", "effect", "muted"):
        delattr(bpy.types.Strip, f"virtual_shutter_{name}")
    del bpy.types.ID.virtual_shutter_made
    del bpy.types.Scene.virtual_shutter
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
