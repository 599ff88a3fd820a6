"""The effect as a JSON file: reading, checking, writing and editing recipes."""
