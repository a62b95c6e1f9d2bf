"""Tasks of the whole body: to walk, to sit down, to lie down, to stand up, to wait."""

from collections.abc import Callable, Sequence

import numpy as np

from ..core.errors import InputError
from ..core.progress import within
from ..core.root import forward_of
from .beds import Bed, bed_of
from .choosing import Chooser, Done, Job, Taken
from .places import Place, before_a_top, beside, known_seats, towards_top
from .room import Piece
from .seats import SeatPlace
from .tasks import LieOn, SitOn, StandUp, Wait, WalkAlong, WalkTo

__all__ = ["lie_on", "sit_on", "stand_up", "take_seat", "wait", "walk_along", "walk_to"]

_TRIED = 5  # places at one thing that are tried before another is
_BESIDE = (0.40, 0.60)  # metres before something that one walks to
_ROOM = 0.25  # metres around who stands
_BESIDES = (0.6, 1.2)  # metres from a place that is taken
_LIES = 0.8  # metres around who lies


def walk_to(chooser: Chooser, task: WalkTo) -> Job[Done]:
    """To a place, or before a thing."""
    person = chooser.person
    if not isinstance(task.where, str):
        return (yield from _walk_to_place(chooser, task, chooser.point(task.where)[:2]))

    def go_to(thing: Piece | np.ndarray) -> Job[Done]:
        name = thing.name if isinstance(thing, Piece) else str(task.where)
        spots = yield from beside.steps(thing, person.room.floor, _BESIDE)
        free = yield from chooser.free_spots(spots, _ROOM)
        if not free:
            raise InputError(f"there is no room to stand before '{name}'; make some there.")

        def stand(spot: Place) -> Job[Done]:
            yaw = chooser.faced(task.facing, spot.position)
            yield from chooser.stand_at(spot, spot.yaw if yaw is None else yaw, task.speed)
            return Done(person.frames, name)

        ordered = chooser.by_choice(free, lambda spot: spot.position, "nearest")
        return (yield from chooser.first(ordered[:_TRIED], stand))

    return (yield from chooser.first(chooser.things(task.where, task.choose), go_to))


def _walk_to_place(chooser: Chooser, task: WalkTo, goal: np.ndarray) -> Job[Done]:
    """To a place (2,) on the floor, or beside who stands there already."""

    def stand(spot: Place) -> Job[Done]:
        yaw = chooser.faced(task.facing, spot.position)
        yield from chooser.stand_at(spot, yaw, task.speed)
        return Done(chooser.person.frames)

    if not chooser.person.is_taken(goal):
        return (yield from stand(Place(goal, 0.0)))
    around = [
        Place(goal + radius * forward_of(angle), 0.0)
        for radius in _BESIDES
        for angle in np.arange(0.0, 2.0 * np.pi, np.pi / 4.0)
    ]
    free = yield from chooser.free_spots(around, _ROOM)
    return (yield from chooser.first(free, stand))


def walk_along(chooser: Chooser, task: WalkAlong) -> Job[Done]:
    """To a line and along it."""
    person = chooser.person
    if isinstance(task.line, str):
        line = person.room.line(task.line)
    else:
        line = np.array([chooser.point(point)[:2] for point in task.line])
    way = yield from person.way_along(line, task.speed)
    person.go(way)
    person.keep(person.place.position)
    return Done(person.frames - len(way.path))


def sit_on(chooser: Chooser, task: SitOn) -> Job[Done]:
    """On the first seat that is free and that one can come to."""
    near = chooser.near(task.near)

    def sit(piece: Piece) -> Job[Done]:
        middle = piece.box().mean(axis=0)[:2]
        yaw = chooser.faced(task.facing, middle)
        towards = chooser.where() if yaw is None else middle + 99.0 * forward_of(yaw)
        asked = task.on == piece.name
        seats = yield from within(_seats(chooser, piece, towards, near, yaw, asked), 0.0, 0.4)
        done = yield from within(_take(chooser, piece, seats, task.choose), 0.4, 1.0)
        chooser.person.here.rest(task.seconds)
        return done

    return (yield from chooser.first(chooser.pieces(task.on, task.choose, near), sit))


