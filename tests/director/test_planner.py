"""Plans: where tasks are done, when, and how hands and heads move; what is refused."""

import numpy as np
import pytest

from dafnet_addon import Controls, InputError
from dafnet_addon.core.rotations import rotate
from dafnet_addon.core.series import minimum_jerk
from dafnet_addon.core.skeleton import STATURE
from dafnet_addon.director import movements
from dafnet_addon.director.places import REACH, Place, seated_pelvis, shoulder
from dafnet_addon.director.planner import plan_tasks
from dafnet_addon.director.plans import Plan
from dafnet_addon.director.room import Room
from dafnet_addon.director.seats import seat_of
from dafnet_addon.director.tasks import (
    LieOn,
    LookAt,
    Reach,
    SitOn,
    StandUp,
    Task,
    Wait,
    WalkAlong,
    WalkTo,
    WorkAt,
    WriteOn,
)
from kit.rooms import block, chair, desk, office, put

START = (0.0, -2.5)
DAY: tuple[Task, ...] = (
    SitOn("Chair", seconds=2),
    WorkAt("Desk", seconds=2),
    LookAt("Lamp", seconds=1),
    StandUp(),
    WriteOn("Whiteboard", seconds=3),
    WorkAt("Counter", how="handling", seconds=4),
    Reach("Cup", seconds=1),
    WalkTo((0.0, -2.0), facing="Whiteboard"),
    Wait(1),
)


def _at(plan: Plan, frame: int) -> np.ndarray:
    return plan.path.position[frame, :2]


def _speeds(plan: Plan, points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(points, axis=0), axis=1) * plan.fps


@pytest.fixture(scope="module")
def day() -> Plan:
    return plan_tasks(office(), DAY, start=START, seed=3)


def test_tasks_follow_one_another_to_the_end(day: Plan) -> None:
    assert [entry.task for entry in day.timeline] == list(DAY)
    assert day.timeline[0].start <= 1 and day.timeline[-1].stop == len(day)
    for before, after in zip(day.timeline, day.timeline[1:], strict=False):
        assert before.stop == after.start
    for entry in day.timeline:
        assert entry.start <= entry.there <= entry.stop
        asked = getattr(entry.task, "seconds", 0.0)
        assert abs((entry.stop - entry.there) / day.fps - asked) < 0.04, entry
    assert [entry.seat for entry in day.timeline[:3]] == ["Chair"] * 3
    assert not any(entry.seat for entry in day.timeline[3:])


def test_the_root_moves_as_people_do(day: Plan) -> None:
    assert isinstance(day.controls(), Controls)
    assert _speeds(day, day.path.position).max() < 1.5
    assert np.abs(np.diff(day.path.yaw)).max() * day.fps < np.radians(300.0)
    for entry in day.timeline:
        there = day.path.position[entry.there : entry.stop]
        assert not len(there) or np.ptp(there, axis=0).max() < 1e-9, "one stays where one does it"


def test_one_sits_where_the_seat_is_and_works_before_the_top(day: Plan) -> None:
    seat = seat_of(chair(), np.array(START))
    sits, works = day.timeline[:2]
    assert np.linalg.norm(_at(day, sits.there) - seat.position) < 1e-6
    place = Place(_at(day, works.there), float(day.path.yaw[works.there]))
    frames = slice(works.there, works.stop)
    for name, side in (("hand_left", -1.0), ("hand_right", 1.0)):
        wrists = day.targets.places[name][frames]
        assert (day.targets.influences[name][frames] == 1.0).all()
        over = wrists[:, 2] - 0.74
        assert over.min() > 0.03 and over.max() < 0.09, "at the height of who types"
        assert (np.abs(wrists[:, 0]) < 0.25).all() and (wrists[:, 1] > 0.5).all()
        reach = np.linalg.norm(wrists - shoulder(place, seated_pelvis(seat), side), axis=1)
        assert reach.max() < REACH


