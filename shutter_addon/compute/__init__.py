"""Pictures: diffusion of strokes, windows of frames, and composition, on a GPU or with NumPy. No bpy."""
