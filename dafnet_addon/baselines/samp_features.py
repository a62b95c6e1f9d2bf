"""What SAMP is given of motions: their tracks, with contacts, actions and goals, from training
windows and held-out clips.

The states of a track are made by ``states_at``; see ``samp_state``. Our data have no labels:
actions follow from the root's speed and the pelvis' height, goals from where the pelvis comes to
rest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import torch
from torch import Tensor

from ..core.kinematics import fit
from ..core.root import AHEAD, RootPath
from ..core.rotations import rotate, yaw_matrix
from ..core.series import MODEL_FPS, runs
from ..core.skeleton import SEAT_TO_PELVIS, joint
from ..data.dataset.prepare import POSE_UNIT
from ..data.furnish.boxes import distances
from ..data.held_out.captured import HeldClip
from ..data.motion.contacts import CONTACTS, contacts
from .samp_state import ACTIONS, CELL, OFFSETS, VOXELS, Parts, pose_seen, seen_from

__all__ = ["FIELDS", "Track", "goals_seen", "clip_track", "window_tracks", "states_at"]

FIELDS = ("poses", "velocity", "ahead", "root", "boxes")
"""What is needed of training windows."""

_SECOND = round(MODEL_FPS)
_SEGMENT = 50
"""Frames between two way points: a goal is 1 to 2.7 seconds ahead, as in a training window."""
_HORIZON = 80
"""Frames before a rest in which it is the goal."""
_SITS_UNDER = 0.80
"""Metres over the floor, of the pelvis."""
_STILL = 0.25
"""Metres a second of the root."""
_SLOW = 0.3
"""Metres a second of the root, under which it idles."""
_FAST = 2.2
"""Metres a second of the root, above which it runs."""
_SEAT = 0.25, 0.78
"""Heights of tops that one sits on, metres."""
_BLEND = 11
"""Frames over which one action becomes another."""
_PELVIS, _NECK, _TOUCHES = joint("pelvis"), joint("neck"), CONTACTS.index("pelvis")


@dataclass(frozen=True)
class Track:
    """B motions with what is known around them. ``root`` (B, N, 4): places. ``joints`` (B, K, 22,
    3), ``axes`` (B, K, 22, 6): forward and up of each joint's frame, ``velocity`` (B, K, 22, 3),
    all in the world, of frames ``first`` to ``first`` + K. ``contacts`` (B, N, 5), ``action`` (B,
    N, 5). ``goal`` (B, N, 5): where one is going to, a place and a height over the floor;
    ``goal_action`` (B, N, 5). ``solid`` (U, 512): occupancies of the voxels at all seats; ``which``
    (B, N): the goal's.
    """

    first: int
    root: Tensor
    joints: Tensor
    axes: Tensor
    velocity: Tensor
    contacts: Tensor
    action: Tensor
    goal: Tensor
    goal_action: Tensor
    solid: Tensor
    which: Tensor

    def repeated(self, count: int) -> "Track":
        """This one motion ``count`` times."""
        many = {
            f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("first", "solid")
        }
        return replace(self, **{name: a.expand(count, *a.shape[1:]) for name, a in many.items()})


def states_at(track: Track, at: Tensor, seen: Tensor) -> Parts:
    """The states of frames ``at`` (F,) as the roots of frames ``seen`` (F,) see them, (B, F, …)."""
    frame, k = track.root[:, seen], at - track.first
    pose = torch.cat([track.joints[:, k], track.axes[:, k], track.velocity[:, k]], dim=-1)
    around = at[:, None] + OFFSETS
    trajectory = torch.cat(
        [seen_from(track.root[:, around], frame[:, :, None]), track.action[:, around]], dim=-1
    )
    return Parts(
        pose_seen(pose, frame), trajectory, track.contacts[:, at], goals_seen(track, at, frame)
    )


def goals_seen(track: Track, at: Tensor, frame: Tensor) -> Tensor:
    """Goals (B, F, 13, 11) around the frames ``at`` (F,), seen from places (B, F, 4)."""
    around = at[:, None] + OFFSETS
    goal, frame = track.goal[:, around], frame[:, :, None]
    place = seen_from(goal[..., :4], frame)
    flat = torch.zeros_like(place[..., :1])
    return torch.cat(
        [place[..., :2], goal[..., 4:], place[..., 2:], flat, track.goal_action[:, around]], dim=-1
    )


def _solid(boxes: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Occupancy (512,) of upright ``boxes`` (M, 7) in the voxels at a place x, y, yaw; 1 inside, 0
    a cell away.
    """
    near = boxes[
        np.linalg.norm(boxes[:, :2] - place[:2], axis=1)
        < 1.0 + np.linalg.norm(boxes[:, 3:5], axis=1)
    ]
    if not len(near):
        return np.zeros(len(VOXELS))

    points = rotate(yaw_matrix(place[2]), VOXELS.numpy().astype(float))
    points[:, :2] += place[:2]
    return np.clip(1.0 - distances(near, points).min(0) / CELL, 0.0, 1.0)


