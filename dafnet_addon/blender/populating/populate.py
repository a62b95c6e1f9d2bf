"""From a shot to a folder: the scene with everybody in it, and what is known of it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
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
from ...core.draws import Draw
from ...core.files import require_replaceable, whole_folder
from ...core.generate import crowd_steps
from ...core.manifest import MANIFEST, Manifest, content_hash, words_hash
from ...core.progress import run_to_end
from ...core.root import root_from_matrices
from ...core.skeleton import STATURE
from ...core.solids import Scene
from ...core.tables import read_tables
from ...core.take import Asked, Controls, Take, warnings_of
from ...director.crowds import Crowd, over_shot, plan_crowd
from ...director.plans import Plan
from ...director.room import Room
from ...director.shots import Shot, drawn, shot_of
from ...director.tasks import said
from ...director.track import Targets
from ..character.settings import settings_of
from ..delivery.deliver import deliver
from ..delivery.people import Played
from ..pipeline.batch import save_scene
from ..scene.scene_reader import read_scene
from .cast import Player, dismiss, embodied, hire, play
from .openings import open_room
from .surroundings import furniture_of_room, room_of

if TYPE_CHECKING:
    from ...core.weights import Weights

__all__ = ["CLEAN_UP", "SCENE", "populate"]

CLEAN_UP = CleanUp(feet=1.0, reach=1.0, seat=1.0)
"""As *Generate* does by default."""
SCENE = "scene.blend"
"""The scene's name in the folder."""

_TAIL = 0.5  # seconds after the last task, where the length of the shot is not given

# Progress when each stage is done.
_OPENED = 0.05
_PLANNED = 0.35
_GENERATED = 0.75
_BAKED = 0.9
_SAVED = 0.92


@dataclass(frozen=True)
class _Part:
    """What somebody does in all frames of the shot: his ``plan``, None where he is led by his own
    root, and what he is generated from.
    """

    player: Player
    plan: Plan | None
    controls: Controls
    draws: tuple[Draw, ...]


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
    opened, warnings = open_room(shot)
    context = bpy.context
    scene = context.scene
    room = room_of(context)
    people = drawn(shot)
    files = [*opened, *{shot.path(who.cast) for who in people if who.cast is not None}]
    inputs = {str(file.absolute()): content_hash(file) for file in files}
    players = [hire(context, shot, who) for who in people]
    clock.done("opening")
    progress(_OPENED)

    parts, left_out = _planned(
        context, shot, room, players, lambda share: progress(_between(_OPENED, _PLANNED, share))
    )
    clock.done("planning")

    solids, said_of_them = prepared(Scene(tuple(room.solids)), room.floor)
    clock.done("distances")
    takes = run_to_end(
        crowd_steps(
            solids,
            [Asked(part.controls, part.draws) for part in parts],
            weights,
            clean_up=CLEAN_UP,
        ),
        lambda share: progress(_between(_PLANNED, _GENERATED, share)),
    )
    clock.done("generating")
    clock.seconds["of which network"] = round(
        sum(take.seconds["sampling"] / len(made) for made in takes for take in made), 3
    )

    scene.frame_end = scene.frame_start + len(parts[0].controls) - 1
    played = []
    furniture = furniture_of_room(scene)
    players = [embodied(context, part.player, part.plan, furniture) for part in parts]
    for player, part, made in zip(players, parts, takes, strict=True):
        armature, actions = play(
            context,
            player,
            takes=made,
            controls=part.controls,
            first=scene.frame_start,
        )
        played.append(Played(armature, made, actions, part.plan))
        progress(_between(_GENERATED, _BAKED, len(played) / len(parts)))
    scene.frame_set(scene.frame_start)
    clock.done("baking")

    told = [*warnings, *said_of_them, *left_out, *_warnings(parts, takes)]
    with whole_folder(output, MANIFEST) as folder:
        save_scene(folder / SCENE, lambda: progress(_SAVED))
        clock.done("saving")
        if shot.wishes.anything:
            job = deliver.steps(scene, played, folder, shot.wishes)
            told += run_to_end(job, lambda share: progress(_between(_SAVED, 1.0, share)))
            clock.done("delivering")

        manifest = Manifest(
            words=words_hash(shot.words),
            seed=shot.seed,
            takes=shot.takes,
            inputs=inputs,
            weights=content_hash(Path(weights.path)),
            seconds=clock.seconds,
            metrics=_means(takes),
            warnings=told,
            people=[_said_of(part, each, scene) for part, each in zip(parts, played, strict=True)],
            content={
                f"{part.player.who.name}, take {k}": _content(take)
                for part, made in zip(parts, takes, strict=True)
                for k, take in enumerate(made, 1)
            },
        )
        manifest.save(folder)
    progress(1.0)
    return manifest


def _between(low: float, high: float, share: float) -> float:
    return low + share * (high - low)


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


