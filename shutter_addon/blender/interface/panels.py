"""Panels, lists and menus: in the Properties editor's Strip tab, and as a tab in the sequencer's sidebar."""

import math

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Menu, Panel, UIList

from ...devices.device import NoDeviceError
from ...media import cuts
from ...media.tracking import SURE
from ..data import annotations, matte_look, selection, strips, validation
from ..data.properties import CONTEXT
from ..devices import available
from ..editing import bar_edits, follow_track, match_source, track_region
from ..rendering import inbetween_build, session, strobing
from ..rendering.session import FAULTS
from . import drawing, inbetween_operators, track_operators

# Units of the interface beside a sentence in a panel: margins and the tabs of a sidebar; its icon.
_MARGIN, _ICON = 64, 20
_MOST_ROWS = 5  # of a list; the rest is scrolled to
# Beyond this a column of numbers helps nobody: the bar editor and the Graph Editor do.
_MOST_NUMBERS = 64


def _sentence(layout, words: str, icon: str = "NONE", room: float = 1.0, is_quiet: bool = False) -> None:
    """A sentence, already translated, in as many lines as the panel's width takes; room: its share of that width."""
    unit, region = drawing.ui_scale(), bpy.context.region
    width = room * (region.width if region else 300 * unit) - (_MARGIN + (_ICON if icon != "NONE" else 0)) * unit
    column = layout.column(align=True)
    column.active = not is_quiet
    for i, line in enumerate(drawing.wrapped(words, width)):
        row = column.row()
        row.scale_y = 0.8 if i else 1.0
        row.label(text=line, icon=icon if i == 0 or icon == "NONE" else "BLANK1", translate=False)


def _rows(items) -> int:
    """Of a list of so many."""
    return min(max(len(items), 1), _MOST_ROWS)


class SHUTTER_UL_shutters(UIList):
    def draw_item(self, _context, layout, effect, shutter, _icon, _active, _property, index):
        row = layout.row(align=True)
        color = row.row(align=True)
        color.ui_units_x = 1.0
        color.prop(shutter, "color", text="")
        row.prop(shutter, "name", text="", emboss=False)
        if index == 0:
            hint = row.row()
            hint.active = False
            hint.label(text="default")


_ICONS = {"LINE": "IPO_LINEAR", "LASSO": "MESH_CIRCLE", "MATTE": "MOD_MASK", "RAMP": "IPO_EASE_IN_OUT"}


class SHUTTER_UL_regions(UIList):
    def draw_item(self, _context, layout, effect, region, _icon, _active, _property, _index):
        row = layout.row(align=True)
        row.label(text="", icon=_ICONS.get(region.kind, "ERROR"))
        row.prop(region, "name", text="", emboss=False)
        if region.kind in strips.MATTES:
            return
        layer = annotations.layer_of(effect, region)
        if layer is None or not any(drawing.strokes for drawing in layer.frames):
            row.label(text="", icon="ERROR")
        if layer is not None:
            row.prop(layer, "annotation_hide", text="", emboss=False)

    def filter_items(self, _context, effect, _property):
        """Those of the active shutter."""
        shutter = selection.active_shutter(effect)
        own = [bool(shutter) and region.shutter == shutter.name for region in effect.regions]
        return [self.bitflag_filter_item if is_own else 0 for is_own in own], []


class SHUTTER_MT_presets(Menu):
    bl_label = "Presets"

    def draw(self, _context):
        self.layout.operator_enum("shutter.preset", "preset")


class SHUTTER_MT_regions(Menu):
    bl_label = "Region Specials"

    def draw(self, _context):
        layout = self.layout
        layout.operator("shutter.matte_add", icon="FILE_MOVIE")
        layout.operator_menu_enum("shutter.matte_strip", "strip", icon="SEQUENCE")
        if bpy.data.masks:
            layout.operator_menu_enum("shutter.matte_mask", "mask", icon="MOD_MASK")
        else:
            layout.operator("shutter.matte_mask", icon="MOD_MASK")  # greyed out; its tooltip says why
        layout.operator_menu_enum("shutter.ramp_add", "ramp", icon="IPO_EASE_IN_OUT")
        layout.separator()
        layout.operator_menu_enum("shutter.time_map", "ramp", icon="TIME")
        layout.separator()
        layout.operator_menu_enum("shutter.region_take", "layer", icon="GREASEPENCIL")


