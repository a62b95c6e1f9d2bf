"""Fits real pieces of furniture to captured motion: under a pelvis that rests, under a body that
lies, under hands that work, and beside its way.

A piece is taken at the height at which it carries the pelvis where the motion has it
(``shapes.PELVIS_OVER``): how far one sinks in belongs to the piece and is never drawn anew. It is
turned and shifted until the body's swept volume leaves it free.
"""

import numpy as np

from ...core.root import RootPath, forward_of
from ...core.skeleton import SEAT_TO_PELVIS
from ..motion.interactions import Interaction, across
from ..motion.rests import Rest
from .flesh import GIVES, LIES_SUNK, Furnishing, clearance, nearest_box, pressed, sunk
from .shapes import STRETCH, Seat, ShapeBank
from .sitters import MET, leans_back, trunk_of

__all__ = [
    "LIES_OVER",
    "ON_DESK",
    "bed_shape_for",
    "carries",
    "desk_shape_for",
    "seat_shape_for",
    "stray_shape",
]

LIES_OVER = 0.01
"""Metres by which the pelvis joint of one that lies is over the undeformed surface of a bed or
sofa.
"""

ON_DESK = pressed(0.0, wrist=0.035, hand=0.09, elbow=0.03)
"""Metres by which flesh may give that works on a top. A stretched wrist would carry the hand's
probe; on a top the wrist bends.
"""

_SHARES = {
    "chair": 0.34,
    "armchair": 0.17,
    "sofa": 0.17,
    "stool": 0.10,
    "bench": 0.08,
    "toilet": 0.03,
    "bed": 0.06,
    "table": 0.04,
    "desk": 0.01,
}
"""How often each kind is sat on, among those that can be as high as the pelvis asks."""
_LEANT_ON = ("chair", "armchair", "sofa")
_PIECES, _PLACES = 5, 6  # tried for one rest, and on each of them
_FROM_USUAL = (-0.08, 0.03)  # metres forward of where ``director.seats`` puts the pelvis, at first
_FARTHEST_BACK, _CLOSER_BY, _CLOSER = -0.16, 0.03, 12  # metres; the same from there on; places
_LEAST_BEFORE = 0.1  # metres of seat that are left before the pelvis, where one sits forward
_TURNED = 0.08  # radians
_WORKED_AT = ("desk", "table")
_UNDER_WRIST = (0.02, 0.05)  # metres from the lowest wrist that works on a top down to it
_REACHED_OVER = 0.22  # metres of a top that are before the nearest wrist, at most
_ON_TOP = 0.8  # of the wrists' places, that have the top under them
_HEAD_FROM_END = (0.75, 1.1)  # metres between the middle of pelvis and chest and a bed's head
_SLEEPS_FROM_EDGE = 0.32
_GRID_BEYOND = 0.17  # metres by which a grid is larger than its piece on every side
_ABOUT_SQUARE = 0.3  # metres


def _stretch(seat: Seat, pelvis: float) -> float:
    """By how much a shape has to be stretched for its seat to carry a pelvis at this height."""
    return (pelvis - (seat.pelvis - seat.height)) / seat.height


def _pieces(bank: ShapeBank, pelvis: float) -> dict[str, dict[str, list[tuple[int, Seat]]]]:
    """The seats that can carry a pelvis at this height, by kind and piece."""
    found: dict[str, dict[str, list[tuple[int, Seat]]]] = {}
    for i, shape in enumerate(bank.shapes):
        for seat in shape.seats:
            if abs(_stretch(seat, pelvis) - 1.0) <= STRETCH:
                found.setdefault(shape.kind, {}).setdefault(shape.name, []).append((i, seat))
    return found


