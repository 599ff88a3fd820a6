"""Saved edits: a .blend file's active scene, as Blender itself would render it."""

from pathlib import Path

import bpy
from bpy.types import Scene

from ...core.messages import UserError, sentence
from ..data import requirements
from ..output import film_output

ENDING = ".blend"


class SavedEditError(UserError, ValueError):
    """This file is no edit that can be rendered; the message is one sentence for the user."""


def is_saved(path: Path) -> bool:
    """Whether the path's name is that of a saved edit."""
    return path.suffix.lower() == ENDING


def open_edit(path: Path, name: str | None = None) -> Scene:
    """Opens a .blend file, none of whose scripts is run: it may be a stranger's. Its scene of that name; None: the
    active one, which Blender would render. SavedEditError: it cannot be opened, or shows no edit."""
    if not path.is_file():
        raise SavedEditError(f"{path}: " + ("is no file" if path.exists() else "no such file"))
    try:
        with film_output.quiet():
            # With its windows, as `blender -b` does: load_ui=False would hold for all that this process opens after it.
            bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False)
    except RuntimeError as error:
        raise SavedEditError(f"{path}: {film_output.message(error)}") from None
    if name is not None and name not in bpy.data.scenes:
        raise SavedEditError(f'{path}: has no scene "{sentence(name, 40)}"')
    scene = bpy.context.scene if name is None else bpy.data.scenes[name]
    if name is None and not _has_strips(scene):
        others = [other.name for other in bpy.data.scenes if _has_strips(other)]
        where = f'; make "{others[0]}" the active one, and save the file' if others else ""
        raise SavedEditError(f'{path}: its active scene, "{scene.name}", has no strips{where}')
    for setting, wanted in (("use_sequencer", True), ("use_multiview", False)):
        if getattr(scene.render, setting) != wanted:
            name, turn = scene.render.bl_rna.properties[setting].name, "on" if wanted else "off"
            raise SavedEditError(f'{path}: turn "{name}" {turn} in the scene "{scene.name}", and save the file')
    for owner, driver in _scripts(scene) if name is None else ():  # of a scene's effects drivers do not count
        words = f'a driver of the {owner.bl_rna.name.lower()} "{owner.name}" needs scripts, which are not run'
        words += f" ({sentence(driver.expression, 40)}); bake it to keyframes, and save the file"
        raise SavedEditError(f"{path}: {words}")
    return scene


def _scripts(scene: Scene) -> list[tuple]:
    """(owner, driver) of each driver that Blender does not evaluate because it could do anything, of all that the
    edit's pictures are made of."""
    used = requirements.used_data(scene, range(scene.frame_start, scene.frame_end + 1))
    drivers = [(item, curve.driver) for item in used for curve in _driven(item)]
    scripted = ((owner, driver) for owner, driver in drivers if driver.type == "SCRIPTED")
    complex_ones = [(owner, driver) for owner, driver in scripted if not driver.is_simple_expression]
    if complex_ones:  # only once they are evaluated it is known of them
        with film_output.quiet():
            for other in used.intersection(bpy.data.scenes):
                for layer in other.view_layers:
                    layer.update()
    return [(owner, driver) for owner, driver in complex_ones if not driver.is_valid]


def _driven(item: bpy.types.ID) -> list:
    """The driver curves of an ID, and of the nodes that are its own."""
    animations = (getattr(each, "animation_data", None) for each in (item, getattr(item, "node_tree", None)))
    return [curve for animation in animations if animation for curve in animation.drivers]


def _has_strips(scene: Scene) -> bool:
    return bool(scene.sequence_editor and scene.sequence_editor.strips)
