"""Rendered footage: scenes built from nothing in Blender's units, and their frames on disk. Needs bpy.

Colors are written as `#rrggbb` of sRGB. Frames count from 1.
"""

from __future__ import annotations

from math import atan2, hypot
from pathlib import Path

import bpy  # which brings the next two

# isort: split
import bmesh
from mathutils import Matrix
from tqdm import tqdm

from shutter_addon.core.frames import light

SIZE = 960, 540


def begin(sky: str, strength: float = 1.0, samples: int = 4, motion_blur: float = 0.0):
    """Gives an empty scene for Cycles, evenly lit by the sky.

    sky: its color
    motion_blur: how much of a frame's time the footage's own shutter is open, 0 to 1, from the frame on
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = SIZE
    render.use_persistent_data = True
    render.use_motion_blur, render.motion_blur_shutter = motion_blur > 0, motion_blur
    render.motion_blur_position = "START"
    cycles.samples, cycles.use_adaptive_sampling = samples, False
    cycles.max_bounces = 2
    # The colors alone guide the denoiser: albedo and normals would double a frame's time.
    cycles.use_denoising, cycles.denoising_quality, cycles.denoising_input_passes = True, "FAST", "RGB"
    scene.view_settings.view_transform = "Standard"
    scene.world = bpy.data.worlds.new("Sky")
    shade(scene.world, "Background", Color=linear(sky), Strength=strength)
    return scene


def render_frames(
    folder: Path, count: int, file_format: str = "PNG", first: int = 1, mode: str = "RGB", depth: str = "16"
) -> Path:
    """Renders the scene's frames from the first to count that the folder does not have yet; the first one's path.

    file_format: PNG (8 bits) or OPEN_EXR (scene-linear, of a depth in bits); mode: RGB or RGBA
    """
    folder.mkdir(parents=True, exist_ok=True)
    scene = bpy.context.scene
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode = file_format, mode
    settings.color_depth = "8" if file_format == "PNG" else depth
    ending = scene.render.file_extension
    paths = [folder / f"{frame:04}{ending}" for frame in range(first, count + 1)]
    part = folder / f".part{ending}"
    for frame, path in enumerate(tqdm(paths, desc="footage", unit="frame"), start=first):
        if not path.exists():
            scene.frame_set(frame)
            bpy.ops.render.render()
            bpy.data.images["Render Result"].save_render(str(part), scene=scene)
            part.replace(path)
    return paths[0]


def write_matte(folder: Path, root: str, name: str) -> None:
    """Lets every render write a matte beside its picture: an EXR with a channel for what hangs on an object.

    What an editor does in the compositor, with Passes ▸ Cryptomatte ▸ Asset: a Cryptomatte node, whose Matte goes into
    a File Output node.
    root: the object, that hangs on nothing; name: of the channel, to which Blender adds `.V`"""
    scene = bpy.context.scene
    scene.view_layers[0].use_pass_cryptomatte_asset = True
    tree = bpy.data.node_groups.new("Matte", "CompositorNodeTree")
    if hasattr(scene, "compositor_effects"):  # from Blender 5.3 on
        scene.compositor_effects.new("Matte").node_group = tree
    else:
        scene.compositing_node_group = tree
    picked, output = (tree.nodes.new(f"CompositorNode{kind}") for kind in ("CryptomatteV2", "OutputFile"))
    picked.source, picked.scene = "RENDER", scene
    picked.layer_name, picked.matte_id = f"{scene.view_layers[0].name}.CryptoAsset", root
    output.directory, output.file_name = str(folder), "####"
    output.format.media_type = "MULTI_LAYER_IMAGE"
    output.format.color_depth = "16"
    output.file_output_items.new("FLOAT", name)
    tree.links.new(picked.outputs["Matte"], output.inputs[name])


def complete(folder: Path, count: int, ending: str = ".png") -> Path | None:
    """The first of `count` frames that are all there already, or None."""
    paths = [folder / f"{frame:04}{ending}" for frame in range(1, count + 1)]
    return paths[0] if all(path.exists() for path in paths) else None


def linear(color: str) -> tuple[float, float, float, float]:
    """`#rrggbb` as scene-linear RGBA."""
    return *light.to_linear([int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]), 1.0


def shade(owner, node: str, **inputs) -> None:
    """Makes one shader node all of a material or world; inputs by name (`Base_Color` is *Base Color*)."""
    nodes = owner.node_tree.nodes
    nodes.clear()
    shader = nodes.new(f"ShaderNode{node}")
    for name, value in inputs.items():
        shader.inputs[name.replace("_", " ")].default_value = value
    output = nodes.new("ShaderNodeOutputWorld" if isinstance(owner, bpy.types.World) else "ShaderNodeOutputMaterial")
    owner.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])


def paint(color: str, roughness: float = 0.6, metallic: float = 0.0):
    """A material with a color."""
    material = bpy.data.materials.new(color)
    shade(material, "BsdfPrincipled", Base_Color=linear(color), Roughness=roughness, Metallic=metallic)
    return material


def glow(color: str, strength: float):
    """A material that emits light but lights nothing: small ones do so with much noise."""
    material = bpy.data.materials.new(color)
    shade(material, "Emission", Color=linear(color), Strength=strength)
    material.cycles.emission_sampling = "NONE"
    return material


def box(size, location, material, bevel: float = 0.0, parent=None):
    """A box of a size (x, y, z) about a location, its edges rounded by a radius."""
    bpy.ops.mesh.primitive_cube_add(size=1)
    made = bpy.context.object
    made.data.transform(_scaling(size))
    if bevel:
        modifier = made.modifiers.new("Bevel", "BEVEL")
        modifier.width, modifier.segments = bevel, 4
    return _placed(made, location, material, parent, smooth=bevel > 0)


def ball(radius, location, material, parent=None):
    """A sphere, or with three radii an ellipsoid."""
    size = _scaling(radius if isinstance(radius, tuple) else (radius,) * 3)
    # An operator would update the scene, which takes its time in one of two hundred buoys.
    sphere = bmesh.new()
    bmesh.ops.create_uvsphere(sphere, u_segments=32, v_segments=16, radius=1, matrix=size)
    data = bpy.data.meshes.new("Ball")
    sphere.to_mesh(data)
    sphere.free()
    return _placed(_linked("Ball", data), location, material, parent, smooth=True)


def tube(start, end, radius: float, material, end_radius: float | None = None, parent=None):
    """A cylinder from one point to another, or a cone that is cut."""
    x, y, z = (b - a for a, b in zip(start, end, strict=True))
    radii = {"radius1": radius, "radius2": radius if end_radius is None else end_radius}
    bpy.ops.mesh.primitive_cone_add(vertices=48, depth=hypot(x, y, z), **radii)
    made = bpy.context.object
    made.rotation_euler = 0, atan2(hypot(x, y), z), atan2(y, x)
    middle = tuple((a + b) / 2 for a, b in zip(start, end, strict=True))
    return _placed(made, middle, material, parent, smooth=True)


def plate(outline, depth: float, location, material, bevel: float = 0.0, parent=None):
    """An outline of points (x, z), extruded along y by a depth about a location."""
    count = len(outline)
    points = [(x, y, z) for y in (-depth / 2, depth / 2) for x, z in outline]
    sides = [(i, i + count, (i + 1) % count + count, (i + 1) % count) for i in range(count)]
    made = mesh(points, [range(count), range(2 * count - 1, count - 1, -1), *sides], location, material, parent)
    if bevel:
        modifier = made.modifiers.new("Bevel", "BEVEL")
        modifier.width, modifier.segments = bevel, 4
        made.data.shade_smooth()
    return made


def mesh(points, faces, location, material, parent=None):
    """A mesh of points (x, y, z) and faces, which are indices of points."""
    data = bpy.data.meshes.new("Mesh")
    data.from_pydata(points, [], list(map(tuple, faces)))
    return _placed(_linked("Mesh", data), location, material, parent)


def text(words: str, size: float, location, material, parent=None):
    """Words that stand upright and face −y, their middle at a location."""
    curve = bpy.data.curves.new("Text", "FONT")
    curve.body, curve.size, curve.extrude = words, size, 0.01
    curve.align_x, curve.align_y = "CENTER", "CENTER"
    made = _linked("Text", curve)
    made.rotation_euler.x = 1.5708
    return _placed(made, location, material, parent)


def limbs(bones, material, voxel: float, parent=None):
    """Bones melted into one soft body; a bone: its start, its end and the radius at each."""
    parts = []
    for start, end, radius, end_radius in bones:
        parts += [tube(start, end, radius, material, end_radius), ball(radius, start, material)]
        parts.append(ball(end_radius, end, material))
    with bpy.context.temp_override(active_object=parts[0], selected_editable_objects=parts):
        bpy.ops.object.join()
    body = parts[0]
    remesh, smooth = body.modifiers.new("Remesh", "REMESH"), body.modifiers.new("Smooth", "SMOOTH")
    remesh.mode, remesh.voxel_size, remesh.use_smooth_shade = "VOXEL", voxel, True
    smooth.factor, smooth.iterations = 0.5, 8
    body.parent = parent
    return body


def empty(location=(0, 0, 0), parent=None):
    """Something that others hang on."""
    made = _linked("Empty", None)
    made.location, made.parent = location, parent
    return made


def camera(location, target, lens: float) -> None:
    """The camera, looking from a location at a target; lens in mm of a 36 mm wide sensor."""
    made = _linked("Camera", bpy.data.cameras.new("Camera"))
    made.data.lens = lens
    aim(made, location, target)
    bpy.context.scene.camera = made


def lamp(kind: str, energy: float, location, target=(0, 0, 0), color: str = "#ffffff", size: float = 0.0, parent=None):
    """A light: AREA and POINT in watts, SUN in W/m²; size: an edge or radius, of a sun its angle in radians."""
    data = bpy.data.lights.new(kind.title(), kind)
    data.energy, data.color = energy, linear(color)[:3]
    setattr(data, {"AREA": "size", "SUN": "angle"}.get(kind, "shadow_soft_size"), size)
    made = _linked(kind.title(), data)
    made.parent = parent
    aim(made, location, target)
    return made


def aim(thing, location, target) -> None:
    """Puts a camera or a light somewhere and turns it to a target."""
    x, y, z = (b - a for a, b in zip(location, target, strict=True))
    thing.location = location
    thing.rotation_euler = atan2(hypot(x, y), -z), 0, atan2(-x, y)


def animate(thing, count: int, **channels) -> None:
    """Keys properties at the frames 1 to count + 1: each is a function from the frame to its value."""
    for name, value in channels.items():
        for frame in range(1, count + 2):
            setattr(thing, name, value(frame))
            thing.keyframe_insert(name, frame=frame)


def _linked(name: str, data):
    made = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made)
    return made


def _scaling(size):
    return Matrix.Diagonal((*size, 1))


def _placed(made, location, material, parent, smooth: bool = False):
    made.location, made.parent = location, parent
    made.data.materials.append(material)
    if smooth:
        made.data.shade_smooth()
        made.data.set_sharp_from_angle(angle=0.7)
    return made
