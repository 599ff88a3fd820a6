"""Baking: an effect as a film on disk, which a strip of the edit shows."""
