"""Recipes, which are effects as JSON files: read, check, write and make them."""
