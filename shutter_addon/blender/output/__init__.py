"""Films and pictures as files: writing, sharing among machines, joining and checking."""
