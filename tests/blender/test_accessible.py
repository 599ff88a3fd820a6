"""Every operator says what it does, is found by Blender's search; menus have by numbers what a mouse drags."""

from types import SimpleNamespace

import pytest

from shutter_addon.blender.editing import region_edits
from shutter_addon.blender.interface import menus


class Recorder:
    """Stands for Blender's layout, which only a window has: it notes what is put into it."""

    def __init__(self):
        self.operators, self.menus, self.properties = [], [], []

    def operator(self, name, **_look):
        self.operators.append(name)
        return SimpleNamespace()

    def operator_menu_enum(self, name, _property, **_look):
        return self.operator(name)

    operator_enum = operator_menu_enum

    def menu(self, name, **_look):
        self.menus.append(name)

    menu_contents = menu

    def separator(self):
        pass

    def prop(self, data, name, **_look):
        assert name in data.bl_rna.properties
        self.properties.append(name)

    prop_menu_enum = prop


@pytest.fixture(scope="module")
def operators(bpy):
    """By name: what Blender has of each of the extension's operators."""
    return {f"shutter.{name}": getattr(bpy.ops.shutter, name).get_rna_type() for name in dir(bpy.ops.shutter)}


def in_menu(bpy, name: str) -> list[str]:
    """The operators of a menu and of all that open from it."""
    recorder = Recorder()
    getattr(bpy.types, name).draw(SimpleNamespace(layout=recorder), bpy.context)
    return recorder.operators + [operator for menu in recorder.menus for operator in in_menu(bpy, menu)]


def test_every_operator_has_a_name_of_its_own_and_a_description(operators):
    assert len({rna.name for rna in operators.values()}) == len(operators)
    for name, rna in operators.items():
        assert rna.name, name
        assert rna.description != rna.name, name
        assert len(rna.description.split()) >= 4, name


def test_every_operator_is_in_the_menu_of_strips_which_blenders_search_reads(bpy, effect, operators):
    assert set(in_menu(bpy, "SHUTTER_MT_strip")) == set(operators)
    recorder = Recorder()
    entry = bpy.types.SEQUENCER_MT_strip.draw._draw_funcs[-1]  # Blender tells of what was appended nowhere else
    entry(SimpleNamespace(layout=recorder), bpy.context)
    assert recorder.menus == [menus.strip_menu.__name__]


def test_a_region_the_split_and_the_probe_are_moved_by_numbers_in_the_menus(bpy, effect):
    region_edits.add_region(effect, effect.shutters[1], "RAMP")
    recorder = Recorder()
    for menu in (bpy.types.SHUTTER_MT_of_region, bpy.types.SHUTTER_MT_of_preview):
        menu.draw(SimpleNamespace(layout=recorder), bpy.context)
    assert {"location", "rotation", "scale", "split", "probe", "probe_at"} <= set(recorder.properties)
