"""What operators that run for a while work on, while Blender's data may change."""

from dataclasses import dataclass
from typing import Any

import bpy
from bpy.types import PropertyGroup

from ...core import revision

_replaced = revision.Revision()  # of Blender's data, by undo or another file


def data_replaced() -> None:
    """End what works on targets, because its data is gone."""
    _replaced.changed()


@dataclass(frozen=True)
class Target:
    """What is worked on. It is looked up before each step, because Blender's data may have changed.

    Attributes:
        scene: session_uid of the effect scene.
        index: see selection.moving.
        known: differs if another region has taken its place.
    """

    scene: int
    index: Any
    known: tuple

    @classmethod
    def of(cls, effect: PropertyGroup, index: int | None) -> "Target":
        return cls(effect.scene.session_uid, index, cls._known(effect, index))

    def effect(self) -> PropertyGroup | None:
        """Return the effect; None: it is gone, moved, or undone, or another region has this index."""
        effects = (effect for scene in bpy.data.scenes for effect in scene.virtual_shutter.effects if effect.scene)
        effect = next((effect for effect in effects if effect.scene.session_uid == self.scene), None)
        is_there = effect is not None and (self.index is None or self.index < len(effect.regions))
        return effect if is_there and self._known(effect, self.index) == self.known else None

    @staticmethod
    def _known(effect: PropertyGroup, index: int | None) -> tuple:
        layer = None if index is None else effect.regions[index].layer
        return _replaced.number, effect.id_data.session_uid, effect.start, layer
