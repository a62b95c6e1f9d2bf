"""The test among real furniture: captured sitting and lying, on pieces of makers whose furniture
training never saw.

Bodies and makers that choose weights are apart from those that tell how good they are (``splits``).
``real.json`` freezes which frames of which motion, which piece at its true size, where it
stands, and how high it carries the pelvis; it holds no motion and no furniture, which come from the
motion files and the furniture library.

The captured pelvis is moved to the height at which the piece carries one (``retarget``,
``shapes.PELVIS_OVER``): so the motion is at most a seat's height away from what was captured, and
the piece is not changed at all.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.root import RootPath, raw_root_from_joints
from ...core.skeleton import PELVIS
from ..dataset.splits import role_of_body, role_of_maker
from ..furnish.flesh import Furnishing, probes
from ..furnish.library import Piece, read_library
from ..furnish.real_pieces import LIES_OVER, bed_shape_for, seat_shape_for, stray_shape
from ..furnish.shapes import ShapeBank, bank_of
from ..motion.interactions import lying
from ..motion.motion import Motion
from ..motion.rests import Rest, rest_of
from ..motion.retarget import at_seat_height
from .captured import HeldClip, fingerprint, held_out, held_out_motions, is_frozen
from .freezing import freeze

__all__ = ["FROZEN_REAL", "freeze_real", "real_test"]

FROZEN_REAL = Path(__file__).with_name("real.json")

_BEFORE, _AFTER, _LONGEST = 90, 45, 150  # frames around an episode, and of it
_EPISODES = 14  # of each body
_NO_HANDS = "ui_prmd"  # whose arms are made up
_TRIES, _STRAYS = 10, 2
_MOVED = 0.25  # metres by which a resting pelvis is moved at most: farther, it is another motion
_SEED = 41


def _sitting(motions: Sequence[Motion]) -> Iterator[tuple[Motion, int, int, Rest]]:
    """Where bodies sit, with frames before and after: motion, first frame, end, and the episode in
    the motion's frames.
    """
    for motion in motions:
        for rest in motion.rests if motion.category != "lying" else ():
            first, end = (
                max(0, rest.start - _BEFORE),
                min(len(motion.joints), rest.end + _AFTER, rest.start + _LONGEST),
            )
            if motion.valid[first:end].all():
                yield motion, first, end, rest


def _by_kind(pieces: Sequence[Piece], rng: np.random.Generator) -> list[Piece]:
    """The pieces in an order in which kinds take turns."""
    turns: dict[str, int] = {}
    rows: list[tuple[int, int, Piece]] = []
    for i in rng.permutation(len(pieces)):
        kind = pieces[i].kind
        turns[kind] = turns.get(kind, -1) + 1
        rows.append((turns[kind], len(rows), pieces[i]))
    return [piece for *_, piece in sorted(rows, key=lambda row: row[:2])]


def freeze_real(folder: Path, library: Path) -> dict[str, Any]:
    """Fit the test anew: what ``real.json`` holds. It is done once, before any weights are
    measured on it.
    """
    motions = held_out_motions(folder)
    pieces, _ = read_library(library)
    clips: list[dict[str, Any]] = []
    for role in ("choose", "tell"):
        own = [piece for piece in pieces if role_of_maker(piece.maker) == role]
        bank = bank_of(own, factors=(1.0,))
        rng = np.random.default_rng([_SEED, len(role)])
        bodies: dict[str, list[Motion]] = {}
        for motion in motions.values():
            if motion.source != _NO_HANDS and role_of_body(motion.source, motion.subject) == role:
                bodies.setdefault(f"{motion.source}/{motion.subject}", []).append(motion)
        for body, theirs in sorted(bodies.items()):
            clips += _frozen_sitting(rng, role, body, theirs, bank)

        clips += _frozen_lying(rng, role, folder, bank)

    return {"version": 4, "clips": clips}


def _frozen_sitting(
    rng: np.random.Generator, role: str, body: str, motions: list[Motion], bank: ShapeBank
) -> list[dict[str, Any]]:
    """Episodes of one body on the role's seats, kinds in turn."""
    found: list[dict[str, Any]] = []
    episodes = list(_sitting(motions))
    seats = [i for i, shape in enumerate(bank.shapes) if shape.seats]
    kinds = sorted({bank.shapes[i].kind for i in seats})
    for e in rng.permutation(len(episodes)):
        if len(found) == _EPISODES:
            break

        motion, first, end, rest = episodes[e]
        # The kinds that this body has had least come first.
        had = {kind: sum(clip["kind"] == kind for clip in found) for kind in kinds}
        order = sorted(rng.permutation(seats), key=lambda i: had[bank.shapes[i].kind])
        for number in order[:_TRIES]:
            clip = _on_piece(rng, bank, int(number), motion, first, end, rest)
            if clip:
                found.append(clip | {"role": role, "body": body})
                break

    return found


