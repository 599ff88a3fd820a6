"""Every operator says what it does, is found by Blender's search; menus have by numbers what a mouse drags."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import pytest

from shutter_addon.blender.editing import region_edits
from shutter_addon.blender.interface import menus


def drawn(draw):
    """What is put into a layout, which only a window has: names of operators, of menus and of properties."""
    layout = MagicMock(spec=bpy.types.UILayout.bl_rna.functions.keys())
    draw(SimpleNamespace(layout=layout), bpy.context)
    calls = [(name, given) for name, given, _ in layout.method_calls]
    properties = [given for name, given in calls if name.startswith("prop")]
    assert all(name in data.bl_rna.properties for data, name in properties)
    operators, menus = ([given[0] for name, given in calls if name.startswith(kind)] for kind in ("operator", "menu"))
    return operators, menus, [name for _data, name in properties]


@pytest.fixture(scope="module")
def operators(bpy):
    """By name: what Blender has of each of the extension's operators."""
    return {f"shutter.{name}": getattr(bpy.ops.shutter, name).get_rna_type() for name in dir(bpy.ops.shutter)}


def in_menu(name: str) -> list[str]:
    """The operators of a menu and of all that open from it."""
    operators, menus, _properties = drawn(getattr(bpy.types, name).draw)
    return operators + [operator for menu in menus for operator in in_menu(menu)]


def test_every_operator_has_a_name_of_its_own_and_a_description(operators):
    assert len({rna.name for rna in operators.values()}) == len(operators)
    for name, rna in operators.items():
        assert rna.name, name
        assert rna.description != rna.name, name
        assert len(rna.description.split()) >= 4, name


def test_every_operator_is_in_the_menu_of_strips_which_blenders_search_reads(bpy, effect, operators):
    assert set(in_menu("SHUTTER_MT_strip")) == set(operators)
    entry = bpy.types.SEQUENCER_MT_strip.draw._draw_funcs[-1]  # Blender tells of what was appended nowhere else
    assert drawn(entry)[1] == [menus.strip_menu.__name__]


def test_a_region_the_split_and_the_probe_are_moved_by_numbers_in_the_menus(bpy, effect):
    region_edits.add_region(effect, effect.shutters[1], "RAMP")
    properties = drawn(bpy.types.SHUTTER_MT_of_region.draw)[2] + drawn(bpy.types.SHUTTER_MT_of_preview.draw)[2]
    assert {"location", "rotation", "scale", "split", "probe", "probe_at"} <= set(properties)
