"""Clips of bodies that training never sees, with furniture fitted to them once: what the metrics
are measured on.

``captured.json`` freezes them: which frames of which clip, its seated episodes and its furniture,
found once and kept, so that figures of different weights are of the same test. It holds no motion;
that comes from the motion files.
"""

import json
from collections import defaultdict
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.root import RootPath, raw_root_from_joints
from ...core.solids import Scene
from ..capture.mocap import Clip, read_clips
from ..dataset.usable import load_motions
from ..furnish.flesh import Furnishing
from ..motion.canonical import calibrate, canonical
from ..motion.motion import Motion, mirrored, motion_of
from ..motion.rests import Rest, rest_of
from ..synthesis.joins import join

__all__ = [
    "ACTIVITIES",
    "FROZEN",
    "HeldClip",
    "fingerprint",
    "frozen_text",
    "held_clip",
    "held_out",
    "is_frozen",
    "held_out_motions",
]

FROZEN = Path(__file__).with_name("captured.json")
ACTIVITIES = {
    "walk": ("locomotion", "walk", "turn", "run", "carry_other", "door"),
    "stand": ("standing", "standing_idle", "standing_gesture", "social_gesture", "greeting"),
    "reach": ("reach-hand-task", "documents", "work_standing"),
    "sit": ("seated", "seated_chair", "seated_table"),
    "sit down or up": ("sit-stand", "sit_down", "stand_up"),
    "lie": ("lying",),
}
"""Activities, and the categories of clips that are of them."""
_ACTIVITY = {
    category: activity for activity, categories in ACTIVITIES.items() for category in categories
}
_TEST_ONLY = {"hdm05_cuts"}  # share-alike: the weights that ship must not be of it
_SAME = 0.01  # metres by which a fingerprint may be off


@dataclass(frozen=True)
class HeldClip:
    """``joints`` (T, 22, 3): ground truth, 30 fps. ``path``: its raw root. ``boxes`` (B, 7): its
    furniture, the same as its ``scene``. ``rests``: seated episodes, on a bed lying ones.
    ``activity``: one of ``ACTIVITIES``. ``unseen``: whether the body has no clip in training.
    ``composed``: whether it was made of several clips, or raised from the floor onto a bed.
    ``room``: what there is beside seats and chance pieces, "desk", "shelf" or "bed" where the body
    uses one, else "". ``real``: real pieces beside the boxes; ``piece``: the one that carries the
    body, with its ``kind`` and ``maker``.
    """

    name: str
    body: str
    activity: str
    unseen: bool
    composed: bool
    room: str
    joints: np.ndarray
    path: RootPath
    boxes: np.ndarray
    rests: tuple[Rest, ...]
    real: Furnishing = field(default_factory=Furnishing)
    piece: str = ""
    kind: str = ""
    maker: str = ""

    @property
    def furniture(self) -> Furnishing:
        """All furniture, boxes and real pieces."""
        return Furnishing(self.boxes) + self.real

    @property
    def scene(self) -> Scene:
        """The same, as the core knows it."""
        return self.furniture.scene()


def fingerprint(joints: np.ndarray) -> list[float]:
    """Seven numbers (metres) that tell one motion (T, 22, 3) from another: mean and spread of its
    points, mean step a frame.
    """
    step = np.linalg.norm(np.diff(joints, axis=0), axis=-1).mean()
    numbers = [*joints.mean((0, 1)), *joints.std((0, 1)), step]
    return [round(float(number), 4) for number in numbers]


def is_frozen(joints: np.ndarray, frozen: dict[str, Any]) -> bool:
    """Whether a motion (T, 22, 3) is the one whose number of frames and fingerprint a frozen clip
    holds.
    """
    return len(joints) == frozen["frames"] and bool(
        np.abs(np.subtract(fingerprint(joints), frozen["fingerprint"])).max() <= _SAME
    )


def frozen_text(frozen: dict[str, Any]) -> str:
    """A frozen test as JSON, a clip a line."""
    lines = ",\n".join(json.dumps(clip) for clip in frozen["clips"])
    head = json.dumps({key: value for key, value in frozen.items() if key != "clips"})
    return f'{head[:-1]}, "clips": [\n{lines}\n]}}\n'


def held_out_motions(folder: Path) -> dict[str, Motion]:
    """All motions of the test by name: those of ``load_motions``, and of sources that are never
    trained on.
    """
    found = load_motions(folder, "choose", "tell")
    bodies: dict[str, list[Clip]] = defaultdict(list)
    for clip in read_clips(folder):
        if clip.source in _TEST_ONLY:
            bodies[clip.subject].append(clip)

    for clips in bodies.values():
        body, wanted = calibrate(clips), [c for c in clips if c.category in _ACTIVITY]
        found += [
            motion_of(c.name, c.source, c.subject, c.category, canonical(c, body)) for c in wanted
        ]

    return {f"{m.source}/{m.name}": m for m in found}


def _composed(recipe: dict[str, Any], motions: dict[str, Motion]) -> Motion:
    """A walk joined to a sit-down, which may be a stand-up reversed, and mirrored."""
    sit = motions[recipe["sit"]]
    joints = sit.joints[::-1] if recipe["reversed"] else sit.joints
    joints = mirrored(joints) if recipe["mirrored"] else joints
    walk = motions[recipe["walk"]].joints[: recipe["at"] + 1]
    return replace(sit, joints=join(walk, joints[recipe["entry"] :]))


def held_clip(frozen: dict[str, Any], motion: Motion) -> HeldClip:
    """A frozen clip with its motion. Raises InputError where that is another one."""
    start = frozen["start"]
    raised = frozen.get("raised", 0.0)
    joints = motion.joints[start : start + frozen["frames"]] + np.array([0.0, 0.0, raised])
    if not is_frozen(joints, frozen):
        raise InputError(
            f"The held-out clip '{frozen['name']}' is not the motion that the test's furniture "
            "was fitted to; "
            "use the motion files and the readers that 'captured.json' was made with, or freeze "
            "the test anew."
        )

    path = raw_root_from_joints(joints)
    rests = tuple(rest_of(joints, path, a, b) for a, b in frozen["rests"])
    return HeldClip(
        frozen["name"],
        f"{motion.source}/{motion.subject}",
        _ACTIVITY[motion.category],
        frozen["unseen"],
        "composed" in frozen or raised > 0,
        frozen.get("room", ""),
        joints,
        path,
        np.array(frozen["boxes"]).reshape(-1, 7),
        rests,
    )


def held_out(folder: Path) -> list[HeldClip]:
    """The frozen clips, cut from the motion files in ``folder``. Raises InputError where one is
    missing or not the same.
    """
    motions = held_out_motions(folder)
    clips = []
    for frozen in json.loads(FROZEN.read_text(encoding="utf-8"))["clips"]:
        recipe = frozen.get("composed")
        needed = [recipe["walk"], recipe["sit"]] if recipe else [frozen["name"]]
        for name in needed:
            if name not in motions:
                raise InputError(
                    f"The held-out clip '{name}' is not in '{folder}'; give the folder with all "
                    "files."
                )

        clips.append(
            held_clip(frozen, _composed(recipe, motions) if recipe else motions[frozen["name"]])
        )

    return clips
