"""Films that several machines render."""
