"""What an effect is in Blender's data, and what it is made of as plain data."""
