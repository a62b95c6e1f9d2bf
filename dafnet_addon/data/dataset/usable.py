"""Which clips are used, on the canonical body, and why the others are not."""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from ...core.errors import InputError
from ...core.series import MODEL_FPS
from ..capture.mocap import Clip, leaving_out, read_clips
from ..motion.borrowed_arms import with_arms
from ..motion.canonical import Calibration, calibrate, canonical
from ..motion.motion import Motion, motion_of
from .splits import role_of_clip

__all__ = [
    "AT_BENCHES",
    "AT_BOARDS",
    "AT_DESKS",
    "LIES",
    "SITS",
    "STANDS",
    "WALKS",
    "calibrated",
    "load_motions",
    "motions_of",
    "not_used",
]

WALKS = {"locomotion", "walk", "turn", "run", "carry_other", "door"}
STANDS = {
    "standing",
    "standing_idle",
    "standing_gesture",
    "social_gesture",
    "greeting",
    "documents",
    "reach-hand-task",
}
SITS = {"sit-stand", "sit_down", "stand_up", "seated", "seated_chair", "seated_table"}
LIES = {"lying"}
AT_BOARDS = {"board"}
"""Hands that write on, wipe and paint what stands upright before them."""
AT_BENCHES = {"work_standing", "kitchen_mime"}
"""Hands that work before a body that stands."""
AT_DESKS = {"desk_mime"}
"""What people do at a desk, standing: only what is above the hips is of use."""

_USED = WALKS | STANDS | SITS | LIES | AT_BOARDS | AT_BENCHES | AT_DESKS
_AVOIDED = (
    "jump",
    "uneven",
    "hop",
    "march",
    "kick",
    "flip",
    "squat",
    "balance",
    "crouch",
    "swing legs",
    "lie",
)
"""Beginnings of words, of clips of the used categories that are not used after all."""

_SHARE_ALIKE = {"hdm05_cuts"}
_ONE_RIG = {"cmu_daz", "cmu_expmap", "cmu_fbx", "gazebo_actors", "snu_tiling", "snu_ys2010"}
_ARMS_RAISED = {"ui_prmd"}
_LEND_ARMS = ("standing_idle", "seated_chair")
_MINUTE = round(60 * MODEL_FPS)


def _avoided(text: str) -> str:
    """The first of ``_AVOIDED`` that a word of the text begins with; chopping is not hopping."""
    return next((word for word in _AVOIDED if re.search(rf"(?<![a-z]){word}", text)), "")


def _why_not(clip: Clip) -> str:
    """Why a clip is not used; nothing where it is."""
    if clip.source in _SHARE_ALIKE:
        return "under a share-alike licence, which would bind the weights"
    if not clip.split:
        return "of no split, or of no stated licence"
    if not role_of_clip(clip):
        return "of people without names, who may be those of the test"
    if clip.category not in _USED:
        return f"of the activity '{clip.category}', of which no windows are drawn"
    if clip.category in LIES:
        return ""

    # "chopOnions" and "chop_onions" are two words, as "chop onions" is.
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", f"{clip.name} {clip.description}").lower()
    word = _avoided(apart)
    return f"whose name or description says '{word}'" if word else ""


def not_used(clips: Iterable[Clip]) -> list[str]:
    """A sentence for each reason why clips are not used."""
    frames: Counter[str] = Counter()
    count: Counter[str] = Counter()
    sources: dict[str, set[str]] = defaultdict(set)
    for clip in clips:
        why = _why_not(clip)
        if why:
            frames[why] += len(clip.joints)
            count[why] += 1
            sources[why].add(clip.source)

    return [
        f"Not used: {n / _MINUTE:.1f} minutes {why} ({count[why]} of the clips of "
        f"{', '.join(sorted(sources[why]))})."
        for why, n in frames.most_common()
    ]


def calibrated(
    clips: Iterable[Clip], roles: Sequence[str], left_out: list[str] | None
) -> list[tuple[Clip, Calibration]]:
    """The clips of some roles that are used, body by body, each with its body's constants,
    calibrated on all its clips.
    """
    bodies: dict[tuple[str, str], list[Clip]] = defaultdict(list)
    for clip in clips:
        if clip.source not in _SHARE_ALIKE:
            bodies[clip.source, "" if clip.source in _ONE_RIG else clip.subject].append(clip)

    found: list[tuple[Clip, Calibration]] = []
    for own in bodies.values():
        used = [clip for clip in own if role_of_clip(clip) in roles and not _why_not(clip)]
        if used:
            with leaving_out(left_out):
                body = calibrate(own)
                found += [(clip, body) for clip in used]

    return found


def motions_of(
    found: list[tuple[Clip, Calibration]], roles: Sequence[str], left_out: list[str] | None
) -> list[Motion]:
    """The calibrated clips of some roles on the canonical body; arms that are not real are
    borrowed from another clip.
    """
    fitted = [(clip, canonical(clip, body)) for clip, body in found if role_of_clip(clip) in roles]
    rng = np.random.default_rng(7)
    lend = {kind: [j for c, j in fitted if c.category == kind] for kind in _LEND_ARMS}
    motions = []
    for clip, joints in fitted:
        with leaving_out(left_out):
            if clip.source in _ARMS_RAISED:
                if not all(lend.values()):
                    raise InputError(
                        f"The clip '{clip.name}' of '{clip.source}' has arms that are not real, "
                        "and none to borrow; add clips "
                        f"of the same split and of the categories {' and '.join(lend)}."
                    )
                poses = [
                    clips[i][rng.integers(len(clips[i]))]
                    for clips in lend.values()
                    for i in [rng.integers(len(clips))]
                ]
                joints = with_arms(joints, *poses)
            motions.append(motion_of(clip.name, clip.source, clip.subject, clip.category, joints))

    return motions


def load_motions(folder: Path, *roles: str) -> list[Motion]:
    """Every usable clip of these roles (``splits``: 'train', 'choose', 'tell') on the canonical
    body, bodies calibrated on all their clips.

    Raises InputError where a file or a body cannot be used.
    """
    return motions_of(calibrated(read_clips(folder), roles, None), roles, None)