def _planned(
    context: bpy.types.Context,
    shot: Shot,
    room: Room,
    players: Sequence[Player],
    progress: Callable[[float], None],
) -> tuple[list[_Part], tuple[str, ...]]:
    """What everybody does, those who are led by their own roots first; and a sentence for each who
    is left out.
    """
    scene = context.scene
    fps = scene.render.fps / scene.render.fps_base
    own = range(scene.frame_start, scene.frame_end + 1)
    led = {player.who.name: player for player in players if not player.who.tasks}
    present = [_walked(_own_controls(context, each, own)) for each in led.values()]

    crowd = Crowd(())
    if len(led) < len(players):
        asked = [player.who for player in players if player.who.tasks]
        job = plan_crowd.steps(room, asked, fps, present=present, fewer=shot.fewer)
        crowd = run_to_end(job, progress)

    plans = {each.who.name: each.plan for each in crowd.people}
    frames = _length(shot, [*plans.values(), *present], fps)
    shown = range(scene.frame_start, scene.frame_start + frames)
    parts = []
    for player in players:
        draws = tuple(Draw(seed, temperature=shot.temperature) for seed in player.who.take_seeds)
        if player.who.name in led:
            parts.append(_Part(player, None, _own_controls(context, player, shown), draws))
        elif player.who.name in plans:
            plan = over_shot(plans[player.who.name], frames)
            parts.append(_Part(player, plan, plan.controls(), draws))
        else:
            dismiss(player)
    return parts, crowd.left_out


def _own_controls(context: bpy.types.Context, player: Player, frames: range) -> Controls:
    """What a character's own root and targets ask."""
    settings = settings_of(
        player.armature, context.scene, frame_start=frames[0], frame_end=frames[-1]
    )
    return read_scene(context, settings).controls


def _walked(controls: Controls) -> Plan:
    """The plan of somebody who goes where his root goes."""
    path, _ = root_from_matrices(np.asarray(controls.root, float))
    return Plan(
        fps=controls.fps,
        path=path,
        targets=Targets({}, None, {}, ("FREE",) * len(path)),
        timeline=(),
        scale=controls.scale,
    )


def _length(shot: Shot, plans: Sequence[Plan], fps: float) -> int:
    """Frames of the shot."""
    if shot.seconds is not None:
        return max(1, round(shot.seconds * fps))
    last = max(round(plan.begins * fps) + len(plan) for plan in plans)
    return last + round(_TAIL * fps)


def _warnings(parts: Sequence[_Part], takes: Sequence[Sequence[Take]]) -> list[str]:
    """Of plans and takes, each sentence once, with who it is about; but that one who sits does not
    move is as it should be.
    """
    found: dict[str, list[str]] = {}
    for part, made in zip(parts, takes, strict=True):
        who = part.player.who.name
        for sentence in part.plan.warnings if part.plan is not None else ():
            found.setdefault(sentence, []).append(who)
        for sentence, which in warnings_of(made).items():
            if part.plan is None or sentence != STAYS:
                all_of_them = len(which) == len(made)
                names = [who] if all_of_them else [f"{who}, take {k + 1}" for k in which]
                found.setdefault(sentence, []).extend(names)
    return [f"{names[0]}{_more(names)}: {sentence}" for sentence, names in found.items()]


def _more(names: Sequence[str]) -> str:
    return f" and {len(names) - 1} more" if len(names) > 1 else ""


def _said_of(part: _Part, played: Played, scene: bpy.types.Scene) -> dict[str, Any]:
    """Who did what when, in plain data; seconds of the shot."""
    who, fps = part.player.who, scene.render.fps / scene.render.fps_base
    return {
        "name": who.name,
        "armature": played.armature.name,
        "cast": who.cast,
        "height": round(part.controls.scale * STATURE, 3),
        "begins": who.begins,
        "actions": [action.name for action in played.actions],
        "seeds": [take.draw.seed for take in played.takes],
        "metrics": [
            {
                name: None if value is None else round(value, 5)
                for name, value in take.metrics.items()
            }
            for take in played.takes
        ],
        "verdict": [[asdict(finding) for finding in take.verdict] for take in played.takes],
        "tasks": [
            {
                "task": said(entry.task),
                "start": round(entry.start / fps, 3),
                "there": round(entry.there / fps, 3),
                "stop": round(entry.stop / fps, 3),
                "furniture": entry.furniture,
                "seat": entry.seat,
            }
            for entry in (part.plan.timeline if part.plan is not None else ())
        ],
    }


def _means(takes: Sequence[Sequence[Take]]) -> dict[str, float]:
    """Of each metric that was measured."""
    values: dict[str, list[float]] = {}
    for take in (take for made in takes for take in made):
        for name, value in take.metrics.items():
            if value is not None and np.isfinite(value):
                values.setdefault(name, []).append(float(value))
    return {name: round(float(np.mean(each)), 5) for name, each in values.items()}


def _content(take: Take) -> str:
    """A hash of a motion, to the tenth of a millimetre."""
    joints = np.rint(np.asarray(take.joints) * 1e4).astype(np.int32)
    return sha256(joints.tobytes()).hexdigest()
