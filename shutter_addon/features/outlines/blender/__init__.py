"""Outlines and subjects in Blender: previews, drawings, operators and the gizmo."""
