"""How a body follows what is dragged: a hand on a mouse jumps and stops, people do not.

A root is followed as a person would go after it, from what is known so far alone: critically
damped, so never past it, no faster than people walk and turn, looking where one goes while it is
far, and as it is turned once it is near. Under way one is ``LAG`` behind a root that is walked
with. A seat is come to from in front, turned round, and left straight ahead. Metres of the
canonical body, 30 frames a second.
"""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .paths import AFTER_SEAT, BEFORE_SEAT, GETS_UP, SEATED_WAY, SITS_DOWN, pace_at_seat
from .root import forward_of, yaw_of
from .series import MODEL_FPS, smoothstep

__all__ = ["LAG", "CRUISE", "PointFollower", "RootFollower", "Seat", "Way"]

LAG = 1 / 3
"""Seconds by which one is behind a root that is dragged at a walker's speed."""
CRUISE = 1.4
"""Metres a second that one walks at most."""

_RESPONSE = 4.0 / LAG  # a second; how soon a speed is taken up, four times the gain: critically
_STARTS, _HALTS = 2.0, 1.2  # metres a second squared, at most
_STEPS = 0.45  # metres a second of steps aside and back, while one keeps looking ahead
_TURNING = 0.12  # metres a second of who still turns to where he will go
_NEAR, _FAR = 0.4, 0.9  # metres still to go, up to which one steps, and from which on one walks
_COMING = 0.5  # seconds, of whose way at the present speed is counted with what is to go
_RECENT = 2.0  # seconds, in which a root that is dragged on and on is walked after
_TURN_LAG = 0.3  # seconds
_TURN = np.radians(150.0)  # a second, at most
_WHIRLS = np.radians(600.0)  # a second squared, at most
_CLIMB = 4.0  # a second; how soon another floor's height is taken up

_CATCHES = 0.30  # metres around a seat, in which a root is meant to be on it
_LETS_GO = 0.38  # metres from it, from which on it is not
_ALIGNED = 0.16  # metres beside the way to a seat
_BEFORE = (0.3, BEFORE_SEAT + 0.15)  # metres before a seat, between which one begins to sit down
_FACES = np.radians(35.0)  # from the way that one sits
_TURNS_AWAY = 0.20  # metres before a seat, where the heading lets go
_CARROT = 0.7  # metres by which what is led along a way is ahead of the body
_SPACED = 0.05  # metres between two points of a way
_AROUND = 0.75  # metres beside a seat, where who comes from behind it passes


class Seat(NamedTuple):
    """Where one may sit: the pelvis at ``position`` (2,), facing ``yaw``; ``aside``: metres to each
    side within which one may sit as well.
    """

    position: np.ndarray
    yaw: float
    aside: float = 0.0


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _limited(vector: np.ndarray, length: float) -> np.ndarray:
    size = float(np.linalg.norm(vector))
    return vector * (length / size) if size > length else vector


class PointFollower:
    """Follows a point that is dragged, critically damped, ``lag`` seconds behind it and no faster
    than ``speed``, metres a second.
    """

    def __init__(self, place: np.ndarray, lag: float, speed: float) -> None:
        self.place = np.array(place, float)
        self._velocity = np.zeros_like(self.place)
        self._lag, self._speed = lag, speed

    def step(self, goal: np.ndarray) -> np.ndarray:
        """Where it is at the next frame."""
        wanted = _limited((goal - self.place) / self._lag, self._speed)
        self._velocity += (wanted - self._velocity) * (1.0 - np.exp(-4.0 / (self._lag * MODEL_FPS)))
        self.place = self.place + self._velocity / MODEL_FPS
        return self.place


