"""Change effects: add, draw, key, copy and remove them, and keep them consistent with the strips."""
