"""What the model's fields define (core/model/fields.py) is what Blender has, and counts wherever an effect is read."""

import numpy as np
import pytest
from support import write_frames

from shutter_addon.blender.data import effect_version, fcurves, snapshot, strips
from shutter_addon.blender.data.property_copy import copy_properties
from shutter_addon.blender.editing import region_edits
from shutter_addon.core.model import effect as model
from shutter_addon.core.model.fields import Field, fields_of
from shutter_addon.core.model.frame_state import Options
from shutter_addon.core.model.keyframes import Samples

# By class: where its property group is in an effect, and where what is read of it is in the model's.
KINDS = {
    model.Effect: (lambda effect: effect, lambda read: read),
    Options: (lambda effect: effect, lambda read: read.options),
    model.Shutter: (lambda effect: effect.shutters[1], lambda read: read.shutters[1]),
    model.Camera: (lambda effect: effect.camera, lambda read: read.camera),
    model.Region: (lambda effect: effect.regions[0], lambda read: read.regions[0]),
    model.MatteRegion: (lambda effect: effect.regions[1], lambda read: read.regions[1]),
    model.OutlineRegion: (lambda effect: effect.regions[2], lambda read: read.regions[2]),
    model.FileContent: (lambda effect: effect.regions[3], lambda read: read.regions[3].content),
    model.RampContent: (lambda effect: effect.regions[1], lambda read: read.regions[1].content),
}
EVERY = [(kind, name) for kind in KINDS for name in fields_of(kind)]
# Read by functions of their own (blender/data/matte_content.py): they are other words there.
CONTENT = model.FileContent, model.RampContent
FIRST, LAST = 1, 9


@pytest.fixture
def whole(bpy, effect, tmp_path):
    """An effect in which every property counts."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "edit.blend"))
    shutter = effect.shutters[1]
    shutter.follow, shutter.length, shutter.combine, shutter.use_threshold = "CAMERA", "MOTION", "LIGHTEST", True
    region_edits.add_region(effect, shutter, "LINE", "line")
    region_edits.add_region(effect, shutter, "RAMP", "ramp")
    region_edits.add_region(effect, shutter, "OUTLINE", "outline").between = "STRAIGHT"
    matte = write_frames(tmp_path / "matte", np.zeros((1, 4, 4, 3), np.uint8))
    region_edits.add_region(effect, shutter, "MATTE", "matte").image = bpy.data.images.load(str(matte))
    return effect


EXPORTED = Options, model.Effect, model.Camera, model.Shutter


def other_value(field: Field):
    """A value beside the default, as the model has it."""
    if field.choices:
        return next(word for word in field.words.values() if word != field.default)
    if isinstance(field.default, bool):
        return not field.default
    if isinstance(field.default, str):
        return "Other"
    if isinstance(field.default, tuple):
        return 0.5, 0.25, 0.125
    by = 1 if isinstance(field.default, int) else 0.25
    return field.default + (by if field.default + by <= field.most else -by)


def _in_blender(field: Field, value):
    return str(value).upper() if field.choices else value


@pytest.mark.parametrize(("kind", "name"), EVERY, ids=[f"{kind.__name__} {name}" for kind, name in EVERY])
def test_a_field_counts_everywhere(whole, kind, name):
    field, (group_of, model_of) = fields_of(kind)[name], KINDS[kind]
    scene, effect, strip = strips.find_effect(whole.scene)
    group, other = group_of(effect), other_value(field)

    def seen(frame: int = FIRST):
        """What the snapshot has of the field; of what is in no field there, all of it."""
        read = model_of(snapshot.read(scene, effect, strip, (FIRST, LAST)))
        if kind in CONTENT:
            return read
        value = getattr(read.at(frame) if kind is Options else read, name)
        return value.at(frame) if field.is_channel else value

    def version() -> str:
        return effect_version.key(scene, effect, strip, effect_version.frames_of(strip))

    _is_registered(group, field)
    setattr(group, field.blender, _in_blender(field, field.default))
    before, was = seen(), version()
    assert kind in CONTENT or before == pytest.approx(field.default)

    setattr(group, field.blender, _in_blender(field, other))
    assert seen() != before
    assert kind in CONTENT or seen() == pytest.approx(other)
    is_unseen = isinstance(field.default, tuple) or (isinstance(field.default, str) and not field.choices)
    assert (version() == was) == is_unseen

    if kind in EXPORTED:
        exported = model_of(snapshot.recipe_of(scene, effect, strip, (model.RampContent(), model.FileContent("x.png"))))
        value = getattr(exported.at(1) if kind is Options else exported, name)
        assert (value.at(1) if field.is_channel else value) == pytest.approx(other)

    copy = scene.virtual_shutter.effects.add()
    copy_properties(effect, copy)
    assert getattr(group_of(copy), field.blender) == getattr(group, field.blender) != _in_blender(field, field.default)

    if field.keyed and not is_unseen:
        path = f"{group.path_from_id()}.{field.blender}"
        numbers = [float(_number(group, field, value)) for value in (field.default, other)]
        keys = [(frame, number, "constant") for frame, number in zip((FIRST, LAST), numbers, strict=True)]
        fcurves.set_keys(scene, path, 0, keys)
        assert (seen(FIRST), seen(LAST)) == pytest.approx((field.default, other))
        assert version() != was


def _number(group, field: Field, value) -> float:
    """What an F-curve has of a value."""
    if not field.choices:
        return float(value)
    return group.bl_rna.properties[field.blender].enum_items[_in_blender(field, value)].value


def _is_registered(group, field: Field) -> None:
    """It is Blender's property with its words, default, range and choices, keyed or not."""
    prop = {prop.identifier: prop for prop in group.bl_rna.properties}[field.blender]  # "name" is Blender's as well
    assert (prop.name, prop.description, prop.translation_context) == (field.label, field.description, field.context)
    if isinstance(field.default, tuple):
        assert list(prop.default_array) == pytest.approx(field.default)
    else:
        assert prop.default == pytest.approx(_in_blender(field, field.default))
    if field.choices:
        assert [(item.identifier, item.name, item.description) for item in prop.enum_items] == list(field.choices)
    elif not isinstance(field.default, bool | str):
        assert (prop.hard_min, prop.hard_max) == (field.least, field.most)
        assert prop.soft_max == pytest.approx(field.soft_most or field.most)
        assert prop.subtype == field.subtype
    if field.choices or not isinstance(field.default, str):
        assert prop.is_animatable == field.keyed


def test_what_does_not_count_is_not_asked_for_its_keys(whole):
    """Keys are sampled at every frame."""
    scene, effect, strip = strips.find_effect(whole.scene)
    shutter = effect.shutters[1]
    for name in ("trail", "threshold", "softness"):
        fcurves.set_keys(scene, f"{shutter.path_from_id()}.{name}", 0, [(FIRST, 0.1, "linear"), (LAST, 0.2, "linear")])

    def sampled() -> set[str]:
        read = snapshot.read(scene, effect, strip, (FIRST, LAST)).shutters[1]
        return {name for name in ("trail", "threshold", "softness") if isinstance(getattr(read, name), Samples)}

    assert sampled() == {"trail", "threshold", "softness"}
    shutter.use_threshold = False
    assert sampled() == {"trail"}
    shutter.length = "FRAMES"
    assert sampled() == set()
    shutter.length, shutter.follow = "MOTION", "NOTHING"
    assert sampled() == set()
