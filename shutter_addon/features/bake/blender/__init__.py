"""Baking in Blender: the film, its strip, the operators and the command."""