class SHUTTER_MT_shutters(Menu):
    bl_label = "Shutter Specials"

    def draw(self, _context):
        layout = self.layout
        layout.operator("shutter.shutter_duplicate", icon="DUPLICATE")
        layout.operator("shutter.shutter_move", text="Move Up", icon="TRIA_UP").direction = "UP"
        layout.operator("shutter.shutter_move", text="Move Down", icon="TRIA_DOWN").direction = "DOWN"
        layout.separator()
        layout.operator("shutter.recipe_import", icon="IMPORT")
        layout.operator("shutter.recipe_export", icon="EXPORT")


def _draw_list(layout, effect, kind: str, items, menu: str | None = None) -> None:
    """The list of shutters or regions, as high as it has to be, and the buttons beside it."""
    row = layout.row()
    row.template_list(f"SHUTTER_UL_{kind}s", "", effect, f"{kind}s", effect, f"active_{kind}", rows=_rows(items))
    column = row.column(align=True)
    if kind == "shutter":
        column.operator("shutter.shutter_add", text="", icon="ADD")
    else:
        column.operator("shutter.draw", text="", icon="ADD").new = True
    column.operator(f"shutter.{kind}_remove", text="", icon="REMOVE")
    if menu:
        column.menu(menu, text="", icon="DOWNARROW_HLT")
    elif len(items) > 1:
        column.operator(f"shutter.{kind}_move", text="", icon="TRIA_UP").direction = "UP"
        column.operator(f"shutter.{kind}_move", text="", icon="TRIA_DOWN").direction = "DOWN"


class _Shutters:
    """What an editor needs first, from the top down: it shows without scrolling in Blender's own layout."""

    bl_label = "Shutter"

    def draw(self, context):
        layout = self.layout
        found = selection.active(context)
        if found is None:
            layout.operator("shutter.draw", icon="GREASEPENCIL")
            layout.operator("shutter.add_effect", icon="ADD")
            return
        effect = found[1]
        if selection.in_picture(context) is None:
            _sentence(layout, selection.why_unseen(found[0], found[2]), "INFO")
        _draw_live(layout, context)
        _draw_list(layout, effect, "shutter", effect.shutters, "SHUTTER_MT_shutters")
        _draw_tools(layout, effect)
        _draw_source(layout, effect)
        _draw_strobing(layout, effect)
        if (shutter := selection.active_shutter(effect)) is None:
            return
        row = layout.row(align=True)
        row.menu("SHUTTER_MT_presets", icon="PRESET")
        row.operator("shutter.bars_key", text="", icon="KEY_HLT")
        row.operator("shutter.bars_unkey", text="", icon="KEY_DEHLT")
        layout.use_property_split = True
        layout.prop(effect, "window")
        if selection.active_region(effect) is not None:
            _draw_tracked(layout, effect, effect.active_region)
        if shutter.follow == "CAMERA":
            _draw_tracked(layout, effect, None)
        _draw_bars(layout, found)


def _draw_tools(layout, effect) -> None:
    """What is done with the picture, and whose the active region is."""
    row = layout.row(align=True)
    row.operator("shutter.draw", icon="GREASEPENCIL")
    row.operator("shutter.erase")
    row.menu("SHUTTER_MT_regions", text="", icon="DOWNARROW_HLT")
    _draw_tracking(layout, effect.active_region)
    row = layout.row(align=True)
    row.operator("shutter.panning_shot", icon="CON_FOLLOWTRACK")
    row.operator("shutter.tripod", icon="CON_CAMERASOLVER")
    if (region := selection.active_region(effect)) is not None:
        row = layout.split(factor=0.4)
        label = row.row()
        label.alignment = "RIGHT"
        label.label(text="Shutter")
        row.operator_menu_enum("shutter.region_assign", "shutter", text=region.shutter, translate=False)


