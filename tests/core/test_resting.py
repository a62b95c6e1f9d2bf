"""Who rests on furniture is where that carries a body: lifted or lowered softly, on the same feet,
as deep as the piece is soft.
"""

import numpy as np
import pytest

from dafnet_addon import Box, InputError, Mesh, Scene
from dafnet_addon.core.cleanup import with_legroom
from dafnet_addon.core.kinematics import two_bone
from dafnet_addon.core.metrics import jerk
from dafnet_addon.core.resting import rested, resting
from dafnet_addon.core.root import RootPath
from dafnet_addon.core.skeleton import (
    ANKLES,
    FEET,
    HIPS,
    KNEES,
    NECK,
    OFFSETS,
    PARENTS,
    PELVIS,
    REST,
    SPINE,
    TOE_HEIGHT,
    joint,
)
from dafnet_addon.core.softness import OVER_HARD, SOFTNESS, Support, guessed, support_under
from dafnet_addon.core.solids import box_distance

SECONDS, FPS = 5.0, 30.0
FRAMES = round(SECONDS * FPS)
_FORWARD = np.array([0.0, 1.0, 0.0])
_LEGS = [*KNEES, *ANKLES, *FEET]


def _lengths(joints: np.ndarray) -> np.ndarray:
    return np.linalg.norm(joints[:, 1:] - joints[:, list(PARENTS[1:])], axis=-1)


def _bent(joints: np.ndarray) -> np.ndarray:
    """Knees forward as far as thighs and shins ask; feet where they are."""
    thigh, shin = (np.linalg.norm(OFFSETS[joint("left_" + n)]) for n in ("knee", "ankle"))
    out = joints.copy()
    hip, ankle = joints[:, HIPS], joints[:, ANKLES]
    out[:, KNEES], out[:, ANKLES] = two_bone(hip, ankle, hip + _FORWARD, thigh, shin)
    return out


def _sitting_down(low: float) -> np.ndarray:
    """A body that stands for a second and a half, goes down to a pelvis at ``low`` metres, a third
    of a metre back, within another, and stays; its feet where they were.
    """
    joints = np.repeat(REST[None], FRAMES, axis=0)
    share = np.clip((np.arange(FRAMES) / FPS - 1.5) / 1.0, 0.0, 1.0)
    share = share * share * (3.0 - 2.0 * share)
    over_legs = [j for j in range(22) if j not in _LEGS]
    joints[:, over_legs] -= share[:, None, None] * (0.0, 0.33, REST[PELVIS, 2] - low)
    return _bent(joints)


def _under(top: float, softness: float = 0.0) -> Support:
    """A seat that is under the root from the last third of the way down on."""
    tops = np.full(FRAMES, top)
    tops[:65] = np.nan
    return Support(tops, np.full(FRAMES, softness), np.zeros(FRAMES, int))


@pytest.mark.parametrize("softness", [0.0, 0.03, 0.07, 0.11])
@pytest.mark.parametrize("over", [-0.12, -0.05, 0.06, 0.12, 0.2])
def test_who_hovers_or_sinks_comes_to_rest_where_the_seat_carries(over: float, softness: float):
    carried = 0.45 + OVER_HARD - softness
    joints = _sitting_down(carried + over)
    out = rested(joints, _under(0.45, softness))
    assert np.abs(out[90:, PELVIS, 2] - carried).max() < 0.015
    assert np.abs(out[:, FEET] - joints[:, FEET]).max() < 0.01, "feet stay"
    assert np.allclose(out[:20], joints[:20], atol=1e-9), "long before it nothing moves"
    assert jerk(out, FPS) < jerk(joints, FPS) + 0.6, "real motion has forty times as much"
    assert np.abs(_lengths(out) - _lengths(joints)).max() < 1e-6
    assert (out[90:, KNEES, 1] > out[90:, HIPS, 1] + 0.2).all(), "knees bend forward"
    half = rested(joints, _under(0.45, softness), 0.5)
    middle = (out + joints)[90:, PELVIS, 2] / 2
    assert np.allclose(half[90:, PELVIS, 2], middle, atol=1e-6)


