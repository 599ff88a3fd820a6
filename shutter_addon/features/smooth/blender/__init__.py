"""Smooth exposures in Blender: previews, and notes on too few frames."""
