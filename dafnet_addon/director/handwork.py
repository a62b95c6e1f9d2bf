"""Tasks of hands and head: to work at a top, to write on a board, to reach, to look."""

import numpy as np

from ..core.errors import InputError
from ..core.paths import facing
from ..core.progress import within
from ..core.root import forward_of
from ..core.rotations import normalised
from . import movements
from .boards import before_boards
from .choosing import Chooser, Done, Job, Taken, middle_of
from .moves import take_seat
from .person import Person
from .places import (
    REACH,
    Place,
    Surface,
    beside,
    seated_pelvis,
    shoulder,
    standing_pelvis,
)
from .room import Piece
from .seats import NoSeat, SeatPlace
from .tasks import LookAt, Reach, WorkAt, WriteOn
from .tops import Top, beside_top, known_top, surface_before

__all__ = ["look_at", "reach", "work_at", "write_on"]

_SIDES = {"hand_left": -1.0, "hand_right": 1.0}
_TRIED = 5  # places at one thing that are tried before another is
_AT_A_WALL = 0.15  # metres around who stands close to what he uses
_STANDING_TOP = 0.84  # metres over the floor, of a top that one works at standing
_LOW_TOP = 0.68  # metres over the floor, of a top on which one handles things standing
_BY = 1.0  # metres from the place that is named within which a seat is there
_AT_DESK = 0.9  # metres between a desk and the seats that stand at it
_SEAT_SIZES = (0.2, 3.0)  # metres across, of what stands at a desk to sit on
_RINGS = ((0.34, 0.46), (0.46, 0.58), (0.58, 0.72))  # metres from what is reached
_SMALL = 0.3  # metres across, of a thing that is taken in its middle
_CHEST = 1.15  # metres over the floor, where a large thing is touched
_TURNS_FROM = np.radians(60.0)  # beyond which who stands turns round to look
_EYES = 0.62  # metres of eyes over the pelvis
_ASTRAY = np.radians(10.0)  # of a look beyond what a neck does, which is told


def work_at(chooser: Chooser, task: WorkAt) -> Job[Done]:
    """At the first top that is free: from where one sits, from a seat that stands at it, or
    standing.
    """
    person, near = chooser.person, chooser.near(task.near)

    def work(piece: Piece) -> Job[Done]:
        top = yield from within(known_top(person.room, piece), 0.0, 0.2)
        surface = _in_reach(top, person.place, person.pelvis) if person.sits else None
        if surface is None:
            surface = yield from within(_come_to(chooser, piece, top, task, near), 0.2, 1.0)
        there = _lead(person, _hand_paths(chooser.rng, person, surface, task))
        return Done(there, piece.name, person.seat_name)

    return (yield from chooser.first(chooser.pieces(task.at, task.choose, near), work))


def _in_reach(top: Top, place: Place, pelvis: float) -> Surface | None:
    """The part of a top that somebody at a place works on; None where he reaches none."""
    surface = surface_before(top, place)
    if surface is None:
        return None
    wrists = np.array([[side * 0.11, 0.07, 0.06] for side in _SIDES.values()])
    for (name, _), wrist in zip(_SIDES.items(), _over(surface, place, wrists), strict=True):
        if _too_far(name, wrist, place, pelvis) > 0.0:
            return None
    return surface


