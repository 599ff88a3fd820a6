"""GPUs that run compute shaders: OpenGL through moderngl, GPU memory, and how passes are declared. No bpy."""
