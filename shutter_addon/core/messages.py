"""Errors and messages for users: each one line, printable on every terminal."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from . import recent_errors

LONGEST = 300  # characters


class UserError(Exception):
    """An error that a user can fix. Its message is one printable line of at most LONGEST characters.

    If the error has a place, such as a file or a region, the message begins with it.
    """

    def __init__(self, *arguments: object) -> None:
        super().__init__(*arguments)
        recent_errors.record(level=2)

    def __str__(self) -> str:
        return sentence(super().__str__())


class EffectError(UserError, RuntimeError):
    """An error of an effect that cannot be rendered.

    Attributes:
        template: The message, one sentence, with placeholders as in str.format, so that an interface can translate it.
        words: The values of the placeholders.
    """

    def __init__(self, template: str, **words: object) -> None:
        super().__init__(template.format(**words) if words else template)
        self.template, self.words = template, words


class MediaError(UserError):
    """An error of a media file. The message is a sentence for the user that names the file."""


@contextmanager
def translated(translate: Callable[[str], str]) -> Iterator[None]:
    """Catch an EffectError of the `with` block, and raise it again with its message in the user's language.

    An error with empty `words` is raised unchanged, not translated.

    Args:
        translate: A function that translates a text. It is applied to the error's template and, if there is one, to the
            value of the placeholder "fault", which is a sentence itself. Other values are inserted as they are.
    """
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
    """Return a text as one printable line of at most `longest` characters.

    A longer text loses its middle, since sentences begin with the place and end with the reason. Unprintable characters
    are escaped.
    """
    words = " ".join(str(text).split())
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in words)
    if len(line) <= longest:
        return line
    head = (longest - 3) // 2
    return f"{line[:head]} … {line[head + 3 - longest :]}"


def of_file(error: Exception, place: str | os.PathLike[str] = "") -> str:
    """Return an error's message. For an OSError, it begins with the file's path, or with `place` if that is unknown."""
    if isinstance(error, OSError):
        return f"{os.fsdecode(error.filename or place)}: {error.strerror or error}"
    return str(error)


def signed(text: object) -> str:
    """Return the text as one sentence with "Virtual Shutter: " before it, for output among Blender's messages."""
    return sentence(f"Virtual Shutter: {text}")
