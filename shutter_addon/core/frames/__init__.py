"""Frames: the interface of their sources, conversions of light, and which frame a retimed strip shows."""
