"""Features that Virtual Shutter works without, and how the rest of the extension finds what they offer.

Each is a folder: its algorithm, and in the folder `blender` what uses bpy. To remove one, delete its folder and its
name in FEATURES. Modules in `blender` register as those of the package `blender` do. Commands are named …_command.

The rest looks up these names in their modules (`each`, `call`, `needed`):

- `SmoothSource`, `steps_for`, `CarriedFile`, `MarkedSubject`, `still_mask`: sources of frames and mattes.
- `want_matte`, `next_needed`: mattes that previews miss, and the frame that needs a drawing.
- `smooth_request`, `advance_smooth`, `rest_smooth`: smooth pictures of previews.
- `note_streaks`, `note_tracking`: notes in previews; `notes`: notes in the panel.
- `draw_new`, `draw_smooth`, `draw_tracking`, `draw_tracked`, `tracking_icon`: parts of panels.
- `after_stroke`: called when the pen goes up.
- `forget`: called before another file is loaded; `forget_pictures`: called when the devices are freed.
"""

from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType
from typing import Any

from ..core.messages import EffectError

FEATURES = (
    "smooth",
    "outlines",
    "masks",
    "tracking",
    "rolling_shutter",
    "bake",
    "farm",
)


@cache
def modules() -> list[ModuleType]:
    """Import all modules of all features, once, and return them."""
    found = []
    for folder in [import_module(f".{name}{part}", __package__) for name in FEATURES for part in ("", ".blender")]:
        found += [import_module(f".{module.name}", folder.__name__) for module in iter_modules(folder.__path__)]
    return found


def each(name: str) -> Iterator[Any]:
    """Yield the attribute `name` of each module, in any feature, that has such an attribute."""
    return (getattr(module, name) for module in modules() if hasattr(module, name))


def call(name: str, *arguments: Any) -> None:
    """Call the function `name` in each module, in any feature, that has such a function."""
    for function in each(name):
        function(*arguments)


def needed(name: str) -> Any:
    """Return an attribute, such as a class or function, of the first module of any feature that has it.

    The extension uses this to reach a feature that may have been removed.

    Args:
        name: The attribute's name.

    Raises:
        EffectError: No module has it, because its feature was removed.
    """
    for found in each(name):
        return found
    raise EffectError(f"this Virtual Shutter was built without {name}")
