"""Devices that run compute passes: OpenGL through moderngl, its memory, and how passes are declared. No bpy."""
