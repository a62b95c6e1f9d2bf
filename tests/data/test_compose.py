"""Composed motion: joins without jumps or sliding feet, lent upper bodies, led hands; where there
is capture, all of it.
"""

import numpy as np
import pytest

from dafnet_addon.core.rotations import yaw_matrix
from dafnet_addon.core.skeleton import LOWER, OFFSETS, PARENTS, joint
from dafnet_addon.data.motion.canonical import pose_legs
from dafnet_addon.data.motion.interactions import stroking, working
from dafnet_addon.data.motion.motion import Motion, motion_of
from dafnet_addon.data.synthesis import compose
from dafnet_addon.data.synthesis.compose import composed
from dafnet_addon.data.synthesis.joins import join, lead_hand, lend_upper_body
from dafnet_addon.data.synthesis.pieces import entrance
from kit.places import MOCAP
from kit.sitting import sit_down, standing

BONES = np.linalg.norm(OFFSETS[1:], axis=1)
TOES = [joint("left_foot"), joint("right_foot")]
LEGS = [j for j in LOWER if j not in (1, 2)]


def _lengths(joints: np.ndarray) -> np.ndarray:
    return np.linalg.norm(joints[:, 1:] - joints[:, list(PARENTS[1:])], axis=-1)


def _speed(joints: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(joints, axis=0), axis=-1).max(1) * 30


def test_a_join_neither_jumps_nor_slides_a_standing_foot():
    stand, sit = standing(100, sway=0.05), sit_down()
    sit[:, LEGS, 0] *= 1.4  # the feet of the one stand farther apart than the other's
    sit = pose_legs(sit)
    turned = sit @ yaw_matrix(np.array(2.0)).T + (3.0, -1.0, 0.0)
    entry = entrance(turned, 100)
    assert entry is not None and 30 < entry < 60
    whole = join(stand, turned[entry:])
    assert len(whole) == len(stand) - 1 + len(turned) - entry
    assert np.abs(np.diff(whole[:, TOES, :2], axis=0)).max() < 1e-3
    assert _speed(whole).max() < _speed(sit).max() + 0.3
    assert np.abs(_lengths(whole) - BONES).max() < 1e-6
    assert (
        whole[-1, 0, 2] == pytest.approx(sit[-1, 0, 2], abs=1e-3)
        and whole[:, TOES, 2].min() > 0.015
    )


def test_a_foot_works_off_its_difference_while_it_swings():
    stand, step = standing(60), standing(90)
    swing = np.clip((np.arange(90) - 40) / 20, 0, 1)
    step[:, [joint("left_ankle"), joint("left_foot")], 1] += (
        0.4 * (swing * swing * (3 - 2 * swing))[:, None]
    )
    step = pose_legs(step)
    stand[:, [joint("left_ankle"), joint("left_foot")], 0] -= 0.06
    whole = join(pose_legs(stand), step)
    toe = whole[:, joint("left_foot"), :2]
    assert np.linalg.norm(np.diff(toe[59:98], axis=0), axis=-1).max() < 1e-3
    gap = whole[:, joint("right_foot"), 0] - whole[:, joint("left_foot"), 0]
    assert gap[70] == pytest.approx(gap[0], abs=1e-3) and gap[-1] < gap[0] - 0.015


def test_a_lent_upper_body_keeps_legs_and_moves_the_chest_and_arms_as_the_other_does():
    sit = sit_down()[100:]
    waving = standing(50)
    waving[:, joint("right_elbow")] = waving[:, joint("right_shoulder")] + (0.26, 0.0, 0.0)
    waving[:, joint("right_wrist")] = waving[:, joint("right_elbow")] + (0.0, 0.0, 0.25)
    seated = lend_upper_body(sit, waving @ yaw_matrix(np.array(1.0)).T, np.linspace(0, 1, 50))
    assert (
        np.abs(seated[:, LOWER] - sit[:, LOWER]).max() < 1e-6
        and np.abs(seated[0] - sit[0]).max() < 1e-6
    )
    forearm = seated[-1, joint("right_wrist")] - seated[-1, joint("right_elbow")]
    assert forearm[2] > 0.24 and np.abs(_lengths(seated) - BONES).max() < 1e-6


def test_a_led_hand_is_where_it_is_led_and_the_other_is_left_alone():
    body = standing(40)
    wrist = np.tile([0.2, 0.3, 1.2], (40, 1))
    led = lead_hand(body, "right_", wrist, np.linspace(0, 1, 40))
    assert np.abs(led[-1, joint("right_wrist")] - wrist[-1]).max() < 1e-6
    assert np.abs(led[0] - body[0]).max() < 1e-6 and np.abs(_lengths(led) - BONES).max() < 1e-6
    moved = np.abs(led - body).max((0, 2)) > 1e-9
    assert set(np.flatnonzero(moved)) == {joint("right_elbow"), joint("right_wrist")}
    assert led[-1, joint("right_elbow"), 2] < led[-1, joint("right_shoulder"), 2]


def test_nothing_is_composed_of_nothing():
    still = motion_of("stand", "composition", "one", "standing", standing(100))
    assert composed([]) == [] and composed([still]) == []


@pytest.fixture(scope="module")
def captured(tmp_path_factory) -> list[Motion]:
    from dafnet_addon.data.dataset.usable import load_motions

    folder = tmp_path_factory.mktemp("mocap")
    for name in ("rocketbox", "cmu69"):
        (folder / f"{name}.npz").symlink_to(MOCAP / f"{name}.npz")
    motions = load_motions(folder, "train")
    sits = [m for m in motions if m.category in ("sit_down", "stand_up")]
    return [m for m in motions if not any(m is s for s in sits[1:-1])]


@pytest.mark.mocap
def test_composed_capture_is_whole_fluent_and_the_same_again(captured, monkeypatch):
    monkeypatch.setattr(compose, "_IDLES", 4)
    made = composed(captured)
    kinds = {m.kind for m in made}
    assert {"approach", "leave", "work", "desk", "write", "counter"} <= kinds
    for m in made[:: max(1, len(made) // 60)]:
        joints = m.motion.joints
        assert np.abs(_lengths(joints) - BONES).max() < 1e-6, m.motion.name
        assert _speed(joints).max() < 5.0 and joints[:, TOES, 2].min() > -0.02, m.motion.name
        assert m.focus.min() >= 0 and m.focus.max() < len(joints), m.motion.name
    seen = {"desk": working, "write": stroking}
    for kind, finds in seen.items():
        of_kind = [m.motion for m in made if m.kind == kind]
        found = [bool(finds(m.joints, compose.root_from_joints(m.joints))) for m in of_kind]
        assert np.mean(found) > 0.7, kind
    sides = [m.motion for m in made if m.kind == "approach"]
    from_behind = 0
    for m in sides:
        rest = m.rests[-1]
        way = (m.joints[0, 0] - rest.position)[:2]
        from_behind += bool(way @ (-np.sin(rest.yaw), np.cos(rest.yaw)) < 0)
    assert 0.2 < from_behind / len(sides) < 0.8
    again = composed(captured)
    assert all(
        np.array_equal(a.motion.joints, b.motion.joints) for a, b in zip(made, again, strict=True)
    )
