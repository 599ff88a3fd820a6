"""Films and pictures as files: written whole, shared by machines, joined, and checked before."""
