"""PyAV, which a package without wheels lacks: a second Blender decodes movies then, where one is lent."""

from functools import cache

LEAST = 19  # the major version whose reformatter converts as Blender does, and that tells how a movie is turned


@cache
def missing() -> str:
    """Why PyAV does not decode movies; "": it does."""
    try:
        import av

        if int(av.__version__.split(".")[0]) < LEAST:
            return f"PyAV is {av.__version__}, not {LEAST} or later"
        from .movie import MovieSource  # noqa: F401
    except ImportError as error:
        return str(error)
    return ""
