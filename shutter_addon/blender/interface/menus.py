"""The menu Strip ▸ Shutter: every operator, so that Blender's search finds it, and keys reach it."""

import bpy
from bpy.types import Menu


class SHUTTER_MT_strip(Menu):
    bl_label = "Shutter"

    def draw(self, _context):
        layout = self.layout
        layout.operator("shutter.add_effect", icon="ADD")
        layout.operator("shutter.draw", icon="GREASEPENCIL")
        layout.operator("shutter.erase")
        layout.separator()
        layout.operator("shutter.effect_copy", icon="COPYDOWN")
        layout.operator("shutter.effect_paste", icon="PASTEDOWN")
        for menu in (
            SHUTTER_MT_of_shutter,
            SHUTTER_MT_of_bars,
            SHUTTER_MT_of_region,
            SHUTTER_MT_of_outline,
            SHUTTER_MT_of_track,
            SHUTTER_MT_of_camera,
            SHUTTER_MT_of_footage,
            SHUTTER_MT_of_bake,
            SHUTTER_MT_of_preview,
        ):
            layout.menu(menu.__name__)
        layout.separator()
        layout.operator("shutter.copy_report", icon="COPYDOWN")


class SHUTTER_MT_of_shutter(Menu):
    bl_label = "Shutters"

    def draw(self, _context):
        layout = self.layout
        layout.operator("shutter.shutter_add", icon="ADD")
        layout.operator("shutter.shutter_remove", icon="REMOVE")
        layout.menu_contents("SHUTTER_MT_shutters")


class SHUTTER_MT_of_bars(Menu):
    bl_label = "Bars"

    def draw(self, _context):
        layout = self.layout
        layout.operator("shutter.bar_set")
        layout.operator_menu_enum("shutter.preset", "preset", icon="PRESET")
        layout.separator()
        layout.operator("shutter.bars_key", icon="KEY_HLT")
        layout.operator("shutter.bars_unkey", icon="KEY_DEHLT")


class SHUTTER_MT_of_region(Menu):
    bl_label = "Regions"

    def draw(self, _context):
        layout = self.layout
        layout.menu_contents("SHUTTER_MT_regions")
        layout.separator()
        layout.operator("shutter.region_transform")
        layout.operator("shutter.region_key", icon="KEY_HLT")
        layout.operator_menu_enum("shutter.region_assign", "shutter")
        layout.operator("shutter.region_move", text="Move Up", icon="TRIA_UP").direction = "UP"
        layout.operator("shutter.region_move", text="Move Down", icon="TRIA_DOWN").direction = "DOWN"
        layout.operator("shutter.region_remove", icon="REMOVE")
        layout.operator("shutter.matte_export", icon="EXPORT")
        layout.separator()
        layout.operator("shutter.sharp_subject", icon="RENDERLAYERS")
        layout.operator("shutter.clean_trail", icon="CURVE_PATH")


class SHUTTER_MT_of_outline(Menu):
    bl_label = "Outline"

    def draw(self, _context):
        layout = self.layout
        layout.operator("shutter.outline_it")
        layout.operator("shutter.outline_points")
        layout.operator("shutter.outline_draw")
        layout.separator()
        layout.operator("shutter.outline_carry")
        layout.operator("shutter.outline_needed")
        layout.operator("shutter.outline_mask")


class SHUTTER_MT_of_track(Menu):
    bl_label = "Track"

    def draw(self, _context):
        layout = self.layout
        layout.operator_menu_enum("shutter.track", "direction")
        layout.operator("shutter.track_look")
        layout.operator("shutter.panning_shot", icon="CON_FOLLOWTRACK")
        layout.separator()
        layout.operator("shutter.follow", icon="TRACKER")
        layout.operator("shutter.follow_update", icon="FILE_REFRESH")


class SHUTTER_MT_of_camera(Menu):
    bl_label = "Camera"

    def draw(self, _context):
        layout = self.layout
        layout.operator_menu_enum("shutter.track_camera", "direction")
        layout.operator("shutter.track_camera_look")
        layout.operator("shutter.tripod", icon="CON_CAMERASOLVER")
        layout.separator()
        layout.operator("shutter.follow_stabilization", icon="TRACKER")


class SHUTTER_MT_of_footage(Menu):
    bl_label = "Footage"

    def draw(self, _context):
        layout = self.layout
        layout.operator_menu_enum("shutter.source", "strip")
        layout.operator("shutter.match_source")
        layout.operator("shutter.copy_modifiers")
        layout.separator()
        layout.operator_menu_enum("shutter.smooth_streaks", "factor")
        layout.operator("shutter.inbetween_build")
        layout.operator("shutter.inbetween_purge")


class SHUTTER_MT_of_bake(Menu):
    bl_label = "Bake"

    def draw(self, _context):
        layout = self.layout
        layout.operator("shutter.bake")
        layout.operator("shutter.bake_stop")
        layout.operator("shutter.unbake")


class SHUTTER_MT_of_preview(Menu):
    bl_label = "Preview"

    def draw(self, context):
        layout, live = self.layout, context.window_manager.virtual_shutter
        layout.operator("shutter.full_quality")
        layout.separator()
        layout.prop(live, "live")
        layout.prop_menu_enum(live, "view")
        layout.prop(live, "split")
        layout.separator()
        layout.prop(live, "probe")
        layout.operator("shutter.probe_pixel")


def _entry(self, _context):
    self.layout.separator()
    self.layout.menu(SHUTTER_MT_strip.__name__)


classes = (
    SHUTTER_MT_strip,
    SHUTTER_MT_of_shutter,
    SHUTTER_MT_of_bars,
    SHUTTER_MT_of_region,
    SHUTTER_MT_of_outline,
    SHUTTER_MT_of_track,
    SHUTTER_MT_of_camera,
    SHUTTER_MT_of_footage,
    SHUTTER_MT_of_bake,
    SHUTTER_MT_of_preview,
)


def register():
    bpy.types.SEQUENCER_MT_strip.append(_entry)


def unregister():
    bpy.types.SEQUENCER_MT_strip.remove(_entry)
