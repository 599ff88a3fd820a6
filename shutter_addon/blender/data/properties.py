"""The effect's data: on the scene that has its strips, where it can be keyed (properties nested on a strip cannot).

`scene.virtual_shutter.effects[i]` belongs to the effect scene it points to; the Scene strips that show that scene
are the effect's strips. Frames are timeline frames, as everywhere in Blender.
"""

import sys

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)
from bpy.types import PropertyGroup

from ...core import revision, told
from ...core.messages import EffectError
from ...core.model.choices import (
    AGGREGATES,
    COMBINES,
    CONTEXT,
    EDGES,
    EXPOSURES,
    FOLLOWS,
    INBETWEENS,
    INTERPOLATIONS,
    LENGTHS,
    LIGHTS,
    METHODS,
    MOTIONS,
    PLACES,
    POSITIONS,
    UNKEYED,
)
from ...core.model.limits import (
    MAX_BAR,
    MAX_DISTANCE,
    MAX_FRAME,
    MAX_PLATE_REACH,
    MAX_SMOOTH,
    MAX_THRESHOLD,
)
from ...core.model.shutters import MAX_WINDOW
from . import consistency, selection
from .consistency import changed
from .region_properties import KEYED, MOVING, ShutterCamera, ShutterRegion, choice, share


def _renamed(shutter, new: str, old: str, _is_set) -> str:
    revision.changed()
    return consistency.rename(selection.effect_of_item(shutter), old, new)


def _recolored(shutter, _context):
    revision.changed()
    consistency.color_layers(selection.effect_of_item(shutter), shutter)


def _window_changed(effect, context):
    _fit(consistency.fit_bars, effect, context)


def _multiplied(effect, context):
    _fit(consistency.fit_factor, effect, context)


def _fit(change, effect, context):
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


def _chosen(effect, context):
    consistency.choose_region(effect)
    _aimed(effect, context)


def _aimed(effect, _context):
    consistency.aim_pen(effect)


def _number(name: str, description: str, default: float, most: float):
    """From 0 on, as a rule no more than 1, of what pictures are made by."""
    words = {"name": name, "description": description}
    return FloatProperty(**words, default=default, min=0.0, max=most, soft_max=1.0, precision=3, step=1, update=changed)


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
        options=UNKEYED,
    )
    bars: CollectionProperty(type=ShutterBar)
    follow: choice("Exposure Moves With", "What the exposure moves with", FOLLOWS)
    follow_region: StringProperty(
        name="Moved With", description="Name of the region that the exposure moves with", update=changed
    )
    follow_motion: choice(
        "Motion", "What of its motion is followed", MOTIONS, default="SCALE", translation_context=CONTEXT
    )
    follow_smooth: IntProperty(
        name="Smoothness",
        description="Frames before and after each over which the motion is averaged, as the mass of a camera does: "
        "at 0 it is followed as it is",
        min=0,
        max=MAX_SMOOTH,
        soft_max=24,
        update=changed,
        options=UNKEYED,
    )
    length: choice("Exposure Length", "What says how long the exposure is", LENGTHS, translation_context=CONTEXT)
    trail: _number(
        "Distance",
        "How far what is followed moves while the shutter is open, as a fraction of the picture's height",
        0.1,
        MAX_DISTANCE,
    )

    combine: choice("Combine", "What the frames that are exposed become", COMBINES)
    by_luminance: BoolProperty(
        name="By Luminance",
        description="Choose a frame for each pixel, by how light it is there, and not one for each color channel",
        update=changed,
        options=UNKEYED,
    )
    use_threshold: BoolProperty(
        name="Use Threshold",
        description="Let only what is lighter, or of the darkest darker, leave a trail beside what is shown",
        update=changed,
        options=UNKEYED,
    )
    threshold: _number(
        "Threshold",
        "Luminance of linear light from which on it leaves a trail; white is 1",
        0.5,
        MAX_THRESHOLD,
    )
    softness: _number(
        "Softness",
        "Range of luminance, around the threshold, over which a trail fades in",
        0.1,
        MAX_THRESHOLD,
    )

    # The preset that it was given last, and the effect's position then (consistency.preset_of).
    preset: StringProperty(options={"HIDDEN"})
    preset_position: StringProperty(options={"HIDDEN"})


