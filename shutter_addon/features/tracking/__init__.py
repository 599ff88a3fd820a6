"""Track a region or the camera."""
