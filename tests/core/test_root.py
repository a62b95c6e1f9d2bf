"""Root path, sensor layout and rotations."""

import numpy as np
import pytest

from dafnet_addon.core.root import (
    RootPath,
    root_from_joints,
    root_from_matrices,
    smoothed,
    to_root,
    to_world,
    velocities,
)
from dafnet_addon.core.rotations import (
    continuous_signs,
    frame_from,
    matrix_from_quaternion,
    normalised,
    quaternion_from_matrix,
    rotate,
    rotation_between,
    slerp,
    transpose,
    yaw_matrix,
)
from dafnet_addon.core.sensor import HEIGHT, RADIUS, REACH, SPHERES, narrowed, occupancy_of_distance
from dafnet_addon.core.skeleton import REST

RNG = np.random.default_rng(7)


def winding_path(frames: int = 200) -> RootPath:
    t = np.linspace(0.0, 6.0, frames)
    return RootPath(
        np.stack([np.sin(t), 0.5 * t, np.zeros(frames)], axis=1),
        1.5 * t + 0.3 * np.sin(3 * t) + 0.4,
    )


def test_integrating_velocities_gives_the_path_back():
    path = winding_path()
    steps = velocities(path)
    yaw = path.yaw[0] + np.cumsum(steps[:, 2])
    before = np.concatenate([path.yaw[:1], yaw[:-1]])
    x, y = steps[:, 0], steps[:, 1]
    across = [np.cos(before) * x - np.sin(before) * y, np.sin(before) * x + np.cos(before) * y]
    place = path.position[0, :2] + np.cumsum(np.stack(across, axis=1), axis=0)
    np.testing.assert_allclose(place, path.position[:, :2], atol=1e-12)
    np.testing.assert_allclose(yaw, path.yaw, atol=1e-12)


def test_velocity_is_right_forward_and_counter_clockwise_turn():
    facing_minus_x = RootPath(
        np.array([[0, 0, 0], [-0.1, 0.02, 0]]), np.array([np.pi / 2, np.pi / 2 + 0.05])
    )
    np.testing.assert_allclose(
        velocities(facing_minus_x), [[0, 0, 0], [0.02, 0.1, 0.05]], atol=1e-12
    )


@pytest.mark.parametrize("fps", [24.0, 60.0, 120.0])
def test_the_root_of_a_body_is_the_same_at_any_rate(fps: float) -> None:
    """It sways and turns fast, which is smoothed and limited by time, not by frames."""

    def root_at(rate: float) -> RootPath:
        t = np.arange(0.0, 4.0, 1.0 / rate)
        yaw = 0.3 * np.sin(9.0 * t) + np.clip(12.0 * (t - 1.5), 0.0, np.pi)
        sway = np.stack([0.05 * np.sin(12.0 * t), 0.8 * t, 0.0 * t], axis=1)
        body = to_world(RootPath(sway, yaw), np.repeat(np.array(REST)[None], len(t), axis=0))
        return root_from_joints(body, fps=rate)

    wanted, found = root_at(30.0), root_at(fps)
    times = np.arange(len(found)) / fps
    shown = times <= 3.9
    for axis in range(2):
        there = np.interp(times, np.arange(len(wanted)) / 30.0, wanted.position[:, axis])
        assert np.abs(found.position[:, axis] - there)[shown].max() < 2e-3
    yaw = np.interp(times, np.arange(len(wanted)) / 30.0, wanted.yaw)
    assert np.abs(found.yaw - yaw)[shown].max() < 0.04


def test_world_and_root_are_inverse_for_any_number_of_points():
    path = winding_path(20)
    for shape in ((20, 3), (20, 22, 3), (20, 2, 5, 3)):
        points = RNG.normal(size=shape)
        np.testing.assert_allclose(to_world(path, to_root(path, points)), points, atol=1e-12)
    ahead = to_world(path, np.broadcast_to([0.0, 1.0, 0.0], (20, 3)))
    np.testing.assert_allclose(ahead, path.position + path.matrices()[:, :3, 1], atol=1e-12)


