"""What is generated from a plan does what the plan says, with the shipped weights."""

import numpy as np
import pytest

from dafnet_addon import CleanUp, Mesh, Scene, Take, generate, load_weights
from dafnet_addon.core.kinematics import global_from_local
from dafnet_addon.core.rotations import matrix_from_quaternion, yaw_matrix
from dafnet_addon.core.skeleton import HEAD, PELVIS, SEAT_TO_PELVIS, WRISTS, joint
from dafnet_addon.data.furnish.library import read_library
from dafnet_addon.director.planner import plan_tasks
from dafnet_addon.director.plans import Entry, Plan
from dafnet_addon.director.room import Room
from dafnet_addon.director.tasks import (
    LieOn,
    LookAt,
    Reach,
    SitOn,
    StandUp,
    Task,
    WorkAt,
    WriteOn,
)
from kit.places import LIBRARY
from kit.rooms import office

pytestmark = pytest.mark.slow

_SETTLES = 15  # frames from where the root rests, until the body has to
_HANDS = dict(zip(("hand_left", "hand_right"), WRISTS, strict=True))


def _taken(room: Room, plan: Plan) -> Take:
    clean = CleanUp(feet=1.0, reach=1.0, seat=1.0)
    return generate(
        Scene(list(room.solids)),
        plan.controls(),
        load_weights(),
        seed=1,
        temperature=0.5,
        clean_up=clean,
    )


def _during(plan: Plan, kind: type[Task]) -> tuple[Entry, slice]:
    entry = next(each for each in plan.timeline if isinstance(each.task, kind))
    return entry, slice(entry.there, entry.stop)


def _wrists_are_there(plan: Plan, take: Take, frames: slice) -> int:
    """How many hands have been asked for over all these frames, and are within 2 cm."""
    asked = 0
    for name, wrist in _HANDS.items():
        if name in plan.targets.places and (plan.targets.influences[name][frames] == 1.0).all():
            asked += 1
            away = take.joints[frames, wrist] - plan.targets.places[name][frames]
            assert np.linalg.norm(away, axis=1).max() < 0.02, name
    return asked


def _face(take: Take, frame: int) -> np.ndarray:
    """Where (3,) the face looks; +y at rest."""
    frames = global_from_local(matrix_from_quaternion(take.rotations[frame : frame + 1]))
    return np.asarray(frames[0, HEAD, :, 1])


def test_an_afternoon_in_the_office() -> None:
    room = office()
    plan = plan_tasks(
        room,
        [
            SitOn("Chair", seconds=2),
            WorkAt("Desk", seconds=2),
            LookAt("Lamp", seconds=1),
            StandUp(),
            WriteOn("Whiteboard", seconds=2),
            Reach("Cup"),
        ],
        start=(0.0, -2.0),
    )
    take = _taken(room, plan)
    _, sits = _during(plan, SitOn)
    pelvis = take.joints[sits.start + _SETTLES : sits.stop, PELVIS]
    assert np.abs(pelvis[:, 2] - 0.45 - SEAT_TO_PELVIS).max() < 0.08
    away = pelvis[:, :2] - plan.path.position[sits.start, :2]
    assert np.linalg.norm(away, axis=1).max() < 0.08

    for kind, hands in ((WorkAt, 2), (WriteOn, 1), (Reach, 1)):
        _, frames = _during(plan, kind)
        assert _wrists_are_there(plan, take, frames) == hands, kind

    looks, _ = _during(plan, LookAt)
    asked = plan.targets.looks[looks.there][:, 1]
    assert _face(take, looks.there) @ asked > 0.98
    assert _face(take, looks.start - 1) @ asked < 0.9, "it was not looked at before"

    standing = take.joints[plan.timeline[3].there :, PELVIS, 2]
    assert standing.min() > 0.8, "up, and nobody sits down again"


@pytest.mark.furniture
def test_on_real_furniture() -> None:
    pieces = {piece.name: piece for piece in read_library(LIBRARY)[0]}

    def put(piece: str, name: str, x: float, y: float, degrees: float) -> Mesh:
        """Its front faces −y where it is not turned."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:2, 3] = yaw_matrix(np.array(np.radians(degrees))), (x, y)
        return Mesh(pieces[piece].vertices, pieces[piece].triangles, matrix, name)

    room = Room(
        [
            put("desk_003", "Desk", 0.0, 0.0, 180.0),
            put("chair_003", "Chair", 0.0, -0.85, 180.0),
            put("bed_002", "Bed", 3.5, 0.0, 0.0),
        ]
    )
    tasks = [WorkAt("Desk", how="writing", seconds=2), LieOn("Bed", seconds=2), StandUp()]
    plan = plan_tasks(room, tasks, start=(1.0, -2.5))
    take = _taken(room, plan)
    works, frames = _during(plan, WorkAt)
    assert works.seat == "Chair" and _wrists_are_there(plan, take, frames) == 2
    pelvis = take.joints[frames.start + _SETTLES : frames.stop, PELVIS]
    seat = 0.493  # as found on the mesh
    assert np.abs(pelvis[:, 2] - seat - SEAT_TO_PELVIS).max() < 0.08
    assert np.linalg.norm(pelvis[:, :2] - plan.path.position[works.there, :2], axis=1).max() < 0.08

    _, lies = _during(plan, LieOn)
    body = take.joints[lies]
    trunk = body[:, joint("neck")] - body[:, PELVIS]
    level = np.abs(trunk[:, 2]) / np.linalg.norm(trunk, axis=1)
    assert level.max() < 0.5, "within 30 degrees of level"
    assert take.joints[-1, PELVIS, 2] > 0.8, "and gets up"
