"""Resampling: any frame rate to the model's and back."""

import numpy as np
import pytest

from dafnet_addon.core.resampling import (
    covering_frames,
    frame_times,
    resample_nearest,
    resample_path,
    resample_positions,
    resample_rigid,
    resample_rotations,
)
from dafnet_addon.core.root import RootPath
from dafnet_addon.core.rotations import matrix_from_quaternion, normalised, yaw_matrix

RATES = [12.0, 24000 / 1001, 24.0, 25.0, 30.0, 50.0, 59.94, 60.0, 120.0]


@pytest.mark.parametrize("fps", RATES)
@pytest.mark.parametrize("frames", [1, 2, 3, 77, 300])
def test_model_frames_cover_the_scene_and_no_more(fps: float, frames: int) -> None:
    count = covering_frames(frames, fps)
    end = (frames - 1) / fps
    assert count >= 1
    assert (count - 1) / 30.0 >= end - 1e-6
    assert (count - 2) / 30.0 < end


@pytest.mark.parametrize("fps", RATES)
def test_a_straight_path_survives_the_round_trip(fps: float) -> None:
    path = RootPath(
        np.outer(np.arange(100) / fps, [1.2, -0.4, 0.1]) + 3.0, 0.8 * np.arange(100) / fps
    )
    model = resample_path(path, fps)
    assert np.allclose(
        model.position, np.outer(frame_times(len(model), 30.0), [1.2, -0.4, 0.1]) + 3.0
    )
    back = resample_path(model, 30.0, fps, frames=100)
    assert np.allclose(back.position, path.position) and np.allclose(back.yaw, path.yaw)


@pytest.mark.parametrize("fps", RATES)
def test_a_smooth_path_survives_the_round_trip_closely(fps: float) -> None:
    time = frame_times(200, fps)
    path = RootPath(np.stack([np.sin(2 * time), np.cos(time), 0 * time], axis=1), np.sin(time))
    back = resample_path(resample_path(path, fps), 30.0, fps, frames=200)
    # curvature 4, h² / 8 twice
    assert np.abs(back.position - path.position).max() < 4 * (1 / min(fps, 30.0)) ** 2 / 4
    assert np.abs(back.yaw - path.yaw).max() < (1 / min(fps, 30.0)) ** 2 / 4


def test_same_rate_changes_nothing() -> None:
    values = np.random.default_rng(0).normal(size=(20, 4, 3))
    values[5] = np.nan
    times = frame_times(20, 30.0)
    assert np.array_equal(resample_positions(values, times, times), values, equal_nan=True)


def test_free_targets_stay_free() -> None:
    values = np.array([[0.0], [1.0], [np.nan], [3.0], [4.0]])
    out = resample_positions(values, frame_times(5, 30.0), frame_times(9, 60.0))[:, 0]
    assert np.array_equal(out, [0, 0.5, 1, np.nan, np.nan, np.nan, 3, 3.5, 4], equal_nan=True)


def test_a_single_frame_is_held() -> None:
    assert np.array_equal(
        resample_positions(np.array([[7.0]]), frame_times(1, 24.0), frame_times(3, 30.0)), [[7]] * 3
    )
    identity = np.eye(4)[None]
    assert np.allclose(
        resample_rigid(identity, frame_times(1, 24.0), frame_times(2, 30.0)), np.eye(4)
    )


def test_modes_come_from_the_nearest_frame() -> None:
    modes = np.array(["FREE", "EE", "FULL"])
    out = resample_nearest(
        modes, frame_times(3, 30.0), np.array([-1.0, 0.0, 0.4, 0.6, 1.4, 1.6, 2.0, 9.0]) / 30.0
    )
    assert out.tolist() == ["FREE", "FREE", "FREE", "EE", "EE", "FULL", "FULL", "FULL"]


def test_rotations_turn_evenly_and_keep_their_signs() -> None:
    rate = 2.0  # radians a second about z
    angle = rate * frame_times(25, 24.0)
    quaternions = np.stack([np.cos(angle / 2), 0 * angle, 0 * angle, np.sin(angle / 2)], axis=1)
    quaternions[::2] *= -1.0
    out = resample_rotations(quaternions, frame_times(25, 24.0), frame_times(31, 30.0))
    assert np.allclose(matrix_from_quaternion(out), yaw_matrix(rate * frame_times(31, 30.0)))
    assert ((out[1:] * out[:-1]).sum(-1) > 0).all()


def test_rotations_of_many_joints() -> None:
    rng = np.random.default_rng(0)
    quaternions = normalised(rng.normal(size=(10, 22, 4)))
    out = resample_rotations(quaternions, frame_times(10, 30.0), frame_times(19, 60.0))
    assert np.allclose(np.abs((out[::2] * quaternions).sum(-1)), 1.0)
    assert np.allclose(np.linalg.norm(out, axis=-1), 1.0)
    quaternions[4, 3] = np.nan
    free = np.isnan(
        resample_rotations(quaternions, frame_times(10, 30.0), frame_times(19, 60.0))
    ).any(axis=-1)
    assert free[7:10, 3].all() and free.sum() == 3


@pytest.mark.parametrize("fps", RATES)
def test_rigid_frames_survive_the_round_trip(fps: float) -> None:
    time = frame_times(60, fps)
    matrices = np.zeros((60, 4, 4))
    matrices[:, :3, :3], matrices[:, :3, 3], matrices[:, 3, 3] = (
        yaw_matrix(1.5 * time),
        np.outer(time, [1, 2, 3]),
        1.0,
    )
    model_time = frame_times(covering_frames(60, fps), 30.0)
    model = resample_rigid(matrices, time, model_time)
    assert np.allclose(model[:, :3, :3], yaw_matrix(1.5 * model_time))
    assert np.allclose(resample_rigid(model, model_time, time), matrices)
