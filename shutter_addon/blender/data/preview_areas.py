"""Blender's areas that show a preview."""


def previews(context):
    """Window and area of every sequencer that shows a preview."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "SEQUENCE_EDITOR" and area.spaces.active.view_type != "SEQUENCER":
                yield window, area


def redraw(context) -> None:
    """Draws all previews again."""
    for _window, area in previews(context):
        area.tag_redraw()  # of the area alone, Blender's picture and ours


def preview_region(area):
    """The region of a sequencer's area that shows the picture."""
    return next(region for region in area.regions if region.type == "PREVIEW")
