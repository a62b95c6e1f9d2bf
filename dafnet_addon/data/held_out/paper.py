"""A test set like the paper's (section 6.2), as near as open data allows: five kinds of furniture,
approached and used.

The paper's test has a low chair, a high and wide one, a chair and desk low and high, and a
whiteboard, 4135 frames in all, "motion that approaches furniture from different directions, sits or
stands, and begins interacting". Nobody has published such captures, so these are composed, as
training motion is (``compose``), but of the motion of bodies that training never sees: a walk is
joined to a sit-down whose seat is moved to the wanted height; then another's captured upper body
gestures over the seated legs, or hands are led over a desk; at the board a hand is led over
captured standing. Figures on it are of composed motion and are not to be mixed with those on
captured clips.

The paper only lowers seats. Here UI-PRMD's two bodies, who sat at 0.35 and 0.47 m, are raised where
that is lower than a kind asks, to its lowest height and by no more than 4 cm; everything else is
lowered. One sits down between chair and desk, so desks stand farther off than one would draw them
up, and backs lean forward to them.

``paper.json`` freezes it: a recipe for each clip, its furniture, fitted once, and a
fingerprint. It holds no motion; that comes from the motion files. To make it anew: ``python -m
dafnet_addon.data.held_out.paper FOLDER [--seed N]``.
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.metrics import body_points
from ...core.root import RootPath, raw_root_from_joints, root_from_joints, velocities
from ...core.rotations import normalised, rotate, yaw_matrix
from ...core.skeleton import ANKLES, FEET, PELVIS, REST, SEAT_TO_PELVIS, WRISTS, joint
from ..dataset.splits import TRAINED_ON_PARTLY
from ..dataset.usable import load_motions
from ..furnish.boxes import distances
from ..furnish.flesh import probes
from ..furnish.seats import SeatKind, seat_for
from ..furnish.tops import board_for, desk_for
from ..motion.contacts import contacts
from ..motion.interactions import Interaction, stroking
from ..motion.motion import Motion, mirrored
from ..motion.rests import Rest, rest_of, resting
from ..motion.retarget import at_seat_height
from ..synthesis.compose import LEANS, at_board, at_top, seated_work
from ..synthesis.joins import join
from ..synthesis.pieces import (
    DIRECTIONS,
    TOELESS,
    WalkIndex,
    features_of,
    find_matches,
    fluent,
    index_walks,
    sit_downs,
    upper_bodies,
)
from .captured import HeldClip, fingerprint, is_frozen
from .freezing import freeze

__all__ = ["FROZEN", "freeze_paper_test", "paper_test", "side_of"]

FROZEN = Path(__file__).with_name("paper.json")
SEED = 2


@dataclass(frozen=True)
class _Kind:
    """How many ``clips``, and of one ``body`` at most; heights (metres) of the ``seat`` and of the
    desk's ``top``, where there are any; which ``chair``.
    """

    clips: int
    body: int
    seat: tuple[float, float] | None = None
    top: tuple[float, float] | None = None
    chair: SeatKind | None = None


_CHAIR = SeatKind(
    (0.20, 0.25),
    (0.13, 0.26),
    (0.10, 0.28),
    (0.03, 0.06),
    1.0,
    0.0,
    SEAT_TO_PELVIS,
    ("legs", "column"),
)
_WIDE = SeatKind(
    (0.30, 0.42),
    (0.14, 0.28),
    (0.10, 0.30),
    (0.03, 0.08),
    1.0,
    0.0,
    SEAT_TO_PELVIS,
    ("legs", "panels"),
)
_KINDS = {
    "low chair": _Kind(6, 2, (0.38, 0.42), None, _CHAIR),
    "high wide chair": _Kind(6, 3, (0.50, 0.55), None, _WIDE),
    "low chair and desk": _Kind(5, 2, (0.38, 0.42), (0.65, 0.70), _CHAIR),
    "high chair and desk": _Kind(5, 3, (0.50, 0.55), (0.75, 0.80), _CHAIR),
    "whiteboard": _Kind(6, 3),
}
_ACTIVITY = {kind: "sit down or up" if about.seat else "reach" for kind, about in _KINDS.items()}
# metres; the paper only lowers seats, here the lower of two sources may be raised by so much
_RAISED = 0.04
_COMES = 70  # frames of walking up
_FROM = 1.0  # metres from where a clip ends, at least, it begins
# metres over the floor, within which the lower foot of a walk mostly is: one of the captures is not
_FLOATS = 0.04
_KEPT = (84, 2)  # frames of a captured walk before and after the join; the way up is known for 80
# frames after a sit-down on a chair and at a desk, and at a board
_USES, _WORKS, _WRITES = 45, 85, 95
# frames after a sit-down's end, or after the join at a board, when hands are at work
_SEATED_HANDS, _STANDING_HANDS = 24, 34
# metres by which a desk's work is farther from the body than training's: one sits down before it
_FARTHER = (0.08, 0.24)
_AT_DESKS = (-0.34, -0.26, -0.18)  # radians; one leans forward to reach it
_BOARD = np.array([0.0, 0.6])  # from the root that stands before it
_TO_BOARDS = range(DIRECTIONS // 4, 3 * DIRECTIONS // 4 + 1)
_EACH = 6  # walks from each direction to a sit-down
_MOMENT = 40  # frames of a walk that count as one
_SLACK = 3  # rounds, in which more and more of the same is let in
_TRIES = 10  # pieces of furniture that are drawn
# metres over a desk's top, within which a working wrist mostly is, and one that cannot reach it
_OVER, _HOVERS = 0.08, 0.2
_OFF = 0.015  # metres by which a desk, which is fitted to hands, may be higher or lower than wanted
_DESK = (0.28, 0.15)  # metres; half the width and depth of a desk at least
_AT_BOARD = 0.1  # metres from a board within which a wrist that writes on it mostly is
# metres; half the width and height of a board, and its lower edge, at least
_WHITEBOARD, _OFF_FLOOR = (0.5, 0.3), 0.4
_ONE_SEAT = 0.25  # metres
# metres of toes over the floor at least, and of bones in furniture at most
_UNDER, _CUTS = -0.01, 0.01
_SLIDES = 0.02  # metres that a standing foot moves in a frame at most
_FEET = [*FEET, *ANKLES]
_SEATED = {"seated_chair", "seated_table"}
_GESTURES = _SEATED | {
    "standing_gesture",
    "social_gesture",
    "greeting",
    "documents",
    "work_standing",
}
_STANDS = {"standing_idle", "standing"}

Recipe = dict[str, Any]


def _unseen(folder: Path) -> dict[str, Motion]:
    """Motions by "source/name", of bodies that have no clip in training."""
    motions = load_motions(folder, "choose", "tell")
    return {
        f"{m.source}/{m.name}": m
        for m in motions
        if TRAINED_ON_PARTLY.isdisjoint({m.source, f"{m.source}/{m.subject}"})
    }


def side_of(clip: HeldClip) -> str:
    """Where a clip comes from: "front", "left", "right" or "behind".

    Front and behind are the furniture's, before its seat or its board; left and right are those of
    whoever uses it. Seen from where the clip ends.
    """
    return _side(clip.path, "board" in clip.room)


def _side(path: RootPath, board: bool) -> str:
    at, yaw = path.position[-1], float(np.median(path.yaw[-30:]))
    x, y = rotate(RootPath(at[None], np.array([yaw])).rotation[0].T, path.position[0] - at)[:2]
    if abs(x) > abs(y):
        return "right" if x > 0 else "left"
    return "front" if (y > 0) != board else "behind"


def _pieces(motion: Motion, seated: bool) -> list[np.ndarray]:
    """What a recipe counts its piece in: a motion's sit-downs, or its pieces of an upper body at
    work.
    """
    return (
        [piece.joints for piece in sit_downs([motion])]
        if seated
        else upper_bodies([motion], {motion.category})
    )


def _picked(recipe: Recipe, part: str, motions: dict[str, Motion]) -> np.ndarray:
    """The captured piece that a recipe names as its "walk", "sit", "upper" or "stand"."""
    words = recipe[part]
    motion = motions[words["clip"]]
    if part == "walk":
        found = (
            [motion.joints[words["at"] - _COMES : words["at"] + 1]]
            if words["at"] < len(motion.joints)
            else []
        )
    else:
        found = _pieces(motion, part == "sit")[words["piece"] :]

    if not found:
        raise InputError(_changed(recipe["name"]))

    return mirrored(found[0]) if words.get("mirrored") else found[0]


def _changed(name: str) -> str:
    return (
        f"The paper test's clip '{name}' is not the motion that its furniture was fitted to; use "
        "the motion files and the "
        "readers that 'paper.json' was made with, or make it anew with 'python -m "
        "dafnet_addon.data.held_out.paper FOLDER'."
    )


def _arrival(recipe: Recipe, motions: dict[str, Motion]) -> np.ndarray:
    """The walk (T, 22, 3) joined to the sit-down, its seat moved, or to standing."""
    walk = _picked(recipe, "walk", motions)
    if "stand" in recipe:
        return join(walk, _picked(recipe, "stand", motions))
    sit = _picked(recipe, "sit", motions)
    return join(walk, at_seat_height(sit, sit[-1, 0, 2], recipe["seat"] + SEAT_TO_PELVIS))


def _replayed(recipe: Recipe, motions: dict[str, Motion]) -> np.ndarray:
    """The motion (T, 22, 3) of a recipe."""
    rng = np.random.default_rng(recipe["seed"])
    joints = _arrival(recipe, motions)
    if "stand" in recipe:
        joints = at_board(rng, joints, _COMES + 8, len(joints) - 4)[: _COMES + _WRITES]
        return mirrored(joints) if recipe["mirrored"] else joints

    top = recipe.get("top")
    body, rest = seated_work(
        rng, joints, _picked(recipe, "upper", motions), _AT_DESKS if top else LEANS
    )
    if top:
        body = at_top(rng, body, rest + 5, len(body) + 60, top, recipe["farther"])

    return body[: len(joints) + (_WORKS if top else _USES)]


def _body(recipe: Recipe, motions: dict[str, Motion]) -> str:
    """Who sits or stands, as "source/subject"; the walk and the arms may be others'."""
    motion = motions[recipe[_part(recipe["kind"])]["clip"]]
    return f"{motion.source}/{motion.subject}"


