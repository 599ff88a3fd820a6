"""What the extension says in Blender's interface: (context, message), as Blender looks its translations up."""

import inspect
import math
from pathlib import Path

import bpy
import pytest
from _bl_i18n_utils import bl_extract_messages, settings

from shutter_addon import blender
from shutter_addon.core.model import effect, scribbles, shutters
from shutter_addon.core.model.choices import CONTEXT
from shutter_addon.features.rolling_shutter import readout
from shutter_addon.features.tracking import camera_tracking, matte_tracking, tracking

ROOT = Path(blender.__file__).parents[1]
SOURCES = sorted([*ROOT.glob("blender/**/*.py"), *ROOT.glob("features/*/blender/*.py")])


def of_classes() -> set:
    """Labels, tooltips and enum items of all registered classes, and of what they added to Blender's."""
    return {(context, words) for cls in _classes() for context, words in _of_class(cls) if words}


def of_presets() -> set:
    """Labels and tooltips of the presets, whose list Blender gets from a function."""
    return {
        (context, words)
        for label, description, *_ in shutters.PRESETS.values()
        for context, words in ((CONTEXT, label), ("*", description))
    }


def of_core() -> set:
    """Sentences of core that data/snapshot.py passes on in the user's language."""
    faults = {("*", _fault(bars)) for bars in ([0], [-1], [math.inf], [1e7], [1e-7])}
    named = (words for module in (effect, scribbles) for words in vars(module).values() if isinstance(words, str))
    return faults | {("*", words) for words in named if '"{name}"' in words}


def of_media() -> set:
    """Sentences of media that say why nothing can be tracked or found, which editing passes on in the user's
    language."""
    modules = tracking, camera_tracking, matte_tracking, readout
    named = [each for module in modules for each in vars(module).items()]
    return {("*", words) for name, words in named if name.isupper() and isinstance(words, str)}


def _fault(bars) -> str:
    with pytest.raises(shutters.ShutterError) as raised:
        shutters.check_bars(bars)
    return str(raised.value)


def of_sources() -> set:
    """What is written in the code itself, as Blender's own tool for translators finds it: reports, labels, pgettext."""
    found, reports = {}, bl_extract_messages._gen_reports(None)  # Blender's, which nothing else makes
    bl_extract_messages.dump_py_messages_from_files(found, reports, map(str, SOURCES), settings.I18nSettings())
    return set(found)


def _classes():
    modules = blender._modules  # what it registers: there is no other list
    return [cls for module in modules for cls in blender.classes_of(module)]


def _of_class(cls):
    """Of properties only those that the extension's classes declare: file dialogs get more from Blender's."""
    rna = _rna(cls)
    yield rna.translation_context, getattr(cls, "bl_label", "")
    yield "*", getattr(cls, "bl_category", "")
    if issubclass(cls, bpy.types.Operator):
        yield "*", rna.description
    ours = [base for base in cls.__mro__ if base.__module__.startswith(blender.__package__.partition(".")[0])]
    properties = {prop.identifier: prop for prop in rna.properties}  # a group's own "name" comes after Blender's
    declared = [name for base in ours for name in inspect.get_annotations(base)]
    for prop in (properties[name] for name in declared if name in properties):  # what is none is a plain attribute
        if prop.name != prop.identifier:  # which is what Blender takes where there is no name
            yield prop.translation_context, prop.name
            yield "*", prop.description
        for item in getattr(prop, "enum_items_static", ()):
            yield prop.translation_context, item.name
            yield "*", item.description


def _rna(cls):
    """A class as Blender has it; an operator's properties are in a type of their own."""
    if not issubclass(cls, bpy.types.Operator):
        return cls.bl_rna
    group, name = cls.bl_idname.split(".")
    return getattr(getattr(bpy.ops, group), name).get_rna_type()
