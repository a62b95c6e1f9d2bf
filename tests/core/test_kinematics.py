"""Kinematics: joints from bones and back, limbs that reach, bend the right way and do not pop."""

import numpy as np
import pytest

from dafnet_addon.core.kinematics import (
    Bent,
    Turn,
    come_over,
    fit,
    forward_kinematics,
    global_from_local,
    local_from_global,
    turned,
    two_bone,
)
from dafnet_addon.core.rotations import (
    matrix_from_quaternion,
    quaternion_from_matrix,
    rotate,
    yaw_matrix,
)
from dafnet_addon.core.series import smoothstep
from dafnet_addon.core.skeleton import OFFSETS, PARENTS, REST

FRAMES = 240


def turn(axis: str, angle: np.ndarray) -> np.ndarray:
    """Rotation matrices about one axis."""
    quaternion = np.zeros((*np.shape(angle), 4))
    half = np.divide(angle, 2.0)
    quaternion[..., 0], quaternion[..., 1 + "xyz".index(axis)] = np.cos(half), np.sin(half)
    return matrix_from_quaternion(quaternion)


def waves(rng: np.random.Generator, low: float, high: float) -> np.ndarray:
    """Smooth random angles (FRAMES,) between two bounds in degrees."""
    time = np.arange(FRAMES) / 30.0
    wave = (
        sum(np.sin(2 * np.pi * (rng.uniform(0.1, 0.5) * time + rng.uniform())) for _ in range(3))
        / 3.0
    )
    return np.radians(low + (high - low) * (wave + 1.0) / 2.0)


def moving_body(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random smooth motion within a person's joint limits: local frames (FRAMES, 22, 3, 3), pelvis
    (FRAMES, 3).
    """
    rng = np.random.default_rng(seed)
    local = np.broadcast_to(np.eye(3), (FRAMES, 22, 3, 3)).copy()
    local[:, 0] = turn("z", waves(rng, -180, 180)) @ turn("x", waves(rng, -30, 30))
    for j in (3, 6, 9, 12, 13, 14):
        local[:, j] = (
            turn("z", waves(rng, -12, 12))
            @ turn("x", waves(rng, -12, 12))
            @ turn("y", waves(rng, -12, 12))
        )
    for side, shoulder, elbow, hip, knee in ((-1, 16, 18, 1, 4), (1, 17, 19, 2, 5)):
        raised, forward, twisted = waves(rng, -20, 80), waves(rng, -40, 40), waves(rng, -50, 50)
        local[:, shoulder] = turn("y", side * raised) @ turn("z", forward) @ turn("x", twisted)
        local[:, elbow] = turn("z", side * waves(rng, 25, 120))
        local[:, hip] = (
            turn("x", waves(rng, -20, 90))
            @ turn("z", waves(rng, -25, 25))
            @ turn("y", waves(rng, -20, 20))
        )
        local[:, knee] = turn("x", -waves(rng, 25, 110))
    for j in (7, 8):
        local[:, j] = turn("x", waves(rng, -30, 20))
    pelvis = np.array([0, 0, 0.9]) + np.cumsum(rng.normal(0, 0.002, (FRAMES, 3)), axis=0)
    return local, pelvis


def angular_steps(frames: np.ndarray) -> np.ndarray:
    """Degrees that every joint turns, in its parent's frame, from frame to frame (T - 1, 22)."""
    local = local_from_global(frames)
    trace = np.einsum("tjab,tjab->tj", local[1:], local[:-1])
    return np.degrees(np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0)))


def bone_lengths(joints: np.ndarray) -> np.ndarray:
    return np.linalg.norm(joints[:, 1:] - joints[:, list(PARENTS[1:])], axis=-1)


