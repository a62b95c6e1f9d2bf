"""A contact sheet of a dataset: for every kind of moment some that windows are drawn around,
furnished, with contacts.
"""

from pathlib import Path

import numpy as np

from ...core.root import root_from_joints
from ..furnish.flesh import NO_BANK
from ..furnish.furniture import furnished
from ..furnish.shapes import ShapeBank
from ..motion.contacts import contacts
from ..motion.motion import Motion
from .motions import Draws
from .sheet import sheet

__all__ = ["preview"]

_BEFORE, _AFTER = 100, 120  # frames about a moment
_TRIES = 10


def preview(
    file: Path,
    motions: list[Motion],
    draws: Draws,
    rng: np.random.Generator,
    each: int = 1,
    bank: ShapeBank = NO_BANK,
) -> None:
    """Draw ``each`` moments of every kind into ``file`` (.png), with furniture as training fits
    it.
    """
    rows, touching = [], []
    for kind, (moments, weights) in draws.items():
        shown = 0
        for i, frame in moments[rng.choice(len(moments), _TRIES * each, p=weights)]:
            joints = motions[i].joints[max(0, frame - _BEFORE) : frame + _AFTER]
            room, _ = furnished(rng, joints, root_from_joints(joints), bank)
            if room is None or shown == each:
                continue
            shown += 1
            rows.append((f"{kind}: {motions[i].source}, {motions[i].name}", joints, room))
            touching.append(contacts(joints))

    sheet(file, rows, contacts=touching)
