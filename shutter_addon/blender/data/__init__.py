"""Read and write what Blender stores of an effect."""
