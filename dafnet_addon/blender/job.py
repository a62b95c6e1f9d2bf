"""From the scene to keyframes: the one code path under the operator, the command line and batches.

A job knows objects by name only and looks them up at each stage, since they may be deleted or undone while it runs.
"""

from collections.abc import Generator
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING

import bpy

from .. import generate_steps, load_weights
from ..core.cleanup import CleanUp
from ..core.errors import InputError
from ..core.progress import drained, within
from ..core.take import Take
from .armature import metres_per_unit
from .baker import bake
from .properties import Settings, find_object, find_scene, names_in_use, settings_of, weights_path
from .scene_reader import read_steps

if TYPE_CHECKING:
    from ..core.weights import Weights

__all__ = ["Result", "Settings", "settings_of", "steps", "run"]

_READ, _GENERATED = 0.1, 0.98
"""Progress after the scene is read and after the take is generated."""


@dataclass(frozen=True)
class Result:
    """A baked take.

    ``action``: new, and played by the armature. ``warnings``: sentences for the user. ``seconds`` by stage:
    ``reading``, those of ``Take.seconds`` (``conditions``, ``sampling``, …) and ``baking``.
    """

    action: bpy.types.Action
    take: Take
    warnings: tuple[str, ...]
    seconds: dict[str, float]


def steps(
    context: bpy.types.Context, settings: Settings, weights: "Weights | None" = None,
) -> Generator[float, None, Result]:
    """Read the scene, generate, bake; yields progress in [0, 1] and returns the ``Result``.

    ``settings`` comes from ``settings_of(armature, scene, **overrides)``. Without ``weights`` those of the
    preferences, else the shipped ones, are loaded. The current frame is as it was at every yield, and until the last
    stage nothing in the scene is changed: an error (``InputError``, ``WeightsError``) or ``close()`` leaves it
    untouched.
    """
    if weights is None:
        weights = load_weights(weights_path(context))
    started = perf_counter()
    used = names_in_use(settings)
    try:
        read = yield from within(read_steps(context, settings), 0.0, _READ)
    except ReferenceError as error:
        raise InputError("Something was deleted while the scene was read; generate again.") from error
    seconds = {"reading": perf_counter() - started}

    take = yield from within(
        generate_steps(
            read.scene, read.controls, weights,
            seed=settings.seed, lower_seed=settings.lower_seed, temperature=settings.temperature,
            clean_up=CleanUp(settings.plant_feet, settings.reach_targets, settings.rest_on_seats),
        ),
        _READ, _GENERATED,
    )
    started = perf_counter()
    if gone := used - names_in_use(settings):
        raise InputError(f"'{min(gone)}' is not in the scene any more; generate again.")
    armature = find_object(settings, settings.armature, "character")
    action = bake(take, armature, settings.frame_start, f"{armature.name} take", metres_per_unit(find_scene(settings)))
    seconds |= take.seconds | {"baking": perf_counter() - started}
    yield 1.0
    return Result(action, take, read.warnings + take.warnings, seconds)


def run(context: bpy.types.Context, settings: Settings, weights: "Weights | None" = None) -> Result:
    """``steps`` drained."""
    return drained(steps(context, settings, weights))