def _on_piece(
    rng: np.random.Generator,
    bank: ShapeBank,
    number: int,
    motion: Motion,
    first: int,
    end: int,
    rest: Rest,
) -> dict[str, Any] | None:
    """One episode on one piece, or None where the body would cut it."""
    shape = bank.shapes[number]
    seat = shape.seats[0]
    was = float(np.median(motion.joints[rest.start : rest.end, PELVIS, 2]))
    if abs(seat.pelvis - was) > _MOVED:
        return None

    joints = at_seat_height(motion.joints[first:end], was, seat.pelvis)
    path = raw_root_from_joints(joints)
    start, stop = rest.start - first, min(rest.end, end) - first
    moved = rest_of(joints, path, start, stop)
    moved = Rest(start, stop, np.array([*moved.position[:2], seat.pelvis]), moved.yaw)
    points = probes(joints)
    under = seat_shape_for(rng, ShapeBank((shape,)), moved, points)
    if under is None:
        return None

    return {
        "name": f"{motion.source}/{motion.name}",
        "start": first,
        "frames": end - first,
        "was": round(was, 4),
        "pelvis": round(seat.pelvis, 4),
        "rest": [start, stop],
        "activity": "sit down or up",
        "fingerprint": fingerprint(joints),
        **_beside(rng, bank, number, under, points, path),
    }


def _beside(
    rng: np.random.Generator,
    bank: ShapeBank,
    number: int,
    under: Furnishing,
    points: np.ndarray,
    path: RootPath,
) -> dict[str, Any]:
    """What a frozen clip holds of its furniture: the piece in use first, then some that stand
    about.
    """
    rows = [[bank.shapes[number].name, *under.shapes[0, 1:]]]
    for _ in range(int(rng.integers(0, _STRAYS + 1))):
        for row in stray_shape(rng, bank, points, path).shapes:
            rows.append([bank.shapes[int(row[0])].name, *row[1:]])

    return {
        "piece": bank.shapes[number].name,
        "kind": bank.shapes[number].kind,
        "maker": bank.shapes[number].maker,
        "rows": [[name, *(round(float(v), 4) for v in row)] for name, *row in rows],
    }


def _frozen_lying(
    rng: np.random.Generator, role: str, folder: Path, bank: ShapeBank
) -> list[dict[str, Any]]:
    """The lying clips of the test on boxes, on real beds and sofas instead."""
    found = []
    for clip in held_out(folder):
        source, subject = clip.body.split("/", 1)
        if clip.room != "bed" or role_of_body(source, subject) != role:
            continue
        for use in lying(clip.joints)[:1]:
            middle = float(use.points.mean(0)[2])
            for number in rng.permutation(len(bank)):
                shape = bank.shapes[number]
                if shape.kind not in ("bed", "sofa") or not shape.seats:
                    continue
                raised = shape.seats[0].height + LIES_OVER - middle
                joints = clip.joints + np.array([0.0, 0.0, raised])
                path, points = raw_root_from_joints(joints), probes(joints)
                (moved,) = lying(joints)[:1] or [use]
                under = bed_shape_for(rng, ShapeBank((shape,)), moved, points, [])
                if under is None:
                    continue
                furniture = _beside(rng, bank, int(number), under, points, path)
                found.append(
                    {
                        "name": clip.name,
                        "lies": True,
                        "raised": round(raised, 4),
                        "frames": len(joints),
                        "activity": "lie",
                        "pelvis": round(
                            float(np.median(joints[use.start : use.end, PELVIS, 2])), 4
                        ),
                        "rest": [use.start, use.end],
                        "fingerprint": fingerprint(joints),
                        "role": role,
                        "body": clip.body,
                        **furniture,
                    }
                )
                break

    return found


