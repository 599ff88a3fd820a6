"""What passes run on: OpenGL by moderngl, its memory, and how a pass is declared. No bpy."""
