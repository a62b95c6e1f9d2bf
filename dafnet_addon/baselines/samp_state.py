"""The state of SAMP's MotionNet, 647 values: what it holds, how it is seen from another root, how
it is fed back.

Hassan et al. 2021, *Stochastic Scene-Aware Motion Prediction*. A state holds the pose (22 ×
[position, forward, up, velocity]), its joints seen from where the root will be in a second (22 ×
3), the trajectory (13 samples from a second ago to a second ahead × [place, direction, action]),
contacts (5), the trajectory seen from the goal (13 × 4), and the goal at each of these times (13 ×
[place, direction, action]). What the network is given of a frame is seen from that frame's root;
what it makes of the next frame is seen from the same root, its joints from the same future root,
its trajectory from the same goal.

A place on the floor is (…, 4): x, y, and the unit vector that looks forward. Metres, seconds, 30
frames a second, z up.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from ..core.series import MODEL_FPS
from ..core.skeleton import OFFSETS as BONES
from ..core.skeleton import PARENTS

__all__ = [
    "ACTIONS",
    "CELL",
    "LAST",
    "NOW",
    "OFFSETS",
    "SENSOR",
    "STATE",
    "VOXELS",
    "Parts",
    "clean_place",
    "next_input",
    "goal_place",
    "network_input",
    "led_to_goal",
    "placed_back",
    "points_back",
    "points_seen",
    "pose_seen",
    "read_pose",
    "seen_from",
    "sensor_of",
    "split_state",
    "state_of",
]

ACTIONS = ("idle", "walk", "run", "sit", "lie")
OFFSETS = torch.arange(-30, 31, 5)
"""Frames at which the trajectory is sampled; the present is the seventh."""
NOW = 6
LAST = 12
_SAMPLES = len(OFFSETS)
_SIZES = (22 * 12, 22 * 3, _SAMPLES * 9, 5, _SAMPLES * 4, _SAMPLES * 11)
STATE = sum(_SIZES)
SENSOR = 8**3 * 4
CELL = 0.175
"""Metres; the voxels are a cube of 1.4 m on the floor."""
_LATTICE = torch.cartesian_prod(*[torch.arange(8.0)] * 3) + 0.5
VOXELS = (_LATTICE - torch.tensor([4.0, 4.0, 0.0])) * CELL
"""(512, 3) centres, in the goal's frame."""


@dataclass(frozen=True)
class Parts:
    """A state without what follows from it: ``pose`` (…, 22, 12), ``trajectory`` (…, 13, 9),
    ``contacts`` (…, 5), ``goal`` (…, 13, 11), all seen from one root.
    """

    pose: Tensor
    trajectory: Tensor
    contacts: Tensor
    goal: Tensor


def _turned(v: Tensor, forward: Tensor) -> Tensor:
    """Horizontal vectors (…, 2 or 3) seen from a place that faces ``forward`` (…, 2); the
    height stays.
    """
    x, y, fx, fy = v[..., 0], v[..., 1], forward[..., 0], forward[..., 1]
    flat = torch.stack([x * fy - y * fx, x * fx + y * fy], dim=-1)
    return torch.cat([flat, v[..., 2:].expand(*flat.shape[:-1], -1)], dim=-1)


def _turned_back(v: Tensor, forward: Tensor) -> Tensor:
    """Inverse of ``_turned``."""
    return _turned(v, forward * forward.new_tensor([-1.0, 1.0]))


def points_seen(points: Tensor, frame: Tensor) -> Tensor:
    """Points (…, 2 or 3) seen from places (…, 4)."""
    return _turned(points - F.pad(frame[..., :2], (0, points.shape[-1] - 2)), frame[..., 2:])


def points_back(points: Tensor, frame: Tensor) -> Tensor:
    """Inverse of ``points_seen``."""
    return _turned_back(points, frame[..., 2:]) + F.pad(frame[..., :2], (0, points.shape[-1] - 2))


def seen_from(place: Tensor, frame: Tensor) -> Tensor:
    """Places (…, 4) seen from places (…, 4)."""
    return torch.cat(
        [points_seen(place[..., :2], frame), _turned(place[..., 2:], frame[..., 2:])], dim=-1
    )


def placed_back(place: Tensor, frame: Tensor) -> Tensor:
    """Inverse of ``seen_from``."""
    return torch.cat(
        [points_back(place[..., :2], frame), _turned_back(place[..., 2:], frame[..., 2:])], dim=-1
    )


def pose_seen(pose: Tensor, frame: Tensor) -> Tensor:
    """Poses (…, 22, 12) seen from places (…, 4)."""
    frame = frame[..., None, :]
    vectors = [_turned(v, frame[..., 2:]) for v in pose[..., 3:].split(3, dim=-1)]
    return torch.cat([points_seen(pose[..., :3], frame), *vectors], dim=-1)


def goal_place(goal: Tensor) -> Tensor:
    """The places (…, 4) of goals (…, 11)."""
    return torch.cat([goal[..., :2], goal[..., 3:5]], dim=-1)