def test_root_of_a_standing_body_is_under_its_pelvis_and_looks_ahead():
    yaw, place = 0.8, np.array([2.0, -1.0, 0.0])
    joints = np.broadcast_to(REST @ yaw_matrix(np.array(yaw)).T + place, (30, 22, 3))
    path = root_from_joints(joints)
    np.testing.assert_allclose(path.position, np.broadcast_to(place, (30, 3)), atol=1e-9)
    np.testing.assert_allclose(path.yaw, yaw, atol=1e-6)


def test_heading_is_held_while_lying_on_the_side():
    upright = np.broadcast_to(REST, (20, 22, 3))
    on_the_side = upright[..., [2, 1, 0]] * [1, 1, -1]
    path = root_from_joints(np.concatenate([upright, on_the_side]))
    np.testing.assert_allclose(path.yaw, 0.0, atol=1e-9)


def test_smoothing_keeps_straight_lines_and_their_ends():
    t = np.arange(60.0)[:, None]
    line = RootPath(t * [0.03, 0.01, 0.0] + 1.0, 0.02 * t[:, 0] + 5.0)
    np.testing.assert_allclose(smoothed(line).position, line.position, atol=1e-12)
    np.testing.assert_allclose(smoothed(line).yaw, line.yaw, atol=1e-12)


def test_smoothing_calms_noise_and_bears_a_single_frame():
    noisy = RootPath(RNG.normal(size=(300, 3)), RNG.normal(size=300))
    calm = smoothed(noisy)
    assert calm.position.std() < 0.45 and calm.yaw.std() < 0.35
    one = RootPath(np.ones((1, 3)), np.ones(1))
    np.testing.assert_array_equal(smoothed(one).position, one.position)


def test_matrices_round_trip_and_tilt_is_flattened():
    path = winding_path(50)
    again, tilt = root_from_matrices(path.matrices())
    np.testing.assert_allclose(again.position, path.position, atol=1e-12)
    np.testing.assert_allclose(again.yaw, path.yaw, atol=1e-12)
    assert tilt < 1e-6

    c, s = np.cos(0.3), np.sin(0.3)
    tilted = path.matrices()
    tilted[:, :3, :3] = path.rotation @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    again, tilt = root_from_matrices(tilted)
    assert tilt == pytest.approx(0.3)
    np.testing.assert_allclose(np.cos(again.yaw - path.yaw), 1.0, atol=1e-9)


def test_sensor_has_2640_spheres_in_15_layers_of_176():
    assert SPHERES.shape == (2640, 3)
    layers = SPHERES.reshape(15, 176, 3)
    np.testing.assert_allclose(
        layers[:, :, 2], np.arange(15)[:, None] / 7 * np.ones(176), atol=1e-12
    )
    for layer in layers[1:]:
        np.testing.assert_array_equal(layer[:, :2], layers[0, :, :2])
    assert layers[-1, 0, 2] == pytest.approx(HEIGHT)


def test_sensor_rings_run_outwards_from_the_right():
    flat = SPHERES[:176, :2]
    radius = np.linalg.norm(flat, axis=1)
    counts = [6, 13, 19, 25, 31, 38, 44]
    np.testing.assert_allclose(radius, np.repeat(np.arange(1, 8) / 7, counts), atol=1e-12)
    assert radius.max() == pytest.approx(REACH)
    start = 0
    for k, count in enumerate(counts, start=1):
        ring = flat[start : start + count]
        np.testing.assert_allclose(ring[0], [k / 7, 0.0], atol=1e-12)
        step = np.diff(np.unwrap(np.arctan2(ring[:, 1], ring[:, 0])))
        np.testing.assert_allclose(step, 2 * np.pi / count, atol=1e-12)
        start += count


