"""The script that a second Blender runs to decode movies where PyAV is missing (media/blender_movie.py).

That Blender does not load the extension. The script reads questions on stdin and answers on stdout. A question is a
line of JSON: `number` identifies a movie, `path` and `deinterlace` say how to open it, and `wanted` is "about", "close"
or a frame's index. A file may be open several times under different numbers.

An answer begins with a line: a mark, which is the script's last argument, and JSON. The JSON's `bytes` says how many
bytes of a frame follow. The mark tells answers from what Blender prints.
"""

import contextlib
import json
import os
import sys

import bpy
import numpy as np


class Movie:
    """A movie file that Blender decodes, opened as an image data-block."""

    def __init__(self, path: str, deinterlace: bool) -> None:
        self._path = path
        self._image = bpy.data.images.load(path)
        self._image.use_deinterlace = deinterlace
        self._image.colorspace_settings.is_data = True  # otherwise Blender converts deep samples to light
        # An image has the pixels of the frame that was evaluated last, and a texture can set that frame.
        self._look = bpy.data.textures.new("look", "IMAGE")
        self._look.image = self._image

    def close(self) -> None:
        bpy.data.textures.remove(self._look)
        bpy.data.images.remove(self._image)

    def about(self) -> dict:
        """Return what is known of the movie.

        Returns:
            By name: "size" (width and height in pixels), "count" (number of frames), "fps" (frame rate), and whether it
            has "alpha", "deep" samples (more than 8 bits) and "audio".

        Raises:
            RuntimeError: The file is no movie that Blender can decode.
        """
        if self._image.source != "MOVIE":
            raise RuntimeError("Blender knows no such movie")
        frame = self.frame(0)
        strips = bpy.context.scene.sequence_editor_create().strips
        strip, sound = strips.new_movie("movie", self._path, 1, 1), bpy.data.sounds.load(self._path)
        try:
            return {
                "size": tuple(self._image.size),
                "count": strip.content_duration,
                "fps": strip.elements[0].orig_fps,
                "alpha": self._image.depth in (32, 128),
                "deep": frame.dtype == np.uint16,
                "audio": sound.channels != "INVALID",
            }
        finally:
            strips.remove(strip)
            bpy.data.sounds.remove(sound)

    def frame(self, index: int) -> np.ndarray:
        """Return a frame as RGBA (H, W, 4), top row first: uint8, or uint16 for more than 8 bits per sample.

        Args:
            index: The frame's number, from 0.

        Raises:
            RuntimeError: Blender cannot decode it.
        """
        self._look.image_user.frame_current = index + 1
        self._look.evaluate((0, 0, 0))
        width, height = self._image.size
        if not self._image.has_data or not width * height:
            raise RuntimeError("Blender cannot decode it")
        samples = np.empty((height, width, 4), np.float32)
        self._image.pixels.foreach_get(samples.reshape(-1))
        if not self._image.is_float:
            levels = np.empty(samples.shape, np.uint8)
            # Level b is b / 255. Half a level more makes sure that truncation gives b.
            return np.multiply(samples[::-1], np.float32(255.5), out=levels, casting="unsafe")
        np.nan_to_num(samples, copy=False)
        return np.rint(samples[::-1].clip(0, 1) * 65535).astype(np.uint16)


def _answer(
    movies: dict[int, Movie], wanted: str | int, number: int, path: str, deinterlace: bool
) -> tuple[dict, np.ndarray | None]:
    """Do what a question asks. A movie that is not open yet is opened. One that fails is closed.

    Args:
        movies: The open movies by their numbers. Entries are added and removed.
        wanted: What to do: "about" (describe the movie), "close", or a frame's index from 0.
        number: The movie's number, which the asking process has chosen.
        path: The movie's file.
        deinterlace: Whether Blender deinterlaces the movie.

    Returns:
        The dictionary to answer as JSON, and a frame. The dictionary has the movie's data for "about", is empty for
        "close", has "shape" and "dtype" of a frame, or only "error", a message. The frame is None unless one was asked
        for and read.
    """
    try:
        if wanted == "close":
            _close(movies, number)
            return {}, None
        if number not in movies:
            movies[number] = Movie(path, deinterlace)
        if wanted == "about":
            return movies[number].about(), None
        frame = movies[number].frame(int(wanted))
        return {"shape": frame.shape, "dtype": frame.dtype.name}, frame
    except (RuntimeError, MemoryError) as error:
        _close(movies, number)
        return {"error": " ".join(str(error).split()) or "there is no memory for it"}, None


def _close(movies: dict[int, Movie], number: int) -> None:
    if movie := movies.pop(number, None):
        movie.close()


def main() -> None:
    """Answer questions from stdin until it closes."""
    # Nothing else that Blender prints may be taken for an answer.
    questions, answers = (os.fdopen(os.dup(number), mode) for number, mode in ((0, "rb"), (1, "wb")))
    os.dup2(os.open(os.devnull, os.O_RDWR), 1)
    if sys.platform == "win32":
        import msvcrt

        for stream in (questions, answers):
            msvcrt.setmode(stream.fileno(), os.O_BINARY)
    bpy.context.preferences.system.memory_cache_limit = 1  # megabyte, so that only the last frame is cached
    movies: dict[int, Movie] = {}
    answers.write(b"\n")  # Blender may have left a line open
    while line := questions.readline():
        said, frame = _answer(movies, **json.loads(line))
        said["bytes"] = 0 if frame is None else frame.nbytes
        answers.write(f"{sys.argv[-1]}{json.dumps(said)}\n".encode())
        if frame is not None:
            answers.write(frame.data)
        answers.flush()


if __name__ == "__main__":
    with contextlib.suppress(BrokenPipeError):  # the asking process has ended
        main()
