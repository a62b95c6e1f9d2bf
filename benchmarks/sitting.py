"""Do people sit where they are sent? To every marked piece of a furniture library, alone and in
rooms as people arrange them, or to pieces that are made for it, from two places each.

    dafnet bench sitting [--weights FILE] [--furniture LIBRARY] [--sheets FOLDER]

Each is sent as *Sit on Selected* does it and generated as *Generate* does with its defaults. Where
people sit on the pieces of the library was marked by looking at them (``benchmarks.marks``); on the
pieces that are made here it follows from how they are made (``benchmarks.made_seats``). What is
asked: the pelvis within 4 cm of the height at which that piece carries one, and within 10 cm of
where a person would sit; no shin, foot or trunk inside of furniture, from the first frame to the
last; and, of all that falls short, a word in the take's own verdict.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.arranged import SCENES, Arranged, Asked, asked_of, sent_to
from benchmarks.made_seats import KINDS, made_seat
from benchmarks.marks import MARKS, STARTS, nearest_mark, piece
from dafnet_addon import (
    Box,
    CleanUp,
    Controls,
    InputError,
    Mesh,
    Scene,
    Take,
    generate,
    load_weights,
)
from dafnet_addon.core.metrics import body_points
from dafnet_addon.core.occupancy import distance
from dafnet_addon.core.paths import Route, Stop
from dafnet_addon.core.rotations import rotate
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import HIPS, JOINTS, PELVIS
from dafnet_addon.core.softness import OVER_HARD, SOFTNESS, kind_by_name
from dafnet_addon.core.text import read_json
from dafnet_addon.core.weights import Weights
from dafnet_addon.director.approach import walk_to_seat
from dafnet_addon.director.room import Room
from dafnet_addon.director.seats import SeatPlace, seats_of

if TYPE_CHECKING:
    from dafnet_addon.data.furnish.flesh import Furnishing

__all__ = ["SEEDS", "measure", "situations"]

SEEDS = (0, 1, 2)
"""Of the pieces that are made, of each kind."""
DEFAULTS = CleanUp(feet=1.0, reach=1.0, seat=1.0)
"""What a new character's clean-up does."""

_HEIGHT, _PLACE, _TURN = 4.0, 10.0, 20.0  # cm, cm, degrees
_INSIDE = 1.0  # cm of a bone in something hard: its flesh is past it
_SEEN = 3  # frames that it is inside
_GIVES_WAY = 60.0  # cm of that, by a metre of softness
_SETTLES = 15  # frames from where the root rests, until the body has to
_PER_BONE = 4
_A_SHEET, _DRAWN = 4, 150  # rows; frames
_ENDS = {  # the joints that end the bones of what may not be inside
    "shin": ("ankle",),
    "foot": ("foot",),
    "trunk": ("spine1", "spine2", "spine3", "neck", "head"),
}


Place = tuple[float, float]
Sent = tuple[Sequence[Box | Mesh], Route, SeatPlace]
"""A room's solids, the way to a seat, and the seat."""


@dataclass(frozen=True)
class Situation:
    """Somebody who is sent to a piece (``name``) from somewhere: ``send`` gives the room, the way
    and the seat, or raises InputError. The pelvis should be ``over`` the marks' top, cm;
    ``refusal``: a person agrees if it is refused.
    """

    name: str
    kind: str
    marks: Sequence[dict[str, Any]]
    send: Callable[[], Sent]
    over: float
    refusal: bool = False


def _over(kind: str) -> float:
    return 100.0 * (OVER_HARD - SOFTNESS[kind])


def _alone(mesh: Mesh, start: Place) -> Sent:
    room = Room([mesh])
    own = room.pieces()[mesh.name]
    seats = seats_of(own.solids, np.array(start), 0.0, mesh.name)
    return room.solids, *walk_to_seat(room, own, Stop(start, 0.0, 0.2), seats)


def _in_room(made: Arranged, asked: Asked, start: Place) -> Sent:
    room, route, seat, _ = sent_to(made, asked, start)
    return room.solids, route, seat


def _of_library(library: Path) -> Iterator[Situation]:
    index = read_json((library / "index.json").read_text(encoding="utf-8"))
    known = {each["name"]: each for each in index["pieces"]}
    for name, mark in sorted(MARKS.items()):
        kind = mark.get("kind", known[name]["kind"])
        mesh = piece(library, name, known[name]["title"])
        for side, start in STARTS.items():
            yield Situation(
                name=f"{name} {side}",
                kind=kind,
                marks=mark["seats"],
                send=partial(_alone, mesh, start),
                over=_over(kind),
                refusal="refusal" in mark,
            )

    for scene, arrange in SCENES.items():
        made = arrange(library)
        for k, (asked, start) in enumerate(asked_of(made)):
            yield Situation(
                name=f"{scene}: {asked.name} {k % 2}",
                kind="in a room",
                marks=asked.marks,
                send=partial(_in_room, made, asked, start),
                over=_over(kind_by_name(asked.name) or "chair"),
            )


