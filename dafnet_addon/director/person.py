"""Somebody on the way through his tasks: where he is, and how he gets from there to a place, a seat
or a bed.

Canonical metres, world.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.paths import Stop, facing, route
from ..core.progress import within
from ..core.root import RootPath, forward_of
from ..core.rotations import rotate, yaw_matrix
from ..core.series import smoothstep
from ..core.softness import LIES_LOWER, OVER_HARD
from ..core.solids import Box
from ..core.trails import trail
from .approach import WayIn, fits, pair, way_in
from .beds import Bed
from .others import APART, Occupied, Others
from .places import Place, seated_pelvis, standing_pelvis
from .plans import Hold
from .room import Piece, Room
from .seats import SeatPlace
from .track import LETS_GO, Track
from .walks import NoWay, unit_doubt, way_round

__all__ = ["SPEED", "Person", "Way"]

SPEED = 1.1
"""Metres a second, of walking where a task names none."""

_SAME_SEAT = 0.2  # metres
_THERE = 0.3  # metres within which one is there already
_STANDS_BEFORE = 0.6  # metres before a seat, where one stands who has got up
_PATIENCE = 30.0  # seconds that one waits for others
_LOOKS_AGAIN = 0.25  # seconds between two tries to go
_BRUSHES = 0.01  # metres by which two may come closer
_FAR_BEYOND = 10.0  # metres beyond start and goal in which a way is looked for in the end
_WIDER = (0.0, 0.1, 0.2)  # metres to each side that who stands is made wider: ways cut corners
_HALT = 0.4  # seconds on a bed's edge before one lies down
_LIES_DOWN = 3.5  # seconds


@dataclass(frozen=True)
class Way:
    """A way that is not gone yet: ``path`` from one frame after the start, to rest at ``goal``."""

    path: RootPath
    goal: Stop


class Person:
    """``size``: over the canonical body; ``begins``: second of the shot in which his first frame
    is; ``waits``: whether he waits for places that others leave soon. He is nowhere (``track``
    None) until his start or his first task says where.
    """

    def __init__(self, room: Room, fps: float, size: float, begins: float, others: Others) -> None:
        self.room, self.fps, self.size, self.begins = room, fps, size, begins
        self.others = others
        self.track: Track | None = None
        self.seat: SeatPlace | None = None
        self.seat_name = ""
        self.bed: Bed | None = None
        self.holds: list[Hold] = []
        self.waits = False

    @property
    def here(self) -> Track:
        """His track; he is somewhere."""
        assert self.track is not None
        return self.track

    @property
    def place(self) -> Place:
        return Place(self.here.position, self.here.yaw)

    @property
    def pelvis(self) -> float:
        """Its height over the world's zero, sitting or standing."""
        return standing_pelvis(self.room.floor) if self.seat is None else seated_pelvis(self.seat)

    @property
    def sits(self) -> bool:
        return self.seat is not None and self.bed is None

    @property
    def frames(self) -> int:
        return self.track.frames if self.track is not None else 0

    @property
    def now(self) -> float:
        """Second of the shot."""
        return self.begins + self.frames / self.fps

    def appear(self, position: Sequence[float] | np.ndarray, yaw: float) -> None:
        """Be somewhere from the first frame on."""
        x, y = position
        self.track = Track((float(x), float(y)), yaw, self.room.floor, self.fps)

    def leaves(self) -> Stop:
        """Where he gets up or sets out from."""
        if self.bed is not None:
            spot = self.bed.seat
            return Stop(pair(spot.position), spot.yaw, 0.0, seated=True)
        at = self.here.position
        return Stop(pair(at), self.here.yaw, 0.0, seated=self.seat is not None)

    def way(
        self, position: np.ndarray, yaw: float | None, speed: float = SPEED
    ) -> Generator[float, None, Way]:
        """The way to stand at ``position`` (2,), facing ``yaw`` or where one comes to. Raises
        InputError where there is none.
        """
        if self.track is None:
            return Way(RootPath(np.zeros((0, 3)), np.zeros(0)), Stop(pair(position), yaw or 0.0))
        left = yield from within(self._sides_of_own_seat(), 0.0, 0.3)
        here = replace(self.leaves(), before=left.before)
        goal = Stop(pair(position), here.yaw if yaw is None else yaw, 0.0)
        if not here.seated and np.linalg.norm(position - here.position) < _THERE:
            return Way(RootPath(np.zeros((0, 3)), np.zeros(0)), goal)
        made = self._routed(here, left.via, (), goal, yaw is None, speed)
        return (yield from within(made, 0.3, 1.0))

    def way_to_seat(self, piece: Piece, seat: SeatPlace) -> Generator[float, None, Way]:
        """The way to sit down on a seat of a piece, straight or, where a desk is before it, from a
        side. Raises InputError where there is none.
        """
        goal = Stop(pair(seat.position), seat.yaw, 0.0, seated=True)
        if self.track is None:
            yield from fits.steps(self.room, piece.name, piece.solids, seat)
            return Way(RootPath(np.zeros((0, 3)), np.zeros(0)), goal)
        left = yield from within(self._sides_of_own_seat(), 0.0, 0.2)
        standing = self._standing(seat.position)
        job = way_in.steps(self.room, piece.name, piece.solids, seat, standing)
        entry = yield from within(job, 0.2, 0.5)
        goal = replace(goal, before=entry.before)
        here = replace(self.leaves(), before=left.before)
        made = self._routed(here, left.via, entry.via, goal, False, SPEED)
        return (yield from within(made, 0.5, 1.0))

    def way_up(self) -> Generator[float, None, Way]:
        """The way to stand before the seat that he is on, or beside it where a desk is before
        it.
        """
        left = yield from self._sides_of_own_seat()
        here = replace(self.leaves(), before=left.before)
        by = left.via
        goal = by[-1] if by else here.position + _STANDS_BEFORE * forward_of(here.yaw)
        stop = Stop(pair(goal), here.yaw, 0.0)
        via = map(pair, by[:-1])
        path = route(here, *via, stop, fps=self.fps, floor=self.room.floor).path
        return Way(RootPath(path.position[1:], path.yaw[1:]), stop)

    def _sides_of_own_seat(self) -> Generator[float, None, WayIn]:
        """How he leaves the seat that he is on."""
        spot = self.bed.seat if self.bed is not None else self.seat
        if spot is None:
            return WayIn()
        own = self.room.pieces().get(self.seat_name)
        solids, standing = own.solids if own else (), self._standing(spot.position)
        found = yield from way_in.steps(self.room, self.seat_name, solids, spot, standing)
        return replace(found, via=found.via[::-1])

    def _routed(
        self,
        here: Stop,
        left: Sequence[np.ndarray],
        comes: Sequence[np.ndarray],
        goal: Stop,
        as_one_comes: bool,
        speed: float,
    ) -> Generator[float, None, Way]:
        out = left[-1] if len(left) else _before(here)
        back = comes[0] if len(comes) else _before(goal)
        standing = self._standing(np.array(goal.position))
        best, widest = None, -np.inf
        for k, wider in enumerate(_WIDER if standing else _WIDER[:1]):
            try:
                job = self._corners(out, back, [_widened(box, wider) for box in standing])
                corners = yield from within(job, 0.2 * k, 0.2 * k + 0.2)
            except NoWay:
                if best is not None:
                    break
                if not standing:
                    raise
                # Whoever stands in the way may be slipped by, or leave in time.
                corners = yield from within(self._corners(out, back, []), 0.6, 0.9)

            way = self._along(here, [*left, *corners, *comes], goal, as_one_comes, speed)
            gap = _gap(way, standing)
            if gap > widest:
                best, widest = way, gap
            if gap > APART:
                break

        assert best is not None
        return best

    def _along(
        self, here: Stop, points: Sequence[Any], goal: Stop, as_one_comes: bool, speed: float
    ) -> Way:
        """The way from one stop over ``points`` (2,) to another."""
        via = _apart(here, list(map(pair, points)), goal)
        if as_one_comes:
            last = np.array(via[-1] if via else here.position)
            goal = Stop(goal.position, facing(np.array(goal.position) - last), 0.0)
        path = route(here, *via, goal, speed=speed, fps=self.fps, floor=self.room.floor).path
        return Way(RootPath(path.position[1:], path.yaw[1:]), goal)

    def _standing(self, goal: np.ndarray) -> list[Box]:
        """Who stands or sits on the way to a ``goal`` (2,)."""
        places = [np.array(self.leaves().position), goal]
        return self.others.standing(round(self.now * self.fps), places)

    def _corners(
        self, start: np.ndarray, goal: np.ndarray, standing: Sequence[Box]
    ) -> Generator[float, None, list[tuple[float, float]]]:
        """Corners of the way from one point (2,) to another, round the furniture and others."""
        stands = [*(yield from self.room.footprints()).values(), *map(_footprint, standing)]
        points = np.concatenate([np.zeros((0, 2)), *stands])
        over_floor = np.column_stack([points, np.ones(len(points))])
        try:
            return (yield from way_round.steps(over_floor, start, goal, self.size))
        except NoWay:
            yield 0.5
        try:  # out of a door that is farther away than both
            job = way_round.steps(over_floor, start, goal, self.size, _FAR_BEYOND)
            return (yield from job)
        except NoWay as error:
            doubt = unit_doubt(self.room.solids, [start, goal], self.room.floor, self.size)
            if doubt:
                raise InputError(doubt) from error
            raise

    def way_along(self, line: np.ndarray, speed: float) -> Generator[float, None, Way]:
        """The way to a line (N, 2) and along it."""
        start, points = None, np.asarray(line, float)
        if self.track is not None:
            start = self.leaves()
            out, begin = _before(start), points[0]
            if np.linalg.norm(out - begin) > _THERE:
                corners = yield from self._corners(out, begin, [])
                points = np.concatenate([np.reshape(corners, (-1, 2)), points])
        made = trail(points, start, speed=speed, fps=self.fps, floor=self.room.floor, seconds=0.0)
        path = made.path
        end = made.rests[-1].place
        if self.track is None:
            self.appear(path.position[0, :2], float(path.yaw[0]))
        return Way(RootPath(path.position[1:], path.yaw[1:]), end)

    def go(self, way: Way) -> None:
        """Go a way, as soon as nobody is in it; raises InputError where somebody stays there."""
        if self.track is None:
            self.appear(way.goal.position, way.goal.yaw)
            return
        later = self.here.frames + round(self._seconds_before_leaving() * self.fps)
        wait = self._wait_for(way, later)
        if self.bed is not None:
            self._get_up_from(self.bed)
        self.here.let_go()
        self._let_place_go()
        self.here.rest(wait)
        self.here.follow(way.path.position, way.path.yaw)
        turn = np.angle(np.exp(1j * (way.goal.yaw - self.here.yaw)))
        if abs(turn) > np.radians(5.0):
            self.here.turn(way.goal.yaw)
        self.seat, self.bed, self.seat_name = None, None, ""

    def sit(self, name: str, seat: SeatPlace, way: Way) -> None:
        """Go a way to a seat, and sit on it."""
        self.go(way)
        self.seat, self.seat_name = seat, name
        self.keep(seat.position)

    def sits_at(self, place: np.ndarray) -> bool:
        """Whether he sits at a place (2,) already."""
        return (
            self.seat is not None
            and self.bed is None
            and float(np.linalg.norm(self.seat.position - place)) < _SAME_SEAT
        )

    def keep(self, place: np.ndarray, radius: float = APART) -> None:
        """Keep a place from now on."""
        self.holds.append(Hold(np.array(place) * self.size, radius * self.size, self.now, np.inf))

    def is_taken(self, place: np.ndarray, radius: float = APART) -> bool:
        """Whether others keep a place (2,); who waits takes one that they leave soon."""
        until = self.now + (_PATIENCE if self.waits else 0.0)
        return self.others.keep(place, radius, self.now, until)

    def lie_down(self, bed: Bed) -> None:
        """From the edge of a bed, where he sits."""
        assert self.seat is not None
        self.here.rest(_HALT)
        positions, yaws, targets = self._swing(bed)
        self.here.follow(positions, yaws)
        self.here.hold(targets, 0.4)
        self.bed = bed
        self.keep(bed.position, 0.9)

    def lie(self, seconds: float) -> None:
        """Stay so."""
        frames = max(1, round(seconds * self.fps))
        places = {name: self.here.last_place(name) for name in ("head", "hand_left", "hand_right")}
        self.here.rest(frames / self.fps)
        self.here.hold(
            {name: np.tile(at, (frames, 1)) for name, at in places.items() if at is not None}, 0.0
        )

    def _get_up_from(self, bed: Bed) -> None:
        positions, yaws, targets = self._swing(bed)
        self.here.follow(positions[::-1], yaws[::-1])
        self.here.hold({name: values[::-1] for name, values in targets.items()}, 0.0)
        self.here.let_go()
        self.bed = None

    def _seconds_before_leaving(self) -> float:
        if self.bed is not None:
            return _LIES_DOWN + LETS_GO
        return self.here.letting_go()

    def _swing(self, bed: Bed) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
        """From sitting on a bed's edge to lying: root (N, 2), (N,), head and hands (N, 3).

        One leans back before one turns: the legs then come up first, else they would swing through
        the bed.
        """
        after = np.arange(1, round(_LIES_DOWN * self.fps) + 1) / self.fps

        def eased(begin: float, seconds: float) -> np.ndarray:
            return smoothstep((after - begin) / seconds)

        turned = eased(0.7, 1.9)
        turn = float(np.angle(np.exp(1j * (bed.yaw - bed.seat.yaw))))
        yaws = bed.seat.yaw + turn * turned
        positions = bed.seat.position + turned[:, None] * (bed.position - bed.seat.position)
        back = 0.6 * eased(0.15, 1.65) + 0.4 * eased(1.4, 2.0)
        angle = np.radians(88.0) * back
        over = bed.top + OVER_HARD - bed.softness - LIES_LOWER * back
        # A skull does not sink in as a pelvis does: its joint comes to lie 9 cm over the pillow.
        pillow = bed.pillow - bed.top + bed.softness - 0.05
        head = np.stack(
            [
                np.zeros(len(after)),
                0.06 * (1.0 - back) - 0.60 * np.sin(angle),
                over + 0.60 * np.cos(angle) + pillow * back,
            ],
            axis=1,
        )
        right = np.stack(
            [0.20 + 0.10 * back, 0.10 - 0.10 * back, bed.top + 0.20 - 0.11 * back], axis=1
        )
        root = np.column_stack([positions, np.zeros(len(after))])
        local = {"head": head, "hand_right": right, "hand_left": right * (-1.0, 1.0, 1.0)}
        turns = yaw_matrix(yaws)
        return positions, yaws, {name: rotate(turns, at) + root for name, at in local.items()}

    def _let_place_go(self) -> None:
        """The places that he kept are free from now on."""
        self.holds = [
            hold if np.isfinite(hold.stop) else Hold(hold.place, hold.radius, hold.start, self.now)
            for hold in self.holds
        ]

    def _wait_for(self, way: Way, frame: int) -> float:
        """Seconds to wait before a way is gone, so that nobody is met on it nor comes to where it
        ends.
        """
        last = self.others.last_frame()
        first = round(self.begins * self.fps) + frame
        here, path = self.here.position, way.path.position[:, :2]
        stay = max(0, last - first)
        end = np.array(way.goal.position)
        whole = np.concatenate([path, np.tile(end, (stay + 1, 1))])
        for delay in np.arange(0.0, _PATIENCE, _LOOKS_AGAIN):
            waits = round(delay * self.fps)
            gone = np.concatenate([np.tile(here, (waits, 1)), whole])
            gap = self.others.gap(gone, first)
            # Who already stands beside him does not keep him from leaving.
            leaving = np.linalg.norm(gone - here, axis=1) < APART
            wanted = np.where(leaving, min(APART, float(gap[0])), APART)
            if (gap >= wanted - _BRUSHES).all():
                return float(delay)

        raise Occupied(
            "Somebody else stays in the way, or comes there later; begin at another time, or go "
            "elsewhere."
        )


