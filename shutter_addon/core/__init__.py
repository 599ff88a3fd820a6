"""What the other layers compute with, in rooms; beside them what all rooms use. Pure Python and NumPy."""