def test_identity_is_the_rest_pose_and_comes_back() -> None:
    identity = np.broadcast_to(np.eye(3), (3, 22, 3, 3))
    joints = forward_kinematics(identity, np.tile(REST[0], (3, 1)))
    assert np.allclose(joints, REST, atol=1e-12)
    pelvis, frames = fit(joints)
    assert np.allclose(pelvis, REST[0]) and np.allclose(frames, np.eye(3), atol=1e-5)
    small = forward_kinematics(identity, np.tile(REST[0] * 0.8, (3, 1)), scale=0.8)
    assert np.allclose(small, REST * 0.8, atol=1e-12)
    assert np.allclose(fit(small, scale=0.8)[1], np.eye(3), atol=1e-5)


def test_local_and_global_frames_are_inverse() -> None:
    local, _ = moving_body(0)
    assert np.allclose(local_from_global(global_from_local(local)), local, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("scale", [1.0, 0.85])
def test_fit_recovers_a_body(seed: int, scale: float) -> None:
    local, pelvis = moving_body(seed)
    frames = global_from_local(local)
    joints = forward_kinematics(frames, pelvis, scale)
    fitted_pelvis, fitted = fit(joints, scale)
    again = forward_kinematics(fitted, fitted_pelvis, scale)
    error = np.linalg.norm(again - joints, axis=-1)
    assert error.mean() < 1e-3
    assert error[:, [0, 7, 8, 20, 21]].max() < 1e-6
    assert np.allclose(bone_lengths(again), scale * np.linalg.norm(OFFSETS[1:], axis=-1), atol=1e-9)
    assert np.allclose(fitted[:, [0, 9]], frames[:, [0, 9]], atol=1e-6)
    limbs = [16, 17, 18, 19, 1, 2, 4, 5]
    trace = np.einsum("tjab,tjab->tj", fitted[:, limbs], frames[:, limbs])
    assert np.degrees(np.arccos(np.clip((trace - 1) / 2, -1, 1))).mean() < 2.0


def test_elbows_and_knees_are_hinges_that_bend_the_right_way() -> None:
    local, pelvis = moving_body(1)
    joints = forward_kinematics(global_from_local(local), pelvis)
    joints += np.random.default_rng(0).normal(0, 0.005, joints.shape)
    quaternion = quaternion_from_matrix(local_from_global(fit(joints)[1]))
    quaternion *= np.where(quaternion[..., :1] < 0, -1.0, 1.0)
    for j, axis, sign in ((18, 3, -1), (19, 3, 1), (4, 1, -1), (5, 1, -1)):
        others = [c for c in (1, 2, 3) if c != axis]
        assert np.abs(quaternion[:, j, others]).max() < 1e-6
        assert (sign * quaternion[:, j, axis]).min() > -1e-9


def test_noise_makes_no_pops() -> None:
    local, pelvis = moving_body(2)
    joints = forward_kinematics(global_from_local(local), pelvis)
    noisy = joints + np.random.default_rng(0).uniform(-0.01, 0.01, joints.shape)
    pelvis_fit, frames = fit(noisy)
    lengths = bone_lengths(forward_kinematics(frames, pelvis_fit))
    assert np.allclose(lengths, np.linalg.norm(OFFSETS[1:], axis=-1), atol=1e-9)
    assert angular_steps(frames).max() < 50.0
    limbs = [1, 2, 4, 5, 16, 17, 18, 19]
    assert angular_steps(frames)[:, limbs].max() < 30.0


def test_straight_limbs_do_not_flip() -> None:
    """Limbs straight to within noise: their planes say nothing, so they keep the parents'."""
    rng = np.random.default_rng(3)
    joints = np.tile(REST, (FRAMES, 1, 1))
    joints[:, [4, 5, 7, 8, 18, 19, 20, 21]] += rng.uniform(-0.005, 0.005, (FRAMES, 8, 3))
    _, frames = fit(joints)
    limbs = [1, 2, 16, 17]
    assert angular_steps(frames)[:, limbs].max() < 15.0
    trace = np.einsum("tjaa->tj", frames[:, limbs])
    assert np.degrees(np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0))).max() < 30.0


