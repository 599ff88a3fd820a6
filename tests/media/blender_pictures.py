"""What Blender itself shows for media files: `blender(jobs)` renders their plain strips in one Blender session.

Run as a script (by `blender` below, in a process of its own) it reads the jobs and writes the pictures.
"""

import json
import subprocess
import sys
from pathlib import Path

from OpenImageIO import FLOAT, ImageBuf


def blender(folder, jobs):
    """Renders frames of plain strips. jobs: {name: {"files": [...], "frames": [index, ...]} and, when wanted,
    "colorspace", "alpha_mode", "deinterlace", "depth": "16"}; a movie has one file and "movie": True.

    Returns {name: {"count", "size": (width, height), "pictures": {index: array}}}; the arrays are (height, width, 4),
    display values 0…1 with associated alpha, top row first.
    """
    folder = Path(folder)
    (folder / "jobs.json").write_text(json.dumps(jobs))
    subprocess.run([sys.executable, __file__, str(folder)], check=True, capture_output=True, text=True)
    results = json.loads((folder / "results.json").read_text())
    for name, result in results.items():
        files = {index: folder / f"{name}_{index}.png" for index in jobs[name]["frames"]}
        # OpenImageIO associates a PNG's alpha
        result["pictures"] = {i: ImageBuf(str(file)).get_pixels(FLOAT) for i, file in files.items()}
    return results


def _render(folder):
    import bpy

    jobs = json.loads((folder / "jobs.json").read_text())
    results = {}
    scene = bpy.context.scene  # a render of any other scene ignores its current frame
    strips = scene.sequence_editor_create().strips
    for name, job in jobs.items():
        if job.get("movie"):
            strip = strips.new_movie(name, job["files"][0], 1, 1)
            strip.use_deinterlace = job.get("deinterlace", False)
        else:
            strip = strips.new_image(name, job["files"][0], 1, 1)
            for file in job["files"][1:]:
                strip.elements.append(Path(file).name)
        strip.blend_type = "REPLACE"
        if "colorspace" in job:
            strip.colorspace_settings.name = job["colorspace"]
        if "alpha_mode" in job:
            strip.alpha_mode = job["alpha_mode"]
        size = strip.elements[0].orig_width, strip.elements[0].orig_height
        render, settings = scene.render, scene.render.image_settings
        (render.resolution_x, render.resolution_y), render.resolution_percentage = size, 100
        scene.view_settings.view_transform, render.dither_intensity = "Standard", 0
        settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGBA", job.get("depth", "8")
        for index in job["frames"]:
            scene.frame_set(index + 1)
            scene.render.filepath = str(folder / f"{name}_{index}.png")
            bpy.ops.render.render(write_still=True, scene=scene.name)
        results[name] = {"count": strip.content_duration, "size": size}
        strips.remove(strip)
    (folder / "results.json").write_text(json.dumps(results))


if __name__ == "__main__":
    _render(Path(sys.argv[1]))