def _part(kind: str) -> str:
    return "sit" if _KINDS[kind].seat else "stand"


def _held(recipe: Recipe, motions: dict[str, Motion], joints: np.ndarray) -> HeldClip:
    path = raw_root_from_joints(joints)
    rests = tuple(rest_of(joints, path, start, end) for start, end in recipe["rests"])
    return HeldClip(
        recipe["name"],
        _body(recipe, motions),
        _ACTIVITY[recipe["kind"]],
        True,
        True,
        recipe["kind"],
        joints,
        path,
        np.array(recipe["boxes"]).reshape(-1, 7),
        rests,
    )


def paper_test(folder: Path) -> list[HeldClip]:
    """The frozen clips, composed again of the motion files in ``folder``; ``room`` says of which of
    the five kinds each is.

    Raises InputError where a motion is missing or not the same.
    """
    motions = _unseen(folder)
    clips = []
    for recipe in json.loads(FROZEN.read_text(encoding="utf-8"))["clips"]:
        for name in (
            recipe[part]["clip"] for part in ("walk", "sit", "upper", "stand") if part in recipe
        ):
            if name not in motions:
                raise InputError(
                    f"The paper test's clip '{recipe['name']}' needs '{name}', which is not in "
                    f"'{folder}'; "
                    "give the folder with all files."
                )

        joints = _replayed(recipe, motions)
        if not is_frozen(joints, recipe):
            raise InputError(_changed(recipe["name"]))

        clips.append(_held(recipe, motions, joints))

    return clips


