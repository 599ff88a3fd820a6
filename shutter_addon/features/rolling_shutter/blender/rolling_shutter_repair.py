"""Repair a rolling shutter: a sensor that reads row by row films each row at another time, so that moving lines lean.

A row that is read a fraction y of the readout after the first one is shown y - 1/2 of the readout earlier. Then all
rows show the time of the middle row. Two shutters are open for one frame each, before and after the shown one, and a
ramp across the picture displaces between them. The ramp is larger than the picture, as a readout is shorter than two
frames.
"""

import math
from typing import NamedTuple

import numpy as np
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty, FloatProperty
from bpy.types import Context, Operator, PropertyGroup, Scene, Strip

from ....blender.data import snapshot, source_media, strips, validation
from ....blender.data.consistency import bars
from ....blender.data.sampled import Sampling
from ....blender.editing import bar_edits, shutter_edits
from ....blender.interface.operator_bases import operator
from ....core.messages import EffectError
from ....core.model.choices import CONTEXT, READS, SIDES
from ....core.model.frame_state import Options
from ....media import opencv
from ....media.cuts import ShotSource
from .. import readout

SMOOTH = "8"  # for effects that are not smooth
FRAMES = 3  # least window: the shown frame and those beside it
LEAST = 0.02  # fraction of a frame: shorter readouts count as none
# Rotation of the ramp in degrees. What is read first lies at its end, which is shown from later.
_TURNS = {"TOP": 90, "BOTTOM": -90, "LEFT": 180, "RIGHT": 0}


class Repair(NamedTuple):
    """The rolling shutter repair that an effect contains.

    Attributes:
        region: Index of the region that does it: a ramp across the picture.
        readout: Time from reading the first row (or column) to the last, as a fraction of a frame of the footage.
        side: The side of the picture that the sensor reads first, an item of choices.SIDES.
    """

    region: int
    readout: float
    side: str


def of(effect: PropertyGroup) -> Repair | None:
    """Return the rolling shutter repair of an effect, recognized by its ramp and shutters; None: it has none.

    Raises:
        EffectError: The length of the effect's window is out of range.
    """
    if effect.inbetween == "1" or not effect.shutters:
        return None
    default = _moment(effect.shutters[0])
    for index, region in enumerate(effect.regions):
        place = effect.shutters.find(region.shutter)
        if (region.kind, region.ramp) != ("RAMP", "LINEAR") or place <= 0:
            continue
        turn = round(math.degrees(region.rotation)) % 360
        side = next((side for side, turned in _TURNS.items() if turned % 360 == turn), None)
        span = _moment(effect.shutters[place]) - default
        if side and 0 < abs(span) <= 2 and abs(default + span / 2 - _shown(effect)) < 0.6:
            return Repair(index, abs(span) / abs(region.scale or 1), side)
    return None


def _moment(shutter: PropertyGroup) -> float:
    """Return the weighted middle of a shutter's open time, in frames of its window from 0; NaN: it is never open."""
    weights = bars(shutter)
    return float((weights * np.arange(len(weights))).sum() / weights.sum()) if weights.any() else math.nan


def _shown(effect: PropertyGroup) -> int:
    """Return the index of the shown frame in the shutters' window, if the window's *Position* is *Center*."""
    return Options(validation.number(effect, "window"), position="center").before


