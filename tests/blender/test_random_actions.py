"""A hundred random actions of a careless user: nothing is lost, nothing is left running, and every
error is a sentence.
"""

from pathlib import Path
from types import ModuleType

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import job, running
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError


class Careless:
    """Does things at random and remembers which actions there must be after each undo and redo."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder = folder
        self.random = np.random.default_rng(seed)
        self.errors = 0
        self.states: list[set[str]] = []
        self.at = -1
        self.scene.frame_end = 12
        bpy.ops.mesh.primitive_cube_add(size=0.45, location=(0.0, 1.0, 0.225))
        furniture = bpy.data.collections.new("Furniture")
        self.scene.collection.children.link(furniture)
        furniture.objects.link(bpy.context.object)
        self.add_character()
        self.remember()

    @property
    def scene(self):
        return bpy.context.scene

    def characters(self) -> list:
        return [o for o in self.scene.objects if o.type == "ARMATURE"]

    def one(self, of):
        of = list(of)
        return of[self.random.integers(len(of))] if of else None

    def actions(self) -> set[str]:
        return {action.name for action in bpy.data.actions}

    def remember(self) -> None:
        """An undo step, and the actions at it."""
        bpy.ops.ed.undo_push(message="Careless")
        self.states = [*self.states[: self.at + 1], self.actions()]
        self.at = len(self.states) - 1

    def activate(self) -> bool:
        chosen = self.one(self.characters())
        bpy.context.view_layer.objects.active = chosen
        return chosen is not None

    # What can be done; each leaves an undo step where it changes something.

    def add_character(self) -> None:
        bpy.ops.dafnet.add_character(name=self.one(["Ann", "Bo"]))
        own = bpy.context.object.dafnet
        own.furniture = bpy.data.collections.get("Furniture")
        for frame, y in ((1, 0.0), (12, float(self.random.uniform(0.1, 0.4)))):
            if own.root:
                own.root.location.y = y
                own.root.keyframe_insert("location", frame=frame)

    def make_takes(self) -> None:
        if self.activate():
            own = bpy.context.object.dafnet
            own.take_count, own.temperature = (
                int(self.random.integers(1, 4)),
                float(self.random.uniform(0.0, 1.5)),
            )
            own.mode = self.one(["FREE", "FREE", "EE", "FULL"])
            before = self.actions()
            bpy.ops.dafnet.generate(task=self.one(["NEW", "NEW", "LEGS", "ONWARD"]))
            assert before < self.actions(), "every take is a new action"

    def cancel(self) -> None:
        character = self.one(self.characters())
        if character:
            before = self.actions()
            steps = job.steps(bpy.context, job.settings_of(character, self.scene))
            for _ in range(int(self.random.integers(1, 40))):
                next(steps)
            steps.close()
            assert self.actions() == before

    def interrupted(self) -> None:
        """Something is deleted, or time goes back, while a take is made; it ends well or with a
        sentence.
        """
        character = self.one(self.characters())
        if character:
            steps = job.steps(bpy.context, job.settings_of(character, self.scene))
            next(steps)
            self.one([self.delete, self.rename, self.undo, self.new_rate])()
            for _ in steps:
                pass

    def play(self) -> None:
        if self.activate():
            bpy.ops.dafnet.play_take(step="NEXT")

    def reject(self) -> None:
        if self.activate():
            before = self.actions()
            bpy.ops.dafnet.reject_take()
            assert self.actions() == before, (
                "a rejected take is there until the file is opened again"
            )

    def clean(self) -> None:
        if self.activate():
            bpy.context.object.dafnet.plant_feet = float(self.random.uniform())
            bpy.ops.dafnet.clean_again()

    def delete(self) -> None:
        victim = self.one(self.scene.objects)
        if victim:
            bpy.data.objects.remove(victim)

    def delete_action(self) -> None:
        victim = self.one(bpy.data.actions)
        if victim:
            bpy.data.actions.remove(victim)

    def rename(self) -> None:
        victim = self.one([*self.scene.objects, *bpy.data.actions, *bpy.data.collections])
        victim.name = f"Named {self.random.integers(1000)}"

    def new_rate(self) -> None:
        self.scene.render.fps = int(self.one([24, 25, 30, 60]))

    def undo(self) -> None:
        if self.at > 0:
            bpy.ops.ed.undo()
            self.at -= 1
            assert self.actions() == self.states[self.at]

    def redo(self) -> None:
        if self.at + 1 < len(self.states):
            bpy.ops.ed.redo()
            self.at += 1
            assert self.actions() == self.states[self.at]

    def reload(self) -> None:
        kept = {action.name for action in bpy.data.actions if action.use_fake_user}
        file = str(self.folder / "careless.blend")
        bpy.ops.wm.save_as_mainfile(filepath=file)
        bpy.ops.wm.open_mainfile(filepath=file)
        assert kept <= self.actions()
        self.states, self.at = [], -1

    def act(self) -> str:
        """One random action; its name."""
        name = str(
            self.random.choice(
                [
                    "make_takes",
                    "cancel",
                    "interrupted",
                    "play",
                    "reject",
                    "clean",
                    "delete",
                    "delete_action",
                    "rename",
                    "new_rate",
                    "undo",
                    "redo",
                    "reload",
                    "add_character",
                ],
                p=[
                    0.24,
                    0.06,
                    0.08,
                    0.08,
                    0.06,
                    0.06,
                    0.06,
                    0.03,
                    0.08,
                    0.05,
                    0.08,
                    0.05,
                    0.03,
                    0.04,
                ],
            )
        )
        if not any(character.dafnet.root for character in self.characters()):
            name = "add_character"
        try:
            getattr(self, name)()
        except (RuntimeError, InputError) as error:
            said = str(error).removeprefix("Error: ").strip()
            grey = ".poll() " in said
            assert grey or (said.endswith(".") and "\n" not in said and "Traceback" not in said), (
                said
            )
            self.errors += 1
        if name not in ("undo", "redo"):
            self.remember()
        return name


@pytest.mark.parametrize("seed", [0, 1])
def test_a_hundred_random_actions(blender: ModuleType, tmp_path: Path, seed: int) -> None:
    handlers = blender.app.handlers
    lists = [value for name in dir(handlers) if isinstance(value := getattr(handlers, name), list)]
    registered = [list(each) for each in lists]
    user = Careless(tmp_path, seed)
    done = []
    for _ in range(100):
        done.append(user.act())
        assert running.running_job() is None
        assert [list(each) for each in lists] == registered, f"a handler is left after {done[-3:]}"
    assert len(set(done)) > 8 and user.errors < 50