def test_hands_reach_eased_and_no_faster_than_people(day: Plan) -> None:
    for name, places in day.targets.places.items():
        share = day.targets.influences[name]
        assert ((share >= 0.0) & (share <= 1.0)).all()
        assert np.isfinite(places[share > 0.0]).all()
        assert np.abs(np.diff(share)).max() < 0.15, "led to and let go softly"
        both = (share[1:] == 1.0) & (share[:-1] == 1.0)
        assert _speeds(day, places)[both].max() < 1.5, name
    mode = np.array(day.targets.mode)
    used = np.max([*day.targets.influences.values()], axis=0) > 0.0
    assert (mode[used] == "EE").all() and "FREE" in mode


def test_writing_stays_on_the_board(day: Plan) -> None:
    (writes,) = (entry for entry in day.timeline if isinstance(entry.task, WriteOn))
    wrists = day.targets.places["hand_right"][writes.there : writes.stop]
    away = 3.0 - wrists[:, 1]
    assert away.min() > 0.10 and away.max() < 0.20, "a pen's length before it"
    assert (np.abs(wrists[:, 0]) < 1.0).all() and np.ptp(wrists[:, 0]) > 0.2
    assert wrists[:, 2].min() > 0.95 and wrists[:, 2].max() < 1.75
    assert np.cos(day.path.yaw[writes.there]) > 0.99


def test_a_thing_is_reached_with_the_palm(day: Plan) -> None:
    (reaches,) = (entry for entry in day.timeline if isinstance(entry.task, Reach))
    cup = np.array([2.615, 0.235, 0.97])
    held = [
        name
        for name, share in day.targets.influences.items()
        if (share[reaches.there : reaches.stop] == 1.0).all()
    ]
    assert len(held) == 1, "one hand"
    wrist = day.targets.places[held[0]][reaches.there]
    assert abs(np.linalg.norm(wrist - cup) - movements.HAND) < 1e-6


def test_a_head_turns_towards_what_is_looked_at_as_far_as_a_neck_does(day: Plan) -> None:
    (looks,) = (entry for entry in day.timeline if isinstance(entry.task, LookAt))
    face = day.targets.looks[looks.there][:, 1]
    ahead = day.path.rotation[looks.there][:, 1]
    turned = np.arccos(face @ ahead)
    assert np.radians(60) < turned < np.radians(80), "the lamp is behind who sits there"
    assert any("Lamp" in each for each in day.warnings)

    stands = plan_tasks(office(), [LookAt("Lamp")], start=(0.0, -2.0), heading=90.0)
    face = stands.targets.looks[stands.timeline[0].there][:, 1]
    lamp = np.array([2.0, -2.0, 1.5]) - np.array([0.0, -2.0, 1.55])
    assert face @ lamp / np.linalg.norm(lamp) > 0.99, "who stands turns round"
    assert not stands.warnings


def test_the_same_seed_plans_the_same_and_another_may_choose_another_seat() -> None:
    def seat(seed: int) -> str:
        task = SitOn("Chair.*", choose="random", seconds=1)
        return plan_tasks(office(), [task], start=START, seed=seed).timeline[0].seat

    chosen = [seat(seed) for seed in range(8)]
    assert chosen == [seat(seed) for seed in range(8)] and len({*chosen}) == 3
    one, two = (plan_tasks(office(), DAY[:2], start=START, seed=3) for _ in range(2))
    assert np.array_equal(one.path.position, two.path.position)
    assert np.array_equal(
        one.targets.places["hand_left"], two.targets.places["hand_left"], equal_nan=True
    )


def test_the_nearest_is_taken_and_facing_and_place_may_be_given() -> None:
    near = plan_tasks(office(), [SitOn("Chair.*", seconds=1)], start=(-1.0, 2.0))
    assert near.timeline[0].seat == "Chair.002"
    group = plan_tasks(office(), [SitOn("Seats", seconds=1)], start=START)
    assert group.timeline[0].seat == "Chair.001"

    bench = Room([block("Bench", (-1.0, -0.2, 0.4), (1.0, 0.2, 0.45))])
    task = SitOn("Bench", seconds=1, facing=180, near=(0.6, 0.0))
    plan = plan_tasks(bench, [task], start=(0.0, 2.0))
    assert abs(plan.path.position[-1, 0] - 0.6) < 0.1
    assert np.cos(plan.path.yaw[-1] - np.pi) > 0.99
    walked = plan_tasks(office(), [WalkTo((0.0, -1.5), facing="Lamp")], start=START)
    ahead = walked.path.rotation[-1][:2, 1]
    assert ahead @ np.array([2.0, -0.5]) / np.hypot(2.0, 0.5) > 0.99


