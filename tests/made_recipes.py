"""Recipes as tests write and compare them."""

import json

from shutter_addon.core.recipes import recipe_file, records


def made(window, shutters, regions=(), **more):
    """The effect of a recipe with these shutters and regions, as JSON has them."""
    data = {"version": 2, "window": window, "shutters": list(shutters), "regions": list(regions)}
    return recipe_file.parse(json.dumps(data | more))


def key(frame, location=(0, 0), rotation=0, scale=1, **more):
    """A key of a region or of the camera."""
    return {"frame": frame, "location": location, "rotation": rotation, "scale": scale, **more}


def is_same(one, other):
    return records.recipe_of(one) == records.recipe_of(other)


def comes_back(effect):
    """Whether an effect is the same once it was written and read."""
    return is_same(recipe_file.parse(recipe_file.dump(effect)), effect)
