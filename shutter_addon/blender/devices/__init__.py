"""Blender's own GPU as a device, and the choice of the device that renders."""
