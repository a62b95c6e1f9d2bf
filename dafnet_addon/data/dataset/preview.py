"""Contact sheets of a dataset: for every kind of moment, every posture and every source some that
windows are drawn around, furnished, with contacts.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...core.root import root_from_joints
from ..furnish.flesh import NO_BANK
from ..furnish.furniture import furnished
from ..furnish.shapes import ShapeBank
from ..motion.contacts import contacts
from ..motion.motion import COMPOSED, Motion
from ..synthesis.postures import POSTURES
from .motions import Draws
from .sheet import sheet

__all__ = ["by_posture", "by_source", "preview"]

_BEFORE, _AFTER = 100, 120  # frames about a moment
_TRIES = 10


def _chosen(draws: Draws, label: Callable[[str, int], str]) -> Draws:
    """The moments apart by what ``label`` says of their kind and motion; those of no label are left
    out.
    """
    found: dict[str, list[tuple[np.ndarray, float]]] = {}
    for kind, (rows, weights) in draws.items():
        for row, weight in zip(rows, weights, strict=True):
            if word := label(kind, int(row[0])):
                found.setdefault(word, []).append((row, float(weight)))

    tables = {word: tuple(zip(*rows, strict=True)) for word, rows in sorted(found.items())}
    return {
        word: (np.array(rows), np.array(weights) / sum(weights))
        for word, (rows, weights) in tables.items()
    }


def by_posture(motions: list[Motion], draws: Draws) -> Draws:
    """The moments of sitting in postures, by the first that is taken."""

    def label(kind: str, number: int) -> str:
        first = motions[number].name.split(",")[0]
        return first if kind == "posture" and first in POSTURES else ""

    return _chosen(draws, label)


def by_source(motions: list[Motion], draws: Draws) -> Draws:
    """The moments of captured motion, by source and activity."""

    def label(_: str, number: int) -> str:
        motion = motions[number]
        return "" if motion.source == COMPOSED else f"{motion.source}, {motion.category}"

    return _chosen(draws, label)


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
