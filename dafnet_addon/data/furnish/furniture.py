"""Fits furniture to captured motion: a seat under the pelvis that rests, other pieces where the
body never goes.

The paper (section 5.2) matched virtual furniture to be consistent with the captured interaction and
switched its shape; motion capture here has no furniture at all, so every piece is drawn at random
and kept only if the body's swept volume allows it.
"""

import numpy as np

from ...core.root import RootPath
from ...core.series import MODEL_FPS
from ...core.skeleton import ANKLES, PELVIS
from ..motion.interactions import Interaction, lying, reaching, stroking, working
from ..motion.rests import Rest, resting
from .beds import bed_for, beside
from .flesh import NO_BANK, Furnishing, probes
from .real_pieces import bed_shape_for, carries, desk_shape_for, seat_shape_for, stray_shape
from .seats import seat_for
from .shapes import ShapeBank
from .strays import scattered
from .tops import board_for, desk_for, shelf_for, spare_desk

__all__ = ["fitted", "furnished"]

_ONE_SEAT = 0.25  # metres between places that are one
_ON_THE_FLOOR = 0.22  # metres; a pelvis that rests lower sits on the floor
_HALF_DOWN = 0.80  # metres; a pelvis that is lower is on its way to a seat
_NEAR_BY = 0.8  # metres from a seat, within which one is on the way to it
_REAL = 0.7  # of what carries a body, where there are real pieces
_REAL_STRAY = 0.5  # of what stands about
_LIKELY = {"desk": 0.95, "board": 0.8, "shelf": 0.6, "spare desk": 0.45}
_CLOSE = 0.6  # of the spare desks that somebody sits at
_STANDS_BEFORE = 0.2  # metres a second: a slower body may have a desk before it, too


def _standing_place(path: RootPath) -> Rest | None:
    """Where a body is slowest, if it is slow there."""
    if len(path) < 2:
        return None
    speed = np.linalg.norm(np.gradient(path.position, axis=0), axis=-1) * MODEL_FPS
    slowest = int(np.argmin(speed))
    if speed[slowest] > _STANDS_BEFORE:
        return None
    return Rest(slowest, slowest + 1, path.position[slowest], float(path.yaw[slowest]))


def _cut_off(joints: np.ndarray, beds: list[Interaction], rests: list[Rest]) -> bool:
    """Whether the motion begins or ends half-way down to a seat: low, off its feet, and not near a
    place known from the motion.

    What it sits down on is then not known, and nothing must be learnt of sitting down on air.
    """
    places = [*(use.points.mean(0) for use in beds), *(rest.position for rest in rests)]
    for end in (0, -1):
        ankles = joints[end, ANKLES].mean(0)
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
    who sit or stand, and nobody uses it: a desk alone is no reason to sit down. As one goes to a
    table along the lane between it and its chairs, it is before most who sit so near that only
    who sits, and a root, have room.
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
            sits_close = bool(places) and rng.random() < _CLOSE
            room = probes(joints[place.start : place.end]) if sits_close else points
            pieces.append(("spare desk", _furnishing(spare_desk(rng, place, room, path))))

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
    rng: np.random.Generator,
    bank: ShapeBank,
    use: Interaction,
    points: np.ndarray,
    rests: list[Rest],
) -> Furnishing | None:
    """A real bed or sofa where there is one to be had, else one of boxes."""
    real = len(bank) > 0 and rng.random() < _REAL
    found = bed_shape_for(rng, bank, use, points, beside(use, rests)) if real else None
    return found or _furnishing(bed_for(rng, use, points, rests))


def _worked_at(
    rng: np.random.Generator, bank: ShapeBank, use: Interaction, points: np.ndarray
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


_FITS = {"desk": desk_for, "board": board_for, "shelf": shelf_for}
