"""Who sits leans back or forward as far as is asked, from how he sits by himself: all over the
pelvis turns about it, the head stays more level, hands that hold on to something stay.

Joints are (T, 22, 3), world, canonical metres. Angles are of the trunk, back is positive.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from .kinematics import with_wrists_at
from .occupancy import distance as distance_to
from .resting import Distance, across_of, lying, reclined, resting
from .root import gaussian
from .rotations import matrix_from_vector, rotate
from .series import MODEL_FPS, runs
from .skeleton import ELBOWS, HEAD, LIMBS, NECK, OFFSETS, PELVIS, SHOULDERS, SPINE, WRISTS
from .softness import LIES_LOWER, Support
from .solids import Scene
from .take import Finding

__all__ = ["Lean", "lean_findings", "lean_of", "with_lean"]

_EASE = 0.3  # seconds; deviation of the Gaussian with which a lean comes and goes
_LATER = 0.3  # seconds from when one sits to when it has half come, and before one gets up
_HANDS_EASE = 0.15  # seconds; deviation of the Gaussian with which a hand goes along, or stays
_LEVEL = 0.6  # share of a lean that the neck takes back, so that the face does not look up
_STRETCHED = 0.97  # of an arm's length, up to which a hand stays where it holds on
_TRUNK = [*SPINE, NECK, HEAD]
_SKIN = 0.05  # metres of a hard back or a table that a trunk comes up to
_GIVES_WAY = 0.6  # of a seat's softness, by which its back gives way
_HAIR = 1e-3  # metres
_TRIED = 10  # parts of a lean of which the last is taken that is free
_STEADY = 4.0  # frames at the model's rate; deviation of the Gaussian over what furniture leaves
_FELT = np.radians(3.0)  # by which a lean falls short, from where on it is said
_LASTS = 0.5  # seconds that it does, at least


class Lean(NamedTuple):
    """How far the trunk leans more than by itself, radians (T,): what is ``asked`` of who sits, and
    how much of that is ``done``: as far as furniture leaves room, and none where the head is
    ``held`` (T,) by a target.
    """

    asked: np.ndarray
    done: np.ndarray
    held: np.ndarray


def _seated(joints: np.ndarray, support: Support, fps: float) -> np.ndarray:
    """How far (T,) somebody sits, coming and going in steps, later than he sits down and sooner
    than he gets up.
    """
    lies = lying(joints)
    later, out = round(_LATER * fps), np.zeros(len(joints))
    for start, stop in resting(joints, support.carried - LIES_LOWER * lies, fps):
        first = start + later if start > 0 else 0
        out[first : stop - later if stop < len(joints) else stop] = 1.0
    return out * (1.0 - lies)


def lean_of(
    joints: np.ndarray,
    asked: np.ndarray,
    support: Support,
    distance: Distance | None,
    targets: Mapping[str, np.ndarray],
    fps: float,
) -> Lean:
    """How far somebody leans where ``asked`` (T,), radians: while he sits on what is his
    ``support`` and does not lie, no farther than he meets furniture, by its ``distance``.
    ``targets``: as of ``conditions.targets_of``; where the head has one, it leads the trunk.
    """
    angle = _seated(joints, support, fps) * asked
    head = targets.get("head")
    held = np.zeros(len(joints), bool) if head is None else np.isfinite(head).all(axis=-1)
    if not angle.any():
        return Lean(angle, angle, held)
    angle = gaussian(angle, _EASE * fps)
    part = 1.0 - _covered(held.astype(float), _EASE * fps)
    if distance is not None:
        part *= _room(joints, angle, support, distance, fps)
    return Lean(angle, angle * part, held)


def _room(
    joints: np.ndarray, angle: np.ndarray, support: Support, distance: Distance, fps: float
) -> np.ndarray:
    """The part (T,) of an ``angle`` (T,) by which a trunk can lean without meeting furniture."""
    keeps_away = (_SKIN - _GIVES_WAY * np.nan_to_num(support.softness))[:, None]
    within = keeps_away - distance(joints[:, _TRUNK])
    allowed = np.maximum(within, 0.0) + _HAIR  # it is never deeper in anything than by itself
    part, open_way = np.zeros(len(joints)), np.ones(len(joints), bool)
    before = within - allowed
    for k in range(1, _TRIED + 1):
        leans = reclined(joints, angle * k / _TRIED)
        over = keeps_away - distance(leans[:, _TRUNK]) - allowed
        met = (over > 0.0).any(axis=1)
        crossed = np.where(over > 0.0, before / np.minimum(before - over, -1e-9), 1.0)
        step = np.where(met, np.clip(crossed.min(axis=1), 0.0, 1.0), 1.0)
        part += open_way * step / _TRIED
        open_way &= ~met
        before = over
    return 1.0 - _covered(1.0 - part, _STEADY * fps / MODEL_FPS)


def _covered(shares: np.ndarray, deviation: float) -> np.ndarray:
    """Shares (T, …) led to and from softly, and nowhere less: the most of the frames around, under
    a Gaussian.
    """
    reach = round(2.0 * deviation)
    wide = np.pad(shares, [(reach, reach), *[(0, 0)] * (shares.ndim - 1)], mode="edge")
    most = np.lib.stride_tricks.sliding_window_view(wide, 2 * reach + 1, axis=0).max(axis=-1)
    return np.clip(gaussian(most, deviation), 0.0, 1.0)


def with_lean(joints: np.ndarray, angle: np.ndarray, holds: np.ndarray, fps: float) -> np.ndarray:
    """Joints of which the trunk leans by an ``angle`` (T,), radians. Hands stay as far as they hold
    on to something, ``holds`` (T, 2), and before and after; free arms hang as they did.
    """
    out = reclined(joints, angle)
    level = matrix_from_vector(-_LEVEL * angle[:, None] * across_of(joints))
    out[:, HEAD] = out[:, NECK] + rotate(level, out[:, HEAD] - out[:, NECK])

    moved = out[:, SHOULDERS] - joints[:, SHOULDERS]
    keeps = _covered(holds, _HANDS_EASE * fps)[..., None]
    wrists, elbows = (joints[:, at] + (1.0 - keeps) * moved for at in (WRISTS, ELBOWS))
    # A hand that is pulled off what it holds on to lets go before the arm is straight.
    length = sum(float(np.linalg.norm(OFFSETS[j])) for j in LIMBS["left_arm"][1:])
    arms = wrists - out[:, SHOULDERS]
    before = np.linalg.norm(joints[:, WRISTS] - joints[:, SHOULDERS], axis=-1, keepdims=True)
    longest = np.maximum(_STRETCHED * length, before)
    far = np.linalg.norm(arms, axis=-1, keepdims=True)
    wrists = out[:, SHOULDERS] + arms * np.minimum(1.0, longest / np.maximum(far, 1e-9))
    return with_wrists_at(out, wrists, elbows)


def _back(joints: np.ndarray) -> np.ndarray:
    """How far (T,) a trunk leans back, radians."""
    trunk = joints[:, NECK] - joints[:, PELVIS]
    forward = np.cross((0.0, 0.0, 1.0), across_of(joints))
    return np.arctan2(-(trunk * forward).sum(axis=-1), trunk[:, 2])


def lean_findings(
    before: np.ndarray,
    joints: np.ndarray,
    lean: Lean | None,
    scene: Scene,
    fps: float,
    floor: np.ndarray,
) -> Iterator[Finding]:
    """What there is to say of a lean that somebody does not come to: joints ``before`` it, and
    after all that was done; ``floor`` (T,): its height.
    """
    if lean is None:
        return
    short = np.sign(lean.asked) * (lean.asked - (_back(joints) - _back(before)))
    for start, stop in runs(short > _FELT, at_least=_LASTS * fps):
        at = start + int(np.argmax(short[start:stop]))
        asked = abs(float(np.degrees(lean.asked[at])))
        came = max(0.0, asked - float(np.degrees(short[at])))
        barred = not lean.held[at] and abs(lean.asked[at] - lean.done[at]) > _FELT / 2.0
        why = (
            f"'{_nearest(joints[at], scene, floor[at])}' is there"
            if barred
            else "a target holds it"
        )
        yield Finding(
            f"leans {came:.0f}\u00b0",
            f"Leans {'back' if lean.asked[at] > 0.0 else 'forward'} by {came:.0f}\u00b0 instead of "
            f"{asked:.0f}\u00b0 at {at / fps:.1f} s: {why}; ask for less Lean, or move that",
            good=False,
        )


def _nearest(joints: np.ndarray, scene: Scene, floor: float) -> str:
    """The piece of furniture that is nearest to a trunk (22, 3)."""
    trunk = joints[None, _TRUNK]
    gaps = [distance_to(Scene((each,)), trunk, floor).min() for each in scene.solids]
    return scene.solids[int(np.argmin(gaps))].name or "the furniture"