def test_one_walks_up_to_furniture_and_along_lines() -> None:
    plan = plan_tasks(office(), [WalkTo("Counter")], start=START)
    away = np.maximum([2.5, -0.5] - plan.path.position[-1, :2], 0.0)
    assert 0.3 < np.linalg.norm(away) < 0.7
    line = plan_tasks(office(), [WalkAlong("Path")], start=START)
    assert np.linalg.norm(line.path.position[-1, :2] - (1.5, -1.5)) < 0.05
    passed = np.linalg.norm(line.path.position[:, :2] - (-1.0, -2.0), axis=1).min()
    assert passed < 0.3, "from its beginning"


def test_who_has_no_start_is_there_already() -> None:
    plan = plan_tasks(office(), [SitOn("Chair", seconds=2), StandUp()])
    seat = seat_of(chair(), np.zeros(2))
    assert np.linalg.norm(_at(plan, 0) - seat.position) < 1e-6 and plan.timeline[0].there <= 1
    works = plan_tasks(office(), [WorkAt("Desk", seconds=2)])
    assert works.timeline[0].seat == "Chair", "sits at the desk"
    with pytest.raises(InputError, match="give a start"):
        plan_tasks(office(), [Wait(1)])


def test_getting_up_goes_without_saying() -> None:
    plan = plan_tasks(office(), [SitOn("Chair", seconds=1), WalkTo("Lamp")], start=START)
    assert plan.timeline[1].furniture == "Lamp" and not plan.timeline[1].seat


def test_a_desk_before_a_chair_is_come_round_from_a_side() -> None:
    plan = plan_tasks(office(), [SitOn("Chair", seconds=1)], start=(1.5, -1.5))
    top = plan.path.position[:, 1] > 0.5 - 0.02
    assert not top[np.abs(plan.path.position[:, 0]) < 0.7].any(), "nobody walks into the desk"
    pushed_in = Room([*put(desk(), (0.0, 0.6)), *chair()])
    with pytest.raises(InputError, match=r"'Desk' stands where one .*sit.*pull 'Chair' out"):
        plan_tasks(pushed_in, [SitOn("Chair")], start=START)


@pytest.mark.parametrize("height", [1.6, 1.95])
def test_bodies_of_any_size_and_any_rate_do_the_same_things(height: float) -> None:
    tasks = [WorkAt("Desk", seconds=2), WriteOn("Whiteboard", seconds=2)]
    plan = plan_tasks(office(), tasks, start=START, height=height, fps=24.0)
    assert abs(plan.scale - height / STATURE) < 1e-9 and plan.fps == 24.0
    works, writes = plan.timeline
    seat = seat_of(chair(), np.array(START))
    assert np.linalg.norm(_at(plan, works.there) - seat.position) < 0.05
    wrists = plan.targets.places["hand_left"][works.there : works.stop]
    assert (np.abs(wrists[:, 2] - 0.74 - 0.06 * plan.scale) < 0.03).all()
    assert writes.furniture == "Whiteboard"