def _candidates(
    rng: np.random.Generator, kind: str, motions: dict[str, Motion], pool: WalkIndex
) -> Iterator[Recipe]:
    """Recipes of a kind, without furniture: every sit-down or stand after the walk that matches
    best from each direction.
    """
    about, part = _KINDS[kind], _part(kind)
    lend = _SEATED if about.top else _GESTURES
    uppers = [
        {"clip": name, "piece": k, "mirrored": mirror}
        for name, m in motions.items()
        if m.category in lend
        for k in range(len(_pieces(m, False)))
        for mirror in (False, True)
    ]
    for name, motion in motions.items():
        if part == "stand" and (motion.category not in _STANDS or motion.source == TOELESS):
            continue
        for k, joints in enumerate(_pieces(motion, part == "sit")):
            path = root_from_joints(joints)
            place, directions = _BOARD, _TO_BOARDS
            if about.seat:
                place, directions = (
                    rotate(path.rotation[0].T, joints[-1, PELVIS] - path.position[0])[:2],
                    range(DIRECTIONS),
                )
            for clip, at in find_matches(pool, features_of(joints)[0], place, _EACH, directions):
                walk, mirror = pool.names[clip]
                if not _comes(pool.clips[clip][at - _COMES : at + 1]):
                    continue
                recipe = {
                    "name": kind,
                    "kind": kind,
                    "seed": int(rng.integers(1 << 31)),
                    "walk": {"clip": walk, "mirrored": mirror, "at": at},
                    part: {"clip": name, "piece": k},
                }
                if about.seat is None:
                    yield recipe | {"mirrored": bool(rng.random() < 0.5)}
                    continue
                (low, high), source = about.seat, float(joints[-1, PELVIS, 2]) - SEAT_TO_PELVIS
                if source < low - _RAISED:
                    break
                seat = rng.uniform(low, max(low, min(high, source)))
                recipe |= {"upper": uppers[rng.integers(len(uppers))], "seat": round(seat, 3)}
                if about.top:
                    recipe |= {
                        "top": round(rng.uniform(*about.top), 3),
                        "farther": round(rng.uniform(*_FARTHER), 3),
                    }
                yield recipe