def _of_made(seeds: Sequence[int]) -> Iterator[Situation]:
    for name in KINDS:
        for seed in seeds:
            made = made_seat(name, seed)
            for side, start in STARTS.items():
                send = partial(_alone, made.mesh, start)
                over = _over(made.kind)
                yield Situation(f"{made.name} {side}", made.kind, made.marks, send, over)


def situations(library: Path | None, seeds: Sequence[int] = SEEDS) -> list[Situation]:
    """Who is sent where: over the pieces of a ``library`` and its rooms, or over made pieces."""
    return list(_of_made(seeds) if library is None else _of_library(library))


def row_of(asked: Situation, weights: Weights) -> tuple[dict[str, Any], Take | None, Scene]:
    """What becomes of one who is sent, as numbers; his take, None where he is refused; and what
    stands around him.
    """
    row: dict[str, Any] = {"name": asked.name, "kind": asked.kind}
    try:
        solids, route, seat = asked.send()
    except InputError as error:
        return {**row, "refused": str(error), "agreed": asked.refusal}, None, Scene()

    scene = Scene(tuple(solids))
    controls = Controls(fps=MODEL_FPS, root=route.path.matrices())
    take = generate(scene, controls, weights, clean_up=DEFAULTS)
    rest = slice(route.rests[-1].start + _SETTLES, route.rests[-1].stop)
    if not asked.marks:
        return {**row, "sits where nobody does": True}, take, scene

    off = nearest_mark(seat, asked.marks)
    pelvis = np.median(take.joints[rest, PELVIS], axis=0)
    found = _inside(take.joints, scene)
    row |= {
        "place": round(
            off.place + 100.0 * float(np.linalg.norm(pelvis[:2] - _root(take, rest))), 1
        ),
        "turn": round(_turned(take.joints[rest], seat.yaw) + off.turn, 1),
        "height": round(100.0 * (float(pelvis[2]) - seat.height) + off.height - asked.over, 1),
        "inside": found,
        "told": [each.text for each in take.verdict if not each.good],
    }
    return row, take, scene


def _root(take: Take, rest: slice) -> np.ndarray:
    return np.asarray(np.median(take.root[rest, :2, 3], axis=0))


def _turned(joints: np.ndarray, yaw: float) -> float:
    """Degrees by which hips are turned away from a seat's yaw."""
    across = np.median(joints[:, HIPS[1]] - joints[:, HIPS[0]], axis=0)
    facing = np.arctan2(across[1], across[0])
    return float(np.degrees(abs(np.angle(np.exp(1j * (facing - yaw))))))


def _inside(joints: np.ndarray, scene: Scene) -> dict[str, float]:
    """How deep (cm) shins, feet and trunk are in furniture where they are deepest, beyond what it
    gives way.
    """
    points = body_points(joints, _PER_BONE)
    names = np.array(["pelvis", *(name for name in JOINTS[1:] for _ in range(_PER_BONE))])
    found: dict[str, float] = {}
    for solid in scene.solids:
        depth = -100.0 * distance(Scene((solid,)), points, 0.0)
        gives = _GIVES_WAY * SOFTNESS.get(kind_by_name(solid.name), 0.0)
        for part, ends in _ENDS.items():
            own = np.array([name.rpartition("_")[2] in ends for name in names])
            # as deep as it is for as long as can be seen
            deepest = float(np.sort(depth[:, own].max(axis=1))[-_SEEN]) - gives * (part == "trunk")
            if deepest > _INSIDE:
                found[part] = round(max(deepest, found.get(part, 0.0)), 1)
    return found


def faults_of(row: Mapping[str, Any]) -> list[str]:
    """What falls short, in words; nothing where somebody sits as he should, or is rightly sent
    away.
    """
    if "refused" in row:
        return [] if row["agreed"] else ["refused"]
    if "height" not in row:
        return ["sits where nobody does"]
    limits = {"height": _HEIGHT, "place": _PLACE, "turn": _TURN}
    faults = [what for what, most in limits.items() if abs(row[what]) > most]
    return [*faults, *(f"{part} inside" for part in row["inside"])]


