"""Make the pictures of effects: the render engine, sessions on devices, previews, render jobs."""
