"""Characters with tasks: what they are to do is planned in the scene, and keyed."""

from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.progress import stepwise, within
from ...core.root import RootPath, yaw_of
from ...core.series import runs
from ...core.skeleton import STATURE
from ...director.others import APART
from ...director.planner import plan_tasks
from ...director.plans import Hold, Plan
from ...director.room import Room
from ...director.tasks import Task
from ...director.track import Targets
from ..character.armature import character_scale, is_character, metres_per_unit
from ..character.settings import Settings, settings_of
from ..character.standing import roots_brought_along
from ..character.targets import add_root, lacks_root
from ..populating.surroundings import room_of
from ..scene.lookup import find_object, require_enabled
from ..scene.playback import frame_kept, play_steps
from .plan_keys import plan_keyed
from .root_keys import keyable_root
from .surroundings import find_furniture
from .walking import extend_range

__all__ = ["Directed", "Assignment", "direct"]

_READ = 0.1
"""Progress once the scene is read."""
_PLANNED = 0.9
"""Progress once everybody is planned."""
_STANDS = 1.0  # seconds of standing for which others keep their place
_STILL = 0.02  # metres a second


@dataclass(frozen=True)
class Assignment:
    """A character's ``armature`` and ``tasks``; ``already_there``: at first it is where its first
    task is done, instead of where its root stands.
    """

    armature: bpy.types.Object
    tasks: Sequence[Task]
    already_there: bool = False


@dataclass(frozen=True)
class Directed:
    """What was keyed for the character ``name``: its ``plan``, frames ``first`` to ``last``, both
    included. ``kept``: the actions in which keys are that the user had made or edited;
    ``extended``: whether its range had to be; ``warnings``: sentences for the user.
    """

    name: str
    plan: Plan
    first: int
    last: int
    kept: tuple[str, ...]
    extended: bool
    warnings: tuple[str, ...]


@stepwise
def direct(
    context: bpy.types.Context, people: Sequence[Assignment]
) -> Generator[float, None, tuple[Directed, ...]]:
    """Plan the tasks of some characters of the active scene, one after another, from the start of
    their ranges on, and key them. All others in the scene are walked round and waited for.

    They begin where their bodies stand, if those alone were moved by hand (``standing``). A root is
    added where a character has none. Who has no furniture gets what is near her path. A
    job that yields its progress. ``InputError``, with the character's name: something cannot be
    done or keyed; nothing is changed then, of nobody.
    """
    armatures = [assigned.armature for assigned in people]
    with (
        _roots_added(context, armatures),
        roots_brought_along(context.scene, armatures, metres_per_unit(context.scene)),
    ):
        return (yield from _direct(context, people))


@contextmanager
def _roots_added(
    context: bpy.types.Context, armatures: Sequence[bpy.types.Object]
) -> Iterator[None]:
    """A block before which characters without a root get one; if it fails, or its job is closed,
    they have none again.
    """
    added: dict[str, str] = {}
    try:
        for each in armatures:
            if lacks_root(context, each):
                added[each.name_full] = add_root(context, each).name_full
        yield
    except BaseException:
        for each in [o for o in bpy.data.objects if o.name_full in added]:
            if each.dafnet.root is not None and each.dafnet.root.name_full == added[each.name_full]:
                bpy.data.objects.remove(each.dafnet.root)
        raise


def _direct(
    context: bpy.types.Context, people: Sequence[Assignment]
) -> Generator[float, None, tuple[Directed, ...]]:
    scene = context.scene
    unit, fps = metres_per_unit(scene), scene.render.fps / scene.render.fps_base
    settings = [settings_of(assigned.armature, scene, mode="FREE") for assigned in people]
    roots = [keyable_root(each) for each in settings]
    require_enabled(context.evaluated_depsgraph_get(), roots)

    first = min(each.frame_start for each in settings)
    others = yield from within(_others(context, people, first), 0.0, _READ)
    plans: list[Plan] = []
    for k, (assigned, own) in enumerate(zip(people, settings, strict=True)):
        share = (_PLANNED - _READ) / len(people)
        before = [*others, *plans]
        job = _plan(context, assigned, own, first=first, unit=unit, fps=fps, others=before)
        plans.append((yield from within(job, _READ + k * share, _READ + (k + 1) * share)))

    armatures = [find_object(own, own.armature, "character") for own in settings]
    # All at once, so that whoever cannot be keyed leaves the others as they were.
    kept = []
    with ExitStack() as undo:
        for armature, own, plan in zip(armatures, settings, plans, strict=True):
            keyed = plan_keyed(context, armature, plan, first=own.frame_start, unit=unit)
            kept.append(undo.enter_context(keyed))

    directed = []
    for k, (armature, plan) in enumerate(zip(armatures, plans, strict=True)):
        first = settings[k].frame_start
        last = first + len(plan) - 1
        extended = extend_range(scene, armature, last)
        directed.append(
            Directed(armature.name, plan, first, last, kept[k], extended, plan.warnings)
        )

    for armature in armatures:
        if armature.dafnet.furniture is None:
            _furnish(context, armature)
    return tuple(directed)


