"""Tracking in Blender: keyframes, operators, panels and the command."""
