"""The test among real furniture for who is sent to a seat: from 2 to 3 metres away, where
``director`` says that one sits, on the way that it finds.

``walks.json`` freezes the questions: which piece, and from where one is sent to it. The answer
is made anew each time, by the director and then by the weights, as *Sit on Selected* does it. Where
one should rest is as high as the piece carries a pelvis at the place that the director chose; where
nothing carries it there, the place is wrong, and nobody can rest right on it.
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.paths import Stop
from ...core.rotations import rotate
from ...core.skeleton import PELVIS, REST
from ...core.solids import Mesh
from ...director.seats import seat_of
from ...director.walks import walk_to
from ..dataset.splits import role_of_maker
from ..dataset.windows import HIGHEST, LOWEST
from ..furnish.flesh import Furnishing
from ..furnish.library import Piece, read_library
from ..furnish.shapes import PELVIS_OVER, ShapeBank, bank_of, surface_under
from ..motion.rests import Rest
from .captured import HeldClip
from .freezing import freeze

__all__ = ["FROZEN_WALKS", "Walks", "freeze_walks", "real_walks"]

FROZEN_WALKS = Path(__file__).with_name("walks.json")

_FROM, _STARTS = (2.0, 3.0), 3  # metres away; places that one is sent from to each piece
_SEED = 43
_BEFORE, _SECONDS = 0.2, 3.0  # of rest at first, and on the seat: those of *Sit on Selected*
_SETTLES = 15  # frames from where the root rests, until the body has to


@dataclass(frozen=True)
class Walks:
    """What came of being sent to seats: ``clips`` to be generated in FREE, whose joints are not
    captured: a body that stands along the way and rests as high as it should; and how often that
    was ``refused``, by kind of piece, of ``sent`` times, or led to a place that carries nobody.
    """

    clips: tuple[HeldClip, ...]
    sent: dict[str, int]
    refused: dict[str, int]


def freeze_walks(library: Path) -> dict[str, Any]:
    """Draw the test anew: what ``walks.json`` holds. Every piece that one sits on, at a
    height that training knows, of makers that choose and that tell, from places all around it.
    """
    pieces, _ = read_library(library)
    rng = np.random.default_rng(_SEED)
    walks = []
    for piece in sorted(pieces, key=lambda piece: piece.name):
        role = role_of_maker(piece.maker)
        seats = bank_of([piece], (1.0,)).shapes[0].seats if role != "train" else ()
        if not any(LOWEST <= seat.pelvis <= HIGHEST for seat in seats):
            continue

        turn = rng.uniform(0.0, 2.0 * np.pi)
        for k in range(_STARTS):
            angle, away = turn + 2.0 * np.pi * k / _STARTS, rng.uniform(*_FROM)
            place = [round(float(v), 3) for v in away * np.array([np.cos(angle), np.sin(angle)])]
            yaw = round(float(rng.uniform(-np.pi, np.pi)), 3)
            walks.append(
                {
                    "piece": piece.name,
                    "kind": piece.kind,
                    "maker": piece.maker,
                    "role": role,
                    "place": place,
                    "yaw": yaw,
                }
            )

    return {"version": 4, "clips": walks}


def real_walks(library: Path, role: str) -> Walks:
    """Everybody who 'choose's or 'tell's sent to their seats, on pieces of ``library``.

    Raises InputError where a piece is missing.
    """
    frozen = json.loads(FROZEN_WALKS.read_text(encoding="utf-8"))["clips"]
    asked = [walk for walk in frozen if walk["role"] == role]
    pieces = {piece.name: piece for piece in read_library(library)[0]}
    if missing := sorted({walk["piece"] for walk in asked} - pieces.keys()):
        raise InputError(
            f"The furniture library '{library}' lacks '{missing[0]}'; give the one that the test "
            "was made with."
        )

    bank = bank_of([pieces[name] for name in sorted({walk["piece"] for walk in asked})], (1.0,))
    numbers = {shape.name: i for i, shape in enumerate(bank.shapes)}
    clips, refused = [], Counter[str]()
    for k, walk in enumerate(asked):
        clip = _sent(walk, k, pieces[walk["piece"]], bank, numbers[walk["piece"]])
        if clip is None:
            refused[walk["kind"]] += 1
        else:
            clips.append(clip)

    return Walks(tuple(clips), dict(Counter(walk["kind"] for walk in asked)), dict(refused))


def _sent(
    walk: dict[str, Any], k: int, piece: Piece, bank: ShapeBank, number: int
) -> HeldClip | None:
    """One who is sent to a seat, or None where that is refused or nothing carries anybody there."""
    solids = [Mesh(piece.vertices, piece.triangles, name=piece.title)]
    place = np.array(walk["place"])
    start = Stop((float(place[0]), float(place[1])), walk["yaw"], _BEFORE)
    try:
        spot = seat_of(solids, place, 0.0, piece.title, tables=True)
        end = Stop((float(spot.position[0]), float(spot.position[1])), spot.yaw, _SECONDS, True)
        made = walk_to(solids, start, end)
    except InputError:
        return None

    height = surface_under(bank.shapes[number].grid, spot.position, spot.yaw, spot.height)
    if height is None:
        return None

    rest = made.rests[-1]
    first, last = rest.start + _SETTLES, rest.stop
    pelvis = height + PELVIS_OVER[piece.kind]
    joints = rotate(made.path.rotation[:, None], REST) + made.path.position[:, None]
    joints[first:last, :, 2] += pelvis - REST[PELVIS, 2]
    at = np.array([*spot.position, pelvis])
    return HeldClip(
        name=f"sent to {piece.name}, {k}",
        body="director",
        activity="sit down or up",
        unseen=True,
        composed=True,
        room="",
        joints=joints,
        path=made.path,
        boxes=np.zeros((0, 7)),
        rests=(Rest(first, last, at, spot.yaw),),
        real=Furnishing(shapes=np.array([[number, 0.0, 0.0, 0.0, 1.0]]), bank=bank),
        piece=piece.name,
        kind=piece.kind,
        maker=piece.maker,
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Make ``walks.json`` anew; 0 if all went well, else 1 and a sentence on standard
    error.
    """
    parser = argparse.ArgumentParser("python -m dafnet_addon.data.held_out.walks")
    parser.add_argument("library", type=Path, help="the furniture library")
    return freeze(parser, arguments, lambda options: freeze_walks(options.library), FROZEN_WALKS)


if __name__ == "__main__":
    sys.exit(main())
