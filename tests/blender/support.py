"""Pictures and recipes for the tests of the Blender layer."""

import dataclasses
import json
import os
import subprocess
import sys
import wave
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import OpenImageIO

ROOT = Path(__file__).parents[2]
EXTENSION = "bl_ext.user_default.virtual_shutter"  # its id where the checkout is linked


def read_picture(path):
    """A picture file's samples as float64; whole-number formats in 8-bit levels, straight alpha."""
    wishes = OpenImageIO.ImageSpec()
    wishes.attribute("oiio:UnassociatedAlpha", 1)
    image = OpenImageIO.ImageInput.open(str(path), wishes)
    spec = image.spec()
    kind = str(spec.format)
    pixels = image.read_image(kind).astype(np.float64)
    image.close()
    return pixels.reshape(spec.height, spec.width, -1) * {"uint8": 1, "uint16": 255 / 65535}.get(kind, 1)


def write_frames(folder, frames, name="f"):
    """Frames (n, H, W, C) uint8 or uint16 as PNG files; the first one's path."""
    folder.mkdir(parents=True, exist_ok=True)
    for i, frame in enumerate(frames, start=1):
        height, width, channels = frame.shape
        spec = OpenImageIO.ImageSpec(width, height, channels, str(frame.dtype))
        spec.attribute("oiio:UnassociatedAlpha", 1)
        output = OpenImageIO.ImageOutput.create("png")
        output.open(str(folder / f"{name}{i:04d}.png"), spec)
        output.write_image(np.ascontiguousarray(frame))
        output.close()
    return folder / f"{name}0001.png"


def write_movie(path, frames, codec="ffv1", pixels="bgr0", rate=24, options=None, tone=None):
    """Frames (n, H, W, 3) uint8 as a movie, with a tone of 16-bit samples at 48 kHz if there is one; its path."""
    import av  # which a Blender that runs the other functions may lack

    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate, options=options)
        stream.height, stream.width = frames[0].shape[:2]
        stream.pix_fmt = pixels
        heard = container.add_stream("pcm_s16le", rate=48000, layout="mono") if tone is not None else None
        for frame in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
        container.mux(stream.encode())
        if heard:
            sound = av.AudioFrame.from_ndarray(np.asarray(tone, np.int16)[None], format="s16", layout="mono")
            sound.sample_rate, sound.pts = 48000, 0
            container.mux([*heard.encode(sound), *heard.encode()])
    return path


def write_tone(path, samples=(0,) * 4800):
    """A sound of these 16-bit samples at 48 kHz."""
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, 48000, 0, "NONE", ""))
        file.writeframes(np.asarray(samples, "<i2").tobytes())


def refused(done, *words):
    """Asserts that a command ended with code 2 and one sentence with these words. It is exit code and stderr, or a
    process that has ended."""
    code, said = done if isinstance(done, tuple) else (done.returncode, done.stderr)
    lines = [line for line in said.strip().splitlines() if not line.startswith("libpng error")]
    assert (code, len(lines)) == (2, 1), said
    assert lines[0].startswith("Virtual Shutter: ")
    assert len(lines[0]) <= 300
    for word in words:
        assert word.lower() in lines[0].lower()  # the system says "No space left", we say "no space left"


def noise(*shape, seed=0):
    """Random bytes, mostly frames (n, H, W, C)."""
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


