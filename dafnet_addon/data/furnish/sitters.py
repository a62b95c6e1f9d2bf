"""How one who rests lies against a seat: the trunk on its back, a forearm on its arm."""

from dataclasses import dataclass

import numpy as np

from ...core.root import forward_of
from ..motion.rests import Rest
from .flesh import FOREARMS, RADIUS, STEP, TRUNK

__all__ = ["MET", "Forearm", "Trunk", "forearm_of", "leans_back", "trunk_of"]

MET = 0.75
"""Of the backs and arms, that are met by who leans on them."""

_LEVEL = 0.07  # metres that an arm's elbow and wrist differ in height, of one that lies
_ASIDE = (0.19, 0.40)  # metres from the middle of the body to an arm that lies
_ARM_STILL = 0.06  # metres that its wrist moves
_LEANS = (-0.05, 0.75)  # tangents of trunks that a back may meet
_MOSTLY = 0.75  # of the time, that a trunk is so far back or less
_NEEDS_A_BACK = 0.3  # tangent of a lean that nobody holds for long without one


def _at_rest(rest: Rest, points: np.ndarray) -> np.ndarray:
    """The probes (N, P, 3) of the frames in which a body rests."""
    return points[rest.start // STEP : max(rest.end // STEP, rest.start // STEP + 1)]


@dataclass(frozen=True)
class Trunk:
    """How the back of one who sits lies over the seat: at the height ``low`` metres over it the
    flesh reaches ``behind`` metres behind the pelvis, and ``lean`` (the tangent) more for each
    metre above.
    """

    low: float
    behind: float
    lean: float


def trunk_of(rest: Rest, points: np.ndarray) -> Trunk | None:
    """The back of who rests, from the body's probes (N, P, 3); None where nothing could carry it:
    who bends forward needs no back, and who lies no seat's.
    """
    own = _at_rest(rest, points)[:, TRUNK]
    if not len(own):
        return None

    away = (own[..., :2] - rest.position[:2]) @ -forward_of(rest.yaw)
    back = np.quantile(away, _MOSTLY, axis=0) + RADIUS[TRUNK]
    height = np.median(own[..., 2], axis=0) - rest.position[2]
    lean = float((back[1] - back[0]) / max(height[1] - height[0], 0.1))
    if not _LEANS[0] < lean < _LEANS[1]:
        return None
    return Trunk(float(height[0]), float(back[0]), lean)


@dataclass(frozen=True)
class Forearm:
    """A forearm that lies level beside the body: ``over``: metres from the pelvis to its underside;
    ``aside``: metres to the side.
    """

    over: float
    aside: float


def forearm_of(rest: Rest, points: np.ndarray) -> Forearm | None:
    """The forearm of who rests that an arm of the seat could carry, or None."""
    resting = _at_rest(rest, points)
    if not len(resting):
        return None

    right = np.array([np.cos(rest.yaw), np.sin(rest.yaw)])
    for rows in FOREARMS:
        own = np.median(resting[:, rows], axis=0)
        aside = np.abs((own[:, :2] - rest.position[:2]) @ right)
        level = float(np.ptp(own[:, 2])) < _LEVEL and _ASIDE[0] < aside.min() < _ASIDE[1]
        still = np.ptp(resting[:, rows[-1]], axis=0).max() < _ARM_STILL
        if level and still:
            under = float((own[:, 2] - RADIUS[rows]).min())
            return Forearm(under - float(rest.position[2]), float(aside.min()))
    return None


def leans_back(rest: Rest, points: np.ndarray) -> bool:
    """Whether who rests leans so far back that there has to be something to lean on."""
    trunk = trunk_of(rest, points)
    return trunk is not None and trunk.lean > _NEEDS_A_BACK
