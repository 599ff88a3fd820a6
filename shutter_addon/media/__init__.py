"""Footage: movies through PyAV, image sequences through OpenImageIO, cuts, tracking, optical flow. No bpy."""

from ..core.frames.frame_source import FrameSource
from ..core.messages import MediaError
from .opening import open_source
from .prefetch import PrefetchSource

__all__ = ["FrameSource", "MediaError", "PrefetchSource", "open_source"]