def test_a_knee_that_straightens_and_bends_again_keeps_its_plane() -> None:
    local = np.broadcast_to(np.eye(3), (FRAMES, 22, 3, 3)).copy()
    splay = np.radians(25.0)
    local[:, 1] = turn("z", np.full(FRAMES, splay))
    bend = np.abs(np.linspace(-1.0, 1.0, FRAMES))
    local[:, 4] = turn("x", -bend)
    truth = global_from_local(local)
    _, frames = fit(forward_kinematics(truth, np.tile(REST[0], (FRAMES, 1))))
    assert angular_steps(frames)[:, 1].max() < 3.0
    clear = bend > 0.4
    assert np.allclose(frames[clear, 1], truth[clear, 1], atol=0.02)


def test_head_and_hands_follow_their_rotation_where_given() -> None:
    joints = np.tile(REST, (4, 1, 1))
    asked = np.broadcast_to(yaw_matrix(np.radians(30.0)), (4, 3, 3)).copy()
    asked[2:] = np.nan
    left = np.stack([np.array([0.0, 1, 0]), np.array([-1.0, 0, 0]), np.array([0.0, 0, 1])], axis=-1)
    right = np.stack(
        [np.array([-1.0, 0, 0]), np.array([0.0, 1, 0]), np.array([0.0, 0, -1])], axis=-1
    )
    known = np.array([1.0, 1.0, 0.0, 0.0])
    fitted = fit(joints)[1]
    frames = turned(
        fitted,
        {
            "head": Turn(asked, known),
            "hand_left": Turn(np.tile(left, (4, 1, 1)), np.ones(4)),
            "hand_right": Turn(2.0 * np.tile(right, (4, 1, 1)), np.ones(4)),
        },
    )
    assert np.allclose(frames[:2, 15], asked[:2]) and np.allclose(frames[2:, 15], frames[2:, 12])
    assert np.allclose(frames[:, 20], np.eye(3))
    # right fingers: rest +x, asked +y
    assert np.allclose(rotate(frames[:, 21], np.array([1.0, 0, 0])), [0, 1, 0])
    # back of the hand: down
    assert np.allclose(rotate(frames[:, 21], np.array([0.0, 0, 1])), [0, 0, -1])
    before, after = (forward_kinematics(each, joints[:, 0]) for each in (fitted, frames))
    assert np.allclose(before, after), "no joint moves"


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
def test_a_rotation_that_counts_in_part_turns_in_part(share: float) -> None:
    fitted = fit(np.tile(REST, (3, 1, 1)))[1]
    asked = np.broadcast_to(yaw_matrix(np.radians(80.0)), (3, 3, 3))
    frames = turned(fitted, {"head": Turn(asked, np.full(3, share))})

    def yaw(frame: np.ndarray) -> np.ndarray:
        return np.degrees(np.arctan2(frame[..., 1, 0], frame[..., 0, 0]))

    neck = yaw(frames[:, 12] @ fitted[:, 12].transpose(0, 2, 1))
    assert np.allclose(neck, 40.0 * share, rtol=0.1), "half of it is the neck's"
    assert np.allclose(yaw(frames[:, 15]), neck + share * (80.0 - neck), atol=2.0)
    assert (share > 0.0) or np.array_equal(frames, fitted)


def test_two_bone_reaches_bends_and_clamps() -> None:
    rng = np.random.default_rng(0)
    root, pole = rng.normal(size=(50, 4, 3)), rng.normal(size=(50, 4, 3))
    target = root + 0.4 * rng.uniform(-1, 1, (50, 4, 3)) / np.sqrt(3)
    middle, end = two_bone(root, target, pole, 0.3, np.array([0.2, 0.25, 0.3, 0.35]))
    reachable = np.linalg.norm(target - root, axis=-1) > 0.11
    assert np.allclose(end[reachable], target[reachable], atol=1e-9)
    assert np.allclose(np.linalg.norm(middle - root, axis=-1), 0.3)
    assert np.allclose(np.linalg.norm(end - middle, axis=-1), [0.2, 0.25, 0.3, 0.35])
    normal = np.cross(target - root, pole - root)
    assert np.abs(((middle - root) * normal).sum(-1)).max() < 1e-9  # in the pole's plane,
    side = np.cross(target - root, middle - root)
    assert ((side * normal).sum(-1)[reachable] > 0).all()  # on the pole's side
    far = two_bone(np.zeros(3), np.array([0.0, 5, 0]), np.array([0.0, 1, 1]), 0.3, 0.2)
    assert np.allclose(far[1], [0, 0.5, 0], atol=1e-6) and np.allclose(
        far[0], [0, 0.3, 0], atol=1e-5
    )


