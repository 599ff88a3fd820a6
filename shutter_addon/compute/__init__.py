"""Passes over a device: diffuse, compose. No bpy."""
