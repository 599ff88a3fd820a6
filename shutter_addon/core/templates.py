"""Which of the extension's own sentences a sentence is, without what it quotes: for reports that name nothing.

What is left of a sentence is text of the extension's source files, and so nothing of a user's: a list of names that
are to be taken out would always lack one.
"""

import ast
import errno
import os
import re
import string
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

_PACKAGE = Path(__file__).parents[1]
UNKNOWN = "(words that are not the extension's own)"
_LEAST = 5  # letters of a template: what has fewer fits anything
_DEEP = 4  # sentences within each other
_NUMBER = r"-?\d{1,9}(?:\.\d{1,6})?"
# What counts is called in templates, and names never are.
_WORDS = (
    "angle count degrees done factor first frame frames height index last least left limit "
    "longest milliseconds most number percent points share size stream time total unsure width window"
)
_COUNTS = frozenset(_WORDS.split())
# What libraries say of files without naming one, as media.decode.reason has it.
_FOREIGN = ("invalid data found when processing input", "end of file", "decoder not found", "unknown format")


class Text(NamedTuple):
    """literals: what is written; fields: what the braces between them hold, one fewer"""

    literals: tuple[str, ...]
    fields: tuple[str, ...]


class Template(NamedTuple):
    """said: in English; pattern: what a told sentence has to match; key: its longest literal part, by which most are
    told apart"""

    said: Text
    pattern: re.Pattern[str]
    key: str


def plain(text: str) -> str:
    """A sentence as the source has it, in English; what was put into its braces stays where it is itself such a
    sentence, or a count. UNKNOWN: it is none of the extension's."""
    return _plain(text.strip(), _DEEP) or UNKNOWN


def _plain(text: str, deep: int) -> str | None:
    if text in _sentences():
        return _sentences()[text]
    if deep == 0:
        return None
    for template in _templates():
        if template.key in text and (match := template.pattern.fullmatch(text)):
            return _filled(template.said, match.groups(), deep)
    _place, _, rest = text.partition(": ")
    told = _plain(rest, deep - 1) if rest else None
    return told and f"…: {told}"


def _filled(text: Text, values: tuple[str, ...], deep: int) -> str:
    words = [text.literals[0]]
    for field, value, literal in zip(text.fields, values, text.literals[1:], strict=True):
        is_count = _is_count(field) and re.fullmatch(_NUMBER, value)
        words += [value if is_count else _plain(value, deep - 1) or f"{{{field}}}", literal]
    return "".join(words)


@cache
def _sentences() -> dict[str, str]:
    """Sentences without braces, by themselves and by their translations."""
    known = {text: text for number in errno.errorcode if (text := os.strerror(number))}
    known |= {text[:1].lower() + text[1:]: text for text in known.values()} | {text: text for text in _FOREIGN}
    return known | {told.literals[0]: said.literals[0] for told, said in _found().items() if not told.fields}


@cache
def _templates() -> list[Template]:
    """Those with braces; those that say the most first."""
    found = {told: said for told, said in _found().items() if told.fields and _letters(told) >= _LEAST}
    return [
        Template(found[told], _pattern(told), max(told.literals, key=len))
        for told in sorted(found, key=_letters, reverse=True)
    ]


def _pattern(text: Text) -> re.Pattern[str]:
    values = (f"({_NUMBER}|.*?)" if _is_count(field) else "(.*?)" for field in text.fields)
    return re.compile("".join(map(str.__add__, map(re.escape, text.literals), (*values, ""))))


def _is_count(field: str) -> bool:
    return not _COUNTS.isdisjoint(re.findall(r"[a-z_]+", field)[-1:])


def _letters(text: Text) -> int:
    return sum(map(str.isalpha, "".join(text.literals)))


@cache
def _found() -> dict[Text, Text]:
    """Every sentence of the source as it is told: in English."""
    found: dict[Text, Text] = {}
    for path in _PACKAGE.rglob("*.py"):
        for told, said in _texts(ast.parse(path.read_text(encoding="utf-8"))):
            if told != said or told not in found:  # a translation is a text of the source as well
                found[told] = said
    return found


def _texts(tree: ast.Module) -> Iterator[tuple[Text, Text]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield (text := _joined(node)), text
        elif said := _text(node):
            yield said, said
        elif isinstance(node, ast.Dict):  # (context, English): what is shown, as in blender/interface/translations
            for key, value in zip(node.keys, node.values, strict=True):
                said, told = _text(key.elts[-1]) if isinstance(key, ast.Tuple) else None, _text(value)
                if said and told and said.fields == told.fields:  # what is in another order, English would mix up
                    yield told, said


def _joined(node: ast.JoinedStr) -> Text:
    parts = [part for part in node.values if isinstance(part, ast.Constant | ast.FormattedValue)]
    return _of(
        (str(part.value), None) if isinstance(part, ast.Constant) else ("", ast.unparse(part.value)) for part in parts
    )


def _text(node: ast.AST | None) -> Text | None:
    """None: it is no text of several words that `format` takes."""
    if not (isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value):
        return None
    words = " ".join(node.value.split())
    try:
        return _of((literal, field) for literal, field, _format, _conversion in string.Formatter().parse(words))
    except ValueError:
        return None


def _of(parts: Iterable[tuple[str, str | None]]) -> Text:
    """parts: what is written, and the field behind it, if there is one"""
    literals, fields = [""], []
    for literal, field in parts:
        literals[-1] += literal
        if field is not None:
            fields.append(field)
            literals.append("")
    return Text(tuple(literals), tuple(fields))
