"""Plans of several people: nobody takes a place that is kept, or walks through anybody."""

from itertools import combinations

import numpy as np
import pytest

from dafnet_addon import InputError
from dafnet_addon.director.crowds import plan_crowd
from dafnet_addon.director.others import APART
from dafnet_addon.director.planner import plan_tasks
from dafnet_addon.director.plans import Plan
from dafnet_addon.director.room import Room
from dafnet_addon.director.shots import Somebody
from dafnet_addon.director.tasks import SitOn, StandUp, Task, Wait, WalkTo
from kit.rooms import block, chair, office


def _closest(plans: list[Plan], fps: float = 30.0) -> float:
    """Metres between any two roots at any time of the shot; before and after their plans they
    stand where they are.
    """
    last = max(round(plan.begins * fps) + len(plan) for plan in plans)
    at = []
    for plan in plans:
        frames = np.clip(np.arange(last) - round(plan.begins * fps), 0, len(plan) - 1)
        at.append(plan.path.position[frames, :2])
    gaps = [np.linalg.norm(a - b, axis=1).min() for a, b in combinations(at, 2)]
    return float(min(gaps))


def test_two_people_never_take_one_seat() -> None:
    plans: list[Plan] = []
    for k in range(3):
        task = SitOn("Chair.*", seconds=2)
        plans.append(plan_tasks(office(), [task], start=(k - 1.0, -2.5), others=plans))
    assert {plan.timeline[0].seat for plan in plans} == {"Chair", "Chair.001", "Chair.002"}
    assert _closest(plans) > APART - 0.02
    with pytest.raises(InputError, match="all places there are taken"):
        plan_tasks(office(), [SitOn("Chair.*")], start=(2.0, -2.5), others=plans)


def test_a_seat_is_free_again_when_one_has_left() -> None:
    first = plan_tasks(office(), [SitOn("Chair", seconds=1), WalkTo((2.0, -1.0))], start=(0, -2))
    left = len(first) / first.fps
    late = plan_tasks(
        office(), [SitOn("Chair", seconds=1)], start=(-1.0, -2.5), begins=left, others=[first]
    )
    assert late.timeline[0].seat == "Chair" and _closest([first, late]) > APART - 0.02


def test_a_seat_that_is_left_soon_is_waited_for() -> None:
    room = Room(chair())
    first = plan_tasks(room, [SitOn("Chair", seconds=4), WalkTo((2.0, 2.0))])
    second = plan_tasks(room, [SitOn("Chair", seconds=1)], start=(-1.0, 2.0), others=[first])
    sits = second.timeline[0]
    assert sits.there / second.fps > 4.0 and _closest([first, second]) > APART - 0.02


def test_a_sofa_holds_as_many_as_fit() -> None:
    sofa = Room(
        [
            block("Sofa", (-1.0, -0.3, 0.0), (1.0, 0.3, 0.42)),
            block("Sofa", (-1.0, 0.3, 0.0), (1.0, 0.45, 0.85)),
        ]
    )
    plans: list[Plan] = []
    with pytest.raises(InputError, match="taken"):
        for _ in range(5):
            plans.append(plan_tasks(sofa, [SitOn("Sofa", seconds=2)], others=plans))
    assert len(plans) == 3 and _closest(plans) > APART, "60 cm each"


def test_a_place_that_is_taken_is_stood_beside() -> None:
    first = plan_tasks(office(), [WalkTo((1.0, -1.5))], start=(0.0, -2.5))
    second = plan_tasks(office(), [WalkTo((1.0, -1.5))], start=(2.0, -2.5), others=[first])
    away = np.linalg.norm(second.path.position[-1, :2] - (1.0, -1.5))
    assert APART < away < 0.8 and _closest([first, second]) > APART - 0.02


def test_ways_that_cross_are_walked_one_after_the_other() -> None:
    first = plan_tasks(Room(), [WalkTo((3.0, 0.0))], start=(-3.0, 0.0), heading=-90.0)
    alone = plan_tasks(Room(), [WalkTo((0.0, 3.0))], start=(0.0, -3.0))
    second = plan_tasks(Room(), [WalkTo((0.0, 3.0))], start=(0.0, -3.0), others=[first])
    assert _closest([first, alone]) < 0.2, "they would meet"
    assert _closest([first, second]) > APART - 0.02
    assert 0 < len(second) - len(alone) < 90, "and wait no longer than they must"


def test_who_stands_in_the_way_is_walked_round() -> None:
    stands = plan_tasks(Room(), [Wait(30)], start=(0.0, 0.0))
    passes = plan_tasks(Room(), [WalkTo((3.0, 0.0))], start=(-3.0, 0.0), others=[stands])
    assert _closest([stands, passes]) > APART - 0.05
    assert len(passes) < 300, "without waiting until he has gone"


def test_who_never_leaves_a_door_bars_it_and_that_is_said() -> None:
    walls = [
        block("Wall", (-0.05, -3.0, 0.0), (0.05, -0.5, 2.0)),
        block("Wall", (-0.05, 0.5, 0.0), (0.05, 3.0, 2.0)),
    ]
    room = Room([*walls, block("End", (-3.0, -3.1, 0.0), (3.0, -3.0, 2.0))])
    room = Room([*room.solids, block("End", (-3.0, 3.0, 0.0), (3.0, 3.1, 2.0))])
    room = Room([*room.solids, block("End", (3.0, -3.1, 0.0), (3.1, 3.1, 2.0))])
    stands = plan_tasks(room, [Wait(60)], start=(0.0, 0.0))
    with pytest.raises(InputError, match=r"no way|Somebody else stays in the way"):
        plan_tasks(room, [WalkTo((2.0, 0.0))], start=(-2.0, 0.0), others=[stands])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_five_people_mind_one_another(seed: int) -> None:
    """Those who are planned first know where the others begin."""
    rng = np.random.default_rng(seed)
    days: list[tuple[Task, ...]] = [
        (SitOn("Chair.*", seconds=3, choose="random"), StandUp(), WalkTo("Counter")),
        (WalkTo("Whiteboard"), Wait(2), SitOn("Chair.*", seconds=3, choose="random")),
        (WalkTo("Counter"), Wait(1), WalkTo("Lamp")),
    ]
    people = [
        Somebody(
            name=f"Person {k}",
            seed=seed,
            height=float(rng.uniform(1.55, 1.9)),
            begins=float(rng.uniform(0.0, 3.0)),
            start=(0.8 * k - 1.6, -2.6),
            heading=0.0,
            tasks=days[day],
            character=None,
            cast=None,
            take_seeds=(0,),
        )
        for k, day in enumerate((0, 1, 2, 2, 0))
    ]
    plans = [each.plan for each in plan_crowd(office(), people, 30.0).people]
    assert _closest(plans) > 0.46
