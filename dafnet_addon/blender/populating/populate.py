"""From a shot to a folder: the scene with everybody in it, and what is known of it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ... import load_weights
from ...core.cleanup import CleanUp
from ...core.conditions import STAYS
from ...core.distance import prepared
from ...core.files import require_replaceable, whole_folder
from ...core.generate import Asked, Draw, crowd_steps
from ...core.manifest import MANIFEST, Manifest, content_hash, words_hash
from ...core.progress import run_to_end
from ...core.skeleton import STATURE
from ...core.solids import Scene
from ...core.tables import read_tables
from ...core.take import Take
from ...director.crowds import Planned, over_shot, plan_crowd
from ...director.plans import Plan
from ...director.shots import Shot, drawn, shot_of
from ...director.tasks import said
from ..character.armature import metres_per_unit
from ..character.takes import add_take, play_take
from ..pipeline.baker import bake
from ..pipeline.batch import save_scene
from .cast import hire
from .openings import open_room
from .surroundings import room_of

if TYPE_CHECKING:
    from ...core.weights import Weights

__all__ = ["CLEAN_UP", "SCENE", "populate"]

CLEAN_UP = CleanUp(feet=1.0, reach=1.0, seat=1.0)
"""As *Generate* does by default."""
SCENE = "scene.blend"
"""The scene's name in the folder."""

_TAIL = 0.5  # seconds after the last task, where the length of the shot is not given
_FIRST_FRAME = 1

# Progress when each stage is done.
_OPENED = 0.05
_PLANNED = 0.35
_GENERATED = 0.75
_BAKED = 0.9


@dataclass(frozen=True)
class _Player:
    """Somebody of the shot with his ``armature``, his ``plan`` over the whole of it, his ``takes``
    and their ``actions``.
    """

    planned: Planned
    armature: bpy.types.Object
    plan: Plan
    takes: Sequence[Take]
    actions: Sequence[bpy.types.Action]


