"""Items of an effect's collections: removed or moved together with their F-curves."""

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup

from ...core.model import limits
from ..data import fcurves


def why_full(effect: PropertyGroup, *, regions: int = 0, shutters: int = 0) -> str | None:
    """Why an effect cannot have so many more regions and shutters, in a sentence; None if it can."""
    if regions and len(effect.regions) + regions > limits.MAX_REGIONS:
        return rpt_("An effect has {most} regions at most").format(most=limits.MAX_REGIONS)
    if shutters and len(effect.shutters) + shutters > limits.MAX_SHUTTERS:
        return rpt_("An effect has {most} shutters at most").format(most=limits.MAX_SHUTTERS)
    return None


def remove(effect: PropertyGroup, collection: str, index: int) -> None:
    items, path = getattr(effect, collection), f"{effect.path_from_id()}.{collection}"
    places = {index: None} | {i: i - 1 for i in range(index + 1, len(items))}
    items.remove(index)
    fcurves.reindex(effect.id_data, path, places)


def move(effect: PropertyGroup, collection: str, index: int, to: int) -> None:
    items, path = getattr(effect, collection), f"{effect.path_from_id()}.{collection}"
    order = list(range(len(items)))
    order.insert(to, order.pop(index))
    items.move(index, to)
    fcurves.reindex(effect.id_data, path, {old: new for new, old in enumerate(order)})