def real_test(folder: Path, library: Path, role: str) -> list[HeldClip]:
    """The frozen clips of those that 'choose' or 'tell', cut from the motion files in ``folder``,
    with pieces of ``library``.

    Raises InputError where a motion or a piece is missing or not the same.
    """
    frozen = [
        clip
        for clip in json.loads(FROZEN_REAL.read_text(encoding="utf-8"))["clips"]
        if clip["role"] == role
    ]
    motions = held_out_motions(folder)
    beds = (
        {clip.name: clip for clip in held_out(folder)}
        if any("lies" in clip for clip in frozen)
        else {}
    )
    wanted = {row[0] for clip in frozen for row in clip["rows"]}
    pieces = {piece.name: piece for piece in read_library(library)[0]}
    if missing := sorted(wanted - pieces.keys()):
        raise InputError(
            f"The furniture library '{library}' lacks '{missing[0]}'; give the one that the test "
            "was made with."
        )

    bank = bank_of([pieces[name] for name in sorted(wanted)], factors=(1.0,))
    numbers = {shape.name: i for i, shape in enumerate(bank.shapes)}
    return [_clip(clip, motions, beds, bank, numbers) for clip in frozen]


def _clip(
    frozen: dict[str, Any],
    motions: dict[str, Motion],
    beds: dict[str, HeldClip],
    bank: ShapeBank,
    numbers: dict[str, int],
) -> HeldClip:
    name = frozen["name"]
    if "lies" in frozen:
        joints = beds[name].joints + np.array([0.0, 0.0, frozen["raised"]])
    elif name in motions:
        cut = motions[name].joints[frozen["start"] : frozen["start"] + frozen["frames"]]
        joints = at_seat_height(cut, frozen["was"], frozen["pelvis"])
    else:
        raise InputError(
            f"The test's motion '{name}' is not in the folder; give the folder with all files."
        )

    if not is_frozen(joints, frozen):
        raise InputError(
            f"The motion '{name}' is not the one that the test was made with; use its files, or "
            "freeze it anew."
        )

    path = raw_root_from_joints(joints)
    rows = np.array([[numbers[row[0]], *row[1:]] for row in frozen["rows"]], float)
    return HeldClip(
        name=f"{name} on {frozen['piece']}",
        body=frozen["body"],
        activity=frozen["activity"],
        unseen=True,
        composed=False,
        room="bed" if "lies" in frozen else "",
        joints=joints,
        path=path,
        boxes=np.zeros((0, 7)),
        rests=(rest_of(joints, path, *frozen["rest"]),),
        real=Furnishing(shapes=rows, bank=bank),
        piece=frozen["piece"],
        kind="lying" if "lies" in frozen else frozen["kind"],
        maker=frozen["maker"],
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Make ``real.json`` anew; 0 if all went well, else 1 and a sentence on standard error."""
    parser = argparse.ArgumentParser("python -m dafnet_addon.data.held_out.real")
    parser.add_argument("folder", type=Path, help="the motion files")
    parser.add_argument("library", type=Path, help="the furniture library")
    return freeze(
        parser, arguments, lambda options: freeze_real(options.folder, options.library), FROZEN_REAL
    )


if __name__ == "__main__":
    sys.exit(main())
