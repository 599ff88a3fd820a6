"""Frames of a source: movies by PyAV, image sequences by OpenImageIO. No bpy."""

from .ahead import Ahead
from .errors import MediaError
from .sequence import SequenceSource
from .source import Source, open_source

__all__ = ["Ahead", "MediaError", "SequenceSource", "Source", "open_source"]
