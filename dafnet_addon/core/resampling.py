"""Between the scene's frame rate and the model's 30 frames a second.

Frame i of a scene lies at i / fps seconds, frame j of the model at j / 30. The model's frames cover
the scene's: the last one lies on the scene's last frame or, by less than a frame, behind it. Beyond
the ends of what is known, motion goes straight on.
"""

import numpy as np

from .root import RootPath
from .rotations import continuous_signs, matrix_from_quaternion, quaternion_from_matrix, slerp
from .series import MODEL_FPS

__all__ = [
    "frame_times",
    "covering_frames",
    "resample_positions",
    "resample_nearest",
    "resample_rotations",
    "resample_rigid",
    "resample_path",
]

_SAME = 1e-6  # fractions of a frame closer to one than this lie on it


def frame_times(frames: int, fps: float) -> np.ndarray:
    """Times (frames,) of frames in seconds, the first at 0."""
    return np.arange(frames) / fps


def covering_frames(frames: int, fps_from: float, fps_to: float = MODEL_FPS) -> int:
    """How many frames at ``fps_to`` it takes to interpolate every one of ``frames`` frames at
    ``fps_from``.
    """
    return int(np.ceil((frames - 1) * fps_to / fps_from - _SAME)) + 1


def _neighbours(
    source: np.ndarray, target: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Source frames before and after each target time, and the way from one to the other (0 to 1
    between them).
    """
    if len(source) == 1:
        zero = np.zeros(len(target), int)
        return zero, zero, np.zeros(len(target))
    before = np.clip(np.searchsorted(source, target, side="right") - 1, 0, len(source) - 2)
    way = (target - source[before]) / (source[before + 1] - source[before])
    nearest = np.rint(way)
    return before, before + 1, np.where(np.abs(way - nearest) < _SAME, nearest, way)


def resample_positions(
    values: np.ndarray, source_times: np.ndarray, target_times: np.ndarray
) -> np.ndarray:
    """Values (T, …) by linear interpolation at other times (N, …).

    NaN means "free": a target between two frames is NaN where either is, and a target that hits a
    frame is that frame.
    """
    before, after, way = _neighbours(source_times, target_times)
    way = way.reshape(-1, *[1] * (values.ndim - 1))
    blend = values[before] * (1.0 - way) + values[after] * way
    return np.where(way == 0.0, values[before], np.where(way == 1.0, values[after], blend))


def resample_nearest(
    values: np.ndarray, source_times: np.ndarray, target_times: np.ndarray
) -> np.ndarray:
    """Values (T, …) that cannot be mixed, such as modes, from the nearest frame (the later one of
    two as near).
    """
    before, after, way = _neighbours(source_times, target_times)
    return np.asarray(values)[np.where(way >= 0.5, after, before)]


def resample_rotations(
    quaternions: np.ndarray, source_times: np.ndarray, target_times: np.ndarray
) -> np.ndarray:
    """Unit quaternions (T, …, 4), w x y z, by slerp at other times (N, …, 4), with signs that are
    continuous in time.

    NaN means "free", as in ``resample_positions``.
    """
    before, after, way = _neighbours(source_times, target_times)
    way = way.reshape(-1, *[1] * (quaternions.ndim - 2))
    blend = slerp(quaternions[before], quaternions[after], way)
    way = way[..., None]
    return continuous_signs(
        np.where(way == 0.0, quaternions[before], np.where(way == 1.0, quaternions[after], blend))
    )


def resample_rigid(
    matrices: np.ndarray, source_times: np.ndarray, target_times: np.ndarray
) -> np.ndarray:
    """Rigid frames (T, 4, 4) at other times (N, 4, 4): rotations by slerp, positions linearly."""
    out = np.zeros((len(target_times), 4, 4))
    quaternions = resample_rotations(
        quaternion_from_matrix(matrices[:, :3, :3]), source_times, target_times
    )
    out[:, :3, :3] = matrix_from_quaternion(quaternions)
    out[:, :3, 3] = resample_positions(matrices[:, :3, 3], source_times, target_times)
    out[:, 3, 3] = 1.0
    return out


def resample_path(
    path: RootPath, fps_from: float, fps_to: float = MODEL_FPS, frames: int | None = None
) -> RootPath:
    """A root path at another frame rate, ``frames`` long or as long as it takes to cover the
    path.
    """
    source = frame_times(len(path), fps_from)
    target = frame_times(
        covering_frames(len(path), fps_from, fps_to) if frames is None else frames, fps_to
    )
    return RootPath(
        resample_positions(path.position, source, target),
        resample_positions(path.yaw, source, target),
    )
