"""Mattes of outlines and subjects, carried through the footage."""