def measure(
    file: Path | None,
    progress: Callable[[float], None],
    library: Path | None = None,
    sheets: Path | None = None,
    seeds: Sequence[int] = SEEDS,
) -> tuple[dict[str, Any], str]:
    """Run the benchmark with the weights in ``file`` (None: those that ship); the report and its
    summary in words. ``sheets``: a folder into which the worst are drawn.
    """
    weights = load_weights(file)
    asked = situations(library, seeds)
    rows, drawn = [], []
    for done, each in enumerate(asked):
        progress(done / len(asked))
        row, take, scene = row_of(each, weights)
        rows.append({**row, "faults": faults_of(row)})
        if take is not None and rows[-1]["faults"]:
            drawn.append((_worst(row), row, take, scene))

    progress(1.0)
    if sheets is not None:
        _draw(sheets, [row for _, *row in sorted(drawn, key=lambda each: -each[0])[:12]])
    all_of_them = _summary(rows)
    kinds = {
        kind: _summary([row for row in rows if row["kind"] == kind])
        for kind in dict.fromkeys(row["kind"] for row in rows)
    }
    report = {"all": all_of_them, "kinds": kinds, "rows": rows}
    lines = [
        f"{name}: " + ", ".join(f"{what} {value:g}" for what, value in found.items())
        for name, found in {"all": all_of_them, **kinds}.items()
    ]
    lines += [f"  {row['name']}: {_told(row)}" for row in rows if row["faults"]]
    return report, "\n".join(lines)


def _worst(row: Mapping[str, Any]) -> float:
    return float(abs(row.get("height", 50.0)) + sum(row.get("inside", {}).values()))


def _told(row: Mapping[str, Any]) -> str:
    if "height" not in row:
        return str(row.get("refused", row["faults"][0]))
    inside = "".join(f", {part} {deep:g} cm inside" for part, deep in row["inside"].items())
    measured = f"height {row['height']:+g} cm, place {row['place']:g} cm, turn {row['turn']:g}"
    return f"{measured}{inside}{'' if row['told'] else '; not told'}"


def _summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Of some who were sent: shares in per cent, heights in centimetres."""
    sat = [row for row in rows if "height" in row]
    heights = np.abs([row["height"] for row in sat]) if sat else np.zeros(1)

    def share(count: int, of: Sequence[Any] = rows) -> float:
        return round(100.0 * count / max(len(of), 1), 1)

    return {
        "sent": len(rows),
        "right": share(sum(not row["faults"] for row in rows)),
        "refused": share(sum("refused" in row for row in rows)),
        "refused wrongly": share(sum("refused" in row["faults"] for row in rows)),
        "within 4 cm": share(int((heights <= _HEIGHT).sum()), sat),
        "height, median cm": round(float(np.median(heights)), 1),
        "height, 95 % cm": round(float(np.percentile(heights, 95)), 1),
        "place right": share(sum(row["place"] <= _PLACE for row in sat), sat),
        **{
            f"{part} inside": share(sum(part in row["inside"] for row in sat), sat)
            for part in _ENDS
        },
        "short and not told": share(sum(bool(row["faults"]) and not row["told"] for row in sat)),
    }


def _draw(folder: Path, worst: Sequence[Sequence[Any]]) -> None:
    """Sheets of the worst takes, from before they sit down on, four on each."""
    from dafnet_addon.data.dataset.sheet import sheet

    folder.mkdir(parents=True, exist_ok=True)
    for first in range(0, len(worst), _A_SHEET):
        rows = [
            (f"{row['name']}: {_told(row)}", take.joints[-_DRAWN:], _furnishing(scene))
            for row, take, scene in worst[first : first + _A_SHEET]
        ]
        sheet(folder / f"sitting_{first // _A_SHEET + 1}.png", rows)


def _furnishing(scene: Scene) -> "Furnishing":
    """The furniture as sheets draw it."""
    from dafnet_addon.data.furnish.flesh import Furnishing
    from dafnet_addon.data.furnish.library import Piece
    from dafnet_addon.data.furnish.shapes import bank_of

    boxes = [[*s.center, *s.half_size, 0.0] for s in scene.solids if isinstance(s, Box)]
    pieces = [
        Piece(
            name=str(k),
            kind="shelf",
            title="",
            maker="",
            source="",
            licence="",
            vertices=rotate(solid.matrix[:3, :3], solid.vertices) + solid.matrix[:3, 3],
            triangles=solid.triangles,
        )
        for k, solid in enumerate(s for s in scene.solids if isinstance(s, Mesh))
    ]
    shapes = [[k, 0.0, 0.0, 0.0, 1.0] for k in range(len(pieces))]
    return Furnishing(
        np.array(boxes).reshape(-1, 7), np.array(shapes).reshape(-1, 5), bank_of(pieces, (1.0,))
    )
