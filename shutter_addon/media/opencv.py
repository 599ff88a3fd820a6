"""OpenCV, which a package without wheels lacks; the extension registers without it."""

from .errors import MediaError

try:
    import cv2
except ImportError:
    cv2 = None

__all__ = ["check", "cv2"]


def check(what: str, module: str = "") -> None:
    """MediaError: OpenCV is missing, or its contributed module of that name: another add-on may bring one without.

    what: the sentence's beginning, as "tracking needs"."""
    if cv2 is None or (module and not hasattr(cv2, module)):
        raise MediaError(
            f"{what} the Python package opencv-contrib-python-headless; "
            "install the zip of Virtual Shutter that is made for your system"
        )
