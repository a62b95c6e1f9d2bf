"""What can be done with the takes in a character's list; the work is done in
``blender.character.takes``, ``blender.pipeline.job`` and ``blender.delivery``.
"""

from collections.abc import Generator
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ..dafnet_addon.blender.character.armature import character_of, selected_characters
from ..dafnet_addon.blender.character.takes import active_take, drop_take, play_take, takes_of
from ..dafnet_addon.blender.delivery.assets import mark_as_asset
from ..dafnet_addon.blender.delivery.export import ENDINGS, export_steps
from ..dafnet_addon.blender.delivery.nla import put_into_nla
from ..dafnet_addon.blender.delivery.people import distinct_names, with_chosen_take
from ..dafnet_addon.blender.overridable import rows_of_library
from ..dafnet_addon.blender.pipeline import job
from ..dafnet_addon.core.errors import InputError
from ..dafnet_addon.core.progress import run_to_end
from .base import DafnetOperator, idle
from .long import LongOperator

__all__ = [
    "DAFNET_OT_clean_again",
    "DAFNET_OT_export_take",
    "DAFNET_OT_keep_accepted",
    "DAFNET_OT_mark_take",
    "DAFNET_OT_play_take",
    "DAFNET_OT_reject_take",
    "DAFNET_OT_take_to_nla",
]


def _character(context: bpy.types.Context) -> Any:
    """The character; ``poll`` has made sure that there is one."""
    return character_of(context)


def _chosen(character: Any) -> bpy.types.Action:
    """The take of the row that is chosen."""
    take = active_take(character)
    if take is None:
        raise InputError("Choose a take in the list of takes first.")
    return take


class _OfTakes(DafnetOperator):
    """For a character that has takes, while none is being generated."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a take, and no job is running."""
        character = character_of(context)
        if not idle(cls):
            return False
        cls.poll_message_set("Generate a take first")  # type: ignore[attr-defined]
        return character is not None and bool(takes_of(character))


class DAFNET_OT_play_take(_OfTakes, bpy.types.Operator):
    """Let the character play this take"""

    bl_idname = "dafnet.play_take"
    bl_label = "Play Take"
    bl_options = {"REGISTER", "UNDO"}

    index: IntProperty(name="Row", options={"SKIP_SAVE"})
    step: EnumProperty(
        name="Step",
        default="NONE",
        options={"SKIP_SAVE"},
        items=[
            ("NONE", "This", "The take of the row"),
            ("NEXT", "Next", "The take below the one that plays"),
            ("PREVIOUS", "Previous", "The take above the one that plays"),
        ],
    )

    def run(self, context: bpy.types.Context) -> None:
        """Play it."""
        character = _character(context)
        find = self._of_row if self.step == "NONE" else self._next
        play_take(character, find(character))

    def _of_row(self, character: Any) -> bpy.types.Action:
        """The take of the row."""
        rows = character.dafnet.takes
        take = rows[self.index].action if 0 <= self.index < len(rows) else None
        if take is None:
            raise InputError("This take's action was deleted; remove its row.")
        return take

    def _next(self, character: Any) -> bpy.types.Action:
        """The take a step from the one that plays, round and round; where none plays, the first one
        of those to come. Rows whose action was deleted are stepped over.
        """
        takes = takes_of(character)
        if self.step == "PREVIOUS":
            takes.reverse()
        data = character.animation_data
        plays = data.action if data else None
        return takes[(takes.index(plays) + 1) % len(takes)] if plays in takes else takes[0]


class DAFNET_OT_reject_take(_OfTakes, bpy.types.Operator):
    """Remove the chosen take from the list; its action is deleted when the file is saved and
    reopened, unless something uses it
    """

    bl_idname = "dafnet.reject_take"
    bl_label = "Reject Take"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a row, whether its action still exists or not."""
        character = character_of(context)
        cls.poll_message_set("There is no take in the list")
        return idle(cls) and character is not None and len(character.dafnet.takes) > 0

    def run(self, context: bpy.types.Context) -> None:
        """Drop it."""
        own = _character(context).dafnet
        drop_take(own.id_data, max(0, min(own.active_take, len(own.takes) - 1)))


class DAFNET_OT_keep_accepted(_OfTakes, bpy.types.Operator):
    """Reject every take that is not accepted"""

    bl_idname = "dafnet.keep_accepted"
    bl_label = "Keep Accepted Only"
    bl_options = {"REGISTER", "UNDO"}

    def run(self, context: bpy.types.Context) -> None:
        """Drop the others; those of an override's library stay."""
        character = _character(context)
        if not any(action.dafnet.accepted for action in takes_of(character)):
            raise InputError("No take is accepted; mark those to keep first.")
        rows = character.dafnet.takes
        for index in reversed(range(rows_of_library(character, "takes"), len(rows))):
            if rows[index].action is None or not rows[index].action.dafnet.accepted:
                drop_take(character, index)