def _draw_bars(layout, found) -> None:
    """What the active shutter's bars come to."""
    effect = found[1]
    try:
        bars = bar_edits.shown(effect, effect.active_shutter).bars
    except validation.EffectError as error:
        _sentence(layout, str(error), "ERROR")
        return
    is_open = bars.any()
    _sentence(layout, bar_edits.summary(bars), "NONE" if is_open else "ERROR", is_quiet=is_open)
    if words := bar_edits.open_for(*found, effect.active_shutter):
        _sentence(layout, words, is_quiet=True)


def _draw_followed_motion(layout, shutter) -> None:
    """What of a motion is followed, and how smoothly."""
    for name in ("follow_motion", "follow_smooth"):
        layout.prop(shutter, name)


def _draw_live(layout, context):
    live = getattr(context.window_manager, "virtual_shutter", None)
    if live is None:
        return
    row = layout.row(align=True)
    row.prop(live, "live", toggle=True, icon="HIDE_OFF" if live.live else "HIDE_ON")
    view = row.row(align=True)
    view.active = live.live
    view.prop(live, "view", text="")
    view.prop(live, "probe", text="", icon="EYEDROPPER")


def _draw_source(layout, effect):
    """What the effect does not have from its source, and the way to it."""
    if (shown := match_source.shown(effect)) is None:
        return
    if shown.differences:
        what = ", ".join(iface_(word) for word in shown.differences)
        column = layout.column(align=True)
        _sentence(column, iface_("Differs from its source: {what}").format(what=what), "INFO")
        column.operator("shutter.match_source")
    if shown.lacks_modifiers:
        column = layout.column(align=True)
        _sentence(column, iface_("Modifiers of the source do not reach the effect"), "INFO")
        column.operator("shutter.copy_modifiers")
    if shown.has_effects:
        words = iface_("Effect strips on the source do not reach the effect: make the Shutter strip their input")
        _sentence(layout, words, "INFO")


def _draw_strobing(layout, effect) -> None:
    """That the exposure that the preview shows has too few frames, and the button that helps."""
    if (found := strobing.last(effect)) is None or inbetween_build.running() is not None:
        return
    column = layout.column(align=True)
    _sentence(column, inbetween_operators.strobing_in_words(found), "INFO")
    if (words := inbetween_operators.smoothing_in_words(found)) is not None:
        column.operator("shutter.smooth_streaks", text=words, translate=False).factor = str(found.factor)


class _WithEffect:
    @classmethod
    def poll(cls, context):
        return super().poll(context) and selection.active(context) is not None


class _Move(_WithEffect):
    """What the exposure moves with, and what says how long it is."""

    bl_label = "Move With"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, effect = self.layout, selection.active(context)[1]
        if (shutter := selection.active_shutter(effect)) is None:
            return
        layout.use_property_split = True
        layout.prop(shutter, "follow")
        if shutter.follow == "REGION":
            layout.prop_search(shutter, "follow_region", effect, "regions", text="Region")
        if shutter.follow != "NOTHING":
            layout.prop(shutter, "length")
            if shutter.length == "MOTION":
                layout.prop(shutter, "trail")
            _draw_followed_motion(layout, shutter)
        if shutter.follow == "CAMERA":
            _draw_tracking(layout, None)


