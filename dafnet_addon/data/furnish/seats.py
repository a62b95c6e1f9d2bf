"""Seats of boxes: chairs, stools, benches, arm chairs, sofas and edges, drawn at random under a
pelvis that rests.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..motion.rests import Rest
from .boxes import NO_BOXES, box, placed
from .carriers import STYLES, carrier
from .flesh import GIVES, box_clearance, sunk
from .shapes import PELVIS_OVER
from .sitters import MET, Forearm, Trunk, forearm_of, leans_back, trunk_of

__all__ = ["SEATS", "SEAT_SHARES", "SeatKind", "seat", "seat_for"]

_TRIES = 16
_TOUCHES = (0.0, 0.045)  # metres that a back presses into the flesh it meets
_YIELDS = 0.13  # metres that a back is moved away for who does not leave it that room
_INWARD = (0.0, 0.04)  # metres from such an arm to the inner side of what carries it
_ON_EDGES = 0.12  # of the other seats, on which one sits far before the back
_EDGE_BEHIND, _EDGE_BEFORE = (0.26, 0.4), (0.05, 0.12)  # metres
_HIGH_SEAT = 0.58  # metres over the floor: from there on feet may have a rest of their own


@dataclass(frozen=True)
class SeatKind:
    """Ranges of a kind of seat in metres: half its width, what lies behind and before the pelvis,
    thickness; how often it has a back and arms; how far over its surface it carries a pelvis; what
    may carry it.
    """

    half_width: tuple[float, float]
    behind: tuple[float, float]
    before: tuple[float, float]
    thick: tuple[float, float]
    backed: float
    armed: float
    over: float
    styles: tuple[str, ...] = STYLES


SEATS = (
    SeatKind((0.15, 0.22), (0.12, 0.2), (0.1, 0.25), (0.03, 0.08), 0.0, 0.0, PELVIS_OVER["stool"]),
    SeatKind(
        (0.18, 0.26),
        (0.14, 0.30),
        (0.14, 0.36),
        (0.02, 0.08),
        0.85,
        0.2,
        PELVIS_OVER["chair"],
        ("legs", "legs", "panels"),
    ),
    # office
    SeatKind(
        (0.22, 0.30),
        (0.15, 0.30),
        (0.14, 0.36),
        (0.05, 0.10),
        0.9,
        0.6,
        PELVIS_OVER["armchair"],
        ("column",),
    ),
    SeatKind(
        (0.5, 1.0),
        (0.12, 0.25),
        (0.12, 0.3),
        (0.03, 0.12),
        0.2,
        0.0,
        PELVIS_OVER["bench"],
        ("block", "legs", "panels"),
    ),
    SeatKind(
        (0.27, 0.36),
        (0.18, 0.35),
        (0.2, 0.42),
        (0.12, 0.25),
        0.9,
        0.8,
        PELVIS_OVER["armchair"],
        ("block", "legs"),
    ),
    SeatKind(
        (0.5, 1.1),
        (0.18, 0.35),
        (0.2, 0.42),
        (0.15, 0.3),
        0.9,
        0.7,
        PELVIS_OVER["sofa"],
        ("block", "legs"),
    ),
    # edges
    SeatKind(
        (0.3, 1.0),
        (0.3, 0.6),
        (0.04, 0.14),
        (0.02, 0.07),
        0.1,
        0.0,
        PELVIS_OVER["table"],
        ("legs", "panels"),
    ),
    SeatKind(
        (0.5, 1.0),
        (0.3, 0.6),
        (0.06, 0.2),
        (0.15, 0.3),
        0.3,
        0.0,
        PELVIS_OVER["bed"],
        ("block", "legs"),
    ),
)
SEAT_SHARES = (0.16, 0.25, 0.13, 0.11, 0.09, 0.13, 0.06, 0.07)
_ARMED = [i for i, kind in enumerate(SEATS) if kind.armed]
_BACKED = [i for i, kind in enumerate(SEATS) if kind.backed > 0.5]


def _surface(
    rng: np.random.Generator, top: float, thick: float, x: float, back: float, front: float
) -> list[np.ndarray]:
    """What one sits on, from ``back`` to ``front`` (y), ``x`` to either side: whole, slatted, open
    in the middle, cushioned.
    """
    middle, depth = (front + back) / 2, front - back
    style = rng.choice(["whole", "slats", "open", "cushion"], p=[0.6, 0.16, 0.08, 0.16])
    if style == "slats" and thick < 0.09:
        count = int(rng.integers(4, 8))
        each = depth / (count - 0.4)
        return [
            box((0, back + each * (k + 0.3), top - thick / 2), (2 * x, 0.6 * each, thick))
            for k in range(count)
        ]

    if style == "open" and thick < 0.09 and min(2 * x, depth) > 0.3:
        rim = rng.uniform(0.09, 0.13)
        sides = [
            box((s * (x - rim / 2), middle, top - thick / 2), (rim, depth, thick)) for s in (-1, 1)
        ]
        ends = [
            box((0, y, top - thick / 2), (2 * x, rim, thick))
            for y in (back + rim / 2, front - rim / 2)
        ]
        return sides + ends

    if style == "cushion" and thick > 0.05:
        pad = min(0.6 * thick, rng.uniform(0.03, 0.12))
        inset = rng.uniform(0.0, 0.03)
        return [
            box((0, middle, top - pad / 2), (2 * (x - inset), depth - inset, pad)),
            box((0, middle, top - pad - (thick - pad) / 2), (2 * x, depth, thick - pad)),
        ]

    return [box((0, middle, top - thick / 2), (2 * x, depth, thick))]


def _back_behind(
    rng: np.random.Generator, thick: float, over: float, x: float, trunk: Trunk, off: float
) -> list[np.ndarray]:
    """A back that meets a trunk, of boards along it, or stays ``off`` it by so many metres;
    ``over``: metres from the seat to the pelvis. z counts from the seat, y from the pelvis.
    """
    height, count = rng.uniform(0.35, 0.7), 4
    touches = rng.uniform(*_TOUCHES) - off
    part = height / count
    rows = []
    for k in range(count):
        rise = part * (k + 0.5)
        y = -(trunk.behind + trunk.lean * (rise - over - trunk.low) - touches + thick / 2)
        rows.append(box((0, y, rise), (2 * x, thick, 1.05 * part)))
    return rows


def _back(
    rng: np.random.Generator, thick: float, top: float, x: float, back: float
) -> list[np.ndarray]:
    """A back behind ``back`` (y): one board, bars across or upright, leaning away from the sitter
    in steps.
    """
    height, low = (
        rng.uniform(0.25, 0.6),
        rng.choice([0.0, rng.uniform(0.05, 0.2)]) if thick < 0.06 else 0.0,
    )
    at = back - thick / 2 + rng.uniform(0, 0.03)
    style = rng.choice(["board", "across", "upright", "leaning"], p=[0.4, 0.2, 0.12, 0.28])
    if style == "across" and thick < 0.09:
        count = int(rng.integers(2, 5))
        bar = rng.uniform(0.04, 0.09)
        heights = np.linspace(top + max(low, 0.06), top + height, count)
        posts = [
            box((s * (x - 0.02), at, top + height / 2), (0.04, thick, height)) for s in (-1, 1)
        ]
        return posts + [box((0, at, z), (2 * x, 0.6 * thick, bar)) for z in heights]

    if style == "upright" and thick < 0.09:
        bars = [
            box((s, at, top + height / 2), (0.03, thick, height))
            for s in np.linspace(-x + 0.02, x - 0.02, 5)
        ]
        return [*bars, box((0, at, top + height), (2 * x, thick, 0.05))]

    if style == "leaning":
        count, lean = 4, np.tan(np.radians(rng.uniform(6.0, 28.0)))
        part = (height - low) / count
        rises = [low + part * (k + 0.5) for k in range(count)]
        return [
            box((0, at - lean * rise, top + rise), (2 * x, thick, 1.05 * part)) for rise in rises
        ]

    return [box((0, at, top + (low + height) / 2), (2 * x, thick, height - low))]


def _arms(
    rng: np.random.Generator,
    kind: SeatKind,
    thick: float,
    top: float,
    x: float,
    back: float,
    front: float,
    height: float,
) -> list[np.ndarray]:
    """Arms to both sides, ``height`` metres over the seat: closed down to the floor or the seat, or
    a rest on two posts.
    """
    # The arms of an office chair hang on its seat; others stand on the floor.
    foot = top if kind.styles == ("column",) else 0.0
    middle, depth = (front + back) / 2, front - back
    if thick < 0.08 and rng.random() < 0.6:
        rests = [
            box((s * (x + thick / 2), middle, top + height - 0.02), (thick, 0.8 * depth, 0.04))
            for s in (-1, 1)
        ]
        ys = (middle - 0.35 * depth, middle + 0.35 * depth)
        post = (0.03, 0.03, top + height - foot)
        posts = [
            box((s * (x + thick / 2), y, (foot + top + height) / 2), post)
            for s in (-1, 1)
            for y in ys
        ]
        return rests + posts

    size = (thick, depth, top + height - foot)
    return [box((s * (x + thick / 2), middle, (top + height + foot) / 2), size) for s in (-1, 1)]


def _lifted(height: float) -> np.ndarray:
    """What lifts a box by so many metres."""
    return np.array([0.0, 0.0, height, 0.0, 0.0, 0.0, 0.0])


def seat(
    rng: np.random.Generator,
    top: float,
    kind: SeatKind,
    small: float,
    trunk: Trunk | None = None,
    forearm: Forearm | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A seat with its front along +y, the sitter's pelvis over the origin: boxes that carry, its
    back and its arms.

    ``small`` from 1 to 0 takes away what lies before the pelvis; a back meets the ``trunk`` of who
    leans on it, and arms the ``forearm`` that lies on them, where they are given.
    """
    x = rng.uniform(*kind.half_width)
    if forearm is not None:
        x = forearm.aside - rng.uniform(*_INWARD)
    room = max(0.0, x - 0.22)
    shift = rng.uniform(-room, room) + rng.uniform(-0.03, 0.03)
    back, front = -rng.uniform(*kind.behind), rng.uniform(*kind.before) * small
    if trunk is not None:
        back = -max(trunk.behind - trunk.lean * (kind.over + trunk.low), kind.behind[0])
    thick = min(rng.uniform(*kind.thick), top - 0.03)
    rows = _surface(rng, top, thick, x, back, front)
    rows += carrier(rng, top, thick, x, back, front, kind.styles)
    if top > _HIGH_SEAT and rng.random() < 0.5:
        # for the feet
        rows.append(box((0, front - 0.02, rng.uniform(0.15, top - 0.35)), (2 * x, 0.03, 0.03)))

    side = rng.uniform(0.03, 0.06) + 0.6 * max(0.0, thick - 0.08)
    behind: list[np.ndarray] = []
    beside: list[np.ndarray] = []
    off = _YIELDS * (1.0 - small)
    if rng.random() < kind.backed:
        behind = (
            _back(rng, side, top, x, back)
            if trunk is None
            else [part + _lifted(top) for part in _back_behind(rng, side, kind.over, x, trunk, off)]
        )
    if forearm is not None or rng.random() < kind.armed:
        height = rng.uniform(0.12, 0.25) if forearm is None else kind.over + forearm.over
        beside = _arms(rng, kind, side, top, x, back, front, height)

    parts = [np.array(part) if part else NO_BOXES.copy() for part in (rows, behind, beside)]
    for part in parts:
        part[:, 0] += shift if forearm is None else 0.0
    return parts[0], parts[1], parts[2]