@pytest.mark.parametrize(
    ("tasks", "words"),
    [
        ([StandUp()], "Task 1, 'stand up': nobody sits or lies there; put 'sit_on'"),
        ([SitOn("Chair", 1), StandUp(), StandUp()], "Task 3, 'stand up': nobody sits"),
        ([SitOn("Chiar")], "Task 1, 'sit on Chiar': .*did you mean 'Chair'"),
        ([SitOn("Whiteboard")], "'Whiteboard' has no level surface .* to sit on"),
        ([LieOn("Chair")], "'Chair' is too short to lie on"),
        ([WorkAt("Whiteboard")], "'Whiteboard' has no level top"),
        ([WriteOn("Chair")], "'Chair' has no upright face"),
        ([Reach((2.0, 0.0, 2.6))], "2.6 m over the floor, higher than one reaches"),
        ([Reach((1.0, -2.0, 0.1))], "out of reach from wherever one can stand"),
        ([WalkTo((900.0, 0.0))], "is the scene's unit right"),
        ([WalkAlong("Pth")], "did you mean 'Path'"),
        ([], "There are no tasks"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_reason(tasks: list[Task], words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        plan_tasks(office(), tasks, start=START)
    assert len(str(caught.value)) < 300 and "\n" not in str(caught.value)


def test_a_low_desk_without_a_chair_is_not_typed_at_standing() -> None:
    room = Room([*put(desk(), (0.0, 0.85))])
    with pytest.raises(InputError, match=r"no free seat stands at 'Desk'.*put a chair there"):
        plan_tasks(room, [WorkAt("Desk")], start=START)


def test_where_there_is_no_way_that_is_said() -> None:
    walls = [block("Wall", (-4, y, 0), (4, y + 0.1, 2)) for y in (-1.0, 3.5)] + [
        block("Wall", (x, -1, 0), (x + 0.1, 3.6, 2)) for x in (-4.0, 3.9)
    ]
    room = Room([*chair(), *walls])
    with pytest.raises(InputError, match="Task 1, 'sit on Chair': There is no way"):
        plan_tasks(room, [SitOn("Chair")], start=START)


def test_a_plan_can_be_stopped_while_it_is_made() -> None:
    job = plan_tasks.steps(office(), DAY, start=START)
    shares = [next(job) for _ in range(20)]
    assert shares == sorted(shares) and shares[0] >= 0.0 and shares[-1] < 1.0
    job.close()


def test_beds_are_lain_on_from_either_long_side() -> None:
    mattress = block("Bed", (-0.7, -1.0, 0.1), (0.7, 1.0, 0.5))
    board = block("Bed", (-0.7, 1.0, 0.0), (0.7, 1.05, 1.1))
    room = Room([mattress, board])
    for start in ((-3.0, 0.0), (3.0, 0.0)):
        plan = plan_tasks(room, [LieOn("Bed", seconds=2), StandUp()], start=start)
        lies, rises = plan.timeline
        side = np.sign(start[0])
        pelvis = _at(plan, lies.there)
        assert abs(pelvis[0]) < 0.6 and 0.0 < pelvis[1] < 0.4
        assert np.cos(plan.path.yaw[lies.there] - np.pi) > 0.99, "the head to the board"
        head = plan.targets.places["head"][lies.there]
        assert 0.5 < head[2] < 0.75 and 0.5 < head[1] - pelvis[1] < 0.7
        assert side * plan.path.position[-1, 0] > 0.9, "up on the side where one came from"
        assert rises.stop == len(plan)


def test_paths_of_hands_are_those_of_people() -> None:
    rng = np.random.default_rng(0)
    typed = movements.typing(rng, 20.0, 30.0)
    written = movements.writing(20.0, 30.0, "right")
    handled = movements.handling(rng, 20.0, 30.0, 0.3)
    for paths, slowest, fastest in ((typed, 0.02, 0.4), (handled, 0.03, 1.5)):
        for path in paths.values():
            speed = np.linalg.norm(np.diff(path, axis=0), axis=1) * 30.0
            assert slowest < speed.mean() and speed.max() < fastest
    assert np.ptp(typed["hand_left"], axis=0).max() < 0.12
    assert np.ptp(written["hand_right"][:, 0]) > 0.1
    assert not np.ptp(written["hand_left"], axis=0).any(), "the other hand holds the paper"
    stroked = movements.strokes(20.0, 30.0, -0.2, 0.2)
    assert stroked[:, 2].min() >= -0.2 and stroked[:, 2].max() <= 0.2
    assert np.linalg.norm(np.diff(stroked, axis=0), axis=1).max() * 30.0 < 1.5
    share = minimum_jerk(np.linspace(0, 1, 101))
    assert share[0] == 0.0 and share[-1] == 1.0 and abs(np.diff(share).max() * 100 - 1.875) < 0.01
    for length in (0.2, 0.5, 0.8):
        assert 1.875 * length / movements.reach_seconds(length) < 1.5
    look, astray = movements.bounded_look(np.array([0.0, -1.0, 0.0]), 0.0)
    assert abs(np.degrees(astray) - 110.0) < 1.0 and abs(np.degrees(np.arccos(look[1])) - 70) < 1
    matrices = movements.look_matrices(look[None])
    assert np.allclose(rotate(matrices, np.array([0.0, 1.0, 0.0])), look)
