"""The effect as data, the reference compositor, recipes and helpers: pure Python and NumPy, for all other packages."""
