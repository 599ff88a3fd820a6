"""Translations: complete, not stale, and shown."""

import ast
import string
from pathlib import Path

import messages

from shutter_addon.blender.interface.translations import LANGUAGES

GERMAN = LANGUAGES["de_DE"]
TOLD = Path(__file__).parent / "told.py"


def test_everything_that_is_said_has_a_german_text_and_nothing_else_has(bpy):
    shown = messages.of_classes() | messages.of_presets() | messages.of_sources()
    said = shown | messages.of_core() | messages.of_media()
    said = {message for message in said if message[0] != bpy.app.translations.contexts.no_translation}
    assert said - GERMAN.keys() == set(), "not translated"
    assert GERMAN.keys() - said == set(), "no longer said"


def test_no_text_is_empty_and_placeholders_agree():
    for (_context, message), text in GERMAN.items():
        assert text.strip() == text != "", message
        assert _placeholders(text) == _placeholders(message), message


def _placeholders(text: str) -> list:
    return sorted(name for _literal, name, _format, _conversion in string.Formatter().parse(text) if name is not None)


# Blender looks up what these get; an f-string would be another message each time.
LOOKED_UP = {"iface_", "rpt_", "data_", "report"}
# What these get is shown as it is.
SHOWN = {"poll_message_set", "say", "undo_push", "EffectError", "MediaError", "RecipeError"}


def test_no_message_misses_its_translation():
    """`rpt_("…{name}…").format(name=…)` is what can be looked up, and what is shown has been looked up before."""
    for path in messages.SOURCES:
        for call in (node for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.Call)):
            name = getattr(call.func, "id", getattr(call.func, "attr", ""))
            given = {type(word) for word in (*call.args, *(keyword.value for keyword in call.keywords))}
            assert not (name in LOOKED_UP | SHOWN and ast.JoinedStr in given), f"{path.name}:{call.lineno}"
            assert not (name in SHOWN and ast.Constant in given), f"{path.name}:{call.lineno}"


# What these return is shown as it is, and what others do that begin with `_why_` or are in needs.py.
TELLING = {"refusal", "why_no_effect", "why_full"}


def _is_telling(path: Path, node: ast.AST) -> bool:
    if not isinstance(node, ast.FunctionDef):
        return False
    return node.name in TELLING or node.name.startswith("_why_") or path.name == "needs.py"


def test_no_refusal_misses_its_translation():
    functions = ((path, each) for path in messages.SOURCES for each in ast.walk(ast.parse(path.read_text("utf-8"))))
    telling = [each for path, each in functions if _is_telling(path, each)]
    assert {function.name for function in telling} >= TELLING | {"a_shutter", "a_region"}
    for function in telling:
        for returned in (each.value for each in ast.walk(function) if isinstance(each, ast.Return)):
            ends = [returned.body, returned.orelse] if isinstance(returned, ast.IfExp) else [returned]
            words = [
                end for end in ends if isinstance(end, ast.JoinedStr) or isinstance(getattr(end, "value", None), str)
            ]
            assert not words, f"{function.name}: {ast.unparse(returned)}"


def test_texts_are_in_blenders_style(bpy):
    """Title case and no full stop, as Blender's guidelines have it."""
    for context, message in messages.of_classes() | messages.of_presets():
        assert not message.endswith("."), message
        assert message[0] == message[0].upper(), message
        if context in {"Operator", messages.CONTEXT}:
            words = message.split()
            assert all(word[0] == word[0].upper() or word in {"to", "from", "by"} for word in words), message


def test_a_german_blender_shows_them(blender, tmp_path):
    """The bpy wheel has no languages."""
    done = blender("--python-exit-code", 1, "--python", TOLD)
    assert done.returncode == 0, done.stderr + done.stdout
    assert "ALL IN GERMAN" in done.stdout
    assert "Traceback" not in done.stderr
