"""Blender's masks: their splines as outlines, and the pixels that these cover. Uses no other room."""
