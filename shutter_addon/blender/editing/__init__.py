"""Changes of effects: add, edit, copy, track, bake, remove, restore."""