class _Regions(_WithEffect):
    bl_label = "Regions"

    def draw(self, context):
        layout = self.layout
        edit, effect, strip = selection.active(context)
        shutter = selection.active_shutter(effect)
        own = [region for region in effect.regions if shutter and region.shutter == shutter.name]
        _draw_list(layout, effect, "region", own)
        layout.use_property_split = True
        layout.prop(effect, "edge_aware")
        region = selection.active_region(effect)
        if region is None:
            return
        try:
            validation.check_region(region)
        except validation.EffectError as error:
            _sentence(layout, str(error), "ERROR")
        layout.prop(region, "kind")
        if region.kind == "LINE":
            layout.prop(region, "width")
        elif region.kind == "RAMP":
            layout.prop(region, "ramp")
        elif region.kind == "MATTE":
            _draw_matte(layout, matte_look.look(edit, effect, strip, region), region)
        if region.kind not in strips.MATTES:
            layout.prop(region, "opacity")
        else:
            _draw_blend(layout, region)


def _draw_matte(layout, look, region) -> None:
    """What the matte is, and what is wrong with it."""
    layout.prop(region, "matte")
    if region.matte == "IMAGE":
        layout.template_ID(region, "image", open="image.open")
        if region.image is not None:
            layout.prop(region.image, "source")
        layout.prop(region, "timing")
        layout.prop(region, "offset")
    elif region.matte == "STRIP":
        layout.prop_search(region, "strip_name", region.id_data.sequence_editor, "strips_all", text="Strip")
    else:
        layout.prop(region, "mask")
    if region.matte != "MASK":
        layout.prop(region, "channel")
        if region.channel == "NAMED":
            layout.prop(region, "channel_name", text="Name")
    for text, icon in ((look.fault, "ERROR"), (look.text, "NONE"), (look.note, "INFO")):
        if text:
            _sentence(layout, text, icon)


def _draw_blend(layout, region) -> None:
    """How a matte or a ramp lies over what is beneath."""
    for name in ("invert", "blend", "opacity", "feather"):
        layout.prop(region, name)


def _draw_tracking(layout, index: int | None) -> None:
    """The buttons that track a region or the camera (selection.moving)."""
    row = layout.row(align=True)
    track = "shutter.track_camera" if index is None else "shutter.track"
    for direction, _name, _description, icon, _number in track_operators.DIRECTIONS:
        button = row.operator(
            track, text=("Track Camera" if index is None else "Track") if direction == "BOTH" else "", icon=icon
        )
        button.direction = direction


def _draw_tracked(layout, effect, index: int | None) -> None:
    """How sure tracking of a region or the camera was of the current frame, and where it stopped."""
    look = "shutter.track_camera_look" if index is None else "shutter.track_look"
    confidence = track_region.confidence_at(effect, index, effect.id_data.frame_current)
    if confidence is not None:
        column = layout.column(align=True)
        text = iface_("Confidence: {percent} %").format(percent=f"{100 * confidence:.0f}")
        column.label(text=text, icon="CHECKMARK" if confidence >= SURE else "ERROR", translate=False)
        column.operator(look)
    if index is None:  # a region's gaps go from its stops on
        _draw_camera_gaps(layout, effect)
    for frame, reason, is_fault in track_region.stops(effect, index):
        row = layout.row(align=True)
        _sentence(row, reason, "ERROR" if is_fault else "INFO", room=0.85)
        place = row.row()
        place.ui_units_x = 2.5
        place.operator(look, text=str(frame), translate=False).frame = frame


def _draw_camera_gaps(layout, effect) -> None:
    """The frames at which the camera is not tracked."""
    for gap in track_region.gaps(effect, None):
        if math.isinf(gap.last):
            text = iface_("Not tracked: from frame {first} on")
        elif math.isinf(gap.first):
            text = iface_("Not tracked: up to frame {last}")
        else:
            text = iface_("Not tracked: frames {first} to {last}")
        _sentence(layout, text.format(first=gap.first, last=gap.last), "INFO")


def _active_region(context):
    return selection.active_region(selection.active(context)[1])


class _WithRegion(_WithEffect):
    @classmethod
    def poll(cls, context):
        return super().poll(context) and _active_region(context) is not None


class _Transform(_WithRegion):
    bl_label = "Transform"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        region = _active_region(context)
        column = layout.column(align=True)
        for name in ("location", "rotation", "scale"):
            column.prop(region, name)
        layout.operator("shutter.region_key", text="Insert Keyframes", icon="KEY_HLT")


