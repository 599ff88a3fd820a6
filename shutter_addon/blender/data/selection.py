"""What is seen, and what is active: the edit, the strip, its effect, and the effect's shutter and region."""

from bpy.app.translations import pgettext_rpt as rpt_

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
    """Edit, effect and effect strip that the interface shows and changes: those that are seen, or where none are, those
    of the active strip, which may be the source as well. None: the active strip has no effect, or nothing has."""
    edit, strip = edit_of(context), active_strip(context)
    effects = _effects_of(edit, strip)
    if strip is not None and not effects:
        return None
    if (shown := seen(edit)) is not None or not effects:
        return shown
    others = [other for other in effect_strips(edit) if effect_of(edit, other.scene) in effects]
    nearest = min(others, key=lambda o: (o != strip, abs(o.left_handle - strip.left_handle)), default=None)
    return (edit, effect_of(edit, nearest.scene), nearest) if nearest else None


def in_picture(context):
    """What is active, where it is seen; else None: nothing in the picture belongs to it."""
    shown = active(context)
    return shown if shown and seen(shown[0]) else None


def seen(edit):
    """Edit, effect and effect strip that previews of an edit show at the playhead: of several the active strip's own,
    then those of the active strip's source, as the other half of a cut one, then the highest. None: no effect."""
    scenes = [strip for strip in visible(edit) if strip.type == "SCENE" and strip.scene]
    shown = [(strip, effect) for strip in scenes if (effect := effect_of(edit, strip.scene))]
    if not shown:
        return None
    active = edit.sequence_editor.active_strip
    kin = _effects_of(edit, active)
    strip, effect = max(shown, key=lambda pair: (pair[0] == active, pair[1] in kin, pair[0].channel))
    return edit, effect, strip


def visible(edit) -> list:
    """Strips with a picture under the playhead, not muted, of the edit or of the meta strip that is open."""
    editor, frame = edit and edit.sequence_editor, edit and edit.frame_current
    if not editor:
        return []
    level = editor.meta_stack[-1] if editor.meta_stack else editor
    return [
        strip
        for strip in level.strips
        if strip.left_handle <= frame < strip.right_handle
        and strip.type != "SOUND"
        and not strip.mute
        and not level.channels[strip.channel].mute
    ]


def why_unseen(edit, strip) -> str:
    """Why nothing of an effect strip is in the picture, and what to do, as a sentence."""
    if not strip.left_handle <= edit.frame_current < strip.right_handle:
        return rpt_("Move the playhead onto the Shutter strip")
    if strip.mute or (strip.parent_meta() or edit.sequence_editor).channels[strip.channel].mute:
        return rpt_("Unmute the Shutter strip")
    return rpt_("Open the meta strip that the Shutter strip is in")


def _effects_of(edit, strip) -> list:
    """The effects of the source that a strip is, or whose effect it shows."""
    if strip is None:
        return []
    own = effect_of(edit, strip.scene) if strip.type == "SCENE" and strip.scene else None
    identity = own.source if own else strip.virtual_shutter_source
    return [effect for effect in edit.virtual_shutter.effects if effect == own or effect.source == identity != ""]


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