class RootFollower:
    """Follows a root that is dragged. ``position`` (3,) and ``yaw``: of the last frame;
    ``seat``: the one that one sits on, or is about to, or gets up from.
    """

    def __init__(self, position: np.ndarray, yaw: float) -> None:
        self.position = np.array(position, float)
        self.yaw = float(yaw)
        self.seat: Seat | None = None
        self._velocity, self._turn = np.zeros(2), 0.0
        self._leaves = False
        self._goals: deque[np.ndarray] = deque(maxlen=round(_RECENT * MODEL_FPS))

    @property
    def speed(self) -> float:
        """Metres a second."""
        return float(np.linalg.norm(self._velocity))

    def step(self, goal: np.ndarray, yaw: float, seats: Sequence[Seat] = ()) -> None:
        """Go on for a frame to where the root is dragged, ``goal`` (3,), to look as it does,
        ``yaw``; ``seats``: those that it may be dragged onto.
        """
        place, turn = self._bound_for(np.asarray(goal[:2], float), yaw, seats)
        to_go = place - self.position[:2]
        away = float(np.linalg.norm(to_go))
        self._goals.append(place)
        dragged = float(np.linalg.norm(place - self._goals[0]))
        walks = 0.0 if self.seat else self._walks(away, dragged)
        looks_to = turn
        if walks > 0.0:
            ahead = float(yaw_of(to_go + 0.2 * self._velocity))
            looks_to = turn + walks * _wrapped(ahead - turn)

        self._turn_to(looks_to)
        self._go(to_go, away, walks)
        self.position[2] += (goal[2] - self.position[2]) * (1.0 - np.exp(-_CLIMB / MODEL_FPS))

    def _walks(self, away: float, dragged: float) -> float:
        """From 0, where one only steps, to 1, where one walks and looks where one goes: it is far
        ``away``, or was ``dragged`` far in the last seconds, however slowly.
        """
        counted = max(away + _COMING * self.speed, dragged)
        return float(smoothstep(np.array((counted - _NEAR) / (_FAR - _NEAR))))

    def _turn_to(self, yaw: float) -> None:
        gain = 1.0 / _TURN_LAG
        wanted = float(np.clip(gain * _wrapped(yaw - self.yaw), -_TURN, _TURN))
        change = (wanted - self._turn) * (1.0 - np.exp(-4.0 * gain / MODEL_FPS))
        most = _WHIRLS / MODEL_FPS
        self._turn += float(np.clip(change, -most, most))
        self.yaw += self._turn / MODEL_FPS

    def _go(self, to_go: np.ndarray, away: float, walks: float) -> None:
        direction = to_go / max(away, 1e-9)
        along = max(0.0, float(direction @ forward_of(self.yaw)))
        slowest = _STEPS + (_TURNING - _STEPS) * walks
        fastest = slowest + (CRUISE - slowest) * along**2
        if self.seat is not None:
            fastest = min(fastest, self._seated_speed())
        speed = min(fastest, away / LAG, np.sqrt(2.0 * _HALTS * away))
        change = (speed * direction - self._velocity) * (1.0 - np.exp(-_RESPONSE / MODEL_FPS))
        limit = (_STARTS if speed > self.speed else 2.0 * _STARTS) / MODEL_FPS
        self._velocity = self._velocity + _limited(change, limit)
        self.position[:2] += self._velocity / MODEL_FPS

    def _seated_speed(self) -> float:
        """Metres a second that one goes at most, next to the seat, so that sitting down or getting
        up takes as long as people take.
        """
        assert self.seat is not None
        from_seat = float(np.linalg.norm(self.position[:2] - self.seat.position))
        seconds = GETS_UP if self._leaves else SITS_DOWN
        pace = pace_at_seat(seconds, down=not self._leaves)
        return pace + max(0.0, from_seat - SEATED_WAY)

    def _bound_for(
        self, goal: np.ndarray, yaw: float, seats: Sequence[Seat]
    ) -> tuple[np.ndarray, float]:
        """Where to go next, (2,), and how to be turned there."""
        meant = self.meant(goal, seats)
        self._leaves = False
        if self.seat is not None:
            ahead = forward_of(self.seat.yaw)
            along = float((self.position[:2] - self.seat.position) @ ahead)
            if meant is not None and np.linalg.norm(meant.position - self.seat.position) < _CATCHES:
                self.seat = meant
                return meant.position, meant.yaw
            if along < AFTER_SEAT - 0.1:
                self._leaves = True
                return self.seat.position + AFTER_SEAT * ahead, self._let_go(along, goal, yaw)
            self.seat = None

        if meant is None:
            return goal, yaw

        ahead = forward_of(meant.yaw)
        right = np.array([ahead[1], -ahead[0]])
        away = self.position[:2] - meant.position
        along, beside = float(away @ ahead), float(away @ right)
        turned = abs(_wrapped(self.yaw - meant.yaw)) < _FACES
        if turned and abs(beside) < _ALIGNED and _BEFORE[0] < along < _BEFORE[1]:
            self.seat = meant
            return meant.position, meant.yaw
        over_it = abs(beside) < _ALIGNED and along > -_ALIGNED  # it was put there, or found late
        if along < 0.2 and abs(beside) < _AROUND - 0.1 and not over_it:
            side = 1.0 if beside >= 0.0 else -1.0
            return meant.position + side * _AROUND * right + 0.3 * ahead, meant.yaw
        return meant.position + BEFORE_SEAT * ahead, meant.yaw

    def _let_go(self, along: float, goal: np.ndarray, yaw: float) -> float:
        """How to be turned while one leaves the seat."""
        assert self.seat is not None
        if along < _TURNS_AWAY:
            return self.seat.yaw
        to_go = goal - self.position[:2]
        return float(yaw_of(to_go)) if np.linalg.norm(to_go) > _FAR else yaw

    def meant(self, goal: np.ndarray, seats: Sequence[Seat]) -> Seat | None:
        """The one of the ``seats`` that a root at ``goal`` (2,) is on, where it is on one."""
        found = None
        for seat in seats:
            ahead = forward_of(seat.yaw)
            right = np.array([ahead[1], -ahead[0]])
            beside = float(np.clip((goal - seat.position) @ right, -seat.aside, seat.aside))
            place = seat.position + beside * right
            mine = self.seat is not None and np.linalg.norm(self.seat.position - place) < _CATCHES
            off = float(np.linalg.norm(goal - place))
            if off < (_LETS_GO if mine else _CATCHES) and (found is None or off < found[0]):
                found = off, Seat(place, seat.yaw)
        return None if found is None else found[1]


