"""Read and write what Blender stores of an effect: properties, F-curves, strips, annotations and files."""
