"""Bodies of other proportions than the canonical one: their joints in the T-pose, and how long
their parts are.
"""

from dataclasses import dataclass

import numpy as np

from .skeleton import (
    ANKLES,
    ELBOWS,
    HEAD,
    HIPS,
    JOINTS,
    KNEES,
    PARENTS,
    REST,
    SHOULDERS,
    WRISTS,
)

__all__ = ["SAME_SIZE", "Body", "canonical_body", "size_ratio"]

SAME_SIZE = 0.03
"""Bodies whose legs differ by less, as a share, count as of one size, so that hands stay on what
they touch.
"""


@dataclass(frozen=True)
class Body:
    """A body laid into the canonical T-pose, whatever pose its rig rests in
    (``t_pose.lay_in_t_pose``).

    ``rest`` (22, 3): its joints in that pose, canonical frame, any unit of length. ``present``
    (22,): which of them a bone turns; the others are rigid on their parents. ``alignment`` (22, 3,
    3): the rotations that laid it so, out of the rig's own rest pose; from the frames of a pose
    they lead to its turns (see ``retargeting``).
    """

    rest: np.ndarray
    present: np.ndarray
    alignment: np.ndarray

    def length(self, child: int) -> float:
        """Of the bone from a joint's parent to the joint."""
        return float(np.linalg.norm(self.rest[child] - self.rest[PARENTS[child]]))

    def leg(self) -> float:
        """Length of the legs, mean of both, hip to ankle."""
        return 0.5 * sum(self.length(j) for j in KNEES + ANKLES)

    def arm(self) -> float:
        """Length of the arms, mean of both, shoulder to wrist."""
        return 0.5 * sum(self.length(j) for j in ELBOWS + WRISTS)

    def chest(self) -> float:
        """From the middle of the hip joints to the middle of the shoulders."""
        return float(
            np.linalg.norm(self.rest[SHOULDERS].mean(axis=0) - self.rest[HIPS].mean(axis=0))
        )

    def trunk(self) -> float:
        """From the middle of the hip joints to the head joint."""
        left, right = self.rest[HIPS]
        return float(np.linalg.norm(self.rest[HEAD] - 0.5 * (left + right)))


def canonical_body(scale: float) -> Body:
    """The DAFNet character's own body; ``scale``: its size over the canonical one, times the unit
    of length wanted.
    """
    return Body(scale * REST, np.ones(len(JOINTS), bool), np.tile(np.eye(3), (len(JOINTS), 1, 1)))


def size_ratio(source: Body, body: Body) -> float:
    """The body's size over the source's, by their legs; 1 where they differ by less than
    ``SAME_SIZE``.
    """
    ratio = body.leg() / source.leg()
    return 1.0 if abs(ratio - 1.0) < SAME_SIZE else ratio
