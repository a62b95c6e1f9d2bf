"""Fits furniture to captured motion: a seat under the pelvis that rests, other pieces where the
body never goes.

The paper (section 5.2) matched virtual furniture to be consistent with the captured interaction and
switched its shape; motion capture here has no furniture at all, so every piece is drawn at random
and kept only if the body's swept volume allows it.
"""

from dataclasses import dataclass

import numpy as np

from ...core.root import RootPath, forward_of
from ...core.series import MODEL_FPS
from ...core.skeleton import PELVIS, joint
from ..motion.rests import Rest, resting
from ..motion.uses import Use, across, lying, reaching, stroking, working
from .boxes import NO_BOXES, box, placed
from .flesh import (
    FAR,
    GIVES,
    LIES_SUNK,
    NO_BANK,
    Furnishing,
    box_clearance,
    pressed,
    probes,
    sunk,
)
from .real_pieces import (
    LIES_OVER,
    ON_DESK,
    bed_shape_for,
    carries,
    desk_shape_for,
    seat_shape_for,
    stray_shape,
)
from .shapes import PELVIS_OVER, ShapeBank

__all__ = [
    "SeatKind",
    "seat_for",
    "desk_for",
    "board_for",
    "scattered",
    "fitted",
    "furnished",
]

_TRIES = 16
_ONE_SEAT = 0.25
_ON_THE_FLOOR = 0.22  # a pelvis that rests lower than this sits on the floor
_HALF_DOWN = 0.80
# of what carries a body, and of what stands about, where there are real pieces
_REAL, _REAL_STRAY = 0.7, 0.5
_NEAR_BY = 0.8
_LIKELY = {"desk": 0.95, "board": 0.8, "shelf": 0.6, "spare desk": 0.35}
_STANDS_BEFORE = 0.2  # metres a second: a slower body may have a desk before it, too


# A stretched wrist would carry the hand's probe; on a board, as on a top, the wrist bends.
_ON_BOARD = pressed(0.0, wrist=0.01, hand=0.12)
_STYLES = ("block", "legs", "legs", "column", "panels")


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
    styles: tuple[str, ...] = _STYLES


_SEATS = (
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
_SEAT_SHARES = (0.16, 0.25, 0.13, 0.11, 0.09, 0.13, 0.06, 0.07)
_HIGH_SEAT = 0.58  # metres over the floor: from there on feet may have a rest of their own


def _carrier(
    rng: np.random.Generator,
    top: float,
    thick: float,
    x: float,
    back: float,
    front: float,
    styles: tuple[str, ...] = _STYLES,
) -> list[np.ndarray]:
    """What carries a seat or table top between ``back`` and ``front`` (y), ``x`` to either side."""
    middle, depth, under = (front + back) / 2, front - back, top - thick
    style = styles[rng.integers(len(styles))]
    if style == "block":
        gap = rng.choice([0.0, rng.uniform(0.05, 0.15)])
        return [box((0, middle, (under + gap) / 2), (2 * x, depth, max(under - gap, 0.02)))]
    if style == "legs":
        t = rng.uniform(0.03, 0.07)
        ys = (back + t / 2, front - t / 2)
        return [box((sx * (x - t / 2), y, under / 2), (t, t, under)) for sx in (-1, 1) for y in ys]
    if style == "wall":
        return [box((0, front - 0.02, under / 2), (2 * x, 0.04, under))]

    if style == "column":
        t, foot = rng.uniform(0.05, 0.12), rng.uniform(0.3, 0.5)
        column = box((0, middle, under / 2), (t, t, under))
        if rng.random() < 0.5:
            return [column, box((0, middle, 0.03), (foot, foot, 0.06))]

        star = [np.pi / 2 + 2 * np.pi * k / 5 for k in range(5)]
        arms = [(foot / 4 * np.cos(a), middle + foot / 4 * np.sin(a), 0.06) for a in star]
        return [
            column,
            *(box(arm, (foot / 2, 0.04, 0.08), a) for arm, a in zip(arms, star, strict=True)),
        ]

    return [box((sx * (x - 0.02), middle, under / 2), (0.04, depth, under)) for sx in (-1, 1)]


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
) -> list[np.ndarray]:
    """Arms to both sides: closed down to the floor or the seat, or a rest on two posts."""
    height = rng.uniform(0.12, 0.25)
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


