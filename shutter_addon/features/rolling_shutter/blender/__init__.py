"""Rolling shutters in Blender: repair them with a ramp of moments."""