class _Track(_WithRegion):
    bl_label = "Track"
    bl_translation_context = CONTEXT
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and _active_region(context).kind not in strips.MATTES

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        _draw_track_options(layout, _active_region(context))


def _draw_track_options(layout, moving) -> None:
    for name in ("motion", "track_until", "track_all_keys", "track_ends"):
        layout.prop(moving, name)


class _Follow(_WithRegion):
    bl_label = "Follow Track"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        region = _active_region(context)
        layout.prop(region, "follow_clip")
        layout.prop(region, "follow_kind")
        if region.follow_clip is not None:
            _draw_tracks(layout, region, region.follow_clip.tracking)
        if follow_track.is_changed(region):
            _sentence(layout, iface_("The track has changed"), "ERROR")
        row = layout.row(align=True)
        row.operator("shutter.follow", icon="TRACKER")
        row.operator("shutter.follow_update", icon="FILE_REFRESH")


def _draw_tracks(layout, region, tracking) -> None:
    layout.prop_search(region, "follow_object", tracking, "objects")
    objects = tracking.objects
    holder = objects.get(region.follow_object) if region.follow_object else objects[0]
    if region.follow_kind != "OBJECT" and holder is not None:
        kind = "plane_tracks" if region.follow_kind == "PLANE" else "tracks"
        layout.prop_search(region, "follow_track", holder, kind)


class _Camera(_WithEffect):
    """Its numbers, and how they are found; the shutter that follows it has the buttons that track it."""

    bl_label = "Camera"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and any(
            shutter.follow == "CAMERA" for shutter in selection.active(context)[1].shutters
        )

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        camera = selection.active(context)[1].camera
        column = layout.column(align=True)
        for name in ("location", "rotation", "scale"):
            column.prop(camera, name)
        layout.prop(camera, "influence")
        _draw_track_options(layout, camera)
        layout.prop(camera, "follow_clip")
        layout.operator("shutter.follow_stabilization", icon="TRACKER")


class _Bars(_WithEffect):
    bl_label = "Bars"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        effect = selection.active(context)[1]
        shutter = selection.active_shutter(effect)
        if shutter is None:
            return
        layout = self.layout
        layout.use_property_split = True
        column = layout.column(align=True)
        label = iface_("Frame {number}")
        for k, bar in enumerate(shutter.bars[:_MOST_NUMBERS]):
            column.prop(bar, "weight", text=label.format(number=k + 1), translate=False, slider=True)
        if len(shutter.bars) > _MOST_NUMBERS:
            more = iface_("and {count} more, in the bar editor").format(count=len(shutter.bars) - _MOST_NUMBERS)
            _sentence(column, more)


class _Options(_WithEffect):
    bl_label = "Options"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        effect = selection.active(context)[1]
        layout.use_property_split = True
        for name in ("position", "interpolation", "light", "exposure", "edges", "stop_at_cuts", "aggregate", "border"):
            layout.prop(effect, name)
        package = effect.stop_at_cuts and cuts.missing_package()
        if package:
            text = iface_("Cuts are not found: the Python package {package} is missing").format(package=package)
            _sentence(layout, text, "ERROR")
        layout.prop(effect, "use_source_time")
        column = layout.column()
        column.active = effect.use_source_time
        column.prop(effect, "source_time")
        if effect.use_source_time and effect.inbetween == "1":
            _sentence(column, iface_("No in-between frames: the nearest source frame is shown"), "INFO")
        _draw_devices(layout)


def _draw_devices(layout):
    """What composes; in a window, which alone has a preview."""
    if bpy.app.background:
        return
    if not available.is_known(session.wanted()):  # it is asked for beside drawing
        if not bpy.app.timers.is_registered(_ask_for_opengl):
            bpy.app.timers.register(_ask_for_opengl)
        return
    column = layout.column(align=True)
    column.active = False
    try:
        preview, render = session.device_names()
    except NoDeviceError as error:
        _sentence(column, str(error), "ERROR")
        return
    for text, device in ((iface_("Preview: {device}"), preview), (iface_("Renders: {device}"), render)):
        _sentence(column, text.format(device=device))


