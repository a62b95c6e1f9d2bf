"""Moments of motion that windows are drawn around: what kinds there are, how often each is drawn,
and where they are.
"""

from collections import defaultdict

import numpy as np

from ...core.errors import InputError
from ...core.root import root_from_joints
from ...core.series import MODEL_FPS
from ...core.skeleton import PELVIS
from ..furnish.flesh import NO_BANK
from ..furnish.shapes import ShapeBank
from ..motion.interactions import stroking, working
from ..motion.motion import Motion
from ..synthesis.compose import composed
from .motions import Draws
from .usable import AT_BENCHES, AT_BOARDS, SITS, STANDS, WALKS
from .windows import AS_PEOPLE_DO, Augmentation, Window, draw_window

__all__ = ["SHARES", "moments_of", "sample"]

SHARES = {
    "approach": 0.13,
    "leave": 0.06,
    "wait": 0.05,
    "descend": 0.11,
    "sit": 0.05,
    "work": 0.05,
    "posture": 0.14,
    "desk": 0.05,
    "counter": 0.03,
    "bench": 0.03,
    "write": 0.03,
    "board": 0.03,
    "lie": 0.05,
    "walk": 0.13,
    "stand": 0.06,
}
"""Shares of windows. Composed: walking up to a seat and sitting down, standing up and walking off,
standing before a seat, hands at work over seated legs, postures of sitting, work at a desk, a
counter or a board, lying down on a bed or getting up. Captured: around a sit-down or stand-up,
seated, work at a bench and at a board, walking, standing.
"""

_DRAWS = 2000  # in a row, of which none gives a window
_MOVES = 0.12  # metres a second: a pelvis that goes down or up
_AROUND_A_REST = 75  # frames before and after it, in which a body may be on its way
_EVERY = 10  # frames between moments of what lasts

_OF_A_SIT_DOWN = {"ui_prmd": 0.35, "snu_tiling": 3.0}
"""Weights: the one stands with borrowed arms, the other walks up to it."""
_OF_STANDING = {"reactidle": 0.1}
_NAMED = 4  # clips that a sentence names
_MIRRORED_LEG = "CMU_79"
"""Who stands on one captured leg, seen twice."""


def _around_rests(motion: Motion) -> dict[str, list[tuple[int, float]]]:
    """Frames, with weights, in which a body sits down or gets up ("descend"), and rests ("sit")."""
    height = motion.joints[:, PELVIS, 2]
    moving = np.abs(np.gradient(height)) * MODEL_FPS > _MOVES
    weight = _OF_A_SIT_DOWN.get(motion.source, 1.0)
    found: dict[str, list[tuple[int, float]]] = {"descend": [], "sit": []}
    for rest in motion.rests:
        near = np.arange(
            max(0, rest.start - _AROUND_A_REST), min(len(height), rest.end + _AROUND_A_REST)
        )
        on_the_way = near[moving[near]]
        found["descend"] += [(int(f), weight / len(on_the_way)) for f in on_the_way]
        found["sit"] += [(f, 1.0) for f in range(rest.start, rest.end, _EVERY)]
    return found


def _of_hands(motion: Motion) -> dict[str, list[tuple[int, float]]]:
    """Frames in which hands work at a bench or stroke a board."""
    path = root_from_joints(motion.joints)
    at_board = motion.category in AT_BOARDS
    uses = (stroking if at_board else working)(motion.joints, path)
    frames = sorted({f for use in uses for f in range(use.start, use.end, _EVERY)})
    return {"board" if at_board else "bench": [(f, 1.0) for f in frames]}


def _captured_in(motion: Motion) -> dict[str, list[tuple[int, float]]]:
    """Frames of one captured motion to draw windows around, with weights, by kind."""
    if motion.category in SITS:
        return _around_rests(motion)
    if motion.category in AT_BOARDS | AT_BENCHES and motion.subject != _MIRRORED_LEG:
        return _of_hands(motion)
    if motion.category in WALKS | STANDS:
        weight = _OF_STANDING.get(motion.source, 1.0)
        kind = "walk" if motion.category in WALKS else "stand"
        return {kind: [(f, weight) for f in range(0, len(motion.joints), _EVERY)]}
    return {}


def moments_of(captured: list[Motion]) -> tuple[list[Motion], Draws, list[str]]:
    """Captured motions and those composed of them; the moments of each kind, in proportion to what
    there is of it; and a sentence for each activity of which some clips give no moment.
    """
    found: dict[str, list[tuple[int, int, float]]] = defaultdict(list)
    without: dict[str, list[Motion]] = defaultdict(list)
    for i, motion in enumerate(captured):
        own = _captured_in(motion)
        for kind, rows in own.items():
            found[kind] += [(i, frame, weight) for frame, weight in rows]
        if not any(own.values()) and (why := _why_without(motion)):
            without[why].append(motion)

    motions = list(captured)
    for made in composed(captured):
        found[made.kind] += [(len(motions), int(f), 1.0 / len(made.focus)) for f in made.focus]
        motions.append(made.motion)

    tables = {kind: np.array(rows) for kind, rows in found.items() if rows}
    draws = {kind: (t[:, :2].astype(int), t[:, 2] / t[:, 2].sum()) for kind, t in tables.items()}
    return motions, draws, [_without(why, of) for why, of in without.items()]


def _why_without(motion: Motion) -> str:
    """Why no window is drawn around a captured motion; nothing where it is there to be composed
    with.
    """
    if motion.category in SITS:
        return "sitting, in which the pelvis rests nowhere"
    if motion.category in AT_BOARDS | AT_BENCHES and motion.subject == _MIRRORED_LEG:
        return "work on a leg that is the other's copy (what is above the hips is composed with)"
    if motion.category in AT_BOARDS:
        return "work at boards, in which no hand strokes a plane"
    if motion.category in AT_BENCHES:
        return "work at benches, in which no hand keeps a level (it is composed with)"
    return ""


def _without(why: str, motions: list[Motion]) -> str:
    minutes = sum(len(m.joints) for m in motions) / (60 * MODEL_FPS)
    names = ", ".join(f"{m.source}/{m.name}" for m in motions[:_NAMED])
    more = f" and {len(motions) - _NAMED} more" if len(motions) > _NAMED else ""
    return f"Not drawn around: {minutes:.1f} minutes of {why} ({names}{more})."


def sample(
    rng: np.random.Generator,
    motions: list[Motion],
    draws: Draws,
    bank: ShapeBank = NO_BANK,
    augmentation: Augmentation = AS_PEOPLE_DO,
) -> tuple[str, Window]:
    """A kind of moment by its share, a moment of that kind, and a window around it.

    Raises InputError where hardly any window can be drawn.
    """
    kinds = [kind for kind in SHARES if kind in draws]
    share = np.array([SHARES[kind] for kind in kinds])
    for _ in range(_DRAWS):
        kind = kinds[rng.choice(len(kinds), p=share / share.sum())]
        rows, weight = draws[kind]
        motion, frame = rows[rng.choice(len(rows), p=weight)]
        window = draw_window(rng, motions[motion], int(frame), bank, augmentation)
        if window is not None:
            return kind, window

    raise InputError(
        f"In {_DRAWS} tries no window could be drawn from the motion, most likely since its clips "
        "are shorter than three "
        "seconds or have many bad frames; give longer or cleaner ones (see summary.txt)."
    )
