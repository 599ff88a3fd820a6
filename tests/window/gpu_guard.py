"""Ends Blender where its GPU is called while it is not current: that may be a segmentation fault, and may go well.

What Python frees is not seen here."""

import os
import sys
import traceback

import gpu

EXIT_CODE = 97
_ANYWHERE = (gpu.types.Buffer, gpu.types.GPUShaderCreateInfo, gpu.types.GPUStageInterfaceInfo)


def is_current() -> bool:
    try:
        gpu.types.GPUTexture((1, 1))
    except RuntimeError:
        return False
    return True


def on() -> None:
    """From now on, on this thread."""
    sys.setprofile(_look)


def _look(frame, event, function) -> None:
    if event == "c_call" and _needs_context(function) and not is_current():
        sys.setprofile(None)
        print(f"{function} was called while Blender's GPU is not current:", file=sys.stderr)
        traceback.print_stack(frame, file=sys.stderr)
        sys.stderr.flush()
        os._exit(EXIT_CODE)


def _needs_context(function) -> bool:
    owner = getattr(function, "__self__", None)
    if isinstance(owner, _ANYWHERE):
        return False
    if isinstance(owner, (gpu.types.GPUShader, gpu.types.GPUBatch)):
        return True
    return any(owner is module for module in (gpu.compute, gpu.shader))