def _furnish(context: bpy.types.Context, armature: bpy.types.Object) -> None:
    """Give a character the furniture along its path, if there is any."""
    try:
        find_furniture(context, armature)
    except InputError:
        return  # nothing is near, which is as good as a bare floor


def _plan(
    context: bpy.types.Context,
    assigned: Assignment,
    settings: Settings,
    *,
    first: int,
    unit: float,
    fps: float,
    others: Sequence[Plan],
) -> Generator[float, None, Plan]:
    """The plan of one of them, who begins at the start of her own range; the shot's second 0 is
    frame ``first``.
    """
    armature = find_object(settings, settings.armature, "character")
    size = character_scale(armature, unit)
    begins = (settings.frame_start - first) / fps
    with frame_kept(context.scene):
        context.scene.frame_set(settings.frame_start)
        root = keyable_root(settings).matrix_world
        place, yaw = np.array(root.translation) * unit, float(yaw_of(np.array(root.col[1][:2])))
        room = replace(_without_people(room_of(context), context.scene), floor=float(place[2]))
    yield 0.1

    try:
        plan = yield from within(
            plan_tasks.steps(
                room,
                assigned.tasks,
                start=None if assigned.already_there else (float(place[0]), float(place[1])),
                heading=float(np.degrees(yaw)),
                seed=settings.seed,
                height=STATURE * size,
                fps=fps,
                begins=begins,
                others=others,
            ),
            0.1,
            1.0,
        )
    except InputError as error:
        raise InputError(f"'{armature.name}': {error}") from error
    return plan


def _without_people(room: Room, scene: bpy.types.Scene) -> Room:
    """The room without the empties of characters, which nobody looks at or reaches for."""
    own = {
        each.name
        for armature in scene.objects
        if armature.type == "ARMATURE"
        for each in (armature.dafnet.root, *_targets(armature))
        if each is not None
    }
    return replace(room, points={k: at for k, at in room.points.items() if k not in own})


def _targets(armature: bpy.types.Object) -> list[bpy.types.Object | None]:
    own = armature.dafnet
    return [own.head, own.hand_left, own.hand_right, own.foot_left, own.foot_right]


def _others(
    context: bpy.types.Context, people: Sequence[Assignment], first: int
) -> Generator[float, None, list[Plan]]:
    """The ways of the characters without tasks, as their roots go them."""
    scene = context.scene
    unit, fps = metres_per_unit(scene), scene.render.fps / scene.render.fps_base
    assigned = {each.armature for each in people}
    roots = [
        each.dafnet.root
        for each in scene.objects
        if each not in assigned and is_character(each) and not lacks_root(context, each)
    ]
    if not roots:
        return []

    seen: list[list[np.ndarray]] = [[] for _ in roots]

    def look(_frame: int, depsgraph: bpy.types.Depsgraph, _shaped: set[bpy.types.Object]) -> None:
        for places, root in zip(seen, roots, strict=True):
            places.append(np.array(root.evaluated_get(depsgraph).matrix_world.translation) * unit)

    yield from play_steps(context, range(first, max(first, scene.frame_end) + 1), (), look)
    return [_as_plan(np.array(places), fps) for places in seen]


def _as_plan(places: np.ndarray, fps: float) -> Plan:
    """A way (T, 3), metres, as somebody's plan, who keeps the places at which she stands."""
    speed = np.linalg.norm(np.diff(places[:, :2], axis=0, prepend=places[:1, :2]), axis=1) * fps
    holds = [
        Hold(places[start, :2], APART, start / fps, np.inf if stop == len(places) else stop / fps)
        for start, stop in runs(speed < _STILL, at_least=_STANDS * fps)
    ]
    return Plan(
        fps=fps,
        path=RootPath(places, np.zeros(len(places))),
        targets=Targets({}, None, {}, ("FREE",) * len(places)),
        timeline=(),
        holds=tuple(holds),
    )
