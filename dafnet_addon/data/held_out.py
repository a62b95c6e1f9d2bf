"""Clips of bodies that training never sees, with furniture fitted to them once: what the metrics are measured on.

``held_out.json`` freezes them: which frames of which clip, its seated episodes and its furniture, found once and kept, so that
figures of different weights are of the same test. It holds no motion; that comes from the motion files.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.root import RootPath, raw_root_from_joints
from ..core.rotations import yaw_matrix
from ..core.solids import Box, Scene
from .furniture import Rest
from .prepare import load_motions
from .windows import Motion

__all__ = ["ACTIVITIES", "FROZEN", "HeldClip", "fingerprint", "held_out", "scene_of"]

FROZEN = Path(__file__).with_name("held_out.json")
ACTIVITIES = {
    "walk": ("locomotion", "walk", "turn", "run", "carry_other", "door"),
    "stand": ("standing", "standing_idle", "standing_gesture", "social_gesture", "greeting"),
    "reach": ("reach-hand-task", "documents", "work_standing"),
    "sit": ("seated", "seated_chair", "seated_table"),
    "sit down or up": ("sit-stand", "sit_down", "stand_up"),
    "lie": ("lying",),
}
"""Activities, and the categories of clips that are of them."""
_ACTIVITY = {category: activity for activity, categories in ACTIVITIES.items() for category in categories}
_SAME = 0.01  # metres by which a fingerprint may be off


@dataclass(frozen=True)
class HeldClip:
    """``joints`` (T, 22, 3): ground truth, 30 fps. ``path``: its raw root. ``boxes`` (B, 7): its furniture, the same as its
    ``scene``. ``rests``: seated episodes. ``activity``: one of ``ACTIVITIES``. ``unseen``: whether the body has no clip in
    training. ``composed``: whether it was made of several clips.
    """

    name: str
    body: str
    activity: str
    unseen: bool
    composed: bool
    joints: np.ndarray
    path: RootPath
    boxes: np.ndarray
    rests: tuple[Rest, ...]

    @property
    def scene(self) -> Scene:
        return scene_of(self.boxes)


def fingerprint(joints: np.ndarray) -> list[float]:
    """Seven numbers (metres) that tell one motion (T, 22, 3) from another: mean and spread of its points, mean step a frame."""
    step = np.linalg.norm(np.diff(joints, axis=0), axis=-1).mean()
    numbers = [*joints.mean((0, 1)), *joints.std((0, 1)), step]
    return [round(float(number), 4) for number in numbers]


def scene_of(rows: np.ndarray) -> Scene:
    """Boxes (B, 7) as solids."""
    return Scene(tuple(Box(center=r[:3], half_size=r[3:6], rotation=yaw_matrix(r[6])) for r in rows))


def _clip(frozen: dict[str, Any], motion: Motion) -> HeldClip:
    start = frozen["start"]
    joints = motion.joints[start : start + frozen["frames"]]
    if len(joints) < frozen["frames"] or np.abs(np.subtract(fingerprint(joints), frozen["fingerprint"])).max() > _SAME:
        raise InputError(
            f"The held-out clip '{frozen['name']}' is not the motion that the test's furniture was fitted to; "
            "use the motion files and the readers that 'held_out.json' was made with, or freeze the test anew."
        )
    path = raw_root_from_joints(joints)
    rests = tuple(
        Rest(a, b, np.median(joints[a:b, 0], axis=0), float(np.median(path.yaw[a:b]))) for a, b in frozen["rests"]
    )
    rows = np.array(frozen["boxes"]).reshape(-1, 7)
    body = f"{motion.source}/{motion.subject}"
    return HeldClip(
        frozen["name"], body, _ACTIVITY[motion.category], frozen["unseen"], "composed" in frozen, joints, path, rows, rests
    )


def held_out(folder: Path) -> list[HeldClip]:
    """The frozen clips, cut from the motion files in ``folder``. Raises InputError where one is missing or not the same."""
    motions = {f"{m.source}/{m.name}": m for m in load_motions(folder, "test")}
    clips = []
    for frozen in json.loads(FROZEN.read_text())["clips"]:
        if frozen["name"] not in motions:
            raise InputError(f"The held-out clip '{frozen['name']}' is not in '{folder}'; give the folder with all files.")
        clips.append(_clip(frozen, motions[frozen["name"]]))
    return clips