def test_who_rests_right_and_who_does_not_rest_are_left_alone():
    right = _sitting_down(0.45 + OVER_HARD + 0.004)
    assert rested(right, _under(0.45)) is right
    nothing = Support(np.full(FRAMES, np.nan), np.zeros(FRAMES), np.full(FRAMES, -1))
    hovers = _sitting_down(0.70)
    assert rested(hovers, nothing) is hovers
    assert rested(hovers, _under(0.75)) is hovers, "what is far over the pelvis is not a seat"
    stands = np.repeat(REST[None], FRAMES, axis=0) + np.array([0.0, 0.0, 0.3])
    assert rested(stands, _under(0.3)) is stands, "who stands on it does not sit"
    walks = hovers + (np.arange(FRAMES) * 0.03)[:, None, None] * _FORWARD
    assert rested(walks, _under(0.45)) is walks, "who walks past does not rest"


def test_life_on_a_seat_stays():
    joints = _sitting_down(0.70)
    sway = 0.004 * np.sin(np.arange(FRAMES) * 2 * np.pi / 20)
    joints[:, [j for j in range(22) if j not in _LEGS], 2] += sway[:, None]
    out = rested(_bent(joints), _under(0.45))
    moved = out[95:, PELVIS, 2] - out[95:, PELVIS, 2].mean()
    assert np.std(moved) > 0.8 * np.std(sway)


def test_a_pose_of_one_frame_rests_too():
    pose = _sitting_down(0.70)[-1:]
    out = rested(pose, Support(np.array([0.45]), np.zeros(1), np.zeros(1, int)))
    assert abs(out[0, PELVIS, 2] - (0.45 + OVER_HARD)) < 0.0101


def test_feet_hang_from_a_seat_that_is_too_high_for_them():
    sunk = _sitting_down(0.93)
    out = rested(sunk, _under(0.90))
    assert np.allclose(out[95:, PELVIS, 2], 0.90 + OVER_HARD, atol=0.015)
    assert (out[95:, FEET, 2] > TOE_HEIGHT + 0.03).all()
    assert np.abs(_lengths(out) - _lengths(sunk)).max() < 2e-3


def test_who_hovers_over_a_bed_comes_down_with_the_feet():
    lying = REST[:, [0, 2, 1]] * (1.0, -1.0, 1.0)
    lying[:, 2] += 0.62 - lying[PELVIS, 2]
    joints = np.repeat(lying[None], FRAMES, axis=0)
    out = rested(
        joints,
        Support(np.full(FRAMES, 0.45), np.full(FRAMES, SOFTNESS["bed"]), np.zeros(FRAMES, int)),
    )
    assert np.abs(out[:, PELVIS, 2] - 0.46).max() < 0.0101, "1 cm over the bed"
    legs = {*KNEES, *ANKLES, *FEET}
    rest = [j for j in range(22) if j not in legs]
    assert np.abs((out - joints)[:, rest] - (out - joints)[:, :1]).max() < 1e-3, "all together"
    assert np.abs(out[:, ANKLES, 2] - 0.49).max() < 0.0101, "heels hardly sink in"


def test_rests_are_told_by_speed_and_height():
    joints = _sitting_down(0.60)
    (start, stop), *others = resting(joints, np.full(FRAMES, 0.59))
    assert not others and 65 <= start <= 80 and stop == FRAMES


def _box(name: str, size: tuple[float, float, float], softness: float | None = None) -> Box:
    half = np.array(size) / 2
    return Box(np.array([0.0, 0.0, half[2]]), half, name=name, softness=softness)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("sofa_03", "sofa"),
        ("Couch.001", "sofa"),
        ("ArmChair", "armchair"),
        ("office chair", "armchair"),
        ("Schlafsofa", "sofa"),
        ("Doppelbett", "bed"),
        ("King bed", "bed"),
        ("Bedside table", "table"),
        ("oak_chair", "chair"),
        ("Barhocker", "stool"),
        ("Bürostuhl", "armchair"),
        ("park-bench", "bench"),
    ],
)
def test_names_tell_how_soft_a_piece_is(name: str, kind: str):
    assert guessed(_box(name, (0.5, 0.5, 0.45)), 0.45) == SOFTNESS[kind]


