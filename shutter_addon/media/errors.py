"""What the media layer says when it cannot do something."""


class MediaError(Exception):
    """One clear sentence for the user, naming the file."""
