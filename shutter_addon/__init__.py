"""Virtual Shutter: every pixel its own exposure. Sub-packages: core, media, compute (no bpy) and blender."""
