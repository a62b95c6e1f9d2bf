"""Where a person sits and lies on each piece of the furniture library, as marked by eye in
``tests/director/marks.toml``, and how far somebody is from there.

As a command, ``python -m benchmarks.marks LIBRARY [PIECE …]``: sends somebody to each piece twice,
from its front and from behind it, and prints what was missed and a table.
"""

import sys
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dafnet_addon import InputError, Mesh
from dafnet_addon.core.paths import Stop
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import RootPath, forward_of
from dafnet_addon.core.text import read_json
from dafnet_addon.director.approach import walk_to_seat
from dafnet_addon.director.room import Room
from dafnet_addon.director.seats import SeatPlace, seats_of

__all__ = ["MARKS", "Off", "Sent", "cuts", "measured", "nearest_mark", "others", "piece", "sent"]

_FILE = Path(__file__).parents[1] / "tests" / "director" / "marks.toml"
MARKS: dict[str, dict[str, Any]] = tomllib.loads(_FILE.read_text(encoding="utf-8"))
STARTS = {"front": (0.8, -3.2), "behind": (-2.8, 2.2)}

_PLACE, _TURN, _HEIGHT = 10.0, 20.0, 3.0  # cm, degrees, cm

# Metres from the seat within which one comes down to it; then what is met: from and to which
# height over the floor, and within how many metres of the body's axis.
_COMES, _SITS = 0.55, 0.45
_STANDING, _COMING = (0.12, 1.4, 0.12), (0.12, 1.4, 0.05)
_TRUNK, _BESIDE_TRUNK = (0.15, 0.75), 0.10  # over the seat; metres


@dataclass(frozen=True)
class Off:
    """How far a seat is from a mark: ``depth`` ahead and ``side`` to the right in its own
    direction, cm; ``turn`` in degrees; ``height`` over it, cm.
    """

    depth: float
    side: float
    turn: float
    height: float

    @property
    def place(self) -> float:
        return float(np.hypot(self.depth, self.side))

    @property
    def right(self) -> bool:
        return self.place <= _PLACE and self.turn <= _TURN and abs(self.height) <= _HEIGHT


@dataclass(frozen=True)
class Sent:
    """What came of sending somebody to a piece: how far ``off`` he sits; how many steps of his way
    lead through furniture (``cuts``); or how that was ``refused``, and whether a person agrees.
    """

    off: Off | None = None
    cuts: int = 0
    refused: str = ""
    agreed: bool = False

    @property
    def right(self) -> bool:
        return self.agreed or (self.off is not None and self.off.right and not self.cuts)


def piece(library: Path, name: str, as_called: str | None = None) -> Mesh:
    """A piece of the library."""
    with np.load(library / f"{name}.npz") as made:
        return Mesh(made["vertices"], made["triangles"], name=as_called or name)


def others(library: Path) -> list[str]:
    """The pieces of the library on which nobody sits."""
    index = read_json((library / "index.json").read_text(encoding="utf-8"))
    return [each["name"] for each in index["pieces"] if each["name"] not in MARKS]


def nearest_mark(seat: SeatPlace, marks: Iterable[dict[str, Any]]) -> Off:
    """How far a seat is from the nearest of the marks."""
    return min((_off(seat, mark) for mark in marks), key=lambda off: off.place + off.turn)


def _off(seat: SeatPlace, mark: dict[str, Any]) -> Off:
    place = 100.0 * seat.position
    ends = [np.ravel(mark[axis]) for axis in ("x", "y")]
    away = place - [np.clip(at, each[0], each[-1]) for at, each in zip(place, ends, strict=True)]
    ahead = forward_of(seat.yaw)
    facing = [np.radians(degrees) for degrees in mark.get("facing", ())] or [seat.yaw]
    turn = min(abs(np.angle(np.exp(1j * (seat.yaw - yaw)))) for yaw in facing)
    return Off(
        depth=float(away @ ahead),
        side=float(away @ [ahead[1], -ahead[0]]),
        turn=float(np.degrees(turn)),
        height=100.0 * seat.height - mark["top"],
    )


def cuts(points: np.ndarray, path: RootPath, seat: SeatPlace) -> int:
    """How many steps of a way to a seat lead a body through furniture with surface ``points``
    (N, 3), the floor at zero.
    """
    found = 0
    for place in path.position[::2, :2]:
        away = float(np.linalg.norm(place - seat.position))
        low, high, beside = _STANDING if away > _COMES else _COMING
        if away < _SITS:
            low, high = (seat.height + over for over in _TRUNK)
            beside = _BESIDE_TRUNK
        near = points[(points[:, 2] > low) & (points[:, 2] < high), :2]
        found += bool(len(near)) and float(np.linalg.norm(near - place, axis=1).min()) < beside
    return found


def sent(library: Path, name: str, start: Sequence[float]) -> Sent:
    """Send somebody to a piece that stands alone."""
    mark, room = MARKS[name], Room([piece(library, name, "Piece")])
    own = room.pieces()["Piece"]
    try:
        seats = seats_of(own.solids, np.array(start), 0.0, "Piece")
        here = Stop((start[0], start[1]), 0.0, 0.2)
        walked, seat = walk_to_seat(room, own, here, seats)
    except InputError as error:
        return Sent(refused=str(error), agreed="refusal" in mark)
    if not mark["seats"]:
        return Sent(off=Off(np.inf, 0.0, 0.0, 0.0))
    points = run_to_end(room.surfaces())["Piece"]
    return Sent(nearest_mark(seat, mark["seats"]), cuts(points, walked.path, seat))


def measured(library: Path, names: Iterable[str]) -> dict[tuple[str, str], Sent]:
    """What comes of sending somebody to these pieces, from the front and from behind."""
    return {
        (name, side): sent(library, name, start) for name in names for side, start in STARTS.items()
    }


def _row(title: str, found: Sequence[Sent]) -> str:
    offs = [each.off for each in found if each.off is not None]
    share = 100.0 * float(np.mean([each.right for each in found]))
    depth = float(np.median([abs(off.depth) for off in offs])) if offs else 0.0
    counts = (
        len(found),
        sum(off.place <= _PLACE for off in offs),
        sum(abs(off.depth) <= _PLACE for off in offs),
        sum(abs(off.side) <= _PLACE for off in offs),
        sum(off.turn <= _TURN for off in offs),
        sum(abs(off.height) <= _HEIGHT for off in offs),
        sum(each.off is not None and not each.cuts for each in found),
        sum(bool(each.refused) for each in found),
    )
    cells = "".join(f"{count:8d}" for count in counts)
    return f"{title:9s}{cells}{share:8.1f} %{depth:8.1f} cm"


def main(library: str, *names: str) -> int:
    """Print what was missed, and a table by kinds."""
    found = measured(Path(library), names or sorted(MARKS))
    for (name, side), each in found.items():
        if not each.right:
            print(f"{name} {side}: {each.refused or each.off}, {each.cuts} cuts")
    heads = ("sent", "place", "depth", "side", "facing", "height", "clean", "refused", "right")
    print("kind     " + "".join(f"{head:>8s}" for head in heads) + "   median depth")
    kinds: dict[str, list[Sent]] = {}
    for (name, _), each in found.items():
        kinds.setdefault(name.split("_")[0], []).append(each)
    for kind, some in kinds.items():
        print(_row(kind, some))
    print(_row("all", list(found.values())))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
