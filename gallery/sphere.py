"""Figure 3: four shutters, one moving sphere; each shelf shows the same motion through a shutter of its own."""

from math import atan2, floor, pi

import numpy as np
from OpenImageIO import ImageBuf

from . import stills
from .item import Item

COUNT = 96
FRAME = 28
SPEED = 0.14  # units a frame; the picture is 16 wide
RADIUS = 0.78
SHELF = 2.2667  # from one to the next: a fourth of the picture's height
SHUTTERS = ("Still frame", "A later frame", "Two cuts", "Constant")


def footage(folder):
    from . import scenes

    return scenes.complete(folder, COUNT) or repeated(rendered(folder / "shelf"), folder)


def rendered(folder):
    """One shelf, a quarter of the picture's height."""
    import bpy

    from . import scenes

    scenes.begin("#dfe8f0", strength=0.5)
    bpy.context.scene.render.resolution_y = 136
    wood, wall = scenes.paint("#b98a5c", roughness=0.4), scenes.paint("#3f6478", roughness=0.9)
    scenes.box((40, 0.2, 20), (0, 1.6, 0), wall)
    for height in (0, SHELF):  # the upper one only casts its shadow
        scenes.box((40, 2.2, 0.16), (0, 0.6, height - RADIUS - 0.08), wood, bevel=0.03)
    roll(beach_ball())
    scenes.lamp("SUN", 3.2, (-4, -7, 2.6), color="#fff1dd", size=0.08)
    scenes.camera((0, -80, 0.14), (0, 0, 0.14), lens=36 * 79 / 16)
    return scenes.render_frames(folder, COUNT)


def beach_ball():
    """A sphere of six wedges around the axis that it rolls about."""
    from . import scenes

    ball = scenes.ball(RADIUS, (0, 0, 0), scenes.paint("#f4ead8", roughness=0.35))
    ball.data.materials.append(scenes.paint("#e2412e", roughness=0.35))
    for face in ball.data.polygons:
        face.material_index = floor(atan2(face.center.y, face.center.x) / (pi / 3)) % 2
    return ball


def roll(ball) -> None:
    """Keys a ball that rolls to the right without slipping."""
    from . import scenes

    def x(frame):
        return -6.6 + SPEED * (frame - 1)

    scenes.animate(ball, COUNT, location=lambda frame: (x(frame), 0, 0))
    scenes.animate(ball, COUNT, rotation_euler=lambda frame: (pi / 2 - 0.3, x(frame) / RADIUS, 0))


def repeated(first, folder):
    """Frames of four shelves from those of one."""
    for path in sorted(first.parent.glob("*.png")):
        stills.save(np.tile(ImageBuf(str(path)).get_pixels()[..., :3], (4, 1, 1)), folder / path.name)
    return folder / first.name


def still(shot):
    picture = stills.scaled(shot.result(FRAME), 1240)
    height, width = (picture.shape[0] - 3 * 8) // 4, stills.WIDTH - 1240 - stills.GAP
    graphs = [stills.graph(*shot.bars(FRAME, name), width, height, name) for name in SHUTTERS]
    return stills.sheet(
        stills.beside(stills.below(*graphs, gap=8), picture),
        caption="One frame of one film: each shelf is a region with a shutter of its own, over the same 32 frames",
    )


ITEM = Item(
    name="sphere",
    figure=3,
    title="four shutters, one sphere",
    footage=footage,
    recipes=("sphere.json",),
    frames=(1, COUNT - 31),
    still=still,
)
