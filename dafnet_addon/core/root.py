"""The root: a frame on the ground under the pelvis that follows the body's heading.

Root frame: x right, y forward, z up; yaw is counter-clockwise seen from above, 0 when forward is
world +y. A path is ``position`` (T, 3) with ``yaw`` (T,). The one smoothing of a path happens here,
for training and for animators alike.
"""

from dataclasses import dataclass

import numpy as np

from .rotations import normalised, rotate, transpose, yaw_matrix
from .series import MODEL_FPS
from .skeleton import PELVIS, joint

__all__ = [
    "RootPath",
    "forward_of",
    "gaussian",
    "raw_root_from_joints",
    "root_from_joints",
    "root_from_matrices",
    "smoothed",
    "velocities",
    "to_root",
    "to_world",
    "yaw_of",
    "AHEAD",
    "ahead",
]

POSITION_SIGMA = 3.0
"""Frames at 30 a second: standard deviation of the Gaussian over a root's position."""
YAW_SIGMA = 6.0
"""The same of the one over its yaw."""

_MAX_TURN = float(np.radians(15.0))
"""Radians in one of these frames up to which a heading may turn."""
AHEAD = (5, 10, 15, 20, 25, 30, 45, 60)
"""How far ahead the model is told of the root, in 30-fps frames: as far as it takes to see where
one will have sat down. Weights that were trained on fewer are told of the first of them."""


def yaw_of(direction: np.ndarray) -> np.ndarray:
    """Yaw (…) of directions (…, 2 or 3) over the floor; 0 looks along +y."""
    return np.asarray(np.arctan2(-direction[..., 0], direction[..., 1]))


def forward_of(yaw: np.ndarray | float) -> np.ndarray:
    """Unit directions (…, 2) over the floor in which a yaw (…) looks."""
    return np.stack([-np.sin(yaw), np.cos(yaw)], axis=-1)


@dataclass(frozen=True)
class RootPath:
    """``position`` (T, 3) metres in the world, z the height of the local floor; ``yaw`` (T,)
    radians, unwrapped.
    """

    position: np.ndarray
    yaw: np.ndarray

    def __len__(self) -> int:
        return len(self.yaw)

    @property
    def rotation(self) -> np.ndarray:
        """(T, 3, 3) rotations from the root's frame to the world."""
        return yaw_matrix(self.yaw)

    def matrices(self) -> np.ndarray:
        """(T, 4, 4) frames, as an animator's root empty gives them."""
        m = np.zeros((len(self), 4, 4))
        m[:, :3, :3], m[:, :3, 3], m[:, 3, 3] = self.rotation, self.position, 1.0
        return m


