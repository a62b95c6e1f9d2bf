"""A body that is led as time runs: each frame is made of what leads it now and of what was before.

The network is as in ``generate``, but for the way ahead, which nobody knows: it is hidden from it,
as in half the windows that it was trained on. The root is followed as a person would follow it
(``following``), feet and seats are seen to as far as that goes without a look ahead
(``live_cleanup``). A step takes as long as it takes; time is the caller's.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .beginning import PREROLL, beginning_at
from .cleanup import CleanUp
from .distance import prepared, scaled
from .errors import InputError
from .following import PointFollower, RootFollower, Seat
from .kinematics import fit, forward_kinematics, local_from_global
from .live_cleanup import LiveCleanUp
from .nearby import REACH_OF_A_BODY, bounds
from .occupancy import occupancy, tops_under
from .resampling import frame_times, resample_positions
from .root import AHEAD, RootPath, to_root, to_world, velocities
from .rotations import quaternion_from_matrix
from .sampler import Conditions, Sampler
from .sensor import HEIGHT, SPHERES
from .series import MODEL_FPS, minimum_jerk
from .skeleton import (
    END_EFFECTORS,
    FEET_ASKED,
    HIPS,
    MODEL_ORDER,
    PELVIS,
    REST,
    SHOULDERS,
    TARGETS,
    UPPER,
)
from .softness import Support, support_under
from .solids import Scene
from .take import Controls

__all__ = ["Lead", "LiveBody", "LiveFrame", "Surroundings", "controls_of"]

_SLOTS = {name: MODEL_ORDER.index(j) for name, j in TARGETS.items()}
_FROM = {
    "head": PELVIS,
    "hand_left": SHOULDERS[0],
    "hand_right": SHOULDERS[1],
    "foot_left": HIPS[0],
    "foot_right": HIPS[1],
}
"""The joint that each target is within reach of, or not."""
_REACHES = {"head": 0.85, "hand_left": 0.80, "hand_right": 0.80} | dict.fromkeys(FEET_ASKED, 0.92)
"""Metres from there, within which a target is taken hold of."""
_HOLDS = 1.15
"""How much farther it may be before it is let go."""
_EASE = 18
"""Frames in which a body comes over from what it has let go."""
_EASES = [j for j in UPPER if j != PELVIS]
"""The joints that do."""
_TARGET_LAG = 0.1
"""Seconds by which head, hands and feet are behind what they are led by."""
_TARGET_SPEED = 3.0
"""Metres a second, of their targets as they are followed."""
_MEMORY = PREROLL
"""Frames that are remembered, so that a take can begin with what was before it."""
_SITS = 0.80
"""Metres over the floor of a pelvis that may be carried by something."""
_HAIR = 1e-6  # of a frame
_LIVELY = 0.5
"""Temperature of a body for which it is 0: at rest it would not move at all."""


@dataclass(frozen=True)
class Lead:
    """What leads a body at one frame; world, metres. ``position`` (3,) and ``yaw`` of the root;
    ``targets`` (3,) by the names of ``TARGETS``, of those that count.
    """

    position: np.ndarray
    yaw: float
    targets: Mapping[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class LiveFrame:
    """One frame of a body, world, metres: its root's ``position`` (3,) and ``yaw`` as it followed,
    its ``joints`` (22, 3) on constant bones, and the ``rotations`` (22, 4) of these, as in
    ``Take``. ``pose`` (66,): the network's own before the clean-up, canonical metres, in the frame
    of the root; with its ``action`` (K,) and ``log_likelihood``. ``targets`` (3,): those that
    count, as they are followed, by name; ``shares``: how far, 1, or less of what was let go.
    """

    position: np.ndarray
    yaw: float
    joints: np.ndarray
    rotations: np.ndarray
    pose: np.ndarray
    action: np.ndarray
    log_likelihood: float
    targets: dict[str, np.ndarray]
    shares: dict[str, float]


def controls_of(played: Sequence[LiveFrame], fps: float, scale: float) -> Controls:
    """What led a body of this ``scale`` in frames that were played, ``fps`` of them a second: FREE,
    or EE where any target counted. Raises InputError for fewer than two frames.
    """
    if len(played) < 2:
        raise InputError("Nothing was played in the recording; record for longer.")

    count = int((len(played) - 1) * fps / MODEL_FPS + _HAIR) + 1
    source, target = frame_times(len(played), MODEL_FPS), frame_times(count, fps)
    path = RootPath(
        resample_positions(np.array([each.position for each in played]), source, target),
        resample_positions(np.array([each.yaw for each in played]), source, target),
    )
    given: dict[str, Any] = {}
    for name in TARGETS:
        shares = np.array([each.shares.get(name, 0.0) for each in played])
        if shares.any():
            free = np.full(3, np.nan)
            places = np.array([each.targets.get(name, free) for each in played])
            given[name] = resample_positions(places, source, target)
            given[f"{name}_influence"] = resample_positions(shares[:, None], source, target)[:, 0]
    return Controls(
        fps=fps, root=path.matrices(), mode="EE" if given else "FREE", scale=scale, **given
    )


class Surroundings:
    """Furniture that stands still until other furniture takes its place: ``scene``, in canonical
    metres, measured once.
    """

    def __init__(self, scene: Scene, floor: float, scale: float = 1.0) -> None:
        """``scene``: world, metres; ``floor``: height of the root's plane there; ``scale``: the
        character's size.
        """
        self.scene, self.warnings = prepared(scaled(scene, 1.0 / scale), floor / scale, scale)
        kept = [s for s in self.scene.solids if len(getattr(s, "triangles", (0,)))]
        self.scene = Scene(tuple(kept))
        corners = [bounds(solid) for solid in kept]
        self._low = np.array([low.reshape(-1, 3)[0] for low, _ in corners]).reshape(-1, 3)
        self._high = np.array([high.reshape(-1, 3)[0] for _, high in corners]).reshape(-1, 3)

    def near(self, place: np.ndarray, reach: float = REACH_OF_A_BODY) -> Scene:
        """What is within ``reach`` of an upright body at ``place`` (3,), canonical metres."""
        beyond = np.maximum(self._low - place - (0.0, 0.0, HEIGHT), place - self._high)
        gap = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        return Scene(tuple(self.scene.solids[k] for k in np.flatnonzero(gap < reach)))

    def carries(self, place: np.ndarray) -> bool:
        """Whether something could carry a body that sits at ``place`` (3,), canonical metres."""
        there = RootPath(place[None], np.zeros(1))
        return bool(np.isfinite(tops_under(self.near(place, 0.3), there)[0]))


class LiveBody:
    """A body of ``scale`` times the canonical size, which stands at ``start``, or sits where that
    is on one of the ``seats``.

    ``sampler`` is its own from now on. ``seed``: of its noise; ``held``: see ``Draw``. Raises
    InputError for weights that have to be told of the way ahead.
    """

    def __init__(
        self,
        sampler: Sampler,
        surroundings: Surroundings,
        start: Lead,
        *,
        scale: float = 1.0,
        clean_up: CleanUp | None = None,
        seed: int = 0,
        held: bool = False,
        seats: Sequence[Seat] = (),
    ) -> None:
        sizes = sampler.network.sizes
        if sizes.ahead and not sizes.ahead_mask:
            raise InputError(
                f"The weights '{sampler.weights.path}' have to know where the root goes during "
                "the next second; choose weights for a live root."
            )

        self.surroundings = surroundings
        self.seats = tuple(seats)
        self.scale = scale
        self.memory: deque[LiveFrame] = deque(maxlen=_MEMORY)
        self._sampler = sampler
        self._noise = sampler.network.noise.stream(seed, held=held)
        self._clean_up = LiveCleanUp(CleanUp(feet=1.0, seat=1.0) if clean_up is None else clean_up)
        self._root = RootFollower(start.position / scale, start.yaw)
        self._root.seat = self._root.meant(self._root.position[:2], self._scaled_seats())
        self._led: dict[str, PointFollower] = {}
        self._asked: dict[str, np.ndarray] = {}
        self._lets_go, self._since = False, _EASE
        self._offset = np.zeros((len(_EASES), 3))
        self._shares = dict.fromkeys(TARGETS, 0.0)

        history = sizes.history + 2
        self._path: deque[tuple[np.ndarray, float]] = deque(maxlen=history)
        self._occupancy: deque[np.ndarray] = deque(maxlen=history)
        self._observation: deque[np.ndarray] = deque(maxlen=history)
        self._given: deque[np.ndarray] = deque(maxlen=history)
        self._last = REST
        self._signs: np.ndarray | None = None

        sampler.forget()
        here = self._here()
        begun = beginning_at(surroundings.near(here.position[0]), here, self._seen(here))
        for k in range(PREROLL):
            place = RootPath(begun.path.position[k, None], begun.path.yaw[k, None])
            self._make(Lead(start.position, start.yaw), 0.0, begun.occupancy[k], place)

    @property
    def frame(self) -> LiveFrame:
        """The last one."""
        return self.memory[-1]

    @property
    def speed(self) -> float:
        """Metres a second, of the root as it follows."""
        return self._root.speed * self.scale

    def step(self, lead: Lead, temperature: float) -> LiveFrame:
        """The next frame, led by ``lead``; at ``temperature`` 0 with a little life as well."""
        self._root.step(lead.position / self.scale, lead.yaw, self._scaled_seats())
        here = self._here()
        return self._make(lead, temperature or _LIVELY, self._seen(here), here)

    def _scaled_seats(self) -> list[Seat]:
        return [Seat(s.position / self.scale, s.yaw, s.aside / self.scale) for s in self.seats]

    def _here(self) -> RootPath:
        """Where the root is now, one frame."""
        return RootPath(self._root.position[None].copy(), np.array([self._root.yaw]))

    def _seen(self, here: RootPath) -> np.ndarray:
        """What the sensor sees from there (2640,)."""
        near = self.surroundings.near(here.position[0])
        if not near.solids:
            return np.zeros(len(SPHERES), np.float32)
        return occupancy(near, here)[0]

    def _make(self, lead: Lead, temperature: float, seen: np.ndarray, here: RootPath) -> LiveFrame:
        self._path.append((here.position[0], float(here.yaw[0])))
        self._occupancy.append(seen)
        self._ask(lead, here)

        frames = len(self._path)
        path = RootPath(
            np.array([place for place, _ in self._path]), np.array([yaw for _, yaw in self._path])
        )
        conditions = Conditions(
            velocity=velocities(path),
            ahead=np.full((frames, 3 * len(AHEAD)), np.nan),
            occupancy=np.array(self._occupancy),
            observation=np.array(self._observation),
            given=np.array(self._given),
        )
        made = self._sampler.step(conditions, temperature * next(self._noise)[None])
        pose = self._eased(made.poses[0, 0].reshape(22, 3))
        self._last = pose.copy()
        return self._shown(
            pose.reshape(66), made.actions[0, 0], float(made.log_likelihood[0, 0]), here
        )

    def _eased(self, pose: np.ndarray) -> np.ndarray:
        """The network's pose (22, 3), which the trunk and arms come over to after something was let
        go: free, they would be elsewhere at once.
        """
        if self._lets_go:
            self._offset, self._since = (self._last - pose)[_EASES], 0
        if self._since < _EASE:
            self._since += 1
            pose = pose.copy()
            left = 1.0 - float(minimum_jerk(np.array(self._since / _EASE)))
            pose[_EASES] += left * self._offset
        return pose

    def _ask(self, lead: Lead, here: RootPath) -> None:
        """What is asked of head, hands and feet: targets within reach, led there from where the
        body has them. Of what is let go, the share only tells how it eases out.
        """
        observation, given = np.zeros((22, 3)), np.zeros(22)
        self._lets_go = False
        for name in TARGETS:
            holds = self._shares[name] >= 1.0
            place = self._wanted(name, lead, here, holds)
            if place is None:
                self._lets_go |= holds
                self._shares[name] = max(0.0, self._shares[name] - 1.0 / _EASE)
                continue
            if not holds:
                free = to_world(here, self._last[None, [TARGETS[name]]])[0, 0]
                self._led[name] = PointFollower(free, _TARGET_LAG, _TARGET_SPEED)
            followed = self._led[name].step(place)
            self._asked[name] = to_root(here, followed[None, None])[0, 0]
            self._shares[name] = 1.0
            observation[_SLOTS[name]], given[_SLOTS[name]] = self._asked[name], 1.0

        self._observation.append(observation.reshape(-1))
        self._given.append(given)

    def _wanted(self, name: str, lead: Lead, here: RootPath, holds: bool) -> np.ndarray | None:
        """Where a target is (3,), canonical metres, where it counts: within reach, and, for feet,
        for weights that have learnt of them.
        """
        heard = name in END_EFFECTORS or self._sampler.weights.heeds_legs
        if name not in lead.targets or not heard:
            return None
        place = np.asarray(lead.targets[name], float) / self.scale
        if not np.isfinite(place).all():
            return None
        base = to_world(here, self._last[None, [_FROM[name]]])[0, 0]
        reach = _REACHES[name] * (_HOLDS if holds else 1.0)
        return place if np.linalg.norm(place - base) < reach else None

    def _shown(
        self, pose: np.ndarray, action: np.ndarray, likelihood: float, here: RootPath
    ) -> LiveFrame:
        joints = to_world(here, pose.reshape(1, 22, 3))[0]
        floor = float(here.position[0, 2])
        joints = self._clean_up.step(joints, floor, self._support(joints, here))
        pelvis, frames = fit(joints[None])
        shown = forward_kinematics(frames, pelvis)[0]
        rotations = quaternion_from_matrix(local_from_global(frames))[0]
        if self._signs is not None:
            turned_over = (rotations * self._signs).sum(axis=-1) < 0.0
            rotations = np.where(turned_over[:, None], -rotations, rotations)
        self._signs = rotations

        counting = {name: share for name, share in self._shares.items() if share > 0.0}
        frame = LiveFrame(
            position=here.position[0] * self.scale,
            yaw=float(here.yaw[0]),
            joints=shown * self.scale,
            rotations=rotations,
            pose=pose,
            action=action,
            log_likelihood=likelihood,
            targets={
                name: to_world(here, self._asked[name][None, None])[0, 0] * self.scale
                for name in counting
            },
            shares=counting,
        )
        self.memory.append(frame)
        return frame

    def _support(self, joints: np.ndarray, here: RootPath) -> Support | None:
        """What carries the body, where it may be carried."""
        if joints[PELVIS][2] - here.position[0, 2] > _SITS:
            return None
        near = self.surroundings.near(here.position[0], 0.3)
        return support_under(near, here) if near.solids else None
