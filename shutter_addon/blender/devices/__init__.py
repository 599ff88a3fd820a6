"""Blender's own GPU as a device that composes pictures, and the choice of the device that renders."""
