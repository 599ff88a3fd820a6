"""What runs on the extension's own threads (core/threads.py): no function of its part that knows Blender, but those
that were read and found to touch nothing of it; and nowhere a value of Blender's data, nor a call of its modules.

Blender's own threads, which call the engine and handlers, are Blender's to care for."""

import os
import sys
import threading

import bpy
import gpu

_MAIN = threading.main_thread().ident
_EVENTS = sys.monitoring.events
_TOOL = 3  # of sys.monitoring's, one for nobody in particular
_PACKAGE = "shutter_addon"
_OURS = "Virtual Shutter"  # how the names of our threads begin
_DATA = (bpy.types.bpy_struct, bpy.types.bpy_prop_collection, bpy.types.bpy_prop_array)
_MODULES = "bpy", "_bpy", "gpu", "bl_math", "mathutils"
# By files below blender/, that of a feature as well: what runs on our threads, and touches no bpy data.
REVIEWED: dict[str, set[str]] = {
    "data/source_media.py": {"SourceSpec.open"},
    "data/versions.py": {"_digest"},
    "devices/available.py": {"<lambda>", "_tried"},
    "devices/blender_gpu.py": {
        *(f"BlenderDevice.{name}" for name in ("__init__", "_cleared", "freeing", "read", "run", "send", "write")),
        *("BlenderDevice.run.<genexpr>", "_buffer", "_packed"),
    },
    "devices/main_thread.py": {
        *(f"RelayedDevice.{name}" for name in ("__init__", "_dispatch", "_free", "_make", "_read", "_send")),
        *("RelayedDevice.current", "RelayedDevice._wait_for", "RelayedDevice.release", "_called", "ask", "soon"),
    },
    "track_region.py": {"_each", "track.<lambda>"},
    "outline_carrying.py": {"_Carrying._carry"},
    "rendering/effect_source.py": {"_options", "find_steps", "find_steps.find", "steps_key", "steps_of"},
    "rendering/pictures.py": {"_weights"},
    "rendering/render_job.py": {"where"},
    "rendering/session.py": {"RenderSession._ask", "RenderSession.forget.<lambda>", "broken_off"},
    "rendering/sessions.py": {"_ask_window"},
    "strobing.py": {"_measure_motion"},
}

seen: set[str] = set()  # functions that were called on our threads
_faults: dict[str, None] = {}
_reviewed_alone = True


def on(reviewed_alone: bool = True) -> None:
    """From now on, on all threads. reviewed_alone: whether other functions than those of REVIEWED are faults."""
    global _reviewed_alone
    _reviewed_alone, monitoring = reviewed_alone, sys.monitoring
    monitoring.use_tool_id(_TOOL, "thread_guard")
    monitoring.register_callback(_TOOL, _EVENTS.PY_START, _started)
    monitoring.register_callback(_TOOL, _EVENTS.PY_RETURN, _returned)
    monitoring.register_callback(_TOOL, _EVENTS.CALL, _called)
    monitoring.set_events(_TOOL, _EVENTS.PY_START)


def faults() -> list[str]:
    found = list(_faults)
    _faults.clear()
    return found


def _is_ours() -> bool:
    if threading.get_ident() == _MAIN:  # most are called there
        return False
    return threading.current_thread().name.startswith(_OURS)


def _started(code, _offset):
    if (path := _below(code.co_filename)) is None:
        return sys.monitoring.DISABLE
    if _is_ours():
        # Not for all functions: calls and returns on the main thread would double what this costs the tests.
        sys.monitoring.set_local_events(_TOOL, code, _EVENTS.PY_RETURN | _EVENTS.CALL)
        name = code.co_qualname.replace(".<locals>", "")
        seen.add(f"{path}: {name}")
        _feature, room, file = f"/{path}".rpartition("/blender/")
        if _reviewed_alone and room and name not in REVIEWED.get(file, ()):
            _faults[f"{path}: {name} runs on a thread"] = None
        _look(code, sys._getframe(1).f_locals)
    return None


def _returned(code, _offset, _value):
    if _is_ours():
        _look(code, sys._getframe(1).f_locals)


def _called(code, _offset, function, _argument):
    if _is_ours() and _is_blenders(function):
        _fault(code, f"calls {function}")


def _is_blenders(function) -> bool:
    owner = getattr(function, "__self__", None)
    if function is gpu.types.Buffer or owner is gpu.platform or owner is gpu.capabilities:
        return False  # which hold memory of their own, and tell what never changes
    module = str(getattr(function, "__module__", None)).split(".")[0]
    name = str(getattr(function, "__name__", ""))
    is_method = isinstance(owner, _DATA) or type(function).__name__ == "bpy_func" or name.startswith("pgettext")
    return is_method or module in _MODULES or any(function is kind for kind in vars(gpu.types).values())


_known: dict[str, str | None] = {}


def _below(file: str) -> str | None:
    if file not in _known:
        _before, package, below = file.replace(os.sep, "/").rpartition(f"/{_PACKAGE}/")
        _known[file] = below if package else None
    return _known[file]


def _look(code, variables) -> None:
    for name, value in variables.items():
        held = getattr(value, "__dict__", None)
        for each in (value, *(held.values() if type(held) is dict else ())):
            if isinstance(each, _DATA):
                _fault(code, f"has {name}, {type(each)},")


def _fault(code, words: str) -> None:
    _faults[f"{_below(code.co_filename)}: {code.co_qualname} {words} on a thread"] = None
