"""Virtual Shutter, an extension for Blender that gives every pixel its own exposure.

Only folders named `blender`, and __main__.py, import bpy.
"""