@pytest.mark.parametrize(
    ("size", "top", "kind"),
    [
        ((1.9, 0.85, 0.85), 0.43, "sofa"),
        ((0.85, 0.85, 0.9), 0.42, "armchair"),
        ((1.5, 2.1, 0.9), 0.5, "bed"),
    ],
)
def test_shapes_tell_it_where_names_do_not(size, top, kind):
    assert guessed(_box("Cube.007", size), top) == SOFTNESS[kind]
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) - 0.5
    y_up = np.array([(1, 0, 0, 3), (0, 0, -1, 2), (0, 1, 0, size[2] / 2), (0, 0, 0, 1)], float)
    mesh = Mesh(corners * (size[0], size[2], size[1]), np.array([(0, 1, 2)]), y_up, "Object_12")
    assert guessed(mesh, top) == SOFTNESS[kind], "whichever axis of its own is upright"


def test_a_plain_box_is_a_hard_seat_of_any_kind():
    assert guessed(_box("Cube", (0.45, 0.45, 0.45)), 0.45) == pytest.approx(0.02)
    assert guessed(_box("Cube", (2.2, 1.0, 0.74)), 0.74) == pytest.approx(0.02), "a table"
    assert guessed(_box("Cube", (6.4, 6.4, 2.5)), 0.45) == pytest.approx(0.02), "a room"
    assert guessed(_box("Cube", (5.0, 5.0, 1.0)), 0.45) == pytest.approx(0.02), "a stage"
    assert guessed(_box("Cube", (2.2, 1.2, 1.36)), 0.34) == pytest.approx(0.02), "stairs"


def test_what_carries_is_the_solid_under_the_root_and_it_may_say_how_soft_it_is():
    path = RootPath(np.array([(0.0, 0, 0), (2.0, 0, 0), (4.0, 0, 0)]), np.zeros(3))
    sofa = _box("sofa", (1.0, 1.0, 0.4))
    said = Box(np.array([2.0, 0.0, 0.25]), np.array([0.3, 0.3, 0.25]), name="sofa", softness=0.05)
    found = support_under(Scene((sofa, said)), path)
    assert np.allclose(found.top[:2], (0.4, 0.5)) and np.isnan(found.top[2])
    assert np.allclose(found.softness, (0.11, 0.05, 0.0))
    assert np.isnan(support_under(Scene(), path).top).all()
    for wrong in (-0.01, 0.5, float("nan"), "soft"):
        with pytest.raises(InputError, match=r"softness of the box 'Cube' is .*from 0 to 0\.3"):
            _box("Cube", (1.0, 1.0, 0.4), wrong)
    with pytest.raises(InputError, match="softness of the mesh 'Bed'"):
        Mesh(np.zeros((3, 3)), np.array([(0, 1, 2)]), name="Bed", softness=7.0)


def test_softness_is_that_by_which_the_training_places_its_furniture():
    shapes = pytest.importorskip("dafnet_addon.data.furnish.shapes")
    assert {k: pytest.approx(OVER_HARD - v) for k, v in SOFTNESS.items()} == shapes.PELVIS_OVER


def _box_distance(low: tuple[float, float, float], high: tuple[float, float, float]):
    middle, half = np.add(low, high) / 2, np.subtract(high, low) / 2
    return lambda points: box_distance(points - middle, half)