def flip_bit(path):
    """Changes one bit in the midst of a file."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def recipe(window, *shutters, regions=(), **options):
    """A recipe as a dictionary; shutters: bars, or a list of (frame, bars) keys."""
    entries = []
    for i, bars in enumerate(shutters):
        entry = {"name": f"S{i}"}
        if isinstance(bars, dict):
            entry["keys"] = [{"frame": frame, "bars": list(b)} for frame, b in bars.items()]
        else:
            entry["bars"] = [float(b) for b in bars]
        entries.append(entry)
    return {"version": 2, "window": window, "shutters": entries, "regions": list(regions), **options}


LASSO = {"name": "Face", "shutter": "S1", "kind": "lasso", "strokes": [[[0.1, 0.1], [0.9, 0.1], [0.5, 0.9]]]}
MOVED = LASSO | {"keys": [{"frame": 1}, {"frame": 9, "location": [0.2, 0.1], "ease": "bezier"}]}
# Keyed bars, and a region that moves.
KEYED = recipe(4, {1: [1, 0, 0, 0], 9: [0, 0, 0, 1]}, [1, 1, 1, 1], regions=[MOVED])


def image_strip(edit, first, start=1, channel=1, name="images"):
    """A strip of all pictures in the folder of the first one."""
    strip = edit.sequence_editor.strips.new_image(name, str(first), channel, start)
    for path in sorted(first.parent.iterdir())[1:]:
        strip.elements.append(path.name)
    return strip


def effect_of(edit, source, data):
    """Puts an effect of a recipe (a dictionary) on a strip; the effect's strip, and the effect."""
    from shutter_addon.blender.data import recipe_import
    from shutter_addon.blender.editing import add_effect
    from shutter_addon.core.recipes import recipe_file

    strip, effect = add_effect.add_effect(edit, source)
    recipe_import.apply(edit, effect, strip, recipe_file.parse(json.dumps(data)))
    return strip, effect


def started(edit, source, chosen=False):
    """Puts an effect on a strip as the button makes it, but not smooth; the effect's strip, and the effect."""
    from shutter_addon.blender.data import selection
    from shutter_addon.blender.editing import add_effect, shutter_edits

    strip, effect = add_effect.add_effect(edit, source)
    shutter_edits.start(effect)
    effect.inbetween = "1"
    if chosen:
        selection.choose(edit, strip)
    return strip, effect


def noise_film(edit, frames, folder):
    """Frames (n, H, W, C) as the edit's source, under an effect of two shutters: source, effect and strip."""
    from shutter_addon.blender.rendering import sessions

    sessions.forget()
    height, width = frames.shape[1:3]
    source = image_strip(edit, write_frames(folder / "in", frames))
    edit.render.resolution_x, edit.render.resolution_y = width, height
    edit.frame_start, edit.frame_end = 1, len(frames)
    edit.sequence_editor.use_cache_raw = edit.sequence_editor.use_cache_final = False
    line = {"shutter": "S1", "kind": "line", "width": 0.1, "strokes": [[[0.2, 0.2], [0.3, 0.8]]]}
    data = recipe(4, [1, 1, 1, 1], [0, 0, 1, 0], regions=[line], border=True)
    strip, effect = effect_of(edit, source, data)
    return source, effect, strip


@contextmanager
def sequencer(bpy):
    """The context of a sequencer: the operators of its menus ask for one. Gives its area."""
    window = bpy.data.window_managers[0].windows[0]
    window.workspace.sequencer_scene = bpy.context.scene
    area = window.screen.areas[0]
    area.type = "SEQUENCE_EDITOR"
    with bpy.context.temp_override(window=window, area=area):
        yield area


def in_sequencer(bpy, operator, **words):
    """Calls an operator of Blender's sequencer, as its keys do."""
    with sequencer(bpy) as area, bpy.context.temp_override(region=area.regions[-1]):
        assert operator(**words) == {"FINISHED"}
    bpy.context.view_layer.update()


def copy_all(bpy):
    """Selects the edit's strips and copies them."""
    for strip in bpy.context.scene.sequence_editor.strips:
        strip.select = True
    in_sequencer(bpy, bpy.ops.sequencer.copy)


def call(bpy, name, *arguments, **settings):
    """Calls an operator as a menu does, with its step of undo."""
    return getattr(bpy.ops.shutter, name)("EXEC_DEFAULT", True, *arguments, **settings)


