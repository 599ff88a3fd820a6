"""Rendering one film on several machines: claims, and versions of an edit."""
