"""Items of an effect's collections: removed or moved together with their F-curves."""

from bpy.app.translations import pgettext_rpt as rpt_

from ...core.model import limits
from ..data import fcurves


def why_full(effect, collection: str, more: int = 1) -> str | None:
    """Why an effect cannot have so many more of its "shutters" or "regions", in a sentence; None if it can."""
    most, sentence = {
        "shutters": (limits.MAX_SHUTTERS, rpt_("An effect has {most} shutters at most")),
        "regions": (limits.MAX_REGIONS, rpt_("An effect has {most} regions at most")),
    }[collection]
    return sentence.format(most=most) if len(getattr(effect, collection)) + more > most else None


def remove(effect, collection: str, index: int) -> None:
    items, path = getattr(effect, collection), f"{effect.path_from_id()}.{collection}"
    places = {index: None} | {i: i - 1 for i in range(index + 1, len(items))}
    items.remove(index)
    fcurves.reindex(effect.id_data, path, places)


def move(effect, collection: str, index: int, to: int) -> None:
    items, path = getattr(effect, collection), f"{effect.path_from_id()}.{collection}"
    order = list(range(len(items)))
    order.insert(to, order.pop(index))
    items.move(index, to)
    fcurves.reindex(effect.id_data, path, {old: new for new, old in enumerate(order)})
