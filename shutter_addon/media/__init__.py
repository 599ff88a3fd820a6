"""Footage: movies, image sequences and the files of mattes, cuts, optical flow, and files made from footage. No bpy."""

from ..core.frames.frame_source import FrameSource
from ..core.messages import MediaError
from .opening import open_source
from .prefetch import PrefetchSource

__all__ = ["FrameSource", "MediaError", "PrefetchSource", "open_source"]
