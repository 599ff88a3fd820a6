"""Render one film on several machines: claims divide the frames, and a job file names the version of the edit."""