def test_occupancy_falls_from_the_centre_to_the_radius():
    assert pytest.approx(1 / 7) == RADIUS
    distance = np.array([-1.0, 0.0, RADIUS / 2, RADIUS, 1.0])
    np.testing.assert_allclose(occupancy_of_distance(distance), [1, 1, 0.5, 0, 0], atol=1e-12)


def test_smaller_spheres_see_what_is_within_them():
    distance = np.linspace(-0.1, 0.2, 61)
    own = np.clip(1.0 - distance / 0.05, 0.0, 1.0)
    np.testing.assert_allclose(narrowed(occupancy_of_distance(distance), 0.05), own, atol=1e-12)


def random_rotations(n: int) -> np.ndarray:
    return matrix_from_quaternion(RNG.normal(size=(n, 4)))


def test_quaternions_and_matrices_are_inverse():
    matrices = np.concatenate(
        [random_rotations(500), [np.diag(d) for d in ([1, 1, 1], [1, -1, -1], [-1, -1, 1])]]
    )
    np.testing.assert_allclose(
        matrices @ transpose(matrices), np.broadcast_to(np.eye(3), matrices.shape), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(matrices), 1.0)
    np.testing.assert_allclose(
        matrix_from_quaternion(quaternion_from_matrix(matrices)), matrices, atol=1e-12
    )


def test_quaternion_of_a_known_turn():
    half = np.sqrt(0.5)
    quarter_about_z = quaternion_from_matrix(yaw_matrix(np.array(np.pi / 2)))
    np.testing.assert_allclose(quarter_about_z, [half, 0, 0, half], atol=1e-12)


def test_slerp_turns_evenly_the_short_way():
    a, b = RNG.normal(size=(2, 100, 4))
    a, b = normalised(a), normalised(b)
    angle = 2 * np.arccos(np.minimum(np.abs((a * b).sum(-1)), 1.0))
    for t in (0.0, 0.25, 1.0):
        between = slerp(a, b, np.full(100, t))
        turned = 2 * np.arccos(np.minimum(np.abs((a * between).sum(-1)), 1.0))
        np.testing.assert_allclose(turned, t * angle, atol=1e-6)
    np.testing.assert_allclose(slerp(a, -a, np.full(100, 0.5)), a, atol=1e-6)


def test_rotation_between_takes_one_direction_onto_the_other():
    a, b = RNG.normal(size=(2, 200, 3))
    b[:50] = -2.0 * a[:50]
    b[50:60] = a[50:60]
    r = rotation_between(a, b)
    np.testing.assert_allclose(rotate(r, normalised(a)), normalised(b), atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(r), 1.0, atol=1e-6)
    cosine = (normalised(a) * normalised(b)).sum(-1)
    np.testing.assert_allclose((np.trace(r, axis1=1, axis2=2) - 1) / 2, cosine, atol=1e-6)


@pytest.mark.parametrize("axes", ["xy", "yz", "zx", "yx", "zy", "xz"])
def test_frames_are_right_handed_and_hold_the_primary_axis(axes):
    primary, secondary = RNG.normal(size=(2, 50, 3))
    frame = frame_from(primary, secondary, axes)
    np.testing.assert_allclose(np.linalg.det(frame), 1.0)
    np.testing.assert_allclose(frame[..., "xyz".index(axes[0])], normalised(primary), atol=1e-12)
    assert ((frame[..., "xyz".index(axes[1])] * secondary).sum(-1) > 0).all()


def test_signs_are_continuous():
    q = slerp(np.array([1.0, 0, 0, 0]), np.array([0.0, 0, 0, 1.0]), np.linspace(0, 1, 40))
    flipped = q * np.where(RNG.random(40) < 0.5, -1.0, 1.0)[:, None]
    assert ((np.diff(continuous_signs(flipped), axis=0) ** 2).sum(-1) < 0.1).all()