def test_backs_meet_furniture_and_do_not_cross_it():
    joints = _sitting_down(0.45 + OVER_HARD)
    _, y, z = joints[-1, PELVIS]
    back = _box_distance((-0.3, y - 0.4, z), (0.3, y - 0.01, z + 0.5))
    out = rested(joints, _under(0.45), distance=back)
    spine = [*SPINE, NECK]
    assert back(joints[100:, spine]).min() < -0.005
    assert back(out[100:, spine]).min() > 0.03, "flesh touches, bones stay out"
    assert np.array_equal(out[:, [PELVIS, *HIPS, *_LEGS]], joints[:, [PELVIS, *HIPS, *_LEGS]])
    assert np.abs(_lengths(out) - _lengths(joints)).max() < 1e-6
    behind = _box_distance((-0.3, y - 0.4, z), (0.3, y - 0.15, z + 0.5))
    assert rested(joints, _under(0.45), distance=behind) is joints, "it may lean there"


def test_thighs_lie_on_the_edge_of_a_high_seat_and_feet_hang_from_it():
    joints = _sitting_down(0.70 + OVER_HARD)
    hips = joints[-1, HIPS].mean(axis=0)
    seat = _box_distance((-0.3, hips[1] - 0.3, 0.6), (0.3, hips[1] + 0.25, 0.70))
    along = np.linspace(0.25, 1.0, 4)[:, None, None]

    def thighs(body: np.ndarray) -> np.ndarray:
        start, end = body[110:, None, HIPS], body[110:, None, KNEES]
        return seat((start + along * (end - start)).reshape(len(body) - 110, -1, 3))

    out = rested(joints, _under(0.70), distance=seat)
    assert thighs(joints).min() < -0.02 and thighs(out).min() > 0.0
    assert (out[110:, FEET, 2] > joints[110:, FEET, 2] + 0.02).all()
    assert np.abs(_lengths(out) - _lengths(joints)).max() < 1e-6


def _closed_to_the_floor(front: float) -> tuple[Scene, Support]:
    """A seat of 0.45 m, closed down to the floor, whose front is at ``front`` metres."""
    box = Box(center=np.array([0.0, front - 0.3, 0.225]), half_size=np.array([0.4, 0.3, 0.225]))
    support = Support(np.full(FRAMES, 0.45), np.zeros(FRAMES), np.zeros(FRAMES, int))
    return Scene((box,)), support


def _in_shins(joints: np.ndarray, box: Box) -> float:
    """The deepest that lower shins and feet are in a box, metres; negative outside."""
    shins = joints[:, KNEES] + 0.5 * (joints[:, ANKLES] - joints[:, KNEES])
    points = np.concatenate([shins, joints[:, ANKLES], joints[:, FEET]], axis=1)
    return float(-box_distance(points - box.center, box.half_size).min())


def test_feet_stand_where_shins_have_room_before_a_seat() -> None:
    scene, support = _closed_to_the_floor(front=0.06)
    (box,) = scene.solids
    joints = _sitting_down(low=0.59)

    def distance(points: np.ndarray) -> np.ndarray:
        return box_distance(points - box.center, box.half_size)

    out = with_legroom(joints, support, distance)
    assert _in_shins(joints[-30:], box) > 0.05 and _in_shins(out[-30:], box) < -0.01
    np.testing.assert_allclose(_lengths(out), _lengths(joints), atol=1e-9)
    np.testing.assert_allclose(out[-30:, PELVIS], joints[-30:, PELVIS], atol=1e-3)
    toes = out[:, FEET]
    assert np.ptp(toes, axis=0).max() < 1e-3, "they stood there before, and slide nowhere"
    assert ((toes - joints[:, FEET])[..., 1] > 0.05).all()
    half = with_legroom(joints, support, distance, strength=0.5)
    assert 0.02 < (half - joints)[0, FEET[0], 1] < (out - joints)[0, FEET[0], 1]


def test_legs_that_have_room_are_left_alone() -> None:
    scene, support = _closed_to_the_floor(front=-0.2)
    (box,) = scene.solids
    joints = _sitting_down(low=0.59)
    out = with_legroom(joints, support, lambda p: box_distance(p - box.center, box.half_size))
    np.testing.assert_array_equal(out, joints)
