"""The errors of footage."""

from ..core.messages import UserError


class MediaError(UserError):
    """An error of a file: a sentence for the user that names the file."""
