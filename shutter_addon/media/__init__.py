"""Frames of a source: movies by PyAV, image sequences by OpenImageIO. No bpy."""

from .errors import MediaError
from .prefetch import PrefetchSource
from .sequence import SequenceSource
from .source import Source, open_source

__all__ = ["MediaError", "PrefetchSource", "SequenceSource", "Source", "open_source"]
