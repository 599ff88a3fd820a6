"""Shutters, quantiles, scribbles, keyframes, recipe and the reference compositor: pure Python and NumPy."""
