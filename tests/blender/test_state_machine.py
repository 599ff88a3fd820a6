"""Random work on an edit: whatever is done, undone and done again, effects and strips stay in line."""

import contextlib
import io
import sys

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from support import effect_of, recipe, sequencer, state, write_frames

from shutter_addon.blender.data import fcurves

REGION = {"name": "Face", "shutter": "S1", "strokes": [[[0.1, 0.1], [0.9, 0.1]]]}
MOVED = REGION | {"keys": [{"frame": 1}, {"frame": 9, "location": [0.2, 0.1], "ease": "bezier"}]}
OUTLINE = {"name": "Hand", "shutter": "S1", "kind": "outline", "strokes": [[[0.2, 0.2], [0.6, 0.2], [0.4, 0.7]]]}
REDRAWN = [[[0.3, 0.2], [0.7, 0.2], [0.5, 0.7], [0.4, 0.5]]]
RECIPES = [
    recipe(2, [1, 0]),
    recipe(2, [1, 1], [0, 1], regions=[OUTLINE | {"keys": [{"frame": 1}, {"frame": 7, "strokes": REDRAWN}]}]),
    recipe(4, {1: [1, 0, 0, 0], 9: [0, 0, 0, 1]}, [1, 1, 1, 1], regions=[MOVED]),
    recipe(3, [1, 1, 1], {5: [0, 1, 0]}, regions=[REGION, MOVED | {"name": "Hand"}]),
    recipe(
        3,
        [1, 1, 1],
        [0, 1, 0],
        regions=[MOVED | {"shutter": "S0"}],
        camera=[{"frame": 2}, {"frame": 8, "location": [0.1, 0]}],
    ),
]
RECIPES[-1]["shutters"][0] |= {"follow": "Face", "trail": 0.1}
MOST_EFFECTS = 6
EXAMPLES = 25  # about 250 steps of work


def edits(bpy):
    return sorted((s for s in bpy.data.scenes if s.sequence_editor), key=lambda scene: scene.name)


def plain_strips(edit, kind):
    return [s for s in edit.sequence_editor.strips if s.type == kind]


def layers(effect):
    return list(effect.scene.annotation.layers) if effect.scene.annotation else []


def snapshot(bpy):
    """All that the user made; what Blender or chance names, and values that curves drive, left out."""
    result = []
    for edit in edits(bpy):
        curves = {
            (c.data_path, c.array_index): [(*k.co, *k.handle_left, k.interpolation) for k in c.keyframe_points]
            for c in fcurves.curves_under(edit, "virtual_shutter")
        }
        effects = [
            (
                (e.name, e.source, e.start, e.window),
                [
                    (
                        s.name,
                        s.follow,
                        s.follow_region,
                        s.length,
                        [b.weight for b in s.bars if (b.path_from_id("weight"), 0) not in curves],
                    )
                    for s in e.shutters
                ],
                [(r.name, r.shutter, r.layer, r.is_layer, r.kind, r.between) for r in e.regions],
                [
                    (y.info, [(f.frame_number, [[tuple(p.co) for p in s.points] for s in f.strokes]) for f in y.frames])
                    for y in layers(e)
                ],
            )
            for e in edit.virtual_shutter.effects
        ]
        shown = sorted(
            (s.name, s.type, s.left_handle, s.right_handle, s.content_start, s.channel, s.mute)
            for s in edit.sequence_editor.strips
        )
        result.append((edit.name, shown, effects, curves))
    return result


def marks(bpy):
    """What handlers note of what belongs together, and which scenes, actions and annotations there are."""
    made = [
        (a.name, a.virtual_shutter_made, a.virtual_shutter_start, a.virtual_shutter_names, a.users)
        for a in bpy.data.annotations
    ]
    scenes = [
        (
            scene.name,
            scene.virtual_shutter.identity,
            scene.annotation and scene.annotation.name,
            scene.animation_data and scene.animation_data.action,
            [(e.identity, e.source, e.start, e.scene) for e in scene.virtual_shutter.effects],
            [(s.name, s.virtual_shutter_effect, s.virtual_shutter_source) for s in scene.sequence_editor.strips_all]
            if scene.sequence_editor
            else [],
        )
        for scene in bpy.data.scenes
    ]
    return made, scenes, [camera.virtual_shutter_made for camera in bpy.data.cameras]