class ShutterEffect(PropertyGroup):
    name: StringProperty(name="Name", description="Name of the effect", default="Shutter")
    scene: PointerProperty(name="Scene", description="Scene that the effect's strips show", type=bpy.types.Scene)
    # Its scene's. Undo may bring the effect back with a pointer to another scene, if its own had been removed.
    identity: StringProperty(options={"HIDDEN"})
    source: StringProperty(name="Source", description="Identity of the source strip")
    start: FloatProperty(name="Start", description="Timeline frame where the effect's content starts", options=UNKEYED)
    window: IntProperty(
        name="Frames",
        description="Number of source frames that a shutter can expose",
        default=8,
        min=1,
        max=MAX_WINDOW,
        update=_window_changed,
        options=UNKEYED,
        translation_context=CONTEXT,
    )
    position: choice(
        "Position",
        "Where the frames that are exposed lie around the shown one",
        POSITIONS,
        update=_window_changed,
        options=KEYED,
    )
    interpolation: choice(
        "Interpolation", "How shutters blend, in the picture and between keyframes", INTERPOLATIONS, options=KEYED
    )
    light: choice("Light", "How the frames that are exposed are summed", LIGHTS, options=KEYED)
    exposure: choice(
        "Exposure",
        "How bright shutters are that are open for different times",
        EXPOSURES,
        options=KEYED,
        translation_context=CONTEXT,
    )
    edges: choice(
        "Clip Ends",
        "What an exposure gets that reaches beyond the ends of the clip, or of the shot",
        EDGES,
        options=KEYED,
        translation_context=CONTEXT,
    )
    aggregate: choice(
        "Matte Resolution", "Pixels that share a shutter (larger blocks are quicker)", AGGREGATES, options=KEYED
    )
    stop_at_cuts: BoolProperty(
        name="Stop at Cuts",
        description="Exposures end at the source's cuts as they do at the clip's ends",
        default=True,
        update=changed,
    )
    plate_reach: IntProperty(
        name="Background Search",
        description="Frames before and after the shown one in which what lies behind layers is looked for, "
        "where no exposed frame shows it",
        default=48,
        min=0,
        max=MAX_PLATE_REACH,
        soft_max=120,
        update=changed,
        options=UNKEYED,
    )
    decontaminate: BoolProperty(
        name="Clean Edges",
        description="Give layers, and what lies behind them, their own colors in the mixed pixels at their edges",
        default=True,
        update=changed,
    )
    border: BoolProperty(
        name="Keep Edges Default",
        description="Make the picture's edge a scribble of the default shutter, so that a stroke alone acts locally",
        update=changed,
    )
    edge_aware: share(
        "Follow Edges",
        "How much shutters keep to the edges of the shown frame: at 1 a scribble fills what it lies in",
        0,
    )
    camera: PointerProperty(name="Camera", description="How what the camera sees moves", type=ShutterCamera)
    bars_per_frame: IntProperty(
        name="Bars per Frame",
        description="How many bars stand for a source frame",
        default=1,
        options={"HIDDEN"},
    )
    inbetween: choice(
        "In-Between Frames",
        "Frames between those of the source, by optical flow: bars count them all, "
        "and a still frame becomes as many equal bars",
        INBETWEENS,
        update=_multiplied,
    )
    inbetween_method: choice("Method", "How in-between frames are made", METHODS)
    inbetween_place: choice("Place", "Where in-between frames lie", PLACES)
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


def register():
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


def unregister():
    for name in ("source", "matte", "effect", "muted", "bake"):
        delattr(bpy.types.Strip, f"virtual_shutter_{name}")
    del bpy.types.ID.virtual_shutter_made
    del bpy.types.Annotation.virtual_shutter_start
    del bpy.types.Annotation.virtual_shutter_names
    del bpy.types.Scene.virtual_shutter
