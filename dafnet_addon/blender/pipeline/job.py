"""From the scene to keyframes: the one code path under the operator, the command line and batches.

A job knows objects by name only and looks them up at each stage, since they may be deleted or
undone while it runs.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import bpy
import numpy as np

from ... import load_weights
from ...core.cleanup import CleanUp
from ...core.draws import Draw
from ...core.errors import InputError
from ...core.generate import clean_again_steps, takes_steps
from ...core.progress import stepwise, within
from ...core.take import Controls, Take, warnings_of
from ..character.armature import metres_per_unit
from ..character.settings import CLEAN_UP, HELD, Settings, settings_of
from ..character.takes import add_take, draw_of, play_take, stored_take
from ..preferences import weights_path
from ..scene.lookup import find_action, find_object, find_scene, names_in_use
from ..scene.playback import nothing_deleted
from ..scene.scene_reader import read_scene
from ..scene.unit_note import unit_note
from .baker import bake
from .rollback import state_restorer, undone_on_failure
from .running import note_change

if TYPE_CHECKING:
    from ...core.weights import Weights

__all__ = [
    "Result",
    "Settings",
    "bake_steps",
    "clean_up_again",
    "clean_up_of",
    "distinct_seeds",
    "draws_of",
    "run",
    "run_all",
    "settings_of",
    "steps",
]

_READ = 0.1
"""Progress once the scene is read."""
_READ_AGAIN = 0.3
"""The same where a take is only cleaned up again."""
_GENERATED = 0.95
"""Progress once the takes are generated."""
_FURTHER_TAKES = 1.0
"""Temperature of the further takes where it is set to 0, at which all would be the same."""


@dataclass(frozen=True)
class Result:
    """Baked takes of one shot.

    ``actions``: new, the first one played by the armature; ``takes``: of each.
    ``warnings``: sentences for the user. ``seconds`` by stage: ``reading``, those of
    ``Take.seconds`` (``conditions``, ``sampling``, …) and ``baking``.
    """

    actions: tuple[bpy.types.Action, ...]
    takes: tuple[Take, ...]
    warnings: tuple[str, ...]
    seconds: dict[str, float]

    @property
    def action(self) -> bpy.types.Action:
        """The first take's action."""
        return self.actions[0]

    @property
    def take(self) -> Take:
        """The first take."""
        return self.takes[0]


def draws_of(settings: Settings) -> list[Draw]:
    """The seeds and temperatures of the takes: each further one has the next seed."""
    held = settings.noise == HELD
    first = Draw(
        seed=settings.seed,
        lower_seed=settings.lower_seed,
        temperature=settings.temperature,
        lower_temperature=settings.lower_temperature,
        held=held,
    )
    further = settings.temperature or _FURTHER_TAKES
    seeds = range(settings.seed + 1, settings.seed + settings.take_count)
    return [first, *(Draw(seed=seed, temperature=further, held=held) for seed in seeds)]


def distinct_seeds(people: Sequence[Settings]) -> list[Settings]:
    """The settings of several characters, whose takes have seeds of their own: who has a seed that
    another one has before her gets the next that is free.
    """
    used: set[int] = set()
    found = []
    for settings in people:
        seed = settings.seed
        while used & {*range(seed, seed + settings.take_count)}:
            seed += 1
        used |= {*range(seed, seed + settings.take_count)}
        found.append(replace(settings, seed=seed))
    return found


def clean_up_of(settings: Settings) -> CleanUp:
    return CleanUp(**{strength: getattr(settings, name) for name, strength in CLEAN_UP.items()})


