"""The effect as plain data, each value over time, and its state at a frame. Uses frames."""
