"""Changes of effects: add, draw, key, copy, remove, restore."""