def test_two_bone_where_the_pole_says_nothing() -> None:
    root, target = np.zeros((3, 3)), np.tile([0.0, 0, -0.8], (3, 1))
    pole = np.array([[0.0, 0, -0.4], [0.1, 0, -0.4], [0.0, 0, -0.4]])
    held, _ = two_bone(root, target, pole, 0.41, 0.41)
    assert (held[:, 0] > 0.05).all() and np.allclose(held[2], held[1])
    asked, _ = two_bone(root, target, pole, 0.41, 0.41, fallback=np.array([0.0, 1, 0]))
    assert asked[0, 1] > 0.05 and asked[1, 0] > 0.05
    nowhere, _ = two_bone(np.zeros(3), np.zeros(3), np.zeros(3), 0.41, 0.41)
    assert np.isfinite(nowhere).all() and np.isclose(np.linalg.norm(nowhere), 0.41)


def _turning(angle: np.ndarray, height: np.ndarray) -> Bent:
    """A body that only turns its left arm, by angles (T,), its pelvis at heights (T,)."""
    local = np.broadcast_to(np.eye(3), (len(angle), 22, 3, 3)).copy()
    local[:, 16] = turn("z", angle)
    return Bent(quaternion_from_matrix(local), height[:, None] * np.array([0.0, 0.0, 1.0]))


def _arm(motion: Bent) -> np.ndarray:
    return 2 * np.arctan2(motion.local[:, 16, 3], motion.local[:, 16, 0])


def test_a_body_comes_over_from_what_would_have_been() -> None:
    time = np.arange(60)
    angle, height = np.where(time < 30, 0.0, 1.2), np.where(time < 30, 0.9, 0.8)
    motion, other = _turning(angle, height), _turning(np.zeros(10), np.full(10, 0.9))
    ease = smoothstep(np.arange(1, 11) / 11)
    out = come_over(motion, [(30, ease, other)])
    untouched = np.r_[0:30, 40:60]
    assert all(np.array_equal(a[untouched], b[untouched]) for a, b in zip(out, motion, strict=True))
    assert np.allclose(_arm(out)[30:40], 1.2 * ease, atol=1e-7)
    assert np.allclose(out.pelvis[30:40, 2], 0.9 - 0.1 * ease)


def test_where_a_change_changes_nothing_the_stride_goes_on() -> None:
    stride = np.sin(np.arange(60) / 5.0)
    motion = _turning(stride, 0.9 + 0.02 * stride)
    other = Bent(motion.local[30:40], motion.pelvis[30:40])
    out = come_over(motion, [(30, smoothstep(np.arange(1, 11) / 11), other)])
    assert np.allclose(_arm(out), stride) and np.allclose(out.pelvis, motion.pelvis)


def test_changes_that_follow_at_once_do_not_pop() -> None:
    time, ease = np.arange(60), smoothstep(np.arange(1, 11) / 11)
    angle = np.select([time < 30, time < 34], [0.0, 1.2], -0.8)
    changes = [
        (30, ease, _turning(np.zeros(10), np.ones(10))),
        (34, ease, _turning(np.full(10, 1.2), np.ones(10))),
    ]
    out = _arm(come_over(_turning(angle, np.ones(60)), changes))
    assert np.abs(np.diff(out)).max() < 0.35 and np.allclose(out[44:], -0.8)
    assert np.allclose(out[30:34], 1.2 * ease[:4])
