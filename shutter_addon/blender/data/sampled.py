"""Sample an effect's properties and F-curves at timeline frames, as plain data that does not need Blender any more.

A property becomes a channel: an object whose `at(frame)` gives the property's value at a sampled frame. To be called on
Blender's main thread only.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from bpy.types import PropertyGroup, Scene, Strip

from ...core.messages import UserError
from ...core.model import effect as model
from ...core.model import keyframes
from ...core.model.fields import Field, fields_of
from ...core.model.keyframes import Channel
from ...core.model.motions import Placement
from . import annotations, strips, validation
from .fcurves import Curves

Frames = Collection[float]  # of the timeline


def tried(function: Callable, *arguments: object) -> Any:
    """Return what a function returns, or the UserError that it raises, as an object.

    A channel stores such an error among its values, and raises it when that value is asked for.
    """
    try:
        return function(*arguments)
    except UserError as error:
        return error


def value(owner: PropertyGroup, field: Field, number: float | None = None) -> Any:
    """Return the value of a Blender property as the model's field has it, such as a word for an enum item.

    Args:
        owner: The struct that has the property.
        field: The model's field. It must not be one whose value is a channel.
        number: The value of the property's F-curve, to be used in place of the stored value. Only choices and switches
            (at least 0.5 is True) use it. None: there is none.

    Raises:
        EffectError: The value is none of its choices, or out of range.
    """
    if field.choices:
        return field.words[validation.word(owner, field.blender, number)]
    if isinstance(field.default, bool) and number is not None:
        return number >= 0.5
    if isinstance(field.default, bool | str):
        return getattr(owner, field.blender)
    if isinstance(field.default, tuple):
        return tuple(getattr(owner, field.blender))
    return validation.number(owner, field.blender)


def placement_now(moving: PropertyGroup) -> Placement:
    """Return where a region or the camera is by the current values of its properties, whether they are keyed or not."""
    return Placement(tuple(moving.location), float(np.degrees(moving.rotation)), moving.scale)


@dataclass(frozen=True)
class Sampling:
    """Reads an effect's properties as channels.

    A property without F-curves becomes a constant. One with F-curves is read at each frame of `frames`.

    Attributes:
        curves: The F-curves of the scene that has the effect.
        effect: The effect's property group.
        strip: The effect strip; None: nothing that is read depends on it; `placement` is then None at all frames.
        frames: Timeline frames at which properties with F-curves are read.
    """

    curves: Curves
    effect: PropertyGroup
    strip: Strip | None
    frames: Frames

    @staticmethod
    def of(scene: Scene, effect: PropertyGroup, strip: Strip | None, frames: Frames) -> "Sampling":
        return Sampling(Curves(scene), effect, strip, frames)

    @cached_property
    def path(self) -> str:
        """The effect's data path from its scene."""
        return self.effect.path_from_id()

    def over(self, keyed: object, at: Callable[[float], object], keys: tuple = ()) -> Channel:
        """Return the results of `at(frame)` as a channel: evaluated at all frames if it is keyed, else once.

        A UserError that `at` raises for one frame is stored and raised when that frame's value is asked for.

        Args:
            keyed: F-curves that `at` evaluates, or anything else that is true if its result depends on the frame.
            at: Returns the value at a timeline frame.
            keys: Frames and eases of the F-curves' keys, as Curves.keys returns them; for keyframes.Samples.
        """
        if not keyed:
            return keyframes.Constant(tried(at, 0.0))
        return keyframes.Samples({frame: tried(at, frame) for frame in self.frames}, keys)

    def channel(self, owner: PropertyGroup, path: str, name: str, change: Callable = lambda value: value) -> Channel:
        """Return the values of a float property or vector over time, as a channel.

        Values of F-curves are clamped to the property's range. A stored value out of range, or NaN, is an EffectError,
        which the channel raises when that value is asked for.

        Args:
            owner: The struct that has the property.
            path: Data path of `owner` from the scene.
            name: Name of the property.
            change: Applied to each value, for example to convert radians to degrees.
        """
        curves, keyed = self.curves, self.curves.of(owner, path, name)
        return self.over(keyed, lambda frame: change(curves.value(owner, path, name, frame)), curves.keys(keyed))

    def fields(self, owner: PropertyGroup, path: str, kind: type, unused: Collection[str] = ()) -> dict:
        """Read a property group as keyword arguments for a class of the model: a value or a channel for each field.

        Args:
            owner: The property group.
            path: Data path of `owner` from the scene.
            kind: The class, such as model.Shutter.
            unused: Names of fields to leave out, because they have no effect now. The class's defaults then apply.

        Raises:
            EffectError: An enum property has an unknown item, or a number that is no channel is out of range.
        """
        return {
            name: self.channel(owner, path, field.blender) if field.is_channel else value(owner, field)
            for name, field in fields_of(kind).items()
            if name not in unused
        }

    def moves(self, moving: PropertyGroup, path: str) -> model.Moves:
        """Return the motion of a region or the camera as channels: location, rotation (in degrees) and scale.

        Args:
            moving: The region or the camera.
            path: Data path of `moving` from the scene.
        """
        return model.Moves(
            location=self.channel(moving, path, "location"),
            rotation=self.channel(moving, path, "rotation", np.degrees),
            scale=self.channel(moving, path, "scale"),
        )

    @cached_property
    def placement(self) -> Channel:
        """Channel of the matrix (3, 3) from the sequencer's image space to fractions of the effect strip's picture.

        A value is None at frames where the strip is so small that a side has fewer than 4 pixels, and at all frames if
        there is no strip.
        """
        strip = self.strip
        if strip is None:
            return keyframes.Constant(None)
        size, path = annotations.picture_size(self.effect), f"{strip.path_from_id()}.transform"
        keyed = {name: curve for name in annotations.TRANSFORM if (curve := self.curves.find(f"{path}.{name}"))}

        def at(frame: float) -> np.ndarray | None:
            moved = {name: curve.evaluate(frame) for name, curve in keyed.items()}
            return annotations.image_to_picture(strip, size, **moved)

        return self.over(keyed, at)

    @cached_property
    def time(self) -> Channel | None:
        """Channel of what *Custom Time* shows: (source frame, whether time runs backward). None: *Custom Time* is off.

        Source frame 1 is the source's first. If the exposure length of a shutter is *Timeline*, the channel has values
        half a frame before and after each sampled frame, too.
        """
        effect = self.effect
        if not effect.use_source_time:
            return None
        sampling = self
        if any(shutter.length == "TIMELINE" for shutter in effect.shutters):
            moments = np.unique(np.add.outer(sorted(self.frames), (-0.5, 0, 0.5))).tolist()
            sampling = Sampling(self.curves, effect, self.strip, moments)
        keyed = self.curves.of(effect, self.path, "source_time")
        numbers = keyframes.Computed(lambda frame: self.curves.value(effect, self.path, "source_time", frame))
        keys = self.curves.keys(keyed)
        return sampling.over(keyed, keyframes.SourceTime(numbers, keys).at, keys)

    def drawings(self, index: int, every: bool = False, layer_name: str = "layer") -> model.Drawings:
        """Return what is drawn in one annotation layer of a region over time, at all frames that have a drawing.

        A drawing is the list of strokes at one timeline frame. Between two drawings the strokes change from one to the
        other. A key of the region's location on a drawing's frame says how, by its ease; without one it is linear.

        Args:
            index: Index of the region in the effect.
            every: True: read the strokes of all drawings. False: only of those at or around a sampled frame; the
                strokes of the others are None.
            layer_name: Which layer of the region, one of annotations.LAYERS.

        Returns:
            The drawings; without any if the region has no such layer.
        """
        region, path = self.effect.regions[index], f"{self.path}.regions[{index}]"
        width, height = annotations.picture_size(self.effect)
        layer = annotations.layer_of(self.effect, region, layer_name)
        drawn = sorted(layer.frames, key=lambda drawing: drawing.frame_number) if layer else []
        numbers = tuple(drawing.frame_number for drawing in drawn)
        frames = numbers if every else self.frames
        needed = {i for frame in frames for i in keyframes.span(numbers, frame)[:2]} if drawn else ()
        timing = self.curves.find(f"{path}.location")
        eases = dict(self.curves.keys([timing])) if timing and len(numbers) > 1 else {}
        return model.Drawings(
            name=region.name,
            frames=numbers,
            strokes=tuple(annotations.strokes_of(drawing) if i in needed else None for i, drawing in enumerate(drawn)),
            eases=tuple(eases.get(number, "linear") for number in numbers),
            aspect=width / height,
            placement=self.placement,
            origins=self._origins(region, path, numbers),
        )

    def _origins(self, region: PropertyGroup, path: str, numbers: tuple[int, ...]) -> tuple[Placement, ...]:
        """Return how the region was moved when each of its drawings was made, to lay drawings where they were drawn.

        Args:
            path: Data path of the region from the scene.
            numbers: Timeline frames of the drawings.

        Returns:
            A placement for each drawing: the one stored with it, else that of the region's keys at the drawing's frame.
            () if none is stored for any drawing, or for outlines, subjects and mattes: the region counts as unmoved.
        """
        if not region.drawn or region.kind in strips.LAID:
            return ()
        known = {np.rint(self.effect.start + noted.frame): placement_now(noted) for noted in region.drawn}
        there = Sampling(self.curves, self.effect, self.strip, numbers).moves(region, path)
        return tuple(known[number] if number in known else there.at(number) for number in numbers)