def populate(
    spec: Path | str | Mapping[str, Any],
    output: Path | str,
    *,
    changes: Mapping[str, Any] | None = None,
    weights: "Weights | None" = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Manifest:
    """Make a shot, a file or a table of one, and write it as the folder ``output``.

    ``changes``: words that stand for those of the shot. What Blender has open is replaced. Raises
    InputError where the shot cannot be made or written, WeightsError for weights that cannot be
    used; nothing is written then, and an earlier output stays.
    """
    shot, output = _shot(spec, changes or {}), Path(output)
    require_replaceable(output, MANIFEST)
    weights = weights or load_weights()

    clock = _Clock()
    files, warnings = open_room(shot)
    clock.done("opening")
    progress(_OPENED)

    context = bpy.context
    scene = context.scene
    fps = scene.render.fps / scene.render.fps_base
    room = room_of(context)
    clock.done("reading")

    crowd = run_to_end(
        plan_crowd.steps(room, drawn(shot), fps, fewer=shot.fewer),
        lambda share: progress(_OPENED + share * (_PLANNED - _OPENED)),
    )
    frames = _length(shot, crowd.people, fps)
    plans = [over_shot(each.plan, frames) for each in crowd.people]
    clock.done("planning")

    solids, said_of_them = prepared(Scene(tuple(room.solids)), room.floor)
    clock.done("distances")
    takes = run_to_end(
        crowd_steps(
            solids,
            [
                Asked(plan.controls(), _draws(each, shot))
                for each, plan in zip(crowd.people, plans, strict=True)
            ],
            weights,
            clean_up=CLEAN_UP,
        ),
        lambda share: progress(_PLANNED + share * (_GENERATED - _PLANNED)),
    )
    clock.done("generating")

    scene.frame_start, scene.frame_end = _FIRST_FRAME, _FIRST_FRAME + frames - 1
    players = []
    for each, plan, made in zip(crowd.people, plans, takes, strict=True):
        players.append(_baked(context, each, plan, made, _draws(each, shot)))
        share = len(players) / len(plans)
        progress(_GENERATED + share * (_BAKED - _GENERATED))
    scene.frame_set(_FIRST_FRAME)
    clock.done("baking")

    told = [*warnings, *said_of_them, *crowd.left_out, *_warnings(players)]
    with whole_folder(output, MANIFEST) as folder:
        save_scene(folder / SCENE, lambda: progress(1.0))
        clock.done("saving")
        manifest = Manifest(
            words=words_hash(shot.words),
            seed=shot.seed,
            takes=shot.takes,
            inputs={str(file.absolute()): content_hash(file) for file in files},
            weights=content_hash(Path(weights.path)),
            seconds=clock.seconds,
            metrics=_means(take for each in players for take in each.takes),
            warnings=told,
            people=[_said_of(each, fps) for each in players],
            content={
                f"{each.planned.who.name}, take {k}": _content(take)
                for each in players
                for k, take in enumerate(each.takes, 1)
            },
        )
        manifest.save(folder)
    return manifest


class _Clock:
    """Seconds by stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._since = perf_counter()

    def done(self, stage: str) -> None:
        now = perf_counter()
        self.seconds[stage] = round(now - self._since, 3)
        self._since = now


def _shot(spec: Path | str | Mapping[str, Any], changes: Mapping[str, Any]) -> Shot:
    if isinstance(spec, Mapping):
        return shot_of({**spec, **changes})
    file = Path(spec)
    return shot_of({**read_tables(file, "shots"), **changes}, file.parent)


def _length(shot: Shot, people: Sequence[Planned], fps: float) -> int:
    """Frames of the shot."""
    if shot.seconds is not None:
        return max(1, round(shot.seconds * fps))
    last = max(round(each.plan.begins * fps) + len(each.plan) for each in people)
    return last + round(_TAIL * fps)


def _draws(planned: Planned, shot: Shot) -> tuple[Draw, ...]:
    return tuple(Draw(seed, temperature=shot.temperature) for seed in planned.who.take_seeds)


def _baked(
    context: bpy.types.Context,
    planned: Planned,
    plan: Plan,
    takes: Sequence[Take],
    draws: Sequence[Draw],
) -> _Player:
    armature = hire(context, planned.who)
    unit = metres_per_unit(context.scene)
    actions = []
    for k, (take, draw) in enumerate(zip(takes, draws, strict=True), 1):
        action = bake(take, armature, _FIRST_FRAME, f"{armature.name} take {k}", unit)
        add_take(
            armature,
            action,
            take=take,
            controls=plan.controls(),
            draw=draw,
            frame_start=_FIRST_FRAME,
        )
        actions.append(action)
    play_take(armature, actions[0])
    return _Player(planned, armature, plan, takes, actions)


def _warnings(players: Sequence[_Player]) -> list[str]:
    """Of plans and takes, each sentence once, with who it is about; but that one who sits does not
    move is as it should be.
    """
    found: dict[str, list[str]] = {}
    for each in players:
        for sentence in (*each.planned.plan.warnings, *each.takes[0].warnings):
            if sentence != STAYS:
                found.setdefault(sentence, []).append(each.planned.who.name)
    return [f"{names[0]}{_more(names)}: {sentence}" for sentence, names in found.items()]


def _more(names: Sequence[str]) -> str:
    return f" and {len(names) - 1} more" if len(names) > 1 else ""


def _said_of(player: _Player, fps: float) -> dict[str, Any]:
    """Who did what when, in plain data; seconds of the shot."""
    who = player.planned.who
    return {
        "name": who.name,
        "armature": player.armature.name,
        "height": round(player.plan.scale * STATURE, 3),
        "begins": who.begins,
        "actions": [action.name for action in player.actions],
        "seeds": list(who.take_seeds),
        "metrics": [
            {
                name: None if value is None else round(value, 5)
                for name, value in take.metrics.items()
            }
            for take in player.takes
        ],
        "tasks": [
            {
                "task": said(entry.task),
                "start": round(entry.start / fps, 3),
                "there": round(entry.there / fps, 3),
                "stop": round(entry.stop / fps, 3),
                "furniture": entry.furniture,
                "seat": entry.seat,
            }
            for entry in player.plan.timeline
        ],
    }


def _means(takes: Any) -> dict[str, float]:
    """Of each metric that was measured."""
    values: dict[str, list[float]] = {}
    for take in takes:
        for name, value in take.metrics.items():
            if value is not None and np.isfinite(value):
                values.setdefault(name, []).append(float(value))
    return {name: round(float(np.mean(each)), 5) for name, each in values.items()}


def _content(take: Take) -> str:
    """A hash of a motion, to the tenth of a millimetre."""
    joints = np.rint(np.asarray(take.joints) * 1e4).astype(np.int32)
    return sha256(joints.tobytes()).hexdigest()
