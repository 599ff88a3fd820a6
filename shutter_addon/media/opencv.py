"""OpenCV, which is missing in a package without wheels."""

from ..core.messages import MediaError

try:
    import cv2
except ImportError:
    cv2 = None

__all__ = ["check", "cv2"]


def check(what: str, module: str = "") -> None:
    """Raise MediaError if OpenCV, or one of its contributed modules, is missing.

    Another add-on may bring an OpenCV without these modules.

    Args:
        what: the beginning of the message, such as "tracking needs"
        module: the name of the contributed module
    """
    if cv2 is None or (module and not hasattr(cv2, module)):
        raise MediaError(
            f"{what} the Python package opencv-contrib-python-headless; "
            "install the zip of Virtual Shutter that is made for your system"
        )