def _places(root: np.ndarray) -> np.ndarray:
    """Places (…, 4) of x, y, yaw (…, 3)."""
    return np.concatenate([root[..., :2], -np.sin(root[..., 2:]), np.cos(root[..., 2:])], axis=-1)


def _actions(root: np.ndarray, low: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Shares of ``ACTIONS`` (B, N, 5) of roots (B, N, 3) whose pelvis is ``low`` and whose trunk
    ``level`` (B, N).
    """
    speed = _speed(root)
    kind = np.where(speed > _FAST, 2, np.where(speed > _SLOW, 1, 0))
    one = np.eye(len(ACTIONS))[np.where(low & level, 4, np.where(low, 3, kind))]
    half = _BLEND // 2
    padded = np.concatenate([one[:, :1]] * half + [one] + [one[:, -1:]] * half, axis=1)
    return np.lib.stride_tricks.sliding_window_view(padded, _BLEND, axis=1).mean(-1)


def _speed(root: np.ndarray) -> np.ndarray:
    """Metres a second (B, N) of roots (B, N, 3), over a third of a second."""
    frames = np.arange(root.shape[1])
    before, after = np.maximum(frames - 5, 0), np.minimum(frames + 5, len(frames) - 1)
    moved = root[:, after, :2] - root[:, before, :2]
    return np.linalg.norm(moved, axis=-1) * MODEL_FPS / (after - before)


def _goals(
    root: np.ndarray,
    height: np.ndarray,
    action: np.ndarray,
    still: np.ndarray,
    boxes: np.ndarray,
    phase: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[np.ndarray]]:
    """Goals (N, 5) of one motion, their actions (N, 5), which seat each is (N,; 0: none), and the
    seats' solids (512,).

    A goal is the next place where the pelvis is ``still`` (N,) on something, until one gets up from
    there; where none is near, a way point of the root (N, 3) itself, as SAMP's path planner gives
    them. ``height`` (N,): of the seat under a low pelvis.
    """
    frames = np.arange(len(root))
    point = np.minimum(
        _SEGMENT * ((frames + _SECOND + phase) // _SEGMENT + 1) - phase, len(root) - 1
    )
    place, rise, does = root[point].copy(), height[point].copy(), action[point].copy()
    which, solids = np.zeros(len(root), dtype=int), []
    for start, end in reversed(runs(still, 8)):
        until = slice(max(0, start - _HORIZON), end)
        place[until], rise[until] = np.median(root[start:end], axis=0), np.median(height[start:end])
        does[until] = np.eye(len(ACTIONS))[4 if action[start:end, 4].mean() > 0.5 else 3]
        solids.append(_solid(boxes, place[start]))
        which[until] = len(solids)

    return np.concatenate([_places(place), rise[:, None]], axis=1), does, which, solids


def _track(
    root: np.ndarray,
    joints: np.ndarray,
    first: int,
    low: np.ndarray,
    level: np.ndarray,
    height: np.ndarray,
    touches: np.ndarray,
    boxes: Sequence[np.ndarray],
    phases: np.ndarray,
) -> Track:
    """Tracks of roots (B, N, 3), world joints (B, K, 22, 3) from frame ``first`` on, and what is
    known of all frames (B, N).
    """
    action = _actions(root, low, level)

    goals, does, seats, solids = [], [], [], [np.zeros(len(VOXELS))]
    for b in range(len(root)):
        still = touches[b, :, _TOUCHES] > 0
        goal, act, which, found = _goals(
            root=root[b],
            height=height[b],
            action=action[b],
            still=still,
            boxes=boxes[b],
            phase=int(phases[b]),
        )
        seats.append(np.where(which > 0, which + len(solids) - 1, 0))
        goals.append(goal)
        does.append(act)
        solids += found

    # One long motion: where one begins and another ends, straight limbs may twist a little.
    frames = fit(joints.reshape(-1, 22, 3))[1].reshape(*joints.shape[:2], 22, 3, 3)
    axes = np.concatenate([frames[..., 1], frames[..., 2]], axis=-1)
    velocity = np.diff(joints, axis=1, prepend=joints[:, :1]) * MODEL_FPS
    if joints.shape[1] > 1:
        velocity[:, 0] = velocity[:, 1]

    arrays = {
        "root": _places(root),
        "joints": joints,
        "axes": axes,
        "velocity": velocity,
        "contacts": touches,
        "action": action,
        "goal": np.stack(goals),
        "goal_action": np.stack(does),
        "solid": np.stack(solids),
    }
    tensors = {name: torch.from_numpy(a).float() for name, a in arrays.items()}
    return Track(first=first, which=torch.from_numpy(np.stack(seats)), **tensors)


def _posture(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Height of the pelvis, and whether the trunk is level, of joints (…, 22, 3)."""
    trunk = joints[..., _NECK, :] - joints[..., _PELVIS, :]
    return joints[..., _PELVIS, 2], np.abs(trunk[..., 2]) < 0.5 * np.linalg.norm(trunk, axis=-1)


def window_tracks(windows: Mapping[str, np.ndarray], phases: np.ndarray) -> tuple[Track, Tensor]:
    """Tracks of B training windows (``data.windows.Window``), and the frames (50,) after which the
    next is known, too.

    The root is known from one frame before the first pose (by the velocities) to a second after the
    last (by the way ahead): 111 frames, the second of which is the first pose's. ``phases`` (B,):
    when the way points change.
    """
    root = _window_root(windows["root"], windows["velocity"], windows["ahead"])
    poses = windows["poses"].reshape(len(root), 80, 22, 3) * POSE_UNIT
    joints = rotate(yaw_matrix(root[:, 1:81, None, 2]), poses)
    joints[..., :2] += root[:, 1:81, None, :2]

    height, level = _posture(joints)
    touched = np.stack([contacts(j) for j in joints]).astype(float)
    low = (height < _SITS_UNDER) | (touched[..., _TOUCHES] > 0)
    seat = np.where(low, height - SEAT_TO_PELVIS, 0.0)

    # Nobody knows the pose after the last: it sits where a seat is under a root that stays, or goes
    # on sitting.
    top = np.stack(
        [_seat_under(b, p) for b, p in zip(windows["boxes"], root[:, 81:, :2], strict=True)]
    )
    stays = _speed(root)[:, 81:] < _STILL
    goes_on = low[:, -1:] & (np.linalg.norm(root[:, 81:, :2] - root[:, 80:81, :2], axis=-1) < 0.25)
    later = (stays & (top > 0)) | goes_on
    on = np.concatenate([touched[:, -1:]] * _SECOND, axis=1)
    on[..., _TOUCHES] = later

    def whole(known: np.ndarray, after: np.ndarray) -> np.ndarray:
        return np.concatenate([known[:, :1], known, after], axis=1)

    level_later = np.repeat(level[:, -1:] & low[:, -1:], _SECOND, axis=1)
    heights = np.where(later, np.where(goes_on, seat[:, -1:], top), 0.0)
    track = _track(
        root=root,
        joints=joints[:, 28:],
        first=29,
        low=whole(low, later),
        level=whole(level, level_later),
        height=whole(seat, heights),
        touches=whole(touched, on),
        boxes=list(windows["boxes"]),
        phases=phases,
    )
    return track, torch.arange(30, 80)


def _window_root(root: np.ndarray, velocity: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Roots (B, 111, 3), x, y, yaw, of windows: before, in and after their 70 frames (B, 70, 3)."""
    out = np.zeros((len(root), 111, 3))
    out[:, 11:81] = root
    for i in range(10, -1, -1):
        out[:, i, 2] = out[:, i + 1, 2] - velocity[:, i, 2]
        step = np.concatenate([velocity[:, i, :2], np.zeros((len(root), 1))], axis=1)
        out[:, i, :2] = out[:, i + 1, :2] - rotate(yaw_matrix(out[:, i, 2]), step)[:, :2]

    last = 3 * AHEAD.index(_SECOND)
    way = ahead[:, 40:, last : last + 3]
    step = np.concatenate([way[..., :2], np.zeros_like(way[..., :1])], axis=-1)
    out[:, 81:, :2] = root[:, 40:, :2] + rotate(yaw_matrix(root[:, 40:, 2]), step)[..., :2]
    out[:, 81:, 2] = root[:, 40:, 2] + way[..., 2]
    return out


def _seat_under(boxes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Height of what one may sit on over each floor point (N, 2), 0 where there is nothing, of
    ``boxes`` (M, 7).
    """
    top = boxes[:, 2] + boxes[:, 5]
    seats = boxes[(top > _SEAT[0]) & (top < _SEAT[1])]
    offset = points[:, None] - seats[:, :2]
    c, s = np.cos(seats[:, 6]), np.sin(seats[:, 6])
    x, y = c * offset[..., 0] + s * offset[..., 1], c * offset[..., 1] - s * offset[..., 0]
    over = (np.abs(x) < seats[:, 3]) & (np.abs(y) < seats[:, 4])
    return np.where(over, seats[:, 2] + seats[:, 5], 0.0).max(1, initial=0.0)


def clip_track(clip: HeldClip, path: RootPath) -> tuple[Track, Tensor]:
    """The track (B = 1) of a held-out clip along its root ``path`` (T), and the frames (T,) of its
    poses.

    Before its first frame and after its last, the path goes on as it moves there.
    """
    root = np.concatenate([path.position[:, :2], path.yaw[:, None]], axis=1)
    steps = np.arange(1, _SECOND + 2)[:, None]
    one = min(1, len(root) - 1)
    before, after = (
        root[:1] - (root[one] - root[0]) * steps[::-1],
        root[-1:] + (root[-1] - root[-1 - one]) * steps[:-1],
    )
    root = np.concatenate([before, root, after])[None]

    height, level = _posture(clip.joints)
    touched = contacts(clip.joints).astype(float)
    for rest in clip.rests:
        touched[rest.start : rest.end, _TOUCHES] = 1.0

    low = (height < _SITS_UNDER) | (touched[:, _TOUCHES] > 0)
    seat = np.where(low, height - SEAT_TO_PELVIS, 0.0)

    def whole(known: np.ndarray) -> np.ndarray:
        return np.concatenate([known[:1]] * len(steps) + [known] + [known[-1:]] * _SECOND)[None]

    track = _track(
        root=root,
        joints=clip.joints[None],
        first=len(steps),
        low=whole(low),
        level=whole(level),
        height=whole(seat),
        touches=whole(touched),
        boxes=[clip.boxes],
        phases=np.zeros(1),
    )
    return track, torch.arange(len(steps), len(steps) + len(path))
