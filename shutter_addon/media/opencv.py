"""OpenCV (`cv2`), or None where it is missing, as in the zip without binary packages."""

from ..core.messages import MediaError

try:
    import cv2
except ImportError:
    cv2 = None

__all__ = ["check", "cv2"]


def check(what: str, module: str = "") -> None:
    """Check that OpenCV can be used and, if named, a contributed module, which another add-on's OpenCV may lack.

    Args:
        what: The beginning of the message, such as "tracking needs".
        module: The name of the contributed module, or "".

    Raises:
        MediaError: One of them is missing.
    """
    if cv2 is None or (module and not hasattr(cv2, module)):
        raise MediaError(
            f"{what} the Python package opencv-contrib-python-headless; "
            "install the zip of Virtual Shutter that is made for your system"
        )
