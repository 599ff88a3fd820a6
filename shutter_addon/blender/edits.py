"""Whole edits made from nothing: a source strip, its effect, and where the film goes."""

import os
from pathlib import Path

import bpy

from . import effects, strips


class OutputError(ValueError):
    """This cannot be written; the message is one sentence for the user."""


# Ending: container, codec, audio codec (Blender's names).
MOVIES = {
    ".mp4": ("MPEG4", "H264", "AAC"),
    ".mov": ("QUICKTIME", "H264", "AAC"),
    ".mkv": ("MKV", "H264", "AAC"),
    ".webm": ("WEBM", "WEBM", "OPUS"),
    ".avi": ("AVI", "MPEG4", "MP3"),
}
FORMATS = ("png", "exr")


def make_edit(path: Path, medium, source_recipe):
    """An edit of one source strip (an opened medium's) under one effect strip; its scene and the strips."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    edit = bpy.context.scene
    edit.name = "Edit"
    render = edit.render
    if medium.fps:
        render.fps = max(1, round(medium.fps))
        render.fps_base = render.fps / float(medium.fps)
    render.resolution_x, render.resolution_y = medium.width, medium.height
    render.resolution_percentage = 100
    # Dither would add noise to a still frame; Standard shows code values as the source has them.
    render.dither_intensity = 0
    edit.view_settings.view_transform = "Standard"
    source = _add_source(edit.sequence_editor_create(), path, medium)
    strip, effect = strips.add_effect(edit, source)
    effects.apply(edit, effect, strip, source_recipe)
    edit.frame_start, edit.frame_end = strip.left_handle, strip.right_handle - 1
    edit.frame_current = edit.frame_start
    return edit, source, strip


def _add_source(editor, path: Path, medium):
    name = path.name
    if getattr(medium, "files", None) is None:
        strip = editor.strips.new_movie(name, str(path), 1, 1)
        if medium.has_audio:
            editor.strips.new_sound(f"{name} Sound", str(path), 3, 1)
        return strip
    strip = editor.strips.new_image(name, str(medium.files[0]), 1, 1)
    for file in medium.files[1:]:
        strip.elements.append(file.name)
    return strip


def set_output(edit, path: Path, file_format: str) -> None:
    """Where and how the edit's render goes: a movie by its ending, else a folder of pictures named by frame."""
    settings, render = edit.render.image_settings, edit.render
    if is_movie(path):
        container, codec, audio = MOVIES[path.suffix.lower()]
        settings.media_type = "VIDEO"
        settings.color_mode = "RGB"
        render.ffmpeg.format, render.ffmpeg.codec = container, codec
        render.ffmpeg.audio_codec = audio if _has_sound(edit) else "NONE"
        render.ffmpeg.constant_rate_factor = "HIGH"
        render.use_file_extension = False
        render.filepath = str(path)
        return
    settings.file_format = {"png": "PNG", "exr": "OPEN_EXR"}[file_format]
    settings.color_mode = "RGBA" if _has_alpha(edit) else "RGB"
    settings.color_depth = {"png": "16", "exr": "32"}[file_format]
    render.use_file_extension = True
    render.filepath = str(path) + os.sep


def is_movie(path: Path) -> bool:
    return path.suffix.lower() in MOVIES


def check_output(path: Path, file_format: str | None, size) -> None:
    """OutputError: Blender cannot write this film there."""
    width, height = size
    if width < 4 or height < 4:
        raise OutputError(f"the source has {width}×{height} pixels; Blender renders no picture smaller than 4×4")
    if not is_movie(path):
        if path.suffix and not path.is_dir() and file_format is None:
            raise OutputError(f"{path}: neither a folder nor one of {', '.join(MOVIES)}")
        return
    if file_format is not None:
        raise OutputError(f"{path}: --format is for a folder of pictures, not for a movie")
    if width % 2 or height % 2:
        raise OutputError(f"{path}: a movie has even sizes, not {width}×{height}; render to a folder of pictures")


def _has_sound(edit) -> bool:
    return any(strip.type == "SOUND" for strip in edit.sequence_editor.strips_all)


def _has_alpha(edit) -> bool:
    return any(strip.type in strips.SOURCES and strip.get("alpha", False) for strip in edit.sequence_editor.strips_all)
