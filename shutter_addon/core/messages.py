"""Sentences for users: one line each, which every terminal can show."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from . import told

LONGEST = 300  # characters of a sentence, as users see it


class UserError(Exception):
    """What a user can mend: one clear sentence, the place first, which can be shown anywhere whatever it quotes."""

    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        told.made(str(self))

    def __str__(self) -> str:
        return sentence(super().__str__())


class EffectError(UserError, RuntimeError):
    """The effect cannot be rendered as it stands; the message is one sentence for the user.

    words: what the sentence's braces stand for, so that an interface can translate the sentence (`template`)."""

    def __init__(self, template: str, **words: object) -> None:
        super().__init__(template.format(**words) if words else template)
        self.template, self.words = template, words


@contextmanager
def translated(translate: Callable[[str], str]) -> Iterator[None]:
    """Context in which the sentences of EffectErrors are passed on in the user's language. translate: a template into
    it."""
    try:
        yield
    except EffectError as error:
        if not error.words:
            raise
        words = dict(error.words)
        if fault := words.get("fault"):
            words["fault"] = translate(str(fault))
        raise EffectError(translate(error.template).format(**words)) from None


def sentence(text: object, longest: int = LONGEST) -> str:
    """The text on one line of at most `longest` characters; where it is longer, its middle is left out, for it begins
    with the place and ends with the reason. What cannot be shown (control characters, names of files that are not
    UTF-8) is escaped."""
    words = " ".join(str(text).split())
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in words)
    if len(line) <= longest:
        return line
    head = (longest - 3) // 2
    return f"{line[:head]} … {line[head + 3 - longest :]}"


def of_file(error: OSError, place: str | os.PathLike[str] = "") -> str:
    """What the system says of a file, its place first. place: where the error has none."""
    return f"{os.fsdecode(error.filename or place)}: {error.strerror or error}"


def signed(text: object) -> str:
    """The sentence with the name of who says it, where it stands among Blender's own."""
    return sentence(f"Virtual Shutter: {text}")