def _seat(
    rng: np.random.Generator, top: float, kind: SeatKind, small: float
) -> tuple[np.ndarray, np.ndarray]:
    """A seat with its front along +y, the sitter's pelvis over the origin: (carrying boxes, back
    and arms).

    ``small`` from 1 to 0 takes away what lies before the pelvis.
    """
    x = rng.uniform(*kind.half_width)
    room = max(0.0, x - 0.22)
    shift = rng.uniform(-room, room) + rng.uniform(-0.03, 0.03)
    back, front = -rng.uniform(*kind.behind), rng.uniform(*kind.before) * small
    thick = min(rng.uniform(*kind.thick), top - 0.03)
    rows = _surface(rng, top, thick, x, back, front)
    rows += _carrier(rng, top, thick, x, back, front, kind.styles)
    if top > _HIGH_SEAT and rng.random() < 0.5:
        # for the feet
        rows.append(box((0, front - 0.02, rng.uniform(0.15, top - 0.35)), (2 * x, 0.03, 0.03)))

    extra = []
    side = rng.uniform(0.03, 0.06) + 0.6 * max(0.0, thick - 0.08)
    if rng.random() < kind.backed:
        extra += _back(rng, side, top, x, back)
    if rng.random() < kind.armed:
        extra += _arms(rng, kind, side, top, x, back, front)

    both = np.array(rows), (np.array(extra) if extra else NO_BOXES.copy())
    for part in both:
        part[:, 0] += shift

    return both


def seat_for(
    rng: np.random.Generator, rest: Rest, points: np.ndarray, wanted: SeatKind | None = None
) -> np.ndarray | None:
    """Boxes of a random seat under a resting pelvis, or None where no try leaves the body's path
    (``points``) free.

    A ``wanted`` kind of seat is exactly as far under the pelvis as it says, and no stool takes its
    place.
    """
    kind = wanted or _SEATS[rng.choice(len(_SEATS), p=_SEAT_SHARES)]
    error = 0.0 if wanted else float(np.clip(rng.normal(0.0, 0.008), -0.02, 0.02))
    for attempt in range(_TRIES):
        if attempt == _TRIES // 2 and not wanted:
            kind = _SEATS[0]  # a plain stool fits where nothing else does

        over = kind.over + error
        top = rest.position[2] - over
        carrying, extra = _seat(rng, top, kind, small=1.0 - 0.7 * attempt / _TRIES)
        yaw = rest.yaw + rng.normal(0.0, 0.08)
        carrying, extra = (placed(part, rest.position[:2], yaw) for part in (carrying, extra))
        if box_clearance(carrying, points, GIVES, sunk(over)) < 0:
            continue
        if box_clearance(extra, points, 0.02) < 0:
            if attempt < _TRIES // 4:
                continue
            extra = NO_BOXES

        return np.concatenate([carrying, extra])

    return None


def _beside(use: Use, rests: list[Rest]) -> list[Rest]:
    """The rests on the edge of where one lies."""
    middle = use.points.mean(0)
    return [rest for rest in rests if np.linalg.norm((rest.position - middle)[:2]) < _NEAR_BY]


