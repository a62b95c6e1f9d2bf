"""What the action predictor says along real clips, and how much their likelihood owes to it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.beginning import PREROLL
from ...core.conditions import shot_steps
from ...core.metrics import action_information, mutual_information
from ...core.progress import run_to_end
from ...core.root import to_root
from ...core.sampler import Sampler
from ...core.series import MODEL_FPS
from ...core.take import Controls
from ...core.weights import Weights
from ...data.held_out.captured import ACTIVITIES, HeldClip
from ..batches import NOISE
from .clips import Figures, map_clips, pooled_row

__all__ = ["FollowedClip", "actions_and_likelihood", "follow"]

_LIKELY = 0.02
"""Share of frames in which an action has to be the likeliest."""


@dataclass(frozen=True)
class FollowedClip:
    """The model led along a real clip: actions (T, K), and nats a frame (T,) of negative
    log-likelihood.
    """

    clip: HeldClip
    actions: np.ndarray
    nats: np.ndarray


def follow(sampler: Sampler, task: tuple[HeldClip, np.ndarray | None]) -> FollowedClip:
    """Actions and likelihood of a clip's true poses, FREE, in metres, with the noise of training;
    of other actions if given.
    """
    clip, other = task
    root = clip.path.matrices()
    held = Controls(MODEL_FPS, root, before=clip.joints[:1], before_root=root[:1])
    shot = run_to_end(shot_steps(clip.scene, held))

    rng = np.random.default_rng(len(clip.joints))
    poses = to_root(shot.path, clip.joints).reshape(-1, 66)
    poses = np.concatenate([np.repeat(poses[:1], PREROLL, axis=0), poses])
    poses = sampler.standardised(poses + rng.normal(0.0, NOISE, poses.shape)).astype(np.float32)

    sampler.start(shot.conditions)
    actions, nats = [], []
    metres = float(np.log(sampler.network.normalisation.pose_std).sum())
    for t, pose in enumerate(poses[:, None]):
        frame = sampler.encode(
            t, pose, None if other is None or t < PREROLL else other[t - PREROLL, None]
        )
        actions.append(frame.inputs[0, : sampler.actions])
        gaussian = 0.5 * (frame.noise**2 + np.log(2.0 * np.pi)).sum()
        nats.append(float(gaussian - frame.log_det[0]) + metres)

    return FollowedClip(clip, np.array(actions[PREROLL:]), np.array(nats[PREROLL:]))


def actions_and_likelihood(
    weights: Weights, clips: Sequence[HeldClip], progress: Callable[[float], None]
) -> dict[str, Any]:
    """What the action predictor, if there is one, says along real clips, and how much the
    likelihood of their poses owes to it.
    """
    tasks: list[tuple[HeldClip, np.ndarray | None]] = [(clip, None) for clip in clips]
    own = list(map_clips(weights, follow, tasks, lambda share: progress(share / 2)))
    actions = np.concatenate([each.actions for each in own])

    activity = np.repeat([clip.activity for clip in clips], [len(clip.joints) for clip in clips])
    present = [name for name in ACTIVITIES if (activity == name).any()]
    groups = {"all": present, **{name: [name] for name in present}}
    counts = {"clips": len(clips), "frames": len(actions)}
    if not actions.shape[1]:
        likelihood = {label: _likelihood(own, chosen) for label, chosen in groups.items()}
        return {**counts, "likelihood": likelihood}

    tasks = list(zip(clips, _shuffled(actions, clips), strict=True))
    shuffled = list(map_clips(weights, follow, tasks, lambda share: progress(0.5 + share / 2)))

    likeliest = actions.argmax(1)
    shares = {"all": _shares(likeliest, actions.shape[1])}
    return {
        **counts,
        "information_nats": round(action_information(actions), 4),
        "likeliest_in_2_percent": int((shares["all"] >= _LIKELY).sum()),
        "normalised_mutual_information": round(mutual_information(likeliest, activity), 4),
        "shares": {
            label: [round(float(share), 3) for share in found]
            for label, found in (
                shares
                | {name: _shares(likeliest[activity == name], actions.shape[1]) for name in present}
            ).items()
        },
        "likelihood": {
            label: _likelihood(own, chosen) | _worth(own, shuffled, chosen)
            for label, chosen in groups.items()
        },
    }


def _shuffled(actions: np.ndarray, clips: Sequence[HeldClip]) -> list[np.ndarray]:
    """Actions (N, K) of all clips' frames in another order, the same each time, clip by clip."""
    mixed = actions[np.random.default_rng(0).permutation(len(actions))].astype(np.float32)
    return np.split(mixed, np.cumsum([len(clip.joints) for clip in clips])[:-1])


def _shares(likeliest: np.ndarray, actions: int) -> np.ndarray:
    """In which share of frames (N,) each action is the likeliest."""
    return np.bincount(likeliest, minlength=actions) / len(likeliest)


def _pooled(
    clips: Sequence[FollowedClip], nats: Sequence[np.ndarray], chosen: Sequence[str]
) -> tuple[dict[str, Any], np.ndarray]:
    """The row of nats (one array for each clip), and their means by clip, in clips of the chosen
    activities.
    """
    own = [n for each, n in zip(clips, nats, strict=True) if each.clip.activity in chosen]
    found = pooled_row([Figures({"nats": (float(n.sum()), float(len(n)))}) for n in own])
    return found, np.array([float(n.mean()) for n in own])


def _likelihood(clips: Sequence[FollowedClip], chosen: Sequence[str]) -> dict[str, Any]:
    """Negative log-likelihood in clips of the chosen activities."""
    found, means = _pooled(clips, [each.nats for each in clips], chosen)
    return {
        "clips": len(means),
        "nll": found["nats"],
        "nll_interval": found["intervals"]["nats"],
        "nll_median_clip": round(float(np.median(means)), 3),
    }


def _worth(
    own: Sequence[FollowedClip], shuffled: Sequence[FollowedClip], chosen: Sequence[str]
) -> dict[str, Any]:
    """What shuffled actions add to the negative log-likelihood in clips of the chosen
    activities.
    """
    rise = [other.nats - each.nats for each, other in zip(own, shuffled, strict=True)]
    found, means = _pooled(own, rise, chosen)
    return {
        "shuffled_adds": found["nats"],
        "shuffled_adds_interval": found["intervals"]["nats"],
        "shuffled_adds_median_clip": round(float(np.median(means)), 3),
        "shuffled_worse_in_clips": round(float(np.mean(means > 0)), 4),
    }