def _come_to(
    chooser: Chooser, piece: Piece, top: Top, task: WorkAt, near: np.ndarray | None
) -> Job[Surface]:
    """Sit down at a top, or stand at it; what one then works on."""
    person = chooser.person
    floor = person.room.floor
    refused: InputError | None = None

    def fits(seat: SeatPlace) -> bool:
        return _in_reach(top, Place(seat.position, seat.yaw), seated_pelvis(seat)) is not None

    middle = middle_of(piece)[:2]
    for seat in chooser.by_choice(_seats_at(person, piece, near), middle_of, "nearest", near):
        try:
            yield from take_seat(chooser, seat, middle, task.choose, fits=fits)
        except (Taken, NoSeat):  # somebody's, or a plant beside the desk
            continue
        except InputError as error:
            refused = refused or error
            continue
        return _reached(top, person)

    if refused is not None:
        raise refused

    height = top.height - floor
    if height < (_LOW_TOP if task.how == "handling" else _STANDING_TOP):
        raise InputError(
            f"no free seat stands at '{piece.name}', which is too low for {task.how} standing; put "
            "a chair there."
        )

    spots = yield from chooser.free_spots(beside_top(top), _AT_A_WALL, besides=piece)
    if not spots:
        raise InputError(f"there is no room to stand at '{piece.name}'; make some there.")

    def stand(spot: Place) -> Job[Done]:
        if _in_reach(top, spot, standing_pelvis(floor)) is None:
            raise InputError(f"'{piece.name}' cannot be worked at standing; choose another top.")
        yield from chooser.stand_at(spot, spot.yaw)
        return Done(person.frames)

    choose = task.choose if near is None else "nearest"
    ordered = chooser.by_choice(spots, lambda spot: spot.position, choose, near)
    yield from chooser.first(ordered[:_TRIED], stand)
    return _reached(top, person)


def _reached(top: Top, person: Person) -> Surface:
    """What is worked on from where one has come to work at it."""
    surface = _in_reach(top, person.place, person.pelvis)
    assert surface is not None
    return surface


def _seats_at(person: Person, desk: Piece, near: np.ndarray | None) -> list[Piece]:
    """Furniture beside a desk that may be sat on, where a place (2,) to work by is named only what
    stands there.
    """
    low, high = desk.box()
    found = []
    for piece in person.room.pieces().values():
        box = piece.box()
        gap = np.maximum(np.maximum(box[0] - high, low - box[1]), 0.0)[:2]
        across = float((box[1] - box[0])[:2].max())
        is_near = float(np.linalg.norm(gap)) < _AT_DESK
        if near is not None and np.linalg.norm(box.mean(axis=0)[:2] - near) > _BY:
            continue
        if piece.name != desk.name and is_near and _SEAT_SIZES[0] < across < _SEAT_SIZES[1]:
            found.append(piece)
    return found


def _hand_paths(
    rng: np.random.Generator, person: Person, surface: Surface, task: WorkAt
) -> dict[str, np.ndarray]:
    """Wrists (N, 3) of who works, world."""
    seconds, fps = task.seconds, person.fps
    if task.how == "typing":
        local = movements.typing(rng, seconds, fps)
    elif task.how == "writing":
        local = movements.writing(seconds, fps, task.hand)
    else:
        local = movements.handling(rng, seconds, fps, surface.high)
    return {name: _over(surface, person.place, path) for name, path in local.items()}


def write_on(chooser: Chooser, task: WriteOn) -> Job[Done]:
    """On the first board or wall before which one can stand."""
    person, near = chooser.person, chooser.near(task.near)
    name, side = f"hand_{task.hand}", _SIDES[f"hand_{task.hand}"]

    def write(piece: Piece) -> Job[Done]:
        faces = yield from before_boards.steps(piece, person.room.floor, near)
        surfaces = {id(place): surface for place, surface in faces}
        spots = yield from chooser.free_spots(
            [place for place, _ in faces], _AT_A_WALL, besides=piece
        )
        if not spots:
            raise InputError(f"there is no room to stand before '{piece.name}'; make some there.")

        def stand(spot: Place) -> Job[Done]:
            yield from chooser.stand_at(spot, spot.yaw)
            surface = surfaces[id(spot)]
            local = movements.strokes(task.seconds, person.fps, surface.low, surface.high)
            local[:, 0] = side * local[:, 0] if side > 0 else local[:, 0] - 0.10
            there = _lead(person, {name: _over(surface, person.place, local)})
            return Done(there, piece.name)

        choose = task.choose if near is None else "nearest"
        ordered = chooser.by_choice(spots, lambda spot: spot.position, choose, near)
        return (yield from chooser.first(ordered[:_TRIED], stand))

    return (yield from chooser.first(chooser.pieces(task.on, task.choose, near), write))