def _comes(walk: np.ndarray) -> bool:
    """Whether a walk (T, 22, 3) goes on the floor, forward and upright: nobody comes up to
    furniture backward or bowing.
    """
    moved = velocities(root_from_joints(walk))[:, :2]
    trunk = normalised(walk[:, joint("neck")] - walk[:, 0])[:, 2]
    over = (walk[:, _FEET, 2] - REST[_FEET, 2]).min(1)
    forward = moved[:, 1].sum() > 0.6 * np.linalg.norm(moved, axis=-1).sum()
    return bool(forward and trunk.min() > 0.9 and np.quantile(over, 0.9) < _FLOATS)


def _chair_of(
    rng: np.random.Generator, kind: SeatKind, rest: Rest, points: np.ndarray
) -> np.ndarray | None:
    """A chair of the kind, with its back, under who rests; None where no try leaves the body's way
    (``points``) free.
    """
    for _ in range(_TRIES):
        chair = seat_for(rng, rest, points, kind)
        if (
            chair is not None
            and (chair[:, 2] + chair[:, 5]).max() > rest.position[2] - SEAT_TO_PELVIS + 0.15
        ):
            return chair
    return None


def _desk_of(
    rng: np.random.Generator,
    top: float,
    joints: np.ndarray,
    works: int,
    rest: Rest,
    points: np.ndarray,
    chair: np.ndarray,
) -> np.ndarray | None:
    """A desk under the hands that work from frame ``works`` on, apart from the chair; None where
    none can be had.
    """
    over = joints[works:, WRISTS, 2] - top
    mostly = np.median(over, axis=0)
    hands = [
        joints[works:, WRISTS[i]] for i in range(2) if mostly[i] < _OVER and over[:, i].min() > 0.0
    ]
    if not hands or ((mostly >= _OVER) & (mostly < _HOVERS)).any():
        return None

    use = Interaction("desk", works, len(joints), np.concatenate(hands), rest.yaw)
    for _ in range(_TRIES):
        desk = desk_for(rng, use, points)
        if (
            desk is None
            or abs(desk[0, 2] + desk[0, 5] - top) > _OFF
            or (desk[0, 3:5] < _DESK).any()
        ):
            continue
        if distances(desk, _filled(chair)).min() > 0.0:
            return desk

    return None


def _board_of(rng: np.random.Generator, use: Interaction, points: np.ndarray) -> np.ndarray | None:
    """A board at a hand that writes, as large as whiteboards are and off the floor; None where none
    can be had.
    """
    for _ in range(_TRIES):
        board = board_for(rng, use, points)
        if (
            board is None
            or (board[0, [3, 5]] < _WHITEBOARD).any()
            or board[0, 2] - board[0, 5] < _OFF_FLOOR
        ):
            continue
        if np.median(distances(board, use.points)) < _AT_BOARD:
            return board

    return None


def _filled(boxes: np.ndarray) -> np.ndarray:
    """Points (N, 3) within upright boxes (B, 7)."""
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 7)] * 3), axis=-1).reshape(-1, 3)
    local = grid * boxes[:, None, 3:6]
    return (rotate(yaw_matrix(boxes[:, 6])[:, None], local) + boxes[:, None, :3]).reshape(-1, 3)


def _sound(joints: np.ndarray, boxes: np.ndarray) -> bool:
    """Whether a motion (T, 22, 3) is fluent and on the floor, its feet do not slide and its bones
    stay out of the furniture.
    """
    stands = contacts(joints)[:, :2]
    steps = np.linalg.norm(np.diff(joints[:, FEET, :2], axis=0), axis=-1) * (
        stands[1:] & stands[:-1]
    )
    inside = -distances(boxes, body_points(joints).reshape(-1, 3)).min()
    smooth = fluent(joints)[2:].all()  # the first frames have no speed before them
    return bool(
        smooth and joints[:, FEET, 2].min() > _UNDER and steps.max() < _SLIDES and inside < _CUTS
    )


