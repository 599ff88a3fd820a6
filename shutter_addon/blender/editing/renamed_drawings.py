"""Regions keep their drawing, a layer of the effect's annotation, when it is renamed."""

_names: dict[int, list[str]] = {}  # of layers, by session_uid of their annotation, as they were at the last update


def follow(scenes) -> None:
    """Gives the regions of effects in all these scenes the new names of their drawings.

    Handlers come after the undo push of the user's step. Undoing the step after a rename brings back a region with
    the old name and an annotation that has the new one: so the annotation carries the names that its regions go by.
    Undoing the rename itself leaves the region as it is now: that the names before were others is told by memory.
    """
    before = dict(_names)
    _names.clear()  # of annotations that are gone
    for effect in [effect for scene in scenes for effect in scene.virtual_shutter.effects]:
        annotation = effect.scene.annotation
        if annotation is None or annotation.library is not None:
            continue
        names = [layer.info for layer in annotation.layers]
        _rename(effect, annotation.virtual_shutter_names.splitlines(), names)
        _rename(effect, before.get(annotation.session_uid, names), names)
        _names[annotation.session_uid] = names
        if annotation.virtual_shutter_names != (known := "\n".join(names)):
            annotation.virtual_shutter_names = known


def forget() -> None:
    """Forgets the names of a file, before another one is loaded."""
    _names.clear()


def _rename(effect, before: list[str], names: list[str]) -> None:
    """One name among the same number of drawings is another: it was renamed."""
    changed = [(old, new) for old, new in zip(before, names, strict=False) if old != new]
    if len(before) == len(names) and len(changed) == 1:
        for region in effect.regions:
            if region.layer == changed[0][0]:
                region.layer = changed[0][1]