def reach(chooser: Chooser, task: Reach) -> Job[Done]:
    """From where one is, or from the nearest place where one can stand to reach it."""
    person = chooser.person

    def reach_for(thing: Piece | np.ndarray) -> Job[Done]:
        named = f"'{thing.name}'" if isinstance(thing, Piece) else _called(task.what)
        over = float(middle_of(thing)[2]) - person.room.floor
        lowest = float(thing.box()[0, 2]) - person.room.floor if isinstance(thing, Piece) else over
        if lowest > reach_height():
            raise InputError(
                f"{named} is {lowest:.1f} m over the floor, higher than one reaches; hang it lower."
            )
        if person.track is not None and person.bed is None:
            there = yield from _try_here(chooser, thing, task)
            if there is not None:
                return Done(there, _name(thing), person.seat_name)
        return (yield from _walk_up(chooser, thing, named, task))

    return (yield from chooser.first(chooser.things(task.what, task.choose), reach_for))


def reach_height() -> float:
    """Metres over the floor up to which a hand comes."""
    up = shoulder(Place(np.zeros(2), 0.0), standing_pelvis(0.0), 1.0)[2]
    return float(up) + REACH - 0.1


def _walk_up(chooser: Chooser, thing: Piece | np.ndarray, named: str, task: Reach) -> Job[Done]:
    """Walk to where a thing is in reach, and reach it."""
    person = chooser.person
    floor = person.room.floor
    besides = thing if isinstance(thing, Piece) else None
    pelvis = standing_pelvis(floor)
    for ring in _RINGS:
        around = yield from beside.steps(thing, floor, ring)
        spots = yield from chooser.free_spots(around, _AT_A_WALL, besides=besides)
        able = [
            spot
            for spot in spots
            if any(
                _too_far(name, at, spot, pelvis) < 0.0
                for name, at in _grips(thing, spot, pelvis, floor, task).items()
            )
        ]
        ordered = chooser.by_choice(able, lambda spot: spot.position, "nearest")
        if not ordered:
            continue

        def stand(spot: Place) -> Job[Done]:
            yield from chooser.stand_at(spot, spot.yaw)
            there = yield from _try_here(chooser, thing, task)
            return Done(person.frames if there is None else there, _name(thing))

        return (yield from chooser.first(ordered[:_TRIED], stand))

    raise InputError(
        f"{named} is out of reach from wherever one can stand; bring it nearer to where there is "
        "room, between 0.6 and 1.9 m over the floor."
    )


def _try_here(chooser: Chooser, thing: Piece | np.ndarray, task: Reach) -> Job[int | None]:
    """Reach a thing from where one is; the frame from which on it is held, None where it is too far
    away.
    """
    yield 0.5
    person = chooser.person
    place, pelvis = person.place, person.pelvis
    grips = _grips(thing, place, pelvis, person.room.floor, task)
    misses = {name: _too_far(name, at, place, pelvis) for name, at in grips.items()}
    name = min(misses, key=lambda each: misses[each])
    ahead = forward_of(place.yaw) @ normalised(grips[name][:2] - place.position)
    if misses[name] > 0.0 or ahead < np.cos(_TURNS_FROM):
        return None
    frames = max(1, round(task.seconds * person.fps))
    return _lead(person, {name: np.tile(grips[name], (frames, 1))})


def _grips(
    thing: Piece | np.ndarray, place: Place, pelvis: float, floor: float, task: Reach
) -> dict[str, np.ndarray]:
    """Where (3,) each hand's wrist is when the palm is at a thing, for who is at a place."""
    hands = _SIDES if task.hand is None else [f"hand_{task.hand}"]
    found = {}
    for name in hands:
        from_ = shoulder(place, pelvis, _SIDES[name])
        goal = _touched(thing, from_, floor)
        found[name] = goal - movements.HAND * normalised(goal - from_)
    return found


