"""A source around another one: what every wrapper shares."""

from collections.abc import Iterable

import numpy as np

from .frame_source import FrameSource
from .planes import Decoded


class _Forwarded:
    """An attribute of the wrapped source, unless the wrapper sets its own."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, wrapper: "SourceWrapper | None", _owner: type | None = None) -> object:
        return self if wrapper is None else getattr(wrapper._source, self._name)


class SourceWrapper(FrameSource):
    """A source around another one. It has all attributes and frames of that one, but for those that a subclass sets."""

    def __init__(self, source: FrameSource) -> None:
        self._source = source

    def read(self, index: int) -> np.ndarray:
        return self._source.read(index)

    def decoded(self, index: int) -> Decoded:
        return self.read(index)  # which may give other frames than the source

    def want(self, indices: Iterable[int]) -> None:
        self._source.want(indices)

    def close(self) -> None:
        self._source.close()


for _name in FrameSource.__annotations__:
    setattr(SourceWrapper, _name, _Forwarded(_name))
