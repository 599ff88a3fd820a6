"""Frames as they come in: what a source offers, their light, and which one a strip shows. Uses no other room."""