class Way:
    """A way over the floor that is drawn while it is walked: what leads along it stays ahead of the
    body, as far as it is drawn.
    """

    def __init__(self) -> None:
        self._points: deque[np.ndarray] = deque()

    def __bool__(self) -> bool:
        return bool(self._points)

    def add(self, point: np.ndarray) -> None:
        """Go to this ``point`` (2,), metres, after all others."""
        if not self._points or np.linalg.norm(point - self._points[-1]) > _SPACED:
            self._points.append(np.asarray(point, float))

    def left(self) -> np.ndarray:
        """The points (N, 2) that are still to be gone to."""
        return np.array(self._points).reshape(-1, 2)

    def clear(self) -> None:
        """Go nowhere any more."""
        self._points.clear()

    def lead(
        self, place: np.ndarray, body: np.ndarray, frames: int, scale: float = 1.0
    ) -> tuple[np.ndarray, float | None]:
        """Where (2,) what leads is ``frames`` later than at ``place`` (2,), and its yaw, None where
        it stays: no faster than one walks, and not too far ahead of the ``body`` (2,), which is
        ``scale`` times the canonical size.
        """
        far, yaw = CRUISE * scale * frames / MODEL_FPS, None
        while self._points and far > 0.0 and np.linalg.norm(place - body) < _CARROT * scale:
            step = self._points[0] - place
            length = float(np.linalg.norm(step))
            if length > 1e-6:
                yaw = float(yaw_of(step))
                place = place + step * min(1.0, far / length)
            if length <= far:
                self._points.popleft()
            far -= length
        return place, yaw