def state_of(parts: Parts, last: Tensor, aim: Tensor) -> Tensor:
    """States (…, 647), with joints seen from the place ``last`` (…, 4), the trajectory from the
    goal's place ``aim`` (…, 4).
    """
    from_last = points_seen(parts.pose[..., :3], last[..., None, :])
    from_goal = seen_from(parts.trajectory[..., :4], aim[..., None, :])
    return torch.cat(
        [
            parts.pose.flatten(-2),
            from_last.flatten(-2),
            parts.trajectory.flatten(-2),
            parts.contacts,
            from_goal.flatten(-2),
            parts.goal.flatten(-2),
        ],
        dim=-1,
    )


def network_input(parts: Parts) -> Tensor:
    """States (…, 647) as the network is given them: seen from their own future and goal."""
    return state_of(parts, parts.trajectory[..., LAST, :4], goal_place(parts.goal[..., NOW, :]))


def split_state(state: Tensor) -> tuple[Parts, Tensor]:
    """The parts of states (…, 647), and their trajectory seen from the goal (…, 13, 4)."""
    pose, _, trajectory, touches, from_goal, goal = state.split(list(_SIZES), dim=-1)
    parts = Parts(
        *(
            pose.unflatten(-1, (22, 12)),
            trajectory.unflatten(-1, (_SAMPLES, 9)),
            touches,
            goal.unflatten(-1, (_SAMPLES, 11)),
        )
    )
    return parts, from_goal.unflatten(-1, (_SAMPLES, 4))


def sensor_of(solid: Tensor, goal: Tensor) -> Tensor:
    """The voxels (…, 2048) at goals (…, 11) seen from the root: centre and occupancy of each; zero
    where there is no seat.

    ``solid`` (…, 512) in the goal's frame.
    """
    centres = points_back(VOXELS.to(goal), goal_place(goal)[..., None, :])
    there = (solid.sum(-1) > 0)[..., None, None]
    return (torch.cat([centres, solid[..., None]], dim=-1) * there).flatten(-2)


def clean_place(place: Tensor) -> Tensor:
    """Places (…, 4) whose direction is a unit vector."""
    return torch.cat([place[..., :2], F.normalize(place[..., 2:], dim=-1)], dim=-1)


def next_input(made: Parts, goal: Tensor, root: Tensor | None = None) -> Parts:
    """The next state as it is fed back: seen from the next ``root`` (B, 4), or from where the made
    trajectory has it, and with the true ``goal`` (B, 13, 11) seen from there.
    """
    places = clean_place(made.trajectory[..., :4])
    root = places[..., NOW, :] if root is None else root
    axes = F.normalize(made.pose[..., 3:9].unflatten(-1, (2, 3)), dim=-1).flatten(-2)
    pose = torch.cat([made.pose[..., :3], axes, made.pose[..., 9:]], dim=-1)
    trajectory = torch.cat(
        [seen_from(places, root[..., None, :]), made.trajectory[..., 4:].clamp(0.0, 1.0)], dim=-1
    )
    return Parts(pose_seen(pose, root), trajectory, made.contacts.clamp(0.0, 1.0), goal)


def _on_bones(joints: Tensor) -> Tensor:
    """Joints (…, 22, 3) with each bone as long as the body's, in its own direction."""
    out = list(joints.unbind(-2))
    for j in range(1, len(PARENTS)):
        bone = F.normalize(joints[..., j, :] - joints[..., PARENTS[j], :], dim=-1)
        out[j] = out[PARENTS[j]] + float(np.linalg.norm(BONES[j])) * bone
    return torch.stack(out, dim=-2)


def read_pose(made: Parts, last: Tensor) -> Parts:
    """The pose as the authors' program reads it: half its positions, half the ``last`` ones moved
    on by its velocities.
    """
    positions = 0.5 * (made.pose[..., :3] + last[..., :3] + made.pose[..., 9:] / MODEL_FPS)
    return replace(made, pose=torch.cat([_on_bones(positions), made.pose[..., 3:]], dim=-1))


def led_to_goal(made: Parts, from_goal: Tensor, goal: Tensor) -> Parts:
    """The future trajectory led to the ``goal`` (B, 13, 11): near it, and late, the one that was
    made as the goal sees it.

    The weight is the authors' program's: ((k - 6) / 7) ^ (100 d²), d metres from the goal.
    """
    places = made.trajectory[..., :4]
    other = placed_back(clean_place(from_goal), goal_place(goal[..., NOW, :])[..., None, :])
    distance = (places[..., :2] - goal[..., :2]).norm(dim=-1)
    late = ((torch.arange(len(OFFSETS)) - NOW).clamp_min(0) / 7.0).to(places)
    weight = torch.where(late > 0, late.clamp_min(1e-6) ** (100.0 * distance.square()), 0.0)[
        ..., None
    ]
    return replace(
        made,
        trajectory=torch.cat(
            [places + weight * (other - places), made.trajectory[..., 4:]], dim=-1
        ),
    )
