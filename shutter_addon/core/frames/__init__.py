"""Frames: what sources offer, light, and which frame a strip shows."""
