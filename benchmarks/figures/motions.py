"""Motion for the figures: the network's own, nothing done to it afterwards."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from dafnet_addon import Controls, generate
from dafnet_addon.core.beginning import PREROLL
from dafnet_addon.core.conditions import shot_steps
from dafnet_addon.core.kinematics import fit, forward_kinematics
from dafnet_addon.core.paths import Route
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import RootPath, to_world
from dafnet_addon.core.sampler import Sampler
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import END_EFFECTORS
from dafnet_addon.core.weights import Weights

from .furniture import Piece, scene_of

__all__ = ["Motion", "free", "make", "make_with", "motion_of", "staying", "target_error"]


@dataclass(frozen=True)
class Motion:
    """Global joint frames (T, 22, 3, 3) and joints (T, 22, 3) on constant bones; action
    probabilities (T, K), K may be 0.
    """

    frames: np.ndarray
    joints: np.ndarray
    action: np.ndarray

    def __len__(self) -> int:
        return len(self.joints)


def motion_of(joints: np.ndarray, action: np.ndarray) -> Motion:
    pelvis, frames = fit(joints)
    return Motion(frames, forward_kinematics(frames, pelvis), action)


def make(weights: Weights, pieces: Iterable[Piece], controls: Controls) -> Motion:
    """One take, as the add-on makes it, but for the clean-up."""
    take = generate(scene_of(pieces), controls, weights)
    return motion_of(take.joints, take.action)


def make_with(sampler: Sampler, pieces: Iterable[Piece], controls: Controls) -> Motion:
    """One take of any system, in one mode."""
    shot = run_to_end(shot_steps(scene_of(pieces), controls))
    made = run_to_end(sampler.run(shot.conditions, np.zeros((1, 66))))
    return motion_of(
        to_world(shot.path, made.poses[PREROLL:, 0].reshape(-1, 22, 3)), made.actions[PREROLL:, 0]
    )


def free(walked: Route) -> Controls:
    return Controls(fps=MODEL_FPS, root=walked.path.matrices())


def staying(seconds: float) -> RootPath:
    """A root that stays at the origin and looks along +y."""
    frames = round(MODEL_FPS * seconds)
    return RootPath(np.zeros((frames, 3)), np.zeros(frames))


def target_error(motion: Motion, controls: Controls, skipped: int = 0) -> float:
    """Mean distance of head and wrists from what was asked of them, centimetres, but for the first
    ``skipped`` frames of EE.
    """
    asked = np.broadcast_to(np.asarray(controls.mode) == "EE", len(controls)).copy()
    asked[: int(np.argmax(asked)) + skipped] = False
    gaps = [
        np.linalg.norm(motion.joints[:, j] - target, axis=-1)[asked]
        for name, j in END_EFFECTORS.items()
        if (target := getattr(controls, name)) is not None
    ]
    return 100.0 * float(np.nanmean(np.concatenate(gaps)))
