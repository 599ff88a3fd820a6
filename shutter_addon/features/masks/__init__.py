"""Mattes and outlines of Blender's masks."""