def _bed_for(
    rng: np.random.Generator, use: Use, points: np.ndarray, rests: list[Rest]
) -> np.ndarray | None:
    """A bed, or a sofa with its back to one side, under a lying body, head end along +y; it carries
    the rests beside it too.
    """
    middle = use.points.mean(0)
    beside_it = _beside(use, rests)
    for attempt in range(_TRIES):
        sofa = rng.random() < 0.35
        x = rng.uniform(0.32, 0.45) if sofa else rng.uniform(0.4, 0.95)
        shift = rng.uniform(-1, 1) * (x - 0.24)
        head, feet = (
            rng.uniform(0.65, 0.95),
            -rng.uniform(0.9, 1.35) * (1.0 - 0.4 * attempt / _TRIES),
        )
        top = middle[2] - LIES_OVER - rng.uniform(0.0, 0.02)
        thick = min(rng.uniform(0.12, 0.3), top - 0.05)
        rows = [box((shift, (head + feet) / 2, top - thick / 2), (2 * x, head - feet, thick))]
        extra = []
        if sofa:
            side, t, h = rng.choice([-1.0, 1.0]), rng.uniform(0.08, 0.2), rng.uniform(0.25, 0.5)
            extra.append(
                box(
                    (shift + side * (x + t / 2), (head + feet) / 2, (top + h) / 2),
                    (t, head - feet, top + h),
                )
            )

        if rng.random() < 0.5:
            t, h = rng.uniform(0.04, 0.1), rng.uniform(0.1, 0.6)
            extra.append(box((shift, head + t / 2, (top + h) / 2), (2 * x, t, top + h)))

        carrying = np.array(rows + _carrier(rng, top, thick, x, feet, head, ("block", "legs")))
        carrying[1:, 0] += shift
        beside = np.array(extra) if extra else NO_BOXES
        yaw = use.yaw + rng.normal(0.0, 0.05)
        carrying, beside = (placed(part, middle[:2], yaw) for part in (carrying, beside))
        under = Furnishing(carrying[:1])
        if box_clearance(carrying, points, GIVES, LIES_SUNK) < 0 or not all(
            carries(under, rest) for rest in beside_it
        ):
            continue

        return np.concatenate(
            [carrying, beside if box_clearance(beside, points, 0.02) >= 0 else NO_BOXES]
        )

    return None


def desk_for(rng: np.random.Generator, use: Use, points: np.ndarray) -> np.ndarray | None:
    """A desk, table or counter whose top is 2 to 5 cm under the lowest wrist that works there."""
    origin = use.points[:, :2].mean(0)
    right, ahead = across(use, origin)
    top = use.points[:, 2].min() - rng.uniform(0.02, 0.05)
    for attempt in range(_TRIES):
        share = 1.0 - attempt / _TRIES
        near = ahead.min() - rng.uniform(0.0, 0.22) * share
        far = ahead.max() + 0.12 + rng.uniform(0.0, 0.4) * share
        left_side, right_side = (
            (-0.1, 0.1) + rng.uniform(0.0, 0.6, 2) * (-share, share) + (right.min(), right.max())
        )
        x, thick = (right_side - left_side) / 2, rng.uniform(0.02, 0.06)
        rows = [box((0, (near + far) / 2, top - thick / 2), (2 * x, far - near, thick))]
        # Knees and feet go under what is carried at its ends, and under a top on the wall if under
        # nothing else.
        styles = ("wall", "panels", "legs", "column")[: 1 if attempt > 0.6 * _TRIES else 4]
        rows += _carrier(
            rng, top, thick, x, near, far, _STYLES if rng.random() < 0.3 * share else styles
        )
        desk = np.array(rows)
        desk[:, 0] += (left_side + right_side) / 2
        desk = placed(desk, origin, use.yaw)
        if box_clearance(desk, points, ON_DESK) >= 0:
            return desk

    return None


def board_for(rng: np.random.Generator, use: Use, points: np.ndarray) -> np.ndarray | None:
    """A board or wall 5 to 9 cm beyond the furthest wrist that strokes it."""
    origin = use.points[:, :2].mean(0)
    right, ahead = across(use, origin)
    low, high = use.points[:, 2].min(), use.points[:, 2].max()
    face = ahead.max() + rng.uniform(0.05, 0.09)
    for attempt in range(_TRIES):
        share = 1.0 - attempt / _TRIES
        left_side, right_side = (
            right.min() - 0.1 - rng.uniform(0, 1.0) * share,
            right.max() + 0.1 + rng.uniform(0, 1.0) * share,
        )
        thick, upper = rng.uniform(0.02, 0.12), high + rng.uniform(0.1, 0.6)
        lower = 0.0 if rng.random() < 0.3 * share else max(0.0, low - rng.uniform(0.1, 0.5))
        size = (right_side - left_side, thick, upper - lower)
        board = placed(
            box(((left_side + right_side) / 2, face + thick / 2, (lower + upper) / 2), size)[None],
            origin,
            use.yaw,
        )
        if box_clearance(board, points, _ON_BOARD) >= 0:
            return board

    return None