def _furnished(
    rng: np.random.Generator, recipe: Recipe, joints: np.ndarray, path: RootPath
) -> Recipe | None:
    """The recipe with its furniture, seated episode and fingerprint; None where nothing fits or the
    motion is not sound.
    """
    about, points = _KINDS[recipe["kind"]], probes(joints)
    rests: list[list[int]] = []
    boxes: np.ndarray | None
    if about.chair is None:
        used = [use for use in stroking(joints, path) if use.end > len(joints) - 30]
        boxes = _board_of(rng, used[-1], points) if used else None
        works = _COMES + _STANDING_HANDS
    else:
        after = [
            r.start
            for r in resting(joints, path)
            if np.linalg.norm(r.position[:2] - path.position[-1, :2]) < _ONE_SEAT
        ]
        if not after:
            return None

        rest = rest_of(joints, path, after[0], len(joints))
        works, rests = (
            len(joints) - (_WORKS if about.top else _USES) + _SEATED_HANDS,
            [[rest.start, rest.end]],
        )
        boxes = _chair_of(rng, about.chair, rest, points)
        if boxes is not None and about.top:
            desk = _desk_of(rng, recipe["top"], joints, works, rest, points, boxes)
            boxes = None if desk is None else np.concatenate([boxes, desk])

    if boxes is None or not _sound(joints, boxes):
        return None

    return recipe | {
        "frames": len(joints),
        "works": works,
        "rests": rests,
        "fingerprint": fingerprint(joints),
        "boxes": np.round(boxes, 4).tolist(),
    }


def freeze_paper_test(folder: Path, seed: int = SEED) -> dict[str, Any]:
    """What ``paper.json`` holds, made of the motion files in ``folder``; the same for the same
    files and ``seed``.

    Of all ways in which the pieces may be joined, in random order, those are kept whose side, body
    and pieces are not in it too often yet; where that leaves too few, more of one body and of one
    walk's clip. Raises InputError where the folder's motion does not give every kind.
    """
    motions = _unseen(folder)
    pool = index_walks(list(motions.values()), arriving=True, kept=_KEPT)
    rng = np.random.default_rng(seed)
    used: Counter[tuple[object, ...]] = Counter()
    clips: list[Recipe] = []
    for kind, about in _KINDS.items():
        candidates = list(_candidates(rng, kind, motions, pool))
        count = 0
        for slack, i in product(range(_SLACK), rng.permutation(len(candidates))):
            recipe = candidates[i]
            piece, walk, body = recipe[_part(kind)], recipe["walk"], _body(recipe, motions)
            most = {
                (kind, body): about.body + slack,
                (kind, walk["clip"]): 3 + slack,
                (kind, piece["clip"], piece["piece"]): 1,
                (kind, walk["clip"], walk["at"] // _MOMENT): 1,
            }
            if any(used[word] >= limit for word, limit in most.items()):
                continue
            joints = _replayed(recipe, motions)
            path = raw_root_from_joints(joints)
            side = _side(path, about.seat is None)
            apart = float(np.linalg.norm(path.position[0] - path.position[-1]))
            if apart < _FROM or (about.seat is None and side == "behind"):
                continue
            if about.top is None and about.seat and side in ("left", "right"):
                # of the paper's three; one can hardly come to a desk from its front
                side = "a side"
            made = _furnished(rng, recipe, joints, path) if used[kind, side] < 2 else None
            if made is not None:
                count += 1
                clips.append(made | {"name": f"{kind} {count}"})
                used.update([*most, (kind, side)])
            if count == about.clips:
                break
        else:
            raise InputError(
                f"The motion in '{folder}' gives only {count} clips of a {kind}; give the folder "
                "with all files."
            )

    return {"version": 1, "seed": seed, "clips": clips}


def main(arguments: Sequence[str] | None = None) -> int:
    """Make ``paper.json`` anew; 0 if all went well, else 1 and a sentence on standard
    error.
    """
    parser = argparse.ArgumentParser("python -m dafnet_addon.data.held_out.paper")
    parser.add_argument("folder", type=Path, help="the motion files")
    parser.add_argument(
        "--seed", type=int, default=SEED, help="the test that ships has %(default)s"
    )
    return freeze(
        parser, arguments, lambda options: freeze_paper_test(options.folder, options.seed), FROZEN
    )


if __name__ == "__main__":
    sys.exit(main())
