"""What the extension says in Blender's interface, in other languages.

A language is a module with a dictionary, as Blender's own: (context, English) to the words shown. Python needs nothing
to read it, and a line is a message, so that changes are easy to compare. To add one, copy german.py and name it below;
tests/blender/test_translations.py says what a language lacks.

What core, media, compute and the command say is English everywhere: it names files, fields and devices, and is looked
for in logs. Only what core says of a shutter's bars is looked up, where data/snapshot.py passes it on.
"""

import bpy

from . import german

LANGUAGES = {"de_DE": german.MESSAGES}


def register():
    bpy.app.translations.register(__name__, LANGUAGES)


def unregister():
    bpy.app.translations.unregister(__name__)
