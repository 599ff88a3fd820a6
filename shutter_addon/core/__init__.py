"""Pure Python and NumPy that all other packages use."""