def _shelf_for(rng: np.random.Generator, use: Use, points: np.ndarray) -> np.ndarray | None:
    """A shelf, bookcase or counter a little under a hand that reached for it."""
    origin = use.points[:, :2].mean(0)
    _, ahead = across(use, origin)
    under = use.points[:, 2].min()
    for _ in range(_TRIES // 2):
        top, x = under - rng.uniform(0.03, 0.08), rng.uniform(0.15, 0.7)
        near, thick = ahead.min() - rng.uniform(0.0, 0.12), rng.uniform(0.02, 0.05)
        far = ahead.max() + rng.uniform(0.1, 0.35)
        rows = [box((0, (near + far) / 2, top - thick / 2), (2 * x, far - near, thick))]
        style = rng.choice(
            ["board", "counter", "bookcase"], p=[0.4, 0.2, 0.4] if top > 1.0 else [0.1, 0.7, 0.2]
        )
        if style == "counter":
            rows += _carrier(rng, top, thick, x, near, far)

        if style == "bookcase":
            height = top + rng.uniform(0.1, 0.8)
            rows.append(box((0, far + 0.01, height / 2), (2 * x, 0.02, height)))
            rows += [
                box((s * x, (near + far) / 2, height / 2), (0.03, far - near, height))
                for s in (-1, 1)
            ]
            rows += [
                box((0, (near + far) / 2, z), (2 * x, far - near, thick))
                for z in np.arange(top - 0.35, 0.1, -0.35)
            ]

        shelf = np.array(rows)
        shelf[:, 0] += rng.uniform(-0.6, 0.6) * x
        shelf = placed(shelf, origin, use.yaw + rng.normal(0.0, 0.1))
        if box_clearance(shelf, points, ON_DESK) >= 0:
            return shelf

    return None


def _spare_desk(rng: np.random.Generator, rest: Rest, points: np.ndarray) -> np.ndarray | None:
    """A desk before a body that rests and leaves it alone, drawn up until it would touch the body
    on its way there.
    """
    top, x, depth, thick = (
        rng.uniform(0.6, 0.85),
        rng.uniform(0.3, 0.8),
        rng.uniform(0.4, 0.8),
        rng.uniform(0.02, 0.06),
    )
    style = ("legs", "panels", "wall", "column")[rng.integers(4)]
    rows = [
        box((0, depth / 2, top - thick / 2), (2 * x, depth, thick)),
        *_carrier(rng, top, thick, x, 0, depth, (style,)),
    ]
    desk = np.array(rows)
    desk[:, 0] += rng.uniform(-0.5, 0.5) * x
    forward = forward_of(rest.yaw)
    gap = rng.uniform(0.01, 0.08)
    for distance in np.arange(0.2, 1.0, 0.08):
        candidate = placed(desk, rest.position[:2] + distance * forward, rest.yaw)
        if box_clearance(candidate, points) >= gap:
            return candidate

    return None


def _standing_place(path: RootPath) -> Rest | None:
    """Where a body is slowest, if it is slow there."""
    if len(path) < 2:
        return None
    speed = np.linalg.norm(np.gradient(path.position, axis=0), axis=-1) * MODEL_FPS
    slowest = int(np.argmin(speed))
    if speed[slowest] > _STANDS_BEFORE:
        return None
    return Rest(slowest, slowest + 1, path.position[slowest], float(path.yaw[slowest]))


def _desk_alone(rng: np.random.Generator) -> np.ndarray:
    top, x, y = rng.uniform(0.4, 1.05), rng.uniform(0.25, 0.9), rng.uniform(0.2, 0.45)
    thick = rng.uniform(0.02, 0.08)
    desk = np.array(
        [box((0, 0, top - thick / 2), (2 * x, 2 * y, thick)), *_carrier(rng, top, thick, x, -y, y)]
    )
    if top > 0.65 and rng.random() < 0.4:  # its chair is drawn up, and nobody sits on it
        seat = np.concatenate(_seat(rng, rng.uniform(0.38, 0.5), _SEATS[1], 1.0))
        desk = np.concatenate(
            [desk, placed(seat, np.array([0.0, -y - rng.uniform(0.1, 0.5)]), rng.normal(0, 0.3))]
        )

    return desk


def _piece(rng: np.random.Generator) -> np.ndarray:
    """Something that nobody uses, about the origin."""
    kind = rng.choice(["block", "wall", "desk", "seat", "bed"], p=[0.25, 0.15, 0.25, 0.3, 0.05])
    if kind == "block":
        size = rng.uniform((0.2, 0.2, 0.2), (1.2, 0.8, 1.9))
        return box((0, 0, size[2] / 2 + rng.choice([0.0, rng.uniform(0, 0.8)])), tuple(size))[None]

    if kind == "wall":
        length, height = rng.uniform(1.0, 4.0), rng.uniform(1.0, 2.6)
        return box(
            (0, 0, height / 2 + rng.choice([0.0, 0.8])), (length, rng.uniform(0.03, 0.2), height)
        )[None]

    if kind == "desk":
        return _desk_alone(rng)
    if kind == "bed":
        size = rng.uniform((0.8, 1.9, 0.3), (1.8, 2.1, 0.6))
        return box((0, 0, size[2] / 2), tuple(size))[None]

    seat = _SEATS[rng.choice(len(_SEATS), p=_SEAT_SHARES)]
    return np.concatenate(_seat(rng, rng.uniform(0.3, 0.75), seat, 1.0))


def scattered(
    rng: np.random.Generator, points: np.ndarray, path: RootPath, count: int
) -> np.ndarray:
    """Up to ``count`` random pieces near the path, none of which the body (``points``) comes near
    to.

    Half of them are pushed to within 5 to 20 cm of the body's path: what one has to walk around.
    """
    kept = [NO_BOXES]
    for _ in range(count):
        piece = _piece(rng)
        wanted = rng.uniform(0.05, 0.2) if rng.random() < 0.5 else FAR
        for _ in range(5):
            at = path.position[rng.integers(len(path)), :2]
            direction, distance = rng.uniform(0, 2 * np.pi), rng.uniform(0.25, 1.5)
            towards = np.array([np.cos(direction), np.sin(direction)])
            candidate = placed(piece, at + distance * towards, rng.uniform(0, 2 * np.pi))
            clearance = box_clearance(candidate, points)
            if clearance < 0.03:
                continue
            for _ in range(4):  # no step can be longer than what is free
                if clearance > wanted + 0.01:
                    candidate[:, :2] -= (clearance - wanted) * towards
                    clearance = box_clearance(candidate, points)
            kept.append(candidate)
            break

    return np.concatenate(kept)


def _cut_off(joints: np.ndarray, beds: list[Use], rests: list[Rest]) -> bool:
    """Whether the motion begins or ends half-way down to a seat: low, off its feet, and not near a
    place known from the motion.

    What it sits down on is then not known, and nothing must be learnt of sitting down on air.
    """
    places = [*(use.points.mean(0) for use in beds), *(rest.position for rest in rests)]
    for end in (0, -1):
        ankles = (joints[end, joint("left_ankle")] + joints[end, joint("right_ankle")]) / 2
        low = (
            _ON_THE_FLOOR < joints[end, PELVIS, 2] < _HALF_DOWN
            and np.linalg.norm((ankles - joints[end, PELVIS])[:2]) > 0.15
        )
        if low and all(
            np.linalg.norm((joints[end, PELVIS] - place)[:2]) > _NEAR_BY for place in places
        ):
            return True

    return False


def fitted(
    rng: np.random.Generator,
    joints: np.ndarray,
    path: RootPath,
    points: np.ndarray,
    bank: ShapeBank = NO_BANK,
    seen: slice = slice(None),
) -> tuple[list[tuple[str, Furnishing | None]], str]:
    """What a motion uses, one word each, with the furniture fitted to it or None where none could
    be had; and what is missing.

    A desk that is worked at leaves the body room in the frames that are ``seen``: before and after
    that a chair is drawn up to it or pushed back, which nobody's motion shows. Where a ``bank`` of
    real pieces is given, most of what carries a body is one of them. Hands may as well work in the
    air: now and then theirs is not tried, and not in the list. A "spare desk" stands before some
    who sit or stand, and nobody uses it: a desk alone is no reason to sit down.
    """
    beds, rests = lying(joints), resting(joints, path)
    if _cut_off(joints, beds, rests):
        return [], "cut"

    pieces = [("bed", _bed(rng, bank, use, points, rests)) for use in beds]
    places: list[Rest] = []
    for rest in rests:
        apart = all(np.linalg.norm(rest.position - other.position) > _ONE_SEAT for other in places)
        on_bed = any(found is not None and carries(found, rest) for _, found in pieces)
        if apart and rest.position[2] > _ON_THE_FLOOR and not on_bed:
            places.append(rest)

    pieces += [("seat", _seat_under(rng, bank, place, points)) for place in places]
    missing = next((kind for kind, found in pieces if found is None), "")
    if not missing:
        # Hands get one piece, as pieces do not know of one another; a top first, as a hand that
        # moves to and fro has both.
        reaches = reaching(joints, path)
        for use in working(joints, path) + stroking(joints, path) or [
            reaches[i] for i in rng.permutation(len(reaches))
        ]:
            kind = use.kind
            first, end, _ = seen.indices(len(joints))
            drawn_up = kind == "desk" and use.start < end and use.end > first
            if rng.random() < _LIKELY[kind]:
                room = probes(joints[seen]) if drawn_up else points
                pieces.append((kind, _worked_at(rng, bank, use, room)))
                if pieces[-1][1] is not None:
                    break

        place = places[0] if places else _standing_place(path)
        bare = all(kind not in ("desk", "bed") or found is None for kind, found in pieces)
        if place is not None and bare and rng.random() < _LIKELY["spare desk"]:
            pieces.append(("spare desk", _furnishing(_spare_desk(rng, place, points))))

    return pieces, missing


def _furnishing(boxes: np.ndarray | None) -> Furnishing | None:
    return None if boxes is None else Furnishing(boxes)


def _seat_under(
    rng: np.random.Generator, bank: ShapeBank, rest: Rest, points: np.ndarray
) -> Furnishing | None:
    """A real seat where there is one to be had, else one of boxes."""
    real = len(bank) > 0 and rng.random() < _REAL
    return (seat_shape_for(rng, bank, rest, points) if real else None) or _furnishing(
        seat_for(rng, rest, points)
    )


def _bed(
    rng: np.random.Generator, bank: ShapeBank, use: Use, points: np.ndarray, rests: list[Rest]
) -> Furnishing | None:
    """A real bed or sofa where there is one to be had, else one of boxes."""
    real = len(bank) > 0 and rng.random() < _REAL
    found = bed_shape_for(rng, bank, use, points, _beside(use, rests)) if real else None
    return found or _furnishing(_bed_for(rng, use, points, rests))


def _worked_at(
    rng: np.random.Generator, bank: ShapeBank, use: Use, points: np.ndarray
) -> Furnishing | None:
    """A desk, board or shelf at hands: a real desk where there is one to be had."""
    real = use.kind == "desk" and len(bank) > 0 and rng.random() < _REAL
    found = desk_shape_for(rng, bank, use, points) if real else None
    return found or _furnishing(_FITS[use.kind](rng, use, points))


def furnished(
    rng: np.random.Generator,
    joints: np.ndarray,
    path: RootPath,
    bank: ShapeBank = NO_BANK,
    seen: slice = slice(None),
) -> tuple[Furnishing | None, str]:
    """A room for one motion (T, 22, 3) with its root path: what the body uses and random pieces,
    and "".

    Or None and one word for why not: "seat" or "bed", that could not be had, or "cut", where the
    motion begins or ends half-way down to one. A desk, board or shelf that does not fit is left
    out. ``seen``: see ``fitted``. Paper, section 5.2.
    """
    points = probes(joints)
    pieces, missing = fitted(rng, joints, path, points, bank, seen)
    if missing:
        return None, missing

    count = int(rng.integers(1, 5)) if rng.random() < 0.8 else 0
    real = rng.binomial(count, _REAL_STRAY) if len(bank) else 0
    room = Furnishing(scattered(rng, points, path, count - real), bank=bank)
    for _ in range(real):
        room = room + stray_shape(rng, bank, points, path)
    for _, found in pieces:
        if found is not None:
            room = found + room

    return room, ""


_FITS = {"desk": desk_for, "board": board_for, "shelf": _shelf_for}
