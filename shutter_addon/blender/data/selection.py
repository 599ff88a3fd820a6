"""What is active: the edit, the strip, its effect, and the effect's shutter and region."""

from .strips import SOURCES, effect_of, effect_strips


def edit_of(context):
    """The scene whose sequencer the context shows, or None."""
    return getattr(context, "sequencer_scene", None) or context.scene


def active_strip(context):
    """The active strip of the context's edit, or None; in place of a movie's sound, which is the active one after both
    were added, the movie."""
    edit = edit_of(context)
    strip = edit.sequence_editor.active_strip if edit and edit.sequence_editor else None
    if strip is None or strip.type != "SOUND":
        return strip
    return next((other for other in strip.connections if other.type in SOURCES), strip)


def active(context):
    """Edit, effect and effect strip of the active strip, which may be the source as well; None: it has no effect."""
    strip = active_strip(context)
    if strip is None:
        return None
    edit = edit_of(context)
    if strip.type != "SCENE":
        above = [s for s in effect_strips(edit) if _shows(edit, s, strip)]
        if not above:
            return None
        strip = min(above, key=lambda s: abs(s.left_handle - strip.left_handle))
    effect = effect_of(edit, strip.scene) if strip.scene else None
    return (edit, effect, strip) if effect else None


def _shows(edit, strip, source) -> bool:
    effect = effect_of(edit, strip.scene)
    return effect is not None and effect.source == source.virtual_shutter_source != ""


def choose(edit, strip) -> None:
    """Makes a strip the active and only selected one."""
    for other in edit.sequence_editor.strips_all:
        other.select = other == strip
    edit.sequence_editor.active_strip = strip


def effect_of_item(item):
    """The effect that a shutter or a region belongs to."""
    path = item.path_from_id()
    return item.id_data.path_resolve(path[: path.index("]") + 1])


def moving(effect, index: int | None):
    """The region of an index; None: the camera. What both can do, functions take by such an index."""
    return effect.camera if index is None else effect.regions[index]


def active_shutter(effect):
    """The shutter that is chosen in the list, or None."""
    return effect.shutters[effect.active_shutter] if 0 <= effect.active_shutter < len(effect.shutters) else None


def active_region(effect):
    """The region that is chosen in the list, if it is one of the active shutter's; or None."""
    region = effect.regions[effect.active_region] if 0 <= effect.active_region < len(effect.regions) else None
    shutter = active_shutter(effect)
    return region if region and shutter and region.shutter == shutter.name else None
