"""A plain copy of a character's settings, which a job keeps while the animator works on."""

from dataclasses import dataclass
from typing import Any

import bpy

from ...core.checks import MAX_FRAMES, MAX_SEED, whole
from ...core.errors import InputError
from ...core.skeleton import TARGETS
from ...core.take import MODES

__all__ = [
    "AS_IT_IS",
    "CLEAN_UP",
    "COMES_AND_GOES",
    "HELD",
    "MAX_TAKES",
    "STANDING",
    "Settings",
    "settings_of",
]

MAX_TAKES = 64
"""How many takes one job may make."""

COMES_AND_GOES, HELD = "COMES_AND_GOES", "HELD"
"""Values of ``noise``: all of it, or only what lasts all along a take."""

STANDING, AS_IT_IS = "STANDING", "AS_IT_IS"
"""Values of ``begins``: from standing at the root, or with the motion that the character has."""

CLEAN_UP = {
    "plant_feet": "feet",
    "rest_on_seats": "seat",
    "reach_targets": "reach",
    "clear_furniture": "clear",
    "smooth": "smooth",
}
"""The strengths of ``core.cleanup.CleanUp`` by the names of the settings, in the panel's order."""

_LAST_FRAME = 1_048_574
"""Blender's last frame; its first one is as far below zero."""


@dataclass(frozen=True)
class Settings:
    """A plain copy of what one generation needs; objects, actions and the collection by
    ``name_full``, None where unset.

    ``mode``: None reads the armature's property frame by frame, a mode overrides it.
    ``frame_start`` and ``frame_end`` are both generated. ``take_count``: takes to make;
    ``lower_seed``, ``lower_temperature``: the legs' own; None for those of the upper body.
    ``source_offset``: frames by which sources play later; ``source_loops``: over
    and over. ``begins``: what the take begins from; ``begins_as``: the action of a take that it
    begins as instead. ``kept``: the action of a take whose motion stays before the scene's frame
    ``kept_until`` and, if it is given, from ``kept_from`` on. ``plant_feet`` and those below it:
    strengths of the clean-up.
    """

    armature: str
    scene: str
    root: str | None
    furniture: str | None = None
    head: str | None = None
    hand_left: str | None = None
    hand_right: str | None = None
    foot_left: str | None = None
    foot_right: str | None = None
    look_at: str | None = None
    upper_body_source: str | None = None
    upper_body_take: str | None = None
    lower_body_source: str | None = None
    source_offset: int = 0
    source_loops: bool = False
    mode: str | None = None
    begins: str = STANDING
    begins_as: str | None = None
    frame_start: int = 1
    frame_end: int = 250
    seed: int = 0
    lower_seed: int | None = None
    temperature: float = 0.0
    lower_temperature: float | None = None
    noise: str = COMES_AND_GOES
    take_count: int = 1
    kept: str | None = None
    kept_until: int = 0
    kept_from: int | None = None
    blend_frames: int = 10
    plant_feet: float = 1.0
    rest_on_seats: float = 1.0
    reach_targets: float = 1.0
    clear_furniture: float = 0.0
    smooth: float = 0.0

    def __post_init__(self) -> None:
        if self.mode is not None and self.mode not in MODES:
            raise InputError(f"The mode '{self.mode}' is unknown; choose {', '.join(MODES)}.")

        for frame in (self.frame_start, self.frame_end):
            whole(frame, "A frame of the range", -_LAST_FRAME, _LAST_FRAME)

        if self.frame_end < self.frame_start:
            raise InputError(
                f"The frame range ends at {self.frame_end}, before its start at "
                f"{self.frame_start}; "
                "set the end after the start."
            )

        whole(self.source_offset, "The source's offset", -_LAST_FRAME, _LAST_FRAME)
        whole(self.frame_end - self.frame_start + 1, "The length of the frame range", 1, MAX_FRAMES)
        whole(self.take_count, "The number of takes", 1, MAX_TAKES)
        for seed in (self.seed, self.lower_seed or 0):
            whole(seed, "The seed", 0, MAX_SEED)

        whole(self.seed + self.take_count - 1, "The last take's seed", 0, MAX_SEED)


def settings_of(armature: bpy.types.Object, scene: bpy.types.Scene, **overrides: Any) -> Settings:
    """The settings of a character (``Object.dafnet``) in a scene; ``overrides`` replace fields of
    ``Settings``.
    """
    own = armature.dafnet
    links = (
        "root",
        "furniture",
        *TARGETS,
        "look_at",
        "upper_body_source",
        "upper_body_take",
        "lower_body_source",
    )

    values: dict[str, Any] = {
        name: target.name_full if (target := getattr(own, name)) else None for name in links
    }
    values |= {
        "frame_start": scene.frame_start if own.use_scene_range else own.frame_start,
        "frame_end": scene.frame_end if own.use_scene_range else own.frame_end,
        **{
            name: getattr(own, name)
            for name in (
                "begins",
                "seed",
                "temperature",
                "noise",
                "take_count",
                "blend_frames",
                "source_offset",
                "source_loops",
                *CLEAN_UP,
            )
        },
    }

    return Settings(armature=armature.name_full, scene=scene.name_full, **(values | overrides))