def _ask_for_opengl() -> None:
    available.opengl()
    _redraw()


class _Inbetween(_WithEffect):
    bl_label = "In-Between Frames"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        edit, effect, strip = selection.active(context)
        build = inbetween_build.running()
        is_built = build is not None and build.scene == effect.scene.session_uid
        column = layout.column()
        column.use_property_split = True
        column.enabled = not is_built
        column.prop(effect, "inbetween", text="Factor")
        column = column.column()
        is_on = effect.inbetween != "1"
        column.active = is_on
        column.prop(effect, "inbetween_method")
        column.prop(effect, "inbetween_place")
        if is_built:
            progress = iface_("{done} of {total}").format(done=build.done, total=build.total)
            layout.progress(factor=build.done / max(build.total, 1), text=progress, translate=False)
        elif is_on:
            try:
                _draw_look(layout, inbetween_build.look(edit, effect, strip))
            except FAULTS as error:
                _sentence(layout, str(error), "ERROR")
        row = layout.row(align=True)
        row.operator("shutter.inbetween_build", text="Build")
        row.operator("shutter.inbetween_purge", text="Remove")


# How a state of in-between frames is called, and its icon.
_STATES = {
    "missing": (n_("Missing"), "ERROR"),
    "partial": (n_("Partial: {done} of {total}"), "ERROR"),
    "stale": (n_("Stale: the source has changed"), "ERROR"),
    "ready": (n_("Ready"), "CHECKMARK"),
}


def _draw_look(layout, look) -> None:
    words, icon = _STATES[look.state.name]
    words = iface_(words).format(done=look.state.done, total=look.state.total)
    column = layout.column(align=True)
    _sentence(column, words, icon)
    if look.size:
        size = inbetween_operators.size_in_words(look.size)
        column.label(text=iface_("{size} on disk").format(size=size), icon="DISK_DRIVE", translate=False)
    if look.state.name != "ready":
        if look.estimate:
            size = inbetween_operators.size_in_words(look.estimate)
            column.label(text=iface_("About {size} when built").format(size=size), icon="BLANK1", translate=False)
        elif look.estimate is None:
            _redraw_later()


def _redraw_later() -> None:
    if not bpy.app.timers.is_registered(_redraw):
        bpy.app.timers.register(_redraw, first_interval=inbetween_operators.TICK)


def _redraw() -> None:
    inbetween_operators.redraw_panels(bpy.context)


class _InProperties:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "strip"

    @classmethod
    def poll(cls, context):
        strip = selection.active_strip(context)
        return strip is not None and (strip.type in strips.SOURCES or selection.active(context) is not None)


class _InSidebar:
    bl_space_type = "SEQUENCE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Shutter"

    @classmethod
    def poll(cls, context):
        return selection.active_strip(context) is not None or selection.active(context) is not None


class STRIP_PT_shutter(_Shutters, _InProperties, Panel):
    pass


class STRIP_PT_shutter_move(_Move, _InProperties, Panel):
    bl_parent_id = "STRIP_PT_shutter"


class STRIP_PT_shutter_regions(_Regions, _InProperties, Panel):
    bl_parent_id = "STRIP_PT_shutter"


class STRIP_PT_shutter_transform(_Transform, _InProperties, Panel):
    bl_parent_id = "STRIP_PT_shutter_regions"


class STRIP_PT_shutter_track(_Track, _InProperties, Panel):
    bl_parent_id = "STRIP_PT_shutter_regions"


class STRIP_PT_shutter_follow(_Follow, _InProperties, Panel):
    bl_parent_id = "STRIP_PT_shutter_regions"


class STRIP_PT_shutter_camera(_Camera, _InProperties, Panel):
    bl_parent_id = "STRIP_PT_shutter"