def _drawn(
    rng: np.random.Generator, pieces: dict[str, dict[str, list[tuple[int, Seat]]]]
) -> list[tuple[int, Seat]]:
    """The seats of one piece: its kind by ``_SHARES``, all pieces of a kind alike."""
    kinds = sorted(pieces)
    share = np.array([_SHARES[kind] for kind in kinds])
    kind = pieces[kinds[rng.choice(len(kinds), p=share / share.sum())]]
    return kind[sorted(kind)[rng.integers(len(kind))]]


def seat_shape_for(
    rng: np.random.Generator, bank: ShapeBank, rest: Rest, points: np.ndarray
) -> Furnishing | None:
    """A real seat under a resting pelvis, or None where no try leaves the body's path, ``points``
    (N, P, 3), free.

    A piece is drawn first, and then tried further and further forward on its seat: so what is easy
    to sit on, as a plain chair, does not take the place of what is not. Who may lean on a back
    mostly sits as near to it as the body allows.
    """
    pelvis = float(rest.position[2])
    pieces = _pieces(bank, pelvis)
    met = trunk_of(rest, points) is not None and rng.random() < MET
    if leans_back(rest, points):
        pieces = {kind: own for kind, own in pieces.items() if kind in _LEANT_ON}
    for _ in range(_PIECES if pieces else 0):
        seats = _drawn(rng, pieces)
        for place in range(_CLOSER if met else _PLACES):
            number, seat = seats[rng.integers(len(seats))]
            forward = forward_of(seat.yaw)
            right = np.array([forward[1], -forward[0]])
            room = max(0.0, seat.edge - _LEAST_BEFORE)
            ahead = min(
                _FARTHEST_BACK + _CLOSER_BY * place
                if met
                else rng.uniform(*_FROM_USUAL) + room * place / (_PLACES - 1),
                room,
            )
            spot = seat.position + ahead * forward + rng.uniform(-seat.aside, seat.aside) * right
            row = np.array([[number, *(-spot), 0.0, _stretch(seat, pelvis)]])
            yaw = rest.yaw - seat.yaw + rng.normal(0.0, _TURNED)
            found = Furnishing(shapes=row, bank=bank).moved(rest.position[:2], yaw)
            if clearance(found, points, GIVES, sunk(seat.pelvis - seat.height)) >= 0.0:
                return found

    return None


def bed_shape_for(
    rng: np.random.Generator,
    bank: ShapeBank,
    use: Interaction,
    points: np.ndarray,
    rests: list[Rest],
) -> Furnishing | None:
    """A real bed or sofa under a lying body; it carries the ``rests`` beside it too, as one sits
    down on its edge.
    """
    middle = use.points.mean(0)
    top = float(middle[2]) - LIES_OVER
    fits = [
        i
        for i, shape in enumerate(bank.shapes)
        if shape.kind in ("bed", "sofa")
        and shape.seats
        and abs(top / shape.seats[0].height - 1.0) <= STRETCH
    ]
    for _ in range(_PIECES * _PLACES if fits else 0):
        number = int(rng.choice(fits))
        shape = bank.shapes[number]
        seat = shape.seats[0]
        size = shape.spacing * (np.array(shape.values.shape) - 1)
        centre = shape.origin[:2] + size[:2] / 2
        # A bed's head is at its back, that of a sofa, or a bed as wide as one, at either side.
        long_axis = 1 if shape.kind == "bed" and size[1] > size[0] - _ABOUT_SQUARE else 0
        side = 1.0 if long_axis == 1 else rng.choice([-1.0, 1.0])
        half = size[:2] / 2 - _GRID_BEYOND
        spot = centre.copy()
        spot[long_axis] += side * (half[long_axis] - rng.uniform(*_HEAD_FROM_END))
        if long_axis == 1:
            room = max(0.0, half[0] - _SLEEPS_FROM_EDGE)
            spot[0] += rng.uniform(-room, room)
        else:
            spot[1] = seat.position[1] - rng.uniform(0.0, 0.12)

        head = 0.0 if long_axis == 1 else -side * np.pi / 2
        row = np.array([[number, *(-spot), 0.0, top / seat.height]])
        found = Furnishing(shapes=row, bank=bank).moved(
            middle[:2], use.yaw - head + rng.normal(0.0, 0.05)
        )
        under = use.points - np.array([0.0, 0.0, SEAT_TO_PELVIS])
        lies_on_it = bool((found.bank.distances(found.shapes, under) < 0.03).all())
        if (
            lies_on_it
            and clearance(found, points, GIVES, LIES_SUNK) >= 0.0
            and all(carries(found, rest) for rest in rests)
        ):
            return found

    return None


