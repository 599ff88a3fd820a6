"""What the media layer says when it cannot do something."""

from ..core.messages import UserError


class MediaError(UserError):
    """One clear sentence for the user, naming the file."""


class NotBuiltError(MediaError):
    """An in-between frame is not built; factor: of in-between frames."""

    def __init__(self, sentence: str, factor: int) -> None:
        super().__init__(sentence)
        self.factor = factor