class STRIP_PT_shutter_bars(_Bars, _InProperties, Panel):
    bl_parent_id = "STRIP_PT_shutter"


class STRIP_PT_shutter_options(_Options, _InProperties, Panel):
    bl_parent_id = "STRIP_PT_shutter"


class STRIP_PT_shutter_inbetween(_Inbetween, _InProperties, Panel):
    bl_parent_id = "STRIP_PT_shutter"


class SEQUENCER_PT_shutter(_Shutters, _InSidebar, Panel):
    pass


class SEQUENCER_PT_shutter_move(_Move, _InSidebar, Panel):
    bl_parent_id = "SEQUENCER_PT_shutter"


class SEQUENCER_PT_shutter_regions(_Regions, _InSidebar, Panel):
    bl_parent_id = "SEQUENCER_PT_shutter"


class SEQUENCER_PT_shutter_transform(_Transform, _InSidebar, Panel):
    bl_parent_id = "SEQUENCER_PT_shutter_regions"


class SEQUENCER_PT_shutter_track(_Track, _InSidebar, Panel):
    bl_parent_id = "SEQUENCER_PT_shutter_regions"


class SEQUENCER_PT_shutter_follow(_Follow, _InSidebar, Panel):
    bl_parent_id = "SEQUENCER_PT_shutter_regions"


class SEQUENCER_PT_shutter_camera(_Camera, _InSidebar, Panel):
    bl_parent_id = "SEQUENCER_PT_shutter"


class SEQUENCER_PT_shutter_bars(_Bars, _InSidebar, Panel):
    bl_parent_id = "SEQUENCER_PT_shutter"


class SEQUENCER_PT_shutter_options(_Options, _InSidebar, Panel):
    bl_parent_id = "SEQUENCER_PT_shutter"


class SEQUENCER_PT_shutter_inbetween(_Inbetween, _InSidebar, Panel):
    bl_parent_id = "SEQUENCER_PT_shutter"


def _add_entry(self, _context):
    self.layout.separator()
    self.layout.operator("shutter.add_effect", text="Shutter")


def _strip_entry(self, context):
    strip = selection.active_strip(context)
    if strip is not None and strip.type in strips.SOURCES:
        self.layout.separator()
        self.layout.operator("shutter.draw", text="Draw Shutter", icon="GREASEPENCIL")
        self.layout.operator("shutter.add_effect")


MENUS = {
    "SEQUENCER_MT_add_effect": _add_entry,
    "SEQUENCER_MT_strip": _strip_entry,
    "SEQUENCER_MT_context_menu": _strip_entry,
}

classes = (
    SHUTTER_UL_shutters,
    SHUTTER_UL_regions,
    SHUTTER_MT_presets,
    SHUTTER_MT_regions,
    SHUTTER_MT_shutters,
    STRIP_PT_shutter,
    STRIP_PT_shutter_move,
    STRIP_PT_shutter_regions,
    STRIP_PT_shutter_transform,
    STRIP_PT_shutter_track,
    STRIP_PT_shutter_follow,
    STRIP_PT_shutter_camera,
    STRIP_PT_shutter_bars,
    STRIP_PT_shutter_options,
    STRIP_PT_shutter_inbetween,
    SEQUENCER_PT_shutter,
    SEQUENCER_PT_shutter_move,
    SEQUENCER_PT_shutter_regions,
    SEQUENCER_PT_shutter_transform,
    SEQUENCER_PT_shutter_track,
    SEQUENCER_PT_shutter_follow,
    SEQUENCER_PT_shutter_camera,
    SEQUENCER_PT_shutter_bars,
    SEQUENCER_PT_shutter_options,
    SEQUENCER_PT_shutter_inbetween,
)


def register():
    for cls in classes:
        bpy.utils.register_class(cls)
    for menu, entry in MENUS.items():
        getattr(bpy.types, menu).append(entry)


def unregister():
    for menu, entry in MENUS.items():
        getattr(bpy.types, menu).remove(entry)
    for timer in (_redraw, _ask_for_opengl):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
