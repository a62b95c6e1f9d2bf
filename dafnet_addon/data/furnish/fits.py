"""How often furniture can be fitted to the motion, and why it cannot."""

from collections import Counter

import numpy as np

from ...core.root import root_from_joints
from ..dataset.motions import Draws
from ..motion.motion import Motion
from ..motion.retarget import at_seat_height
from .flesh import NO_BANK, probes
from .furniture import fitted
from .shapes import ShapeBank

__all__ = ["fit_report"]

_PIECES = ("seat", "bed", "desk", "board", "shelf", "spare desk")
_BEFORE, _AFTER = 80, 60  # frames about a moment: what a training window and its margins hold
_PELVIS = 0.42, 0.82  # resting heights that every other seat is moved to


def fit_report(
    motions: list[Motion],
    draws: Draws,
    rng: np.random.Generator,
    count: int = 200,
    bank: ShapeBank = NO_BANK,
) -> str:
    """A table of ``count`` moments of every kind in ``draws``: pieces fitted of pieces tried, and
    moments not used, with why.

    A moment cannot be used where a seat or bed fits nowhere ("no seat", "no bed"), or where the
    motion is cut off half-way down to one ("cut"). A desk, board or shelf that does not fit is left
    out. Every other seat is moved to a random height first.
    """
    head = f"{'moments of':14}{'used':>7}{'no seat':>9}{'no bed':>8}{'cut':>6}"
    lines = [head + "".join(piece.rjust(12) for piece in _PIECES)]
    for kind, (rows, weights) in draws.items():
        tally: Counter[str] = Counter()
        for i, frame in rows[rng.choice(len(rows), count, p=weights)]:
            low, high = max(0, frame - _BEFORE), frame + _AFTER
            joints = motions[i].joints[low:high]
            heights = [r.position[2] for r in motions[i].rests if r.start < high and r.end > low]
            if heights and rng.random() < 0.5:
                joints = at_seat_height(joints, float(heights[0]), rng.uniform(*_PELVIS))

            pieces, missing = fitted(rng, joints, root_from_joints(joints), probes(joints), bank)
            tally["no " + missing if missing in _PIECES else missing] += 1
            for piece, found in pieces:
                tally[piece + " tried"] += 1
                tally[piece + " fitted"] += found is not None

        cells = "".join(f"{tally[p + ' fitted']}/{tally[p + ' tried']}".rjust(12) for p in _PIECES)
        lines.append(
            f"{kind:14}{tally['']:>7}{tally['no seat']:>9}{tally['no bed']:>8}{tally['cut']:>6}"
            + cells
        )

    return "\n".join(lines)
