"""The effect as plain data: shutters, regions and options that change over time, and its state at one frame."""