def _widened(box: Box, by: float) -> Box:
    return replace(box, half_size=box.half_size + by * np.array([1.0, 1.0, 0.0]))


def _gap(way: Way, standing: Sequence[Box]) -> float:
    """Metres between a way and the middles of those who stand there."""
    path = way.path.position[:, :2]
    gaps = [np.linalg.norm(path - box.center[:2], axis=1).min(initial=np.inf) for box in standing]
    return float(min(gaps, default=np.inf))


def _footprint(box: Box) -> np.ndarray:
    """Points (N, 2) all over an upright box, seen from above."""
    axes = [np.arange(-half, half + 0.04, 0.04) for half in box.half_size[:2]]
    return np.asarray(box.center[:2] + np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2))


def _before(stop: Stop) -> np.ndarray:
    """Where (2,) one is on the way to or from a stop: before a seat, else at the stop itself."""
    return np.array(stop.position) + (stop.before if stop.seated else 0.0) * forward_of(stop.yaw)


def _apart(here: Stop, via: Sequence[tuple[float, float]], goal: Stop) -> list[tuple[float, float]]:
    """Points of a way that are not too close to one another or to its ends to bend there."""
    kept: list[np.ndarray] = []
    ends = [np.array(here.position), _before(here), np.array(goal.position), _before(goal)]
    for each in map(np.array, via):
        if all(np.linalg.norm(each - other) > 0.12 for other in (*kept[-1:], *ends)):
            kept.append(each)
    return [pair(each) for each in kept]
