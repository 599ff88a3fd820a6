"""The GPU that Blender draws with as a device, and which device makes which picture."""
