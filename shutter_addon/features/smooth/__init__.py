"""Smooth exposures: the moments between filmed frames."""
