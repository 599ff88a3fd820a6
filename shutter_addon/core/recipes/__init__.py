"""The effect as a JSON file: its format, read, checked, written and edited. Uses model and frames."""
