import ast
import string
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import shutter_addon
from shutter_addon.core.templates import UNKNOWN, plain

NAME = "Qanarix"
PACKAGE = Path(shutter_addon.__file__).parent


@pytest.mark.parametrize(
    ("told", "expected"),
    [
        (f"{NAME}.mov: may not be read", "{path.name}: may not be read"),
        (f'strip "{NAME}" is scaled to nothing', 'strip "{strip}" is scaled to nothing'),
        (f"Streifen „{NAME}“ ist zu nichts skaliert", 'strip "{strip}" is scaled to nothing'),
        (f"Virtual Shutter: {NAME}.png: file is empty", "Virtual Shutter: {path.name}: file is empty"),
        (f"/home/{NAME}/f.png: Permission denied", "…: Permission denied"),
        (
            f"frame 12 of {NAME}.mov cannot be decoded: invalid data found when processing input",
            "frame 12 of {self.path.name} cannot be decoded: invalid data found when processing input",
        ),
        (f"{NAME}.png: is 12×7, but 0001.png is 40×24", "{path.name}: is 12×7{window}, but {first}"),
        ("the readout cannot be found here: there are too few frames",) * 2,
        (f"{NAME} has said something", UNKNOWN),
        (NAME, UNKNOWN),
        ("", UNKNOWN),
    ],
)
def test_names_are_taken_out(told, expected):
    assert plain(told) == expected


class Name(str):
    """Stands in the place of numbers as well."""

    def __format__(self, _specification):
        return NAME


def sentences():
    """(English, as it is shown) of all that the interface says."""
    tree = ast.parse((PACKAGE / "blender" / "interface" / "translations" / "german.py").read_text(encoding="utf-8"))
    (messages,) = (ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign | ast.AnnAssign))
    return [(english, shown) for (_, english), german in messages.items() for shown in (english, german)]


def test_no_sentence_keeps_a_name_in_any_language():
    known, filled = 0, 0
    for english, shown in sentences():
        fields = [field for _, field, _, _ in string.Formatter().parse(shown) if field]
        filled += bool(fields)
        said = plain(shown.format(**dict.fromkeys(fields, Name())))
        assert NAME not in said, shown
        known += bool(fields) and said == english
    assert 0.9 * filled < known < filled > 200  # the others have hardly a word


@given(st.text(max_size=40), st.sampled_from(["{}", 'strip "{}" is scaled to nothing', "{}: may not be read", "a: {}"]))
def test_whatever_a_name_is(name, template):
    said = plain(template.format(f"{NAME}{name}{NAME}"))
    assert NAME not in said
