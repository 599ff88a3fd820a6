"""The effect as plain data, with values over time, and its state at a frame."""