def repair(scene: Scene, effect: PropertyGroup, strip: Strip, share: float, side: str) -> None:
    """Add a rolling shutter repair to an effect, or change the one that it has.

    This also sets the effect's window, *Position*, interpolation and, if it is off, *Smooth* as the repair needs them.

    Args:
        share: Readout time as a fraction of a frame of the footage, above 0 (Repair.readout).
        side: The side of the picture that the sensor reads first, an item of choices.SIDES.

    Raises:
        EffectError, MediaError: The effect has no room for another region and two shutters, the footage cannot be read,
            or OpenCV is missing. Nothing has changed.
    """
    frame = scene.frame_current
    if (time := Sampling.of(scene, effect, strip, (frame,)).time) is not None:
        backward = bool(time.at(frame)[1])
    else:
        backward = source_media.timing_of(strips.source_of(scene, effect, strip)).use_reverse_frames
    known = of(effect)
    if known is None and (sentence := validation.why_full(effect, regions=1, shutters=2)):
        raise EffectError(sentence)
    opencv.check("moments between frames need")
    effect.window = max(validation.number(effect, "window"), FRAMES)
    effect.position, effect.interpolation = "CENTER", "DISPLACEMENT"
    if effect.inbetween == "1":
        effect.inbetween = SMOOTH
    shown = _shown(effect)
    if known is None:
        names = (data_("Earlier"), "ANGLE_360"), (data_("Later"), "ANGLE_360")
        region = shutter_edits.ramp_between(effect, *names, name=data_("Rolling Shutter"), ramp="LINEAR")
    else:
        region = effect.regions[known.region]
    region.rotation, region.scale = math.radians(_TURNS[side]), 2 / share
    region.location, region.opacity, region.invert, region.blend = (0, 0), 1.0, False, "OVER"
    earlier, later = effect.shutters[0], effect.shutters[region.shutter]
    for shutter, to in ((earlier, -1), (later, 1)):
        shutter.follow, shutter.length, shutter.combine = "NOTHING", "FRAMES", "AVERAGE"
        place = shown - to if backward else shown + to
        bar_edits.paint(effect, effect.shutters.find(shutter.name), np.eye(effect.window)[place])
    effect.active_shutter = effect.shutters.find(later.name)
    effect.active_region = list(effect.regions).index(region)


def _why_no_repair(effect: PropertyGroup) -> str | None:
    try:
        has_repair = of(effect) is not None
    except EffectError as error:
        return str(error)
    return None if has_repair else validation.why_full(effect, regions=1, shutters=2)


_SIDE = EnumProperty(
    name="Read First",
    description="The side of the picture that the sensor reads first",
    items=SIDES,
    translation_context=CONTEXT,
)
_READOUT = FloatProperty(
    name="Readout",
    description="Time from reading the first row to the last, as a percentage of a frame",
    subtype="PERCENTAGE",
    default=50.0,
    min=1.0,
    max=100.0,
    options={"SKIP_SAVE"},
)
_READS = EnumProperty(
    name="Reads",
    description="Whether the sensor reads row by row or column by column",
    items=READS,
    translation_context=CONTEXT,
)


@operator("Rolling Shutter Repair", _why_no_repair, icon="CAMERA_DATA", side=_SIDE, readout=_READOUT)
def rolling_shutter(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Show every row as it was when the middle one was filmed, so that skewed lines become straight"""
    known = of(effect)
    if known is not None and not self.properties.is_property_set("readout"):
        self.readout = 100 * known.readout  # choosing a side in the menu keeps the readout
    repair(self.edit, effect, self.effect_strip, self.readout / 100, self.side)


@operator("Find Readout", _why_no_repair, icon="VIEWZOOM", reads=_READS)
def find_readout(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Find the sensor's readout time from lines that lean while they move around the current frame, and repair it"""
    scene, strip, columns = self.edit, self.effect_strip, self.reads == "COLUMNS"
    frame = scene.frame_current
    index = snapshot.source_frames(scene, effect, strip, (frame,))[frame]
    with ShotSource(source_media.spec(strips.source_of(scene, effect, strip)).open()) as medium:
        half = readout.FRAMES // 2
        low, high = max(index - half, 0), min(index + half, medium.count)
        shot = medium.around(index, low, high - 1)
        frames = range(max(low, shot.start), min(high, shot.stop))
        try:
            found = readout.of_source(medium, frames, columns=columns)
        except readout.ReadoutError as error:
            sentence = rpt_("the readout cannot be found here: {why}")
            raise EffectError(sentence.format(why=rpt_(str(error)))) from None
    if abs(found) < LEAST:
        raise EffectError(rpt_("moving lines stay upright: there is no rolling shutter to repair"))
    side = (("LEFT", "RIGHT") if columns else ("TOP", "BOTTOM"))[found < 0]
    repair(scene, effect, strip, min(abs(found), 1.0), side)
    name = next(name for word, name, _ in SIDES if word == side)
    percent = round(100 * abs(found))
    sentence = rpt_("Readout of {percent} % of a frame, read first: {side}")
    self.report({"INFO"}, sentence.format(percent=percent, side=iface_(name, CONTEXT)))