def desk_shape_for(
    rng: np.random.Generator, bank: ShapeBank, use: Interaction, points: np.ndarray
) -> Furnishing | None:
    """A real desk or table, 2 to 5 cm under the lowest wrist that works on it, or None."""
    origin = use.points[:, :2].mean(0)
    _, ahead = across(use, origin)
    away = forward_of(use.yaw)
    top = float(use.points[:, 2].min()) - rng.uniform(*_UNDER_WRIST)
    # As one may sit on a table's edge from any side, one may work there.
    pieces: dict[str, list[tuple[int, Seat]]] = {}
    for i, shape in enumerate(bank.shapes):
        for edge in shape.seats if shape.kind in _WORKED_AT else ():
            if abs(top / edge.height - 1.0) <= STRETCH:
                pieces.setdefault(shape.name, []).append((i, edge))

    for _ in range(_PIECES if pieces else 0):
        edges = pieces[sorted(pieces)[rng.integers(len(pieces))]]
        for place in range(_PLACES):
            number, edge = edges[rng.integers(len(edges))]
            out = forward_of(edge.yaw)
            aside = rng.uniform(-edge.aside, edge.aside)
            front = edge.position + edge.edge * out + aside * np.array([out[1], -out[0]])
            row = np.array([[number, *(-front), 0.0, top / edge.height]])
            near = float(ahead.min()) - rng.uniform(0.0, _REACHED_OVER) * (1.0 - place / _PLACES)
            found = Furnishing(shapes=row, bank=bank).moved(
                origin + near * away, use.yaw + np.pi - edge.yaw
            )
            under = use.points * (1.0, 1.0, 0.0) + (0.0, 0.0, top)
            on_it = (bank.distances(found.shapes, under) < 0.02).mean()
            if on_it > _ON_TOP and clearance(found, points, ON_DESK) >= 0.0:
                return found

    return None


def carries(found: Furnishing, rest: Rest) -> bool:
    """Whether furniture is the seat of this rest as well: one sits down on a bed's edge, a little
    higher than one lies.
    """
    under = (rest.position - np.array([0.0, 0.0, SEAT_TO_PELVIS]))[None]
    on_box = len(found.boxes) > 0 and float(nearest_box(found.boxes, under)[0]) < 0.1
    return on_box or (
        len(found.shapes) > 0 and float(found.bank.distances(found.shapes, under)[0]) < 0.1
    )


def stray_shape(
    rng: np.random.Generator, bank: ShapeBank, points: np.ndarray, path: RootPath
) -> Furnishing:
    """A real piece beside the path that nobody uses, or nothing where there is no room for it."""
    for _ in range(6):
        number = int(rng.integers(len(bank)))
        at = path.position[rng.integers(len(path)), :2]
        direction, distance = rng.uniform(0, 2 * np.pi), rng.uniform(0.3, 1.7)
        place = at + distance * np.array([np.cos(direction), np.sin(direction)])
        row = np.array(
            [[number, *place, rng.uniform(0, 2 * np.pi), rng.uniform(1 - STRETCH, 1 + STRETCH)]]
        )
        found = Furnishing(shapes=row, bank=bank)
        if clearance(found, points, -rng.uniform(-0.02, 0.03)) >= 0.0:
            return found

    return Furnishing(bank=bank)