def take_seat(
    chooser: Chooser,
    piece: Piece,
    towards: np.ndarray,
    choose: str,
    near: np.ndarray | None = None,
    fits: Callable[[SeatPlace], bool] = lambda seat: True,
) -> Job[Done]:
    """Sit down on a place of a piece that is free and ``fits``; see ``places.seats_on``."""
    job = known_seats(chooser.person.room, piece, towards, near, chooser.person.size)
    seats = yield from within(job, 0.0, 0.4)
    return (yield from within(_take(chooser, piece, seats, choose, fits), 0.4, 1.0))


def _seats(
    chooser: Chooser,
    piece: Piece,
    towards: np.ndarray,
    near: np.ndarray | None,
    yaw: float | None,
    tables: bool,
) -> Job[list[SeatPlace]]:
    """The places on a piece; on what has no back, facing the table or bar that it stands at, where
    no ``yaw`` and no place are asked for.
    """
    room, size = chooser.person.room, chooser.person.size
    seats = yield from known_seats(room, piece, towards, near, size, tables)
    if yaw is None and near is None and not seats[0].back:
        top = yield from before_a_top(room, piece, seats[0])
        if top is not None:
            found = yield from known_seats(room, piece, top, near, size, tables)
            seats = towards_top(found, top)
    return seats


def _take(
    chooser: Chooser,
    piece: Piece,
    seats: Sequence[SeatPlace],
    choose: str,
    fits: Callable[[SeatPlace], bool] = lambda seat: True,
) -> Job[Done]:
    person = chooser.person
    free = [seat for seat in seats if fits(seat) and not person.is_taken(seat.position)]
    for seat in free:
        if person.sits_at(seat.position):
            return Done(person.frames, piece.name, piece.name)

    def sit(place: np.ndarray) -> Job[Done]:
        (seat,) = (each for each in free if each.position is place)
        way = yield from person.way_to_seat(piece, seat)
        person.sit(piece.name, seat, way)
        return Done(person.frames, piece.name, piece.name)

    ordered = chooser.by_choice([seat.position for seat in free], np.asarray, choose)
    return (yield from chooser.first(ordered, sit))


def lie_on(chooser: Chooser, task: LieOn) -> Job[Done]:
    """On the first bed that is free and that one can come to, from either side."""
    person = chooser.person

    def lie(piece: Piece) -> Job[Done]:
        beds = yield from bed_of.steps(piece, chooser.where(), person.room.floor, person.size)
        if any(person.is_taken(bed.position, _LIES) for bed in beds):
            raise Taken()

        def lie_in(bed: Bed) -> Job[Done]:
            if not person.sits_at(bed.seat.position):
                way = yield from person.way_to_seat(piece, bed.seat)
                person.sit(piece.name, bed.seat, way)
            person.lie_down(bed)
            there = person.frames
            person.lie(task.seconds)
            return Done(there, piece.name, piece.name)

        return (yield from chooser.first(beds, lie_in))

    return (yield from chooser.first(chooser.pieces(task.on, task.choose), lie))


def stand_up(chooser: Chooser, task: StandUp) -> Job[Done]:
    """From a seat or bed."""
    person = chooser.person
    if person.seat is None:
        raise InputError(
            "nobody sits or lies there; put 'sit_on' or 'lie_on' before it, or leave it out."
        )
    way = yield from person.way_up()
    person.go(way)
    person.keep(person.place.position)
    there = person.frames
    person.here.rest(task.seconds)
    return Done(there)


def wait(chooser: Chooser, task: Wait) -> Job[Done]:
    """As one is."""
    person = chooser.somewhere()
    yield 0.0
    there = person.frames
    if person.bed is not None:
        person.lie(task.seconds)
    else:
        person.here.rest(task.seconds)
    return Done(there, person.seat_name, person.seat_name)