def _touched(thing: Piece | np.ndarray, from_: np.ndarray, floor: float) -> np.ndarray:
    """The point (3,) of a thing where a hand touches it: its middle where it is small, else where
    its box is nearest at a comfortable height.
    """
    if not isinstance(thing, Piece):
        return thing
    low, high = thing.box()
    if (high - low).max() < _SMALL:
        return np.asarray(0.5 * (low + high))
    return np.clip([*from_[:2], floor + _CHEST], low, high)


def _name(thing: Piece | np.ndarray) -> str:
    return thing.name if isinstance(thing, Piece) else ""


def _called(what: object) -> str:
    return f"'{what}'" if isinstance(what, str) else "the place"


def look_at(chooser: Chooser, task: LookAt) -> Job[Done]:
    """Turn round to it where one stands, then the head, as far as a neck does."""
    person = chooser.awake()
    thing = chooser.things(task.what, task.choose)[0]
    yield 0.5
    eyes = np.array([*person.place.position, person.pelvis + _EYES])
    away = middle_of(thing) - eyes
    if isinstance(thing, Piece):
        low, high = thing.box()
        away[2] = np.clip(eyes[2], low[2], high[2]) - eyes[2]
    aside = np.angle(np.exp(1j * (facing(away[:2]) - person.here.yaw)))
    if person.seat is None and abs(aside) > _TURNS_FROM:
        person.here.let_go()
        person.here.turn(facing(away[:2]))
    direction, astray = movements.bounded_look(away, person.here.yaw)
    if astray > _ASTRAY:
        chooser.warnings.append(
            f"{_called(task.what)} lies {np.degrees(astray):.0f}° farther round than a head turns; "
            "it is looked towards."
        )
    last = person.here.last_place("look")
    from_ = np.array([*forward_of(person.here.yaw), 0.0]) if last is None else last
    lead = movements.look_seconds(float(np.arccos(np.clip(from_ @ direction, -1.0, 1.0))))
    frames = max(1, round(task.seconds * person.fps))
    there = person.frames + round(lead * person.fps)
    person.here.lead({"look": lead}, {"look": np.tile(direction, (frames, 1))})
    return Done(there, _name(thing), person.seat_name)


def _lead(person: Person, paths: dict[str, np.ndarray]) -> int:
    """Lead hands to and along places (N, 3); the frame from which on they are there."""
    seconds = {}
    for name, path in paths.items():
        last = person.here.last_place(name)
        here = _hanging(person, name) if last is None else last
        seconds[name] = movements.reach_seconds(float(np.linalg.norm(path[0] - here)))
    there = person.frames + round(max(seconds.values()) * person.fps)
    person.here.lead(seconds, paths)
    return there


def _hanging(person: Person, name: str) -> np.ndarray:
    """Where (3,) a wrist is about, of which nothing is asked."""
    ahead, up = (0.05, -0.10) if person.seat is None else (0.28, 0.05)
    at = forward_of(person.here.yaw)
    aside = 0.2 * _SIDES[name] * np.array([at[1], -at[0]])
    return np.array([*(person.place.position + aside + ahead * at), person.pelvis + up])


def _over(surface: Surface, place: Place, local: np.ndarray) -> np.ndarray:
    """Points (N, 3) that lie to the right of, beyond and above a surface's origin, world."""
    ahead = forward_of(place.yaw)
    across = np.array([ahead[1], -ahead[0]])
    at = surface.origin[:2] + local[:, :1] * across + local[:, 1:2] * ahead
    return np.column_stack([at, local[:, 2] + surface.origin[2]])


def _too_far(name: str, wrist: np.ndarray, place: Place, pelvis: float) -> float:
    """Metres by which a wrist (3,) is too far from the shoulder of who is at a place."""
    return float(np.linalg.norm(wrist - shoulder(place, pelvis, _SIDES[name]))) - REACH
