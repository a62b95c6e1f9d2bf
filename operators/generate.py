"""Generate takes and bake them onto the character."""

from collections.abc import Callable, Generator
from typing import Any

import bpy
import numpy as np
from bpy.props import EnumProperty

from ..dafnet_addon.blender.character.armature import (
    character_of,
    metres_per_unit,
    selected_characters,
)
from ..dafnet_addon.blender.character.settings import COMES_AND_GOES, HELD
from ..dafnet_addon.blender.character.standing import roots_brought_along
from ..dafnet_addon.blender.character.takes import active_take, draw_of, frames_of
from ..dafnet_addon.blender.overlay import display
from ..dafnet_addon.blender.pipeline import job
from ..dafnet_addon.blender.pipeline.running import running_job
from ..dafnet_addon.blender.translations import translated_tip
from ..dafnet_addon.core.errors import InputError
from ..dafnet_addon.core.progress import run_to_end
from .base import DafnetOperator, may_be_led
from .long import LongOperator

__all__ = ["DAFNET_OT_cancel", "DAFNET_OT_generate"]

_CALM_LEGS = 1.0
"""Temperature of the legs of a take whose legs are varied though it is calm."""


class DAFNET_OT_generate(LongOperator, bpy.types.Operator):
    """Generate the motion of the selected characters from their roots, targets and furniture, and
    bake it into new actions
    """

    bl_idname = "dafnet.generate"
    bl_label = "Generate"
    bl_options = {"UNDO"}

    task: EnumProperty(
        name="Task",
        default="NEW",
        options={"SKIP_SAVE"},
        items=[
            ("NEW", "Generate", "Generate new takes"),
            (
                "LEGS",
                "Vary the Legs",
                "Generate other legs under the upper body of the chosen take",
            ),
            (
                "ONWARD",
                "From Here On",
                "Keep the chosen take up to the current frame, and generate the rest anew",
            ),
            (
                "BETWEEN",
                "From Here to There",
                "Generate the frames of the preview range anew, and keep the chosen take before "
                "and after it",
            ),
        ],
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A character with a root, and no other job."""
        return may_be_led(cls, context)

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: Any) -> str:
        """The task's own tooltip."""
        if properties.task == "NEW":
            return ""
        does = cls.bl_rna.properties["task"].enum_items[properties.task].description
        return translated_tip(does)

    def _settings(self, context: bpy.types.Context) -> job.Settings:
        """The character's settings, and what the task changes in them."""
        character = character_of(context)
        if self.task == "NEW":
            return job.settings_of(character, context.scene)

        take = active_take(character)
        if take is None:
            raise InputError("Choose a take in the list of takes first.")

        first, last = frames_of(take)
        scene = context.scene
        if self.task == "BETWEEN":
            if not scene.use_preview_range:
                raise InputError(
                    "Mark the part that is to be made anew as the preview range: P in the timeline."
                )
            return job.settings_of(
                character,
                scene,
                kept=take.name_full,
                begins_as=take.name_full,
                kept_until=scene.frame_preview_start,
                kept_from=scene.frame_preview_end + 1,
                frame_start=first,
                frame_end=last,
            )

        if self.task == "ONWARD":
            return job.settings_of(
                character,
                context.scene,
                kept=take.name_full,
                begins_as=take.name_full,
                kept_until=context.scene.frame_current,
                frame_start=first,
            )

        if not take.dafnet.whole:
            raise InputError(
                f"Part of '{take.name}' is of another take or was recorded, so its upper body is "
                "not made by its seed alone; set the mode to FULL and copy the upper body from it."
            )
        draw = draw_of(take)
        return job.settings_of(
            character,
            context.scene,
            take_count=1,
            begins_as=take.name_full,
            seed=draw.seed,
            temperature=draw.temperature,
            noise=HELD if draw.held else COMES_AND_GOES,
            frame_start=first,
            frame_end=last,
            lower_seed=(draw.lower_seed or 0) + 1,
            lower_temperature=draw.lower_temperature or _CALM_LEGS,
        )

    def _people(self, context: bpy.types.Context) -> list[job.Settings]:
        """The settings of all selected characters; further ones only for new takes."""
        characters = selected_characters(context)
        if self.task != "NEW" or len(characters) == 1:
            return [self._settings(context)]
        return job.distinct_seeds([job.settings_of(o, context.scene) for o in characters])

    def run(self, context: bpy.types.Context) -> None:
        """Generate without showing progress."""
        self.report_result(run_to_end(self._job(context)))

    def steps(self, context: bpy.types.Context) -> Generator[float, None, tuple[job.Result, ...]]:
        """Generate and show each frame as it is made."""
        return self._job(context, self._watch)

    def _job(
        self, context: bpy.types.Context, watch: Callable[[int, np.ndarray], None] | None = None
    ) -> Generator[float, None, tuple[job.Result, ...]]:
        unit = metres_per_unit(context.scene)
        with roots_brought_along(context.scene, selected_characters(context), unit):
            people = self._people(context)
            if len(people) > 1:
                return (yield from job.run_all.steps(context, people, watch))
            return ((yield from job.run.steps(context, people[0], watch=watch)),)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Start the job and show the frames as they are made."""
        begun = super().invoke(context, event)
        if begun == {"RUNNING_MODAL"}:
            running = self._running
            display.show_live_pose(lambda: running.joints)
        return begun

    def cancel(self, context: bpy.types.Context) -> None:
        """End the job, which leaves the scene untouched unless it has finished."""
        try:
            super().cancel(context)
        finally:
            display.hide_live_pose()

    def report_result(self, result: tuple[job.Result, ...]) -> None:
        """Say what was generated, and pass the warnings on."""
        for warning in dict.fromkeys(each for one in result for each in one.warnings):
            self.report({"WARNING"}, warning)
        seconds = sum(sum(one.seconds.values()) for one in result)
        frames, takes = len(result[0].take), sum(len(one.takes) for one in result)
        made = f"'{result[0].action.name}'" if takes == 1 else f"{takes} takes"
        for_all = f" for {len(result)} characters" if len(result) > 1 else ""
        self.report({"INFO"}, f"{frames} frames in {seconds:.1f} s: {made}{for_all}")

    def _watch(self, _frame: int, joints: np.ndarray) -> None:
        self._running.joints = joints


class DAFNET_OT_cancel(DafnetOperator, bpy.types.Operator):
    """Stop the job that is running; the scene stays as it was"""

    bl_idname = "dafnet.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """A job is running."""
        cls.poll_message_set("No job is running")
        return running_job() is not None

    def run(self, _context: bpy.types.Context) -> None:
        """Let the running job end itself at its next tick."""
        if (running := running_job()) is not None:
            running.cancel_requested = True