def gaussian(values: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian smoothing along time; beyond its ends the path goes on as a point reflection, so
    straight lines stay.
    """
    n = len(values)
    if n < 2:
        return values.copy()

    radius = int(4 * sigma + 0.5)
    reach = np.arange(1, radius + 1)
    before = 2 * values[:1] - values[np.minimum(reach[::-1], n - 1)]
    after = 2 * values[-1:] - values[np.maximum(n - 1 - reach, 0)]
    padded = np.concatenate([before, values, after])
    kernel = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    kernel /= kernel.sum()
    columns = padded.reshape(len(padded), -1)
    out = np.stack([np.convolve(c, kernel, mode="valid") for c in columns.T], axis=1)
    return out.reshape(values.shape)


def smoothed(
    path: RootPath, position_sigma: float = POSITION_SIGMA, yaw_sigma: float = YAW_SIGMA
) -> RootPath:
    """The path smoothed once by Gaussians (standard deviations in 30-fps frames)."""
    return RootPath(gaussian(path.position, position_sigma), gaussian(path.yaw, yaw_sigma))


def _held_yaw(forward: np.ndarray, certainty: np.ndarray, max_turn: float) -> np.ndarray:
    """Yaw of horizontal vectors; held where ``certainty`` is under 0.35, and limited to
    ``max_turn`` radians a frame.
    """
    yaw = yaw_of(forward)
    good = certainty > 0.35
    if not good.any():
        return np.zeros(len(yaw))

    last = np.maximum.accumulate(np.where(good, np.arange(len(yaw)), -1))
    yaw = np.unwrap(yaw[np.where(last < 0, np.argmax(good), last)])
    turn = np.abs(np.diff(yaw)) > max_turn
    if turn.any():
        for t in range(1, len(yaw)):
            yaw[t] = yaw[t - 1] + np.clip(yaw[t] - yaw[t - 1], -max_turn, max_turn)

    return yaw


def raw_root_from_joints(
    joints: np.ndarray, floor: float = 0.0, fps: float = MODEL_FPS
) -> RootPath:
    """Root path of world joints (T, 22, 3), ``fps`` frames a second, not smoothed: pelvis on the
    ground, heading from shoulders and hips.

    Paper, section 4.1; the heading is held where shoulders and hips give none, as in lying.
    """
    left_shoulder, right_shoulder = (
        joints[:, joint("left_shoulder")],
        joints[:, joint("right_shoulder")],
    )
    left_hip, right_hip = joints[:, joint("left_hip")], joints[:, joint("right_hip")]
    across = normalised(
        normalised(left_shoulder - right_shoulder) + normalised(left_hip - right_hip)
    )
    forward = np.cross(across, [0.0, 0.0, 1.0])
    position = joints[:, PELVIS].copy()
    position[:, 2] = floor
    certainty = np.linalg.norm(forward[:, :2], axis=-1)
    yaw = _held_yaw(forward, certainty, _MAX_TURN * MODEL_FPS / fps)
    return RootPath(position.astype(float), yaw)


def root_from_joints(joints: np.ndarray, floor: float = 0.0, fps: float = MODEL_FPS) -> RootPath:
    """R^τ of world joints (T, 22, 3), ``fps`` frames a second: their raw root path, smoothed."""
    rate = fps / MODEL_FPS
    path = raw_root_from_joints(joints, floor, fps)
    return smoothed(path, POSITION_SIGMA * rate, YAW_SIGMA * rate)


def root_from_matrices(matrices: np.ndarray) -> tuple[RootPath, float]:
    """Path of an animator's root frames (T, 4, 4), flattened, not smoothed; and its largest tilt
    from upright (radians).
    """
    up = normalised(matrices[:, :3, 2])
    forward = matrices[:, :3, 1]
    certainty = np.linalg.norm(normalised(forward)[:, :2], axis=-1)
    tilt = float(np.arccos(np.clip(up[:, 2], -1.0, 1.0)).max())
    yaw = yaw_of(forward)
    good = certainty > 0.1
    last = np.maximum.accumulate(np.where(good, np.arange(len(yaw)), -1))
    yaw = np.unwrap(yaw[np.where(last < 0, np.argmax(good), last)])
    return RootPath(matrices[:, :3, 3].astype(float), yaw), tilt


def velocities(path: RootPath) -> np.ndarray:
    """c_vel (T, 3): (right, forward) displacement in the previous root's frame, metres per frame,
    and the turn, radians.

    The first frame, which has no previous one, is given no motion.
    """
    out = np.zeros((len(path), 3))
    step = np.diff(path.position, axis=0)
    out[1:, :2] = rotate(transpose(path.rotation[:-1]), step)[:, :2]
    out[1:, 2] = np.diff(path.yaw)
    return out


def ahead(path: RootPath) -> np.ndarray:
    """Where the root will be (T, 24): right, forward (metres) and turn (radians) from R^τ to each
    of ``AHEAD`` frames later.

    Beyond its end the path goes on as it last moved. Not in the paper; in Blender the whole path is
    known.
    """
    last, rest = len(path) - 1, max(AHEAD)
    step = path.position[-1:] - path.position[max(last - 1, 0)]
    turn = path.yaw[-1] - path.yaw[max(last - 1, 0)]
    beyond = np.arange(1, rest + 1)
    position = np.concatenate([path.position, path.position[-1:] + step * beyond[:, None]])
    yaw = np.concatenate([path.yaw, path.yaw[-1] + turn * beyond])
    out = np.empty((len(path), len(AHEAD), 3))
    for k, frames in enumerate(AHEAD):
        later = slice(frames, frames + len(path))
        out[:, k, :2] = rotate(transpose(path.rotation), position[later] - path.position)[:, :2]
        out[:, k, 2] = yaw[later] - path.yaw

    return out.reshape(len(path), -1)


def to_root(path: RootPath, points: np.ndarray) -> np.ndarray:
    """World points (T, …, 3) in the root's frames."""
    shape = (len(path),) + (1,) * (points.ndim - 2) + (3,)
    return np.einsum("tji,t...j->t...i", path.rotation, points - path.position.reshape(shape))


def to_world(path: RootPath, points: np.ndarray) -> np.ndarray:
    """Points (T, …, 3) in the root's frames, in the world."""
    shape = (len(path),) + (1,) * (points.ndim - 2) + (3,)
    return np.einsum("tij,t...j->t...i", path.rotation, points) + path.position.reshape(shape)