@stepwise
def run(
    context: bpy.types.Context,
    settings: Settings,
    weights: "Weights | None" = None,
    watch: Callable[[int, np.ndarray], None] | None = None,
    device: str | None = None,
) -> Generator[float, None, Result]:
    """Read the scene, generate, bake; yields progress in [0, 1] and returns the ``Result``.

    ``settings`` comes from ``settings_of(armature, scene, **overrides)``. Without ``weights`` those
    of the preferences, else the shipped ones, are loaded. ``watch``, ``device``: see
    ``takes_steps``. The current frame is as it was at every yield (but see ``read_scene`` for
    simulations). Any error (``InputError``, ``WeightsError`` or any other), and ``close()``, leaves
    the scene as it was.
    """
    if weights is None:
        weights = load_weights(weights_path(context))

    started = perf_counter()
    used = names_in_use(settings)
    kept = _kept_take(settings)
    begins_as = None
    if settings.begins_as is not None:
        _, begins_as = _chosen_take(settings, find_action(settings.begins_as))
    note = unit_note(find_scene(settings), _character(settings))

    with nothing_deleted("the scene was read", "generate again"):
        read = yield from within(read_scene.steps(context, settings), 0.0, _READ)

    seconds = {"reading": perf_counter() - started}

    controls = read.controls
    if begins_as is not None:
        controls = replace(controls, before=begins_as.before, before_root=begins_as.before_root)
    takes = yield from within(
        takes_steps(
            read.scene,
            controls,
            weights,
            draws_of(settings),
            resume=None if kept is None else kept.take,
            resume_frame=0 if kept is None else kept.until,
            resume_until=None if kept is None else kept.again,
            device=device,
            clean_up=clean_up_of(settings),
            watch=watch,
        ),
        _READ,
        _GENERATED,
    )

    started = perf_counter()
    if gone := used - names_in_use(settings):
        raise InputError(f"'{min(gone)}' is no longer in the scene; generate again.")

    baked = bake_steps(settings, takes, controls, whole=kept is None)
    actions = yield from within(baked, _GENERATED, 1.0)
    seconds |= takes[0].seconds | {"fitting": sum(take.seconds["fitting"] for take in takes)}
    seconds["baking"] = perf_counter() - started
    yield 1.0

    return Result(
        actions=tuple(actions),
        takes=tuple(takes),
        warnings=(*([note] if note else []), *read.warnings, *_warnings(actions, takes)),
        seconds=seconds,
    )


steps = run.steps


@stepwise
def run_all(
    context: bpy.types.Context,
    people: Sequence[Settings],
    watch: Callable[[int, np.ndarray], None] | None = None,
) -> Generator[float, None, tuple[Result, ...]]:
    """``run`` for several characters, one after another: all get their takes, or none does. The
    seeds become their settings.
    """
    weights = load_weights(weights_path(context))
    results: list[Result] = []
    with ExitStack() as undo:
        for k, settings in enumerate(people):
            names: list[str] = []
            undo.callback(_remove_bake, settings, names, state_restorer(_character(settings)))
            one = run.steps(context, settings, weights, watch=watch)
            result = yield from within(one, k / len(people), (k + 1) / len(people))
            names += [action.name_full for action in result.actions]
            results.append(result)
        undo.pop_all()
    for settings in people:
        _character(settings).dafnet.seed = settings.seed
    return tuple(results)


class _Kept(NamedTuple):
    """A ``take`` that is kept in part: before the frame ``until`` of the range and, if it is given,
    from the frame ``again`` on.
    """

    take: Take
    until: int
    again: int | None


def _kept_take(settings: Settings) -> _Kept | None:
    """The take that is kept in part; None where nothing is kept."""
    if settings.kept is None:
        return None

    action, start = find_action(settings.kept), settings.frame_start
    take, _ = _chosen_take(settings, action)
    if action.dafnet.frame_start != start:
        raise InputError(
            f"The take '{action.name}' begins at another frame than the range; let the range "
            "start there."
        )
    if settings.kept_until == start:
        raise InputError(
            f"The take '{action.name}' begins at frame {start}, so nothing of it would be kept "
            "before that; press Generate to make all of it anew, or go to a later frame."
        )
    stop = start + len(take)
    if settings.kept_from == stop and settings.kept_until < stop:
        raise InputError(
            f"The take '{action.name}' ends at frame {stop - 1}, so nothing of it would be kept "
            "after that; go to where it is to be made anew, and press From Here On."
        )
    for frame in (settings.kept_until, settings.kept_from):
        if frame is not None and not start < frame < stop:
            raise InputError(
                f"Frame {frame} is not inside the take '{action.name}'; go to a frame in it."
            )

    again = None if settings.kept_from is None else settings.kept_from - start
    return _Kept(take, settings.kept_until - start, again)


