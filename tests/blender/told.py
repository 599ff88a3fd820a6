"""What a German Blender shows of the extension; run inside one that has it enabled, by test_translations.py."""

import importlib
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import bpy
from bpy.app.translations import pgettext
from support import EXTENSION, sequencer

translations = importlib.import_module(f"{EXTENSION}.shutter_addon.blender.interface.translations")
view = bpy.context.preferences.view
view.language = "de_DE"
view.use_translate_interface = view.use_translate_tooltips = view.use_translate_reports = True
view.use_translate_new_dataname = True


def report(operator, **values) -> str:
    try:
        operator(**values)
    except RuntimeError as error:
        return str(error)
    return ""


german = translations.LANGUAGES["de_DE"]
shown = {message: pgettext(message[1], message[0]) for message in german}
translations.unregister()
blenders = {message: pgettext(message[1], message[0]) for message in german}
translations.register()
for message, text in german.items():
    # Blender's own word comes first, where it has one.
    expected = text if blenders[message] == message[1] else blenders[message]
    assert shown[message] == expected, (message, shown[message])

with sequencer(bpy):
    assert german["*", "Select a movie, image or clip strip"] in report(bpy.ops.shutter.add_effect)
    strips = bpy.context.scene.sequence_editor_create().strips
    strips.new_image("Bild", str(Path(__file__).parents[2] / "docs" / "demo.jpg"), 1, 1)
    bpy.context.scene.sequence_editor.active_strip = strips[0]
    bpy.ops.shutter.add_effect()
    effect = bpy.context.scene.virtual_shutter.effects[0]
    assert [shutter.name for shutter in effect.shutters] == ["Lang", "Scharf"], [s.name for s in effect.shutters]
    assert german["*", "The shutter has {count} bars"].format(count=8) in report(bpy.ops.shutter.bar_set, bar=9)
print("ALL IN GERMAN")