class Work(RuleBasedStateMachine):
    """Each step ends with an undo push, as an operator of a window does; there, handlers come after it."""

    folder = None

    @initialize()
    def start(self):
        import bpy

        self.bpy = bpy
        self.said = io.StringIO()
        self.stderr, sys.stderr = sys.stderr, self.said
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        edit = bpy.context.scene
        edit.sequence_editor_create()
        for channel, start in ((1, 1), (2, 21)):
            self.add_source(edit, channel, start)
        self.add_recipe(edit, edit.sequence_editor.strips[0], RECIPES[-1])
        self.clear_history()

    def teardown(self):
        if hasattr(self, "stderr"):
            sys.stderr = self.stderr

    def add_source(self, edit, channel, start):
        files = sorted((self.folder / "in").iterdir())
        source = edit.sequence_editor.strips.new_image("images", str(files[0]), channel, start)
        for file in files[1:]:
            source.elements.append(file.name)

    def add_recipe(self, edit, source, chosen):
        _strip, _effect = effect_of(edit, source, chosen)

    # Undo

    def clear_history(self):
        self.bpy.context.view_layer.update()
        self.bpy.ops.ed.undo_push(message="start")
        self.history, self.now = [snapshot(self.bpy)], 0

    @contextlib.contextmanager
    def step(self, late: bool):
        """A step of work; late: handlers come after its undo push."""
        from shutter_addon.blender import handlers

        update, handler = self.bpy.app.handlers.depsgraph_update_post, handlers.HANDLERS["depsgraph_update_post"]
        update.remove(handler)
        try:
            yield
            if not late:
                handler(None)
            self.bpy.ops.ed.undo_push(message="step")
        finally:
            update.append(handler)
        handler(None)
        self.bpy.context.view_layer.update()
        self.history[self.now + 1 :] = [snapshot(self.bpy)]
        self.now += 1

    def update_edits(self):
        """As a window does after undo, again and again: of a depsgraph that is new the first update tells nobody."""
        for edit in edits(self.bpy):
            edit.view_layers[0].update()

    @precondition(lambda self: self.now > 0)
    @rule()
    def undo(self):
        self.bpy.ops.ed.undo()
        self.now -= 1
        self.update_edits()
        assert snapshot(self.bpy) == self.history[self.now]

    @precondition(lambda self: self.now + 1 < len(self.history))
    @rule()
    def redo(self):
        self.bpy.ops.ed.redo()
        self.now += 1
        self.update_edits()
        assert snapshot(self.bpy) == self.history[self.now]

    # Work

    @rule(data=st.data(), late=st.booleans())
    def add_effect(self, data, late):
        edit = data.draw(st.sampled_from(edits(self.bpy)))
        if not (sources := plain_strips(edit, "IMAGE")) or len(edit.virtual_shutter.effects) >= MOST_EFFECTS:
            return
        with self.step(late):
            self.add_recipe(edit, data.draw(st.sampled_from(sources)), data.draw(st.sampled_from(RECIPES)))

    @rule(data=st.data(), late=st.booleans(), kind=st.sampled_from(["SCENE", "SCENE", "IMAGE"]))
    def remove_strip(self, data, late, kind):
        edit = data.draw(st.sampled_from(edits(self.bpy)))
        if found := plain_strips(edit, kind):
            with self.step(late):
                edit.sequence_editor.strips.remove(data.draw(st.sampled_from(found)))

    @rule(data=st.data(), late=st.booleans(), method=st.sampled_from(["SOFT", "HARD"]), alone=st.booleans())
    def cut(self, data, late, method, alone):
        edit = data.draw(st.sampled_from(edits(self.bpy)))
        if found := [s for s in edit.sequence_editor.strips if s.right_handle - s.left_handle > 1]:
            strip = data.draw(st.sampled_from(found))
            frame = data.draw(st.integers(strip.left_handle + 1, strip.right_handle - 1))
            with self.step(late):
                strip.split(frame, method, ignore_connections=alone)

    @rule(data=st.data(), late=st.booleans(), frames=st.integers(-40, 40))
    def move(self, data, late, frames):
        edit = data.draw(st.sampled_from(edits(self.bpy)))
        if found := list(edit.sequence_editor.strips):
            strip = data.draw(st.sampled_from(found))
            with self.step(late):
                for s in (strip, *strip.connections):
                    s.content_start += frames

    @rule(data=st.data(), late=st.booleans(), frame=st.integers(-10, 60))
    def key(self, data, late, frame):
        edit = data.draw(st.sampled_from(edits(self.bpy)))
        if not (effects := [e for e in edit.virtual_shutter.effects if e.shutters]):
            return
        effect = data.draw(st.sampled_from(effects))
        owners = [bar for shutter in effect.shutters for bar in shutter.bars] + list(effect.regions)
        owner = data.draw(st.sampled_from(owners))
        name = "weight" if hasattr(owner, "weight") else data.draw(st.sampled_from(["location", "rotation", "scale"]))
        with self.step(late):
            setattr(owner, name, (0.3, 0.4) if name == "location" else 0.7)
            edit.keyframe_insert(owner.path_from_id(name), frame=frame)

    @rule(data=st.data(), late=st.booleans(), what=st.sampled_from(["draw", "erase", "rename", "delete"]))
    def scribble(self, data, late, what):
        edit = data.draw(st.sampled_from(edits(self.bpy)))
        if not (found := [y for effect in edit.virtual_shutter.effects for y in layers(effect)]):
            return
        layer = data.draw(st.sampled_from(found))
        with self.step(late):
            if what == "draw":
                stroke = layer.frames[0].strokes.new()
                stroke.points.add(2)
                stroke.points.foreach_set("co", [3, 4, 0, 5, 6, 0])
            elif what == "erase" and layer.frames[0].strokes:
                layer.frames[0].strokes.remove(layer.frames[0].strokes[0])
            elif what == "rename":
                layer.info = "Renamed"
            elif what == "delete":
                layer.id_data.layers.remove(layer)

    @rule(
        data=st.data(),
        late=st.booleans(),
        name=st.sampled_from(["track", "track_camera", "panning_shot", "tripod", "rolling_shutter", "find_readout"]),
    )
    def track(self, data, late, name):
        from shutter_addon.blender.data import selection, strips

        edit = data.draw(st.sampled_from(edits(self.bpy)))
        if not (found := strips.effect_strips(edit)):
            return
        strip = data.draw(st.sampled_from(found))
        self.bpy.context.window.scene = edit
        selection.choose(edit, strip)
        edit.frame_set(data.draw(st.integers(strip.left_handle, strip.right_handle - 1)))
        # There may be no region, or nothing to track.
        with self.step(late), contextlib.suppress(RuntimeError), sequencer(self.bpy):
            getattr(self.bpy.ops.shutter, name)()

    @rule(data=st.data(), late=st.booleans(), name=st.sampled_from(["sharp_subject", "clean_trail"]))
    def make_layer(self, data, late, name):
        from shutter_addon.blender.editing import shutter_edits

        edit = data.draw(st.sampled_from(edits(self.bpy)))
        if effects := [e for e in edit.virtual_shutter.effects if e.regions]:
            with self.step(late):
                getattr(shutter_edits, name)(data.draw(st.sampled_from(effects)), 0)

    @rule(data=st.data(), late=st.booleans())
    def change_window(self, data, late):
        edit = data.draw(st.sampled_from(edits(self.bpy)))
        if edit.virtual_shutter.effects:
            with self.step(late):
                data.draw(st.sampled_from(list(edit.virtual_shutter.effects))).window += 1

    @precondition(lambda self: len(edits(self.bpy)) < 3)
    @rule(data=st.data(), late=st.booleans(), full=st.booleans())
    def copy_edit(self, data, late, full):
        edit = data.draw(st.sampled_from(edits(self.bpy)))
        with self.step(late):
            self.bpy.context.window.scene = edit
            self.bpy.ops.scene.new(type="FULL_COPY" if full else "LINK_COPY")

    @precondition(lambda self: len(edits(self.bpy)) > 1)
    @rule(data=st.data(), late=st.booleans())
    def remove_edit(self, data, late):
        with self.step(late):
            self.bpy.data.scenes.remove(data.draw(st.sampled_from(edits(self.bpy))))

    @rule(data=st.data(), late=st.booleans(), how=st.sampled_from(["duplicate", "copy", "cut"]), all_=st.booleans())
    def copy_strips(self, data, late, how, all_):
        edit = data.draw(st.sampled_from(edits(self.bpy)))
        if not (found := list(edit.sequence_editor.strips)) or len(edit.virtual_shutter.effects) >= MOST_EFFECTS / 2:
            return
        chosen = found if all_ else [data.draw(st.sampled_from(found))]
        self.bpy.context.window.scene = edit
        for strip in found:
            strip.select = strip in chosen
        with sequencer(self.bpy) as area, self.bpy.context.temp_override(region=area.regions[-1]):
            if how == "duplicate":
                with self.step(late):
                    self.bpy.ops.sequencer.duplicate()
                return
            self.bpy.ops.sequencer.copy()
            if how == "cut":
                with self.step(late):
                    self.bpy.ops.sequencer.delete()
        edit.frame_set(data.draw(st.integers(-50, 150)))
        with (
            self.step(late),
            sequencer(self.bpy) as area,
            self.bpy.context.temp_override(region=area.regions[-1]),
        ):
            self.bpy.ops.sequencer.paste()

    @rule()
    def save_and_reload(self):
        path = str(self.folder / "work.blend")
        before = snapshot(self.bpy)
        self.bpy.ops.wm.save_as_mainfile(filepath=path)
        self.bpy.ops.wm.open_mainfile(filepath=path)
        assert snapshot(self.bpy) == before
        self.clear_history()

    # What always holds

    @invariant()
    def nothing_is_said(self):
        assert "Traceback" not in self.said.getvalue(), self.said.getvalue()

    @invariant()
    def effects_and_strips_are_in_line(self):
        from shutter_addon.blender.data import strips, validation

        made = [scene for scene in self.bpy.data.scenes if scene.render.engine == strips.ENGINE]
        known = []
        for edit in edits(self.bpy):
            parts: dict = {}
            for strip in strips.effect_strips(edit):
                parts.setdefault(strip.scene, []).append(strip)
                assert strip.virtual_shutter_effect == strip.scene.virtual_shutter.identity
            assert [e.scene for e in edit.virtual_shutter.effects if e.scene not in parts] == []
            assert len(parts) == len(edit.virtual_shutter.effects)
            for scene, same in parts.items():
                effect = strips.effect_of(edit, scene)
                assert {strips.origin(strip) for strip in same} == {effect.start}
                with contextlib.suppress(validation.EffectError):
                    strips.source_of(edit, effect, same[0])
                    state(edit, effect, same[0], same[0].left_handle)
            known += parts
        assert sorted(s.name for s in known) == sorted(s.name for s in made)
        assert len({scene.virtual_shutter.identity for scene in made}) == len(made)
        assert set(self.bpy.data.objects) == {scene.camera for scene in made}
        assert set(self.bpy.data.cameras) == {scene.camera.data for scene in made}
        assert sorted(a.name for a in self.bpy.data.annotations) == sorted(scene.annotation.name for scene in made)

    @invariant()
    def keys_have_their_properties(self):
        from shutter_addon.blender.data import fcurves

        actions = []
        for edit in edits(self.bpy):
            for curve in fcurves.curves_under(edit, "virtual_shutter"):
                edit.path_resolve(curve.data_path)
            if edit.virtual_shutter.effects and edit.animation_data:
                actions.append((edit.animation_data.action, edit.animation_data.action_slot_handle))
        assert len(set(actions)) == len(actions)

    @invariant()
    def a_second_update_changes_nothing(self):
        from shutter_addon.blender.editing import reconcile

        before = snapshot(self.bpy), marks(self.bpy)
        reconcile.update()
        assert (snapshot(self.bpy), marks(self.bpy)) == before


def test_random_work(bpy, tmp_path):
    Work.folder = tmp_path
    noise = np.random.default_rng(0).integers(0, 256, (12, 16, 3), dtype=np.uint8).repeat(6, 0).repeat(6, 1)
    write_frames(tmp_path / "in", np.stack([np.roll(noise, index, axis=1) for index in range(30)]))
    limits = settings(
        max_examples=EXAMPLES, stateful_step_count=20, derandomize=True, suppress_health_check=list(HealthCheck)
    )
    run_state_machine_as_test(Work, settings=limits)
