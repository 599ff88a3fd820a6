"""Pictures of the screen and of files, and how far they are apart."""

import numpy as np
import OpenImageIO

TOLERANCE = 2


def pixels(path, box=None):
    """8-bit RGB of a picture file, or of its box of left, top, right, bottom."""
    image = OpenImageIO.ImageBuf(str(path)).get_pixels(OpenImageIO.UINT8)[..., :3].astype(int)
    left, top, right, bottom = box or (0, 0, image.shape[1], image.shape[0])
    return image[top:bottom, left:right]


def assert_alike(picture, expected, keep, tolerance=TOLERANCE):
    """Within the tolerance; otherwise the amplified difference is kept."""
    assert picture.shape == expected.shape
    apart = np.abs(picture - expected)
    if apart.max() > tolerance:
        image = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(*apart.shape[1::-1], 3, "uint8"))
        image.set_pixels(OpenImageIO.ROI(), np.minimum(apart * 20, 255).astype(np.uint8))
        image.write(str(keep))
    assert apart.max() <= tolerance, f"{apart.max()} levels apart, {(apart > tolerance).mean():.2%}; see {keep}"


def crop(folder, entry):
    left, top, width, height = entry["crop"]
    return pixels(folder / f"{entry['step']}.png", (left, top, left + width, top + height))


def means(picture):
    """Means of 8 × 8 pixels: a codec hardly touches them, nor does how a picture is enlarged."""
    height, width = (length // 8 for length in picture.shape[:2])
    return picture[: height * 8, : width * 8].reshape(height, 8, width, 8, 3).mean(axis=(1, 3), dtype=np.float32)


def apart_on_screen(screen, frame):
    """By how many levels the middle of a frame differs at most from where a screen shows it, pixel for pixel."""
    import cv2

    height, width = frame.shape[:2]
    middle = frame[height // 4 : 3 * height // 4, width // 4 : 3 * width // 4].astype(np.uint8)
    near = cv2.matchTemplate(screen.astype(np.uint8), middle, cv2.TM_SQDIFF)
    top, left = np.unravel_index(near.argmin(), near.shape)
    shown = screen[top : top + middle.shape[0], left : left + middle.shape[1]]
    return np.abs(shown - middle).max()
