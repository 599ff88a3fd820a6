"""The command that joins frames to a movie."""