def does(bpy, seen, name, **settings):
    """Calls an operator, which changes what `seen` gives; undone and done again, nothing else than that."""
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="before")
    before = seen(bpy)
    assert call(bpy, name, **settings) == {"FINISHED"}
    after = seen(bpy)
    assert after != before
    bpy.ops.ed.undo()
    assert seen(bpy) == before
    bpy.ops.ed.redo()
    assert seen(bpy) == after


def state(edit, effect, strip, frame):
    """The effect at a timeline frame, as its pictures are made with it."""
    from bpy.app.translations import pgettext_rpt

    from shutter_addon.blender.data import snapshot
    from shutter_addon.core.messages import translated

    with translated(pgettext_rpt):
        return snapshot.read(edit, effect, strip, (frame,)).at(frame)


def source_time(edit, effect, frame):
    """Source frame, and whether it runs backward."""
    from shutter_addon.blender.data import snapshot, strips

    return snapshot.read(*strips.find_effect(effect.scene), (frame,)).time.at(frame)


def picture_of(scene, scene_frame, say=print, stopped=lambda: False):
    """The picture of an effect scene, as the engine gives it to Blender."""
    from shutter_addon.blender.rendering import job_snapshots, pictures, sessions
    from shutter_addon.core import stopping

    with stopping.once(stopped):
        return pictures.picture(sessions.of_engine(say), *job_snapshots.of(scene, scene_frame))


def request(edit, effect, strip, frame):
    """What is asked of the session for the picture at a timeline frame, and what it gives."""
    from shutter_addon.blender.data import snapshot
    from shutter_addon.blender.rendering import sessions

    context = sessions.of_drawing()
    return Asked(context, context.request(snapshot.take(edit, effect, strip, (frame,)), frame))


class Asked:
    """A request in a context, with what is made of it."""

    def __init__(self, context, request):
        self.context, self.session = context, context.session
        self.request, self.renderer = request, context.renderer(request)
        self.state, self.index, self.direction = request.state, request.index, request.direction

    def with_state(self, state):
        return Asked(self.context, dataclasses.replace(self.request, state=state))

    def picture(self):
        return self.session.picture(self.request)

    def coefficients(self):
        return self.session.run(self.renderer.coefficients, self.request)


def python(*arguments, **environment):
    """A Python of its own, with more in its environment, that has ended."""
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )


def packages(folder, blenders_python):
    """A folder, for PYTHONPATH, of what smooth effects need besides what the Blender of a distribution has."""
    import cv2
    import pytest

    here = f"{sys.version_info.major}.{sys.version_info.minor}"
    if blenders_python != here:
        pytest.skip(f"OTHER PYTHON: this one's packages are for {here}, Blender's is {blenders_python}")
    folder.mkdir()
    site = Path(cv2.__file__).parents[1]
    for name in ("cv2", *(each.name for each in site.glob("opencv*.libs"))):
        (folder / name).symlink_to(site / name)
    return folder


@contextmanager
def small_disk(folder, size):
    """A folder on a disk of that many bytes."""
    folder.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)], check=True)
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)  # a worker may still read there


class Like:
    """An item of Blender's data that has some attributes of its own."""

    def __init__(self, item, **own):
        self.item = item
        vars(self).update(own)

    def __getattr__(self, name):
        return getattr(self.item, name)


def remembering(key):
    """The names of the extension's modules that have a key in a dictionary, in whatever variable. What a module keeps
    of things that are gone shows nowhere else."""
    modules = [module for name, module in sys.modules.items() if name.startswith("shutter_addon.") and module]
    return {module.__name__.rpartition(".")[2] for module in modules if _has(vars(module), key, set())}


def _has(value, key, seen: set) -> bool:
    if id(value) in seen:
        return False
    seen.add(id(value))
    if isinstance(value, dict):
        return key in value or any(_has(part, key, seen) for pair in value.copy().items() for part in pair)
    if isinstance(value, list | tuple | set | frozenset):
        return any(_has(part, key, seen) for part in tuple(value))
    is_ours = type(value).__module__.startswith("shutter_addon.")
    return is_ours and hasattr(value, "__dict__") and _has(vars(value), key, seen)
