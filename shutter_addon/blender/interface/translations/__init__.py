"""Translations of the interface, by language.

A language is a module with a dictionary in Blender's format: (context, English) to the translation. To add one, copy
german.py and name it below. tests/blender/test_translations.py lists missing texts.

Texts of core, media, compute and the command are always English: they name files, fields and devices, and users search
for them. Only what core says about a shutter's bars is translated, by data/snapshot.py.
"""

import bpy

from . import german

LANGUAGES = {"de_DE": german.MESSAGES}


def register():
    bpy.app.translations.register(__name__, LANGUAGES)


def unregister():
    bpy.app.translations.unregister(__name__)
