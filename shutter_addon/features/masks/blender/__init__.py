"""Read Blender's masks, and operators that use them."""
