"""What the media layer says when it cannot do something."""

from ..core.messages import UserError


class MediaError(UserError):
    """One clear sentence for the user, naming the file."""
