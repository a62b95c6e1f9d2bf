"""Which of several things or places somebody takes: the nearest free one, or any by the seed."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ..core.errors import InputError
from ..core.paths import facing
from .others import Occupied
from .person import SPEED, Person
from .places import Place, has_room
from .room import Piece

__all__ = ["Chooser", "Done", "Job", "Taken", "middle_of"]

_T = TypeVar("_T")
Job = Generator[float, None, _T]
"""A long job, see ``core.progress``."""

_FREE = "all places there are taken; choose another, or send fewer people."


class Taken(Occupied):
    """Somebody else keeps the place."""

    def __init__(self) -> None:
        super().__init__(_FREE)


@dataclass(frozen=True)
class Done:
    """How a task was done: the frame from which on, and with what."""

    there: int
    furniture: str = ""
    seat: str = ""


def middle_of(thing: Piece | np.ndarray) -> np.ndarray:
    """(3,) of a piece or point."""
    return thing.box().mean(axis=0) if isinstance(thing, Piece) else np.asarray(thing)


class Chooser:
    """Chooses for a ``person``, by chance with ``rng``; ``warnings``: sentences for the user."""

    def __init__(self, person: Person, rng: np.random.Generator) -> None:
        self.person, self.rng = person, rng
        self.warnings: list[str] = []

    def where(self) -> np.ndarray:
        """(2,): what is near to here is chosen first."""
        return self.person.place.position if self.person.track is not None else np.zeros(2)

    def point(self, place: Sequence[float]) -> np.ndarray:
        """A place that a task names, in the metres of who does it."""
        return np.asarray(place, float) / self.person.size

    def near(self, place: Sequence[float] | None) -> np.ndarray | None:
        """(2,): the same, where one is named."""
        return None if place is None else self.point(place)[:2]

    def by_choice(
        self,
        candidates: Sequence[_T],
        at: Callable[[_T], np.ndarray],
        choose: str,
        near: np.ndarray | None = None,
    ) -> list[_T]:
        """The candidates in the order in which they are tried: the nearest first, to ``near`` (2,)
        or to here, or at random.
        """
        if choose == "random" and near is None:
            return [candidates[k] for k in self.rng.permutation(len(candidates))]
        middle = self.where() if near is None else near
        return sorted(candidates, key=lambda each: float(np.linalg.norm(at(each)[:2] - middle)))

    def pieces(self, name: str, choose: str, near: np.ndarray | None = None) -> list[Piece]:
        """The furniture that a task names, in order."""
        return self.by_choice(self.person.room.named(name), middle_of, choose, near)

    def things(self, what: str | Sequence[float], choose: str) -> list[Piece | np.ndarray]:
        """The furniture and points that a task names, in order."""
        if not isinstance(what, str):
            return [self.point(what)]
        return self.by_choice(self.person.room.things(what), middle_of, choose)

    def first(self, candidates: Sequence[_T], attempt: Callable[[_T], Job[Done]]) -> Job[Done]:
        """The first attempt that succeeds. Raises what the first one says that was not about a
        place that is taken, else that all are.
        """
        refused: InputError = Taken()
        for each in candidates:
            try:
                return (yield from attempt(each))
            except InputError as error:
                refused = error if isinstance(refused, Taken) else refused
        raise refused

    def faced(self, wanted: float | str | None, position: np.ndarray) -> float | None:
        """Yaw of what is to be faced from a place (2,), None where nothing is."""
        if wanted is None:
            return None
        if not isinstance(wanted, str):
            return float(np.radians(wanted))
        middles = [middle_of(each)[:2] - position for each in self.person.room.things(wanted)]
        return facing(min(middles, key=lambda away: float(np.linalg.norm(away))))

    def free_spots(
        self, spots: Sequence[Place], radius: float, besides: Piece | None = None
    ) -> Job[list[Place]]:
        """Those that nobody keeps and where one can stand with ``radius`` metres around; what is
        used from there may be closer (``besides``).
        """
        open_ = [spot for spot in spots if not self.person.is_taken(spot.position)]
        at = np.array([spot.position for spot in open_]).reshape(-1, 2)
        named = None if besides is None else besides.name
        free = yield from has_room(self.person.room, at, radius, named)
        if spots and not open_:
            raise Taken()
        return [spot for spot, is_free in zip(open_, free, strict=True) if is_free]

    def stand_at(self, spot: Place, yaw: float | None, speed: float = SPEED) -> Job[None]:
        """Walk to a spot, and keep it."""
        way = yield from self.person.way(spot.position, yaw, speed)
        self.person.go(way)
        self.person.keep(spot.position)

    def somewhere(self) -> Person:
        """Who is to do something where he is."""
        if self.person.track is None:
            raise InputError(
                "nobody knows where that is to be; give a start, or put 'sit_on' or 'walk_to' "
                "before it."
            )
        return self.person

    def awake(self) -> Person:
        """Who is to do something where he stands or sits."""
        if self.somewhere().bed is not None:
            raise InputError("that cannot be done lying; put 'stand_up' before it.")
        return self.person
