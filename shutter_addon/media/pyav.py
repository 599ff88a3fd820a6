"""PyAV, which a package without wheels lacks: a second Blender decodes movies then, where one is lent."""

from functools import cache


@cache
def missing() -> str:
    """Why PyAV does not decode movies, in Python's words; "": it does."""
    try:
        from .movie import MovieSource  # noqa: F401
    except ImportError as error:
        return str(error)
    return ""
