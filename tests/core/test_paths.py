"""Root paths: they go where they are told, at human speeds, and move at a seat as captured people
do.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.paths import Route, Stop, facing, route
from dafnet_addon.core.root import root_from_joints, smoothed, velocities
from kit.places import MOCAP

SEAT = Stop((0.0, 0.0), 0.0, 2.0, seated=True, name="seat")
FROM_SIDE = Stop((-3.0, 0.6), facing((1, 0)), 1.0)
FROM_FRONT = Stop((0.0, 4.0), np.pi, 1.0)
FROM_BEHIND = Stop((0.3, -3.0), 0.0, 1.0)


def approaches() -> dict[str, Route]:
    leave = ((1.5, 2.0), Stop((3.0, 2.0), 0.0, 1.0))
    return {
        "side": route(FROM_SIDE, SEAT, *leave),
        "front": route(FROM_FRONT, SEAT, *leave),
        "behind": route(FROM_BEHIND, (0.9, -0.5), (0.8, 0.5), SEAT, *leave),
    }


@pytest.mark.parametrize("name", ["side", "front", "behind"])
def test_rests_where_it_was_told_and_moves_as_people_do(name: str) -> None:
    walked = approaches()[name]
    rest = walked.rests[1]
    frames = slice(rest.start, rest.stop)
    assert rest.stop - rest.start == 60
    np.testing.assert_allclose(walked.path.position[frames], np.zeros((60, 3)), atol=1e-9)
    np.testing.assert_allclose(np.cos(walked.path.yaw[frames]), 1.0, atol=1e-9)
    end = walked.rests[-1]
    np.testing.assert_allclose(walked.path.position[end.start], [3.0, 2.0, 0.0], atol=1e-9)
    assert end.stop - 1 == len(walked.path) - 1

    velocity = velocities(smoothed(walked.path)) * 30
    speed = np.linalg.norm(velocity[:, :2], axis=1)
    assert 1.05 < speed.max() < 1.15
    # captured: 170 in a turn of 180 degrees before a seat
    assert np.degrees(np.abs(velocity[:, 2])).max() < 160
    steps = np.diff(smoothed(walked.path).position, n=2, axis=0) * 900
    assert np.linalg.norm(steps, axis=1).max() < 2.5


def test_walkers_look_where_they_go_and_back_onto_the_seat() -> None:
    path = approaches()["behind"].path
    velocity = velocities(path)
    rest = approaches()["behind"].rests[1]
    assert (velocity[40 : rest.start - 100, 1] > 0).all()
    assert (velocity[rest.start - 20 : rest.start - 2, 1] < 0).all()
    last_metre = np.linalg.norm(path.position[:, :2], axis=1)[: rest.start] < 0.2
    assert np.degrees(np.abs(np.angle(np.exp(1j * path.yaw[: rest.start][last_metre])))).max() < 2.0


def test_standing_stop_turns_to_face_its_yaw() -> None:
    walked = route(
        Stop((0, 0), 0.0, 1.0), (0.0, 2.0), Stop((2.0, 3.0), facing((0, -1)), 2.0), floor=1.5
    )
    assert np.degrees(np.abs(velocities(walked.path)[:, 2])).max() * 30 < 170
    assert np.cos(walked.path.yaw[-1]) == pytest.approx(-1.0)
    assert (walked.path.position[:, 2] == 1.5).all()


def test_frame_rate_changes_the_number_of_frames_only() -> None:
    slow, fast = route(FROM_SIDE, SEAT, fps=24.0), route(FROM_SIDE, SEAT, fps=60.0)
    assert len(fast.path) / 60 == pytest.approx(len(slow.path) / 24, abs=0.1)


def test_refuses_paths_that_cannot_be_walked() -> None:
    with pytest.raises(InputError, match="end at a stop"):
        route(FROM_SIDE, (1.0, 1.0))
    with pytest.raises(InputError, match="5 cm"):
        route(FROM_SIDE, (1.0, 1.0), (1.0, 1.0), SEAT)
    with pytest.raises(InputError, match="speed"):
        route(FROM_SIDE, SEAT, speed=0.0)


@pytest.mark.parametrize("seconds", [0.8, 1.3, 2.0])
def test_a_root_tells_how_long_sitting_down_and_getting_up_take(seconds: float) -> None:
    """Captured roots go the last quarter of a metre at an even pace: they take 1.22 times as long
    for 80 % of it as the pelvis for 80 % of its way down, as long as it on its way up.
    """
    seat = replace(SEAT, sits_down=seconds, gets_up=seconds)
    walked = route(FROM_SIDE, seat, Stop((3.0, 2.0), 0.0, 1.0))
    rest = walked.rests[1]
    away = np.linalg.norm(walked.path.position[:, :2], axis=1)
    comes = (away[: rest.start] > 0.025) & (away[: rest.start] < 0.225)
    goes = (away[rest.stop :] > 0.025) & (away[rest.stop :] < 0.225)
    assert comes.sum() / 30 == pytest.approx(1.22 * seconds, rel=0.06)
    assert goes.sum() / 30 == pytest.approx(1.0 * seconds, rel=0.06)

    pace = 30 * np.abs(np.diff(away[: rest.start]))[comes[1:]]
    assert pace.max() < 1.2 * pace.mean()


def test_people_take_their_time_unless_they_are_asked_not_to() -> None:
    assert (SEAT.sits_down, SEAT.gets_up) == (1.3, 0.9)
    quick = route(FROM_SIDE, replace(SEAT, sits_down=0.5))
    assert len(quick.path) < len(route(FROM_SIDE, SEAT).path) - 20
    for wrong in (0.0, 60.0, float("nan")):
        with pytest.raises(InputError, match="sits down or gets up"):
            route(FROM_SIDE, replace(SEAT, sits_down=wrong))


@pytest.mark.mocap
def test_a_captured_sit_down_moves_alike() -> None:
    """Distance to the seat over the last second, against a captured person who comes from the side
    (held-out clip).
    """
    data = np.load(MOCAP / "snu_tiling.npz")
    info = json.loads(str(data["clips"]))
    index = next(i for i, clip in enumerate(info) if clip["clip"] == "1/chair_2")
    start = int((data["frames"][:index] - 1).sum())
    deltas = data["delta_mm"][start : start + int(data["frames"][index]) - 1].astype(np.int32)
    joints = np.concatenate([data["first_mm"][index][None], deltas]).cumsum(0) / 1000.0

    captured = root_from_joints(joints)
    rest = 170
    made = route(
        FROM_SIDE, replace(SEAT, sits_down=0.4)
    )  # that person comes fast, and takes 0.55 s
    path = smoothed(made.path)
    seconds = np.arange(-30, 1)

    def profile(position: np.ndarray, frame: int, home: np.ndarray) -> np.ndarray:
        distance = np.linalg.norm(position[:, :2] - home[:2], axis=1)
        # aligned where 10 cm are left to go
        near = frame - int(np.argmax(distance[frame::-1] > 0.1))
        return distance[near + seconds]

    ours = profile(path.position, made.rests[1].start + 10, np.zeros(3))
    theirs = profile(captured.position, rest, captured.position[rest])
    assert np.abs(ours - theirs).max() < 0.2, f"differs by {np.abs(ours - theirs).max():.2f} m"


@pytest.mark.parametrize("ahead", [0.1, 0.5, 0.52, 0.55, 0.58, 0.6, 0.62, 0.8])
@pytest.mark.parametrize("yaw", [0.0, np.pi / 2, np.pi])
def test_who_stands_anywhere_before_a_seat_sits_down_on_it(ahead: float, yaw: float) -> None:
    made = route(Stop((0.02, ahead), yaw, 0.2), Stop((0.0, 0.0), 0.0, 1.0, seated=True))
    assert np.allclose(made.path.position[-1, :2], 0.0, atol=1e-6)
    step = np.linalg.norm(np.diff(made.path.position[:, :2], axis=0), axis=1)
    assert step.max() * 30.0 < 1.2, "metres a second"
