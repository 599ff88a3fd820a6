"""The commands `render` and `check` of the command line, one module each. Features have more."""
