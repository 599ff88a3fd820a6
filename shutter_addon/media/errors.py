"""What the media layer says when it cannot do something."""

from ..core.messages import sentence


class MediaError(Exception):
    """One clear sentence for the user, naming the file, that can be shown anywhere whatever the file's name."""

    def __str__(self):
        return sentence(super().__str__())