def seat_for(
    rng: np.random.Generator, rest: Rest, points: np.ndarray, wanted: SeatKind | None = None
) -> np.ndarray | None:
    """Boxes of a random seat under a resting pelvis, or None where no try leaves the body's path
    (``points``) free. Who leans far back gets a back to lean on.

    A ``wanted`` kind of seat is exactly as far under the pelvis as it says, and no stool takes its
    place.
    """
    kind = wanted or SEATS[rng.choice(len(SEATS), p=SEAT_SHARES)]
    error = 0.0 if wanted else float(np.clip(rng.normal(0.0, 0.008), -0.02, 0.02))
    trunk = None if wanted or rng.random() > MET else trunk_of(rest, points)
    forearm = None if wanted or rng.random() > MET else forearm_of(rest, points)
    if forearm is not None and not kind.armed:
        kind = SEATS[rng.choice(_ARMED)]
    leans = not wanted and leans_back(rest, points)
    if leans:
        trunk = trunk_of(rest, points)
        kind = replace(kind if kind.backed > 0.5 else SEATS[rng.choice(_BACKED)], backed=1.0)
    if not wanted and trunk is None and rng.random() < _ON_EDGES:
        kind = replace(kind, behind=_EDGE_BEHIND, before=_EDGE_BEFORE)
    for attempt in range(_TRIES):
        if attempt == _TRIES // 2 and not (wanted or leans):
            kind = SEATS[0]  # a plain stool fits where nothing else does

        over = kind.over + error
        top = rest.position[2] - over
        first_half = leans or attempt < _TRIES // 2
        meets, lies = (trunk, forearm) if first_half else (None, None)
        parts = seat(rng, top, kind, 1.0 - 0.7 * attempt / _TRIES, meets, lies)
        yaw = rest.yaw + rng.normal(0.0, 0.08 if meets is None else 0.03)
        carrying, *extras = (placed(part, rest.position[:2], yaw) for part in parts)
        if box_clearance(carrying, points, GIVES, sunk(over)) < 0:
            continue

        # Backs and arms that the body would cut are tried anew for a while, then left out.
        give = 0.02 if meets is None and lies is None else GIVES
        free = [part for part in extras if box_clearance(part, points, give) >= 0]
        if len(free) < len(extras) and (leans or attempt < _TRIES // 4):
            continue
        return np.concatenate([carrying, *free])

    return None
