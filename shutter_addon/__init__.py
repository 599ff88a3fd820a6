"""Virtual Shutter: every pixel its own exposure. Only the package `blender` uses bpy."""