def _chosen_take(settings: Settings, action: bpy.types.Action) -> tuple[Take, Controls]:
    """The take of an action that another one is to go by, and its controls. ``InputError`` where
    the scene has another rate now: its keys stay at their frames, so that it plays at another
    speed than it was made for.
    """
    take, controls = stored_take(action)
    render = find_scene(settings).render
    fps = render.fps / render.fps_base
    if not np.isclose(take.fps, fps, rtol=1e-5):
        raise InputError(
            f"The take '{action.name}' was made at {take.fps:g} frames a second and the scene has "
            f"{fps:g} now, so it plays at another speed; set the rate back, or press Generate for "
            "a new one."
        )
    return take, controls


def bake_steps(
    settings: Settings, takes: list[Take], controls: Controls, *, whole: bool
) -> Generator[float, None, list[bpy.types.Action]]:
    """An action for each take, listed on the armature; the first one plays. All are made or none:
    whatever stops it, nothing has changed. ``whole``: see ``add_take``.
    """
    names: list[str] = []
    with ExitStack() as undo:
        undo.callback(_remove_bake, settings, names, state_restorer(_character(settings)))
        for take in takes:
            armature = _character(settings)

            with undone_on_failure(armature):
                unit = metres_per_unit(find_scene(settings))
                start = settings.frame_start
                action = bake(take, armature, start, name=f"{armature.name} take", unit=unit)
                add_take(armature, action, take, controls, frame_start=start, whole=whole)
                names.append(action.name_full)

            note_change()
            if len(names) < len(takes):
                yield len(names) / len(takes)

        actions = list(map(find_action, names))
        play_take(armature, actions[0])
        undo.pop_all()

    return actions


def _warnings(actions: Sequence[bpy.types.Action], takes: Sequence[Take]) -> Iterator[str]:
    """What takes have to say, each sentence once; what not all have, with the names of those."""
    for sentence, which in warnings_of(takes).items():
        about = ", ".join(f"'{actions[k].name}'" for k in which)
        yield sentence if len(which) == len(takes) else f"{about}: {sentence}"


def _character(settings: Settings) -> bpy.types.Object:
    return find_object(settings, settings.armature, "character")


def _remove_bake(
    settings: Settings, names: list[str], restore: Callable[[bpy.types.Object], None]
) -> None:
    """Restore the character, if it still exists, and remove the actions of these names."""
    for armature in (o for o in bpy.data.objects if o.name_full == settings.armature):
        restore(armature)
    for action in [action for action in bpy.data.actions if action.name_full in names]:
        bpy.data.actions.remove(action)


@stepwise
def clean_up_again(
    context: bpy.types.Context, armature: bpy.types.Object, action: bpy.types.Action
) -> Generator[float, None, Result]:
    """Clean up the take of ``action`` with the character's present settings, as a new action and
    without sampling again.

    Targets, root and mode count as they were when it was generated, furniture as it is now. A job
    as ``run`` is one. ``InputError`` as there, and where the action holds no take; nothing is
    changed then.
    """
    take, controls = stored_take(action)
    # In takes that were packed before it was noted, only the action knows it.
    take = replace(take, draw=draw_of(action))
    start, whole = action.dafnet.frame_start, action.dafnet.whole
    settings = settings_of(
        armature,
        context.scene,
        frame_start=start,
        frame_end=start + len(take) - 1,
        mode="FREE",
        begins_as=action.name_full,
    )
    with nothing_deleted("the scene was read", "clean up again"):
        read = yield from within(read_scene.steps(context, settings), 0.0, _READ_AGAIN)

    cleaned = clean_again_steps(read.scene, controls, take, clean_up_of(settings))
    again = yield from within(cleaned, _READ_AGAIN, _GENERATED)
    baked = bake_steps(settings, [again], controls, whole=whole)
    actions = yield from within(baked, _GENERATED, 1.0)
    return Result(
        actions=tuple(actions),
        takes=(again,),
        warnings=again.warnings,
        seconds=again.seconds,
    )
