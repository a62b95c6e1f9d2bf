"""Fits real pieces of furniture to captured motion: under a pelvis that rests, under a body that
lies, and beside its way.

A piece is taken at the height at which it carries the pelvis where the motion has it
(``shapes.PELVIS_OVER``): how far one sinks in belongs to the piece and is never drawn anew. It is
turned and shifted until the body's swept volume leaves it free.
"""

import numpy as np

from ..core.root import RootPath
from ..core.skeleton import SEAT_TO_PELVIS
from .flesh import Furnishing, clearance, nearest_box, pressed
from .rests import Rest
from .shapes import STRETCH, Seat, ShapeBank
from .uses import Use

__all__ = ["LIES_OVER", "bed_shape_for", "carries", "seat_shape_for", "stray_shape"]

LIES_OVER = 0.01
"""Metres by which the pelvis joint of one that lies is over the undeformed surface of a bed or
sofa.
"""

_SHARES = {
    "chair": 0.34,
    "armchair": 0.17,
    "sofa": 0.17,
    "stool": 0.10,
    "bench": 0.08,
    "toilet": 0.03,
    "bed": 0.05,
    "table": 0.06,
}
"""How often each kind is sat on, among those that can be as high as the pelvis asks."""
_TRIES = 10
_FORWARD = 0.14  # metres by which one sits nearer the front edge at the last try than at the first
_TURNED = 0.08  # radians
_GIVES = pressed(
    0.03, hip=0.08, thigh=0.08, trunk=0.05, shoulder=0.05, elbow=0.045, wrist=0.045, hand=0.08
)
_SINKS = pressed(0.3, hip=1.0, thigh=1.0)
_GIVES_LYING = pressed(
    0.10, hip=0.2, thigh=0.2, trunk=0.2, head=0.2, shoulder=0.2, elbow=0.2, wrist=0.2, hand=0.2
)
_HEAD_FROM_END = (0.75, 1.1)  # metres between the middle of pelvis and chest and a bed's head
_SLEEPS_FROM_EDGE = 0.32
_GRID_BEYOND = 0.17  # metres by which a grid is larger than its piece on every side
_ABOUT_SQUARE = 0.3  # metres


def _stretch(seat: Seat, pelvis: float) -> float:
    """By how much a shape has to be stretched for its seat to carry a pelvis at this height."""
    return (pelvis - (seat.pelvis - seat.height)) / seat.height


def _candidates(bank: ShapeBank, pelvis: float) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the shapes that can carry a pelvis at this height, and how likely each is; of one
    piece they share.
    """
    fits = [
        i
        for i, shape in enumerate(bank.shapes)
        if shape.seat is not None and abs(_stretch(shape.seat, pelvis) - 1.0) <= STRETCH
    ]
    pieces: dict[str, dict[str, int]] = {}
    for i in fits:
        kind = pieces.setdefault(bank.shapes[i].kind, {})
        kind[bank.shapes[i].name] = kind.get(bank.shapes[i].name, 0) + 1
    likely = [
        _SHARES[bank.shapes[i].kind]
        / len(pieces[bank.shapes[i].kind])
        / pieces[bank.shapes[i].kind][bank.shapes[i].name]
        for i in fits
    ]
    return np.array(fits, int), np.array(likely)


def seat_shape_for(
    rng: np.random.Generator, bank: ShapeBank, rest: Rest, points: np.ndarray
) -> Furnishing | None:
    """A real seat under a resting pelvis, or None where no try leaves the body's path, ``points``
    (N, P, 3), free.
    """
    pelvis = float(rest.position[2])
    fits, likely = _candidates(bank, pelvis)
    if not len(fits):
        return None
    for attempt in range(_TRIES):
        number = int(rng.choice(fits, p=likely / likely.sum()))
        seat = bank.shapes[number].seat
        assert seat is not None
        forward = np.array([-np.sin(seat.yaw), np.cos(seat.yaw)])
        right = np.array([forward[1], -forward[0]])
        ahead = rng.normal(0.0, 0.02) + _FORWARD * attempt / _TRIES
        spot = seat.position + ahead * forward + rng.uniform(-seat.aside, seat.aside) * right
        row = np.array([[number, *(-spot), 0.0, _stretch(seat, pelvis)]])
        yaw = rest.yaw - seat.yaw + rng.normal(0.0, _TURNED)
        found = Furnishing(shapes=row, bank=bank).moved(rest.position[:2], yaw)
        sunk = max(0.0, SEAT_TO_PELVIS - (seat.pelvis - seat.height))
        if clearance(found, points, _GIVES + sunk * _SINKS) >= 0.0:
            return found
    return None


def bed_shape_for(
    rng: np.random.Generator, bank: ShapeBank, use: Use, points: np.ndarray, rests: list[Rest]
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
        and shape.seat is not None
        and abs(top / shape.seat.height - 1.0) <= STRETCH
    ]
    for _ in range(_TRIES if fits else 0):
        number = int(rng.choice(fits))
        shape = bank.shapes[number]
        assert shape.seat is not None
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
            spot[1] = shape.seat.position[1] - rng.uniform(0.0, 0.12)
        head = 0.0 if long_axis == 1 else -side * np.pi / 2
        row = np.array([[number, *(-spot), 0.0, top / shape.seat.height]])
        found = Furnishing(shapes=row, bank=bank).moved(
            middle[:2], use.yaw - head + rng.normal(0.0, 0.05)
        )
        under = use.points - np.array([0.0, 0.0, SEAT_TO_PELVIS])
        lies_on_it = bool((found.bank.distances(found.shapes, under) < 0.03).all())
        if (
            lies_on_it
            and clearance(found, points, _GIVES_LYING) >= 0.0
            and all(carries(found, rest) for rest in rests)
        ):
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
