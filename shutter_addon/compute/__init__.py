"""Diffusion and composition, on a device or with NumPy. No bpy."""