class DAFNET_OT_clean_again(_OfTakes, LongOperator, bpy.types.Operator):
    """Clean up the chosen take with the present settings, as a new take; nothing is generated"""

    bl_idname = "dafnet.clean_again"
    bl_label = "Clean Up Again"
    bl_options = {"REGISTER", "UNDO"}

    def steps(self, context: bpy.types.Context) -> Generator[float, None, job.Result]:
        """Clean it."""
        character = _character(context)
        return job.clean_up_again.steps(context, character, _chosen(character))

    def report_result(self, result: job.Result) -> None:
        """Say which take it is now."""
        self.report({"INFO"}, f"'{result.action.name}'")


class DAFNET_OT_take_to_nla(_OfTakes, bpy.types.Operator):
    """Put the chosen take as a strip onto a track of its own in the Nonlinear Animation editor"""

    bl_idname = "dafnet.take_to_nla"
    bl_label = "To NLA"
    bl_options = {"REGISTER", "UNDO"}

    def run(self, context: bpy.types.Context) -> None:
        """Add the strip."""
        character = _character(context)
        strip = put_into_nla(character, _chosen(character))
        self.report(
            {"INFO"}, f"'{strip.name}' plays from {strip.frame_start:.0f} to {strip.frame_end:.0f}"
        )


class DAFNET_OT_mark_take(_OfTakes, bpy.types.Operator):
    """Mark the chosen take as an asset, with tags and a picture; its catalog stays as it is"""

    bl_idname = "dafnet.mark_take"
    bl_label = "Mark as Asset"
    bl_options = {"REGISTER", "UNDO"}

    def run(self, context: bpy.types.Context) -> None:
        """Mark it."""
        take = _chosen(_character(context))
        mark_as_asset(take)
        self.report({"INFO"}, f"'{take.name}' is an asset of this file")


class DAFNET_OT_export_take(_OfTakes, bpy.types.Operator):
    """Write the chosen take of each selected character into a file for other programs: her bones
    and meshes, one action, and the way through the room on a root bone or the hips
    """

    bl_idname = "dafnet.export_take"
    bl_label = "Export"
    bl_options = {"REGISTER"}

    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    filter_folder: BoolProperty(default=True, options={"HIDDEN"})
    kind: EnumProperty(
        name="Format",
        default="fbx",
        items=[
            ("fbx", "FBX", "For Unreal, Unity, Maya, MotionBuilder"),
            ("gltf", "glTF", "A .glb for engines and the web"),
            ("usd", "USD", "A .usdc for pipelines"),
            ("bvh", "BVH", "Bones alone, for motion tools"),
        ],
    )
    root_motion: EnumProperty(
        name="Root Motion",
        default="bone",
        items=[
            ("bone", "Root Bone", "A bone over the hips moves through the room"),
            ("hips", "Hips", "The hips move through the room"),
        ],
    )
    overwrite: BoolProperty(
        name="Overwrite", options={"SKIP_SAVE"}, description="Replace files that are there already"
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Ask for a folder."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def run(self, context: bpy.types.Context) -> None:
        """Write them."""
        if not self.directory:
            raise InputError("There is no folder to write to; choose one.")
        folder = Path(bpy.path.abspath(self.directory))
        if not folder.is_dir():
            raise InputError(f"There is no folder '{folder}'; choose one.")

        people = [with_chosen_take(each) for each in selected_characters(context)]
        names = distinct_names([each.actions[0].name for each in people])
        for name in names:
            file = folder / f"{name}{ENDINGS[self.kind]}"
            if file.exists() and not self.overwrite:
                raise InputError(f"'{file}' is there already; tick Overwrite to replace it.")
        for person, name in zip(people, names, strict=True):
            run_to_end(
                export_steps(
                    context,
                    [person],
                    0,
                    kinds=[self.kind],
                    root_motion=self.root_motion,
                    folder=folder,
                    names=[name],
                )
            )
        self.report({"INFO"}, f"{len(names)} files written to '{folder}'")
