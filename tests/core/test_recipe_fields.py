"""Recipes say each property as its field defines it."""

import json
import re

import pytest
from made_recipes import comes_back

from shutter_addon.core.model import effect
from shutter_addon.core.model.fields import MISSING, fields_of
from shutter_addon.core.model.frame_state import Options
from shutter_addon.core.recipes import recipe, recipe_file

STROKES = [[[0.1, 0.1], [0.5, 0.1], [0.5, 0.5]]]
BASE = {
    "version": 2,
    "window": 2,
    "shutters": [
        {"name": "A", "bars": [1, 1]},
        {"name": "B", "bars": [0, 1], "combine": "lightest", "threshold": 0.5, "softness": 0.2, "follow": "camera"},
    ],
    "regions": [
        {"shutter": "A", "strokes": STROKES},
        {"shutter": "A", "kind": "outline", "strokes": STROKES},
        {"shutter": "A", "kind": "matte", "path": "x.png"},
        {"shutter": "A", "kind": "ramp", "ramp": "linear"},
    ],
}
# Where a recipe has the fields of a class, and where its effect has them.
PLACES = [
    (Options, (), lambda found: found.options.at(1)),
    (effect.Effect, (), lambda found: found),
    (effect.Camera, (), lambda found: found.camera),
    (effect.Shutter, ("shutters", 1), lambda found: found.shutters[1]),
    (effect.Region, ("regions", 0), lambda found: found.regions[0]),
    (effect.OutlineRegion, ("regions", 1), lambda found: found.regions[1]),
    (effect.MatteRegion, ("regions", 2), lambda found: found.regions[2]),
    (effect.FileContent, ("regions", 2), lambda found: found.regions[2].content),
    (effect.MatteRegion, ("regions", 3), lambda found: found.regions[3]),
    (effect.RampContent, ("regions", 3), lambda found: found.regions[3].content),
]
CASES = [
    pytest.param(name, field, way, part, id=f"{kind.__name__}.{name}")
    for kind, way, part in PLACES
    for name, field in fields_of(kind).items()
    if field.recipe
]
NEW = object()  # the field is left out


def said(field, way, value):
    data = json.loads(json.dumps(BASE))
    owner = data
    for step in way:
        owner = owner[step]
    for each in (field.recipe, *(("threshold", "softness") if field.recipe == "combine" else ())):
        owner.pop(each, None)
    if value is not NEW:
        owner[field.recipe] = value
    return json.dumps(data)


def values(field):
    """Values that a recipe may have, and some that it may not."""
    if field.choices:
        return field.words.values(), ["other", 3.5, None]
    if isinstance(field.default, bool):
        return (True, False), [1, "true"]
    if isinstance(field.default, str):
        return ("é" * int(field.most), "C"), ["x" * (int(field.most) + 1), "\0", 1]
    if isinstance(field.default, tuple):
        return ((0, 0.5, 1),), [[0, 0, 2], [1, 1], 0.5]
    ends = type(field.default)(field.least), type(field.default)(field.most)
    if field.recipe == "window":
        return (2,), [0, 257, 2.0]
    return ends, [ends[0] - 1, ends[1] + 1, "1", True]


@pytest.mark.parametrize(("name", "field", "way", "part"), CASES)
def test_a_recipe_has_each_field_in_its_range(name, field, way, part):
    right, wrong = values(field)

    def value_of(found):
        value = getattr(part(found), name)
        return value.at(1) if field.is_channel else value

    for value in right:
        found = recipe_file.parse(said(field, way, value))
        assert value_of(found) == value
        assert comes_back(found)
    place = f"{way[0]}[{way[1]}].{field.recipe}" if way else field.recipe
    for value in wrong:
        with pytest.raises(recipe.RecipeError, match=rf"^{re.escape(place)}(\[\d\])?: "):
            recipe_file.parse(said(field, way, value))
    if field.absent is MISSING:
        with pytest.raises(recipe.RecipeError, match=f"{field.recipe}: missing"):
            recipe_file.parse(said(field, way, NEW))
    else:
        assert value_of(recipe_file.parse(said(field, way, NEW))) == field.absent


@pytest.mark.parametrize(("name", "field", "way", "part"), CASES)
def test_a_recipe_keys_what_may_be_keyed(name, field, way, part):
    keys = [{"frame": 1, "value": field.most}, {"frame": 5, "value": field.least, "ease": "constant"}]
    if not field.keyed_in_recipe:
        with pytest.raises(recipe.RecipeError, match=field.recipe):
            recipe_file.parse(said(field, way, keys))
        return
    found = recipe_file.parse(said(field, way, keys))
    half = (field.least + field.most) / 2
    assert [getattr(part(found), name).at(frame) for frame in (1, 3, 5, 9)] == [field.most, half, *[field.least] * 2]
    assert comes_back(found)
    keys[0]["value"] = 2 * field.most
    with pytest.raises(recipe.RecipeError, match=rf"{field.recipe}\[0\].value"):
        recipe_file.parse(said(field, way, keys))
