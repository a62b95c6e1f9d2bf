"""From motion files to a training set: clips on the canonical body, and a pool of augmented, furnished windows on disk.

A dataset is a folder: ``dataset.json`` (what it was made from), ``pool-NNN.npz`` (training windows) and ``held.npz`` (windows
of held-out clips, for the likelihood).
"""

import json
from collections import defaultdict
from collections.abc import Callable, Iterator
from multiprocessing import Pool
from pathlib import Path

import numpy as np

from ..core.rotations import frame_from, normalised
from ..core.skeleton import OFFSETS, PARENTS
from .canonical import calibrate, canonical
from .compose import entrance, joined, matches
from .mocap import Clip, read_clips
from .windows import Motion, Window, draw, mirrored, motion_of

__all__ = ["load_motions", "prepare", "load_pool", "TRAINED_ON_PARTLY"]

_WALK = {"locomotion", "walk", "turn", "run", "carry_other", "door"}
_STAND = {"standing", "standing_idle", "standing_gesture", "social_gesture", "greeting", "work_standing", "documents",
          "reach-hand-task"}
_SIT = {"sit-stand", "sit_down", "stand_up", "seated", "seated_chair", "seated_table"}
_AVOID = ("jump", "uneven", "hop", "march", "kick", "flip", "squat", "balance", "crouch", "swing legs", "lie")
_SHARES = {"approach": 0.20, "descend": 0.29, "sit": 0.10, "walk": 0.27, "stand": 0.14}
"""Shares of windows: walking up to a seat and sitting down (composed), around a captured sit-down or stand-up, seated,
walking, standing.
"""
_COMPOSED = "composed"
_COMPOSITION = (
    "walks joined to sit-downs; seats moved to other heights; mirrored, reversed, re-timed; arms lent to the UI-PRMD bodies; "
    "all furniture"
)
"""What in the training motion nobody ever did in one piece; said on the weights' card."""
_TRIES, _JOINS = 60, 8  # walks tried and joins kept for each captured sit-down and its mirror image

_SHARE_ALIKE = {"hdm05_cuts"}
_ONE_RIG = {"cmu_daz", "cmu_expmap", "gazebo_actors", "snu_tiling", "snu_ys2010"}
_ARMS_RAISED = {"ui_prmd"}
_WEIGHT = {"ui_prmd": 0.35, "snu_tiling": 3.0}  # of a sit-down: the one stands with borrowed arms, the other walks up to it
TRAINED_ON_PARTLY = {"cmu69", "snu_tiling/wd2(dir 1)", "snu_ys2010", "gazebo_actors"}
"""Bodies with clips on both sides of the split; figures of their test clips are reported apart."""

_ARMS = [18, 20, 19, 21]  # elbow and wrist, left then right
_SHARD = 1000


def _wanted(clip: Clip) -> bool:
    if clip.source in _SHARE_ALIKE or clip.category not in _WALK | _STAND | _SIT:
        return False
    return not any(word in f"{clip.name} {clip.description}".lower() for word in _AVOID)


def _arm_directions(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Chest frames (T, 3, 3) and, in them, unit directions (T, 4, 3) of upper arms and forearms."""
    chest = frame_from(joints[:, 12] - joints[:, 9], joints[:, 14] - joints[:, 13], "zx")
    bones = normalised(joints[:, _ARMS] - joints[:, [PARENTS[j] for j in _ARMS]])
    return chest, np.einsum("tji,tbj->tbi", chest, bones)


def _with_arms(joints: np.ndarray, standing: np.ndarray, seated: np.ndarray) -> np.ndarray:
    """The motion with its arms hung as in one standing and one seated pose (22, 3), blended as the pelvis goes down."""
    height = joints[:, 0, 2]
    share = np.clip((height.max() - height) / max(float(np.ptp(height)), 0.05), 0.0, 1.0)[:, None, None]
    chest, _ = _arm_directions(joints)
    ends = [_arm_directions(pose[None])[1][0] for pose in (standing, seated)]
    world = np.einsum("tij,tbj->tbi", chest, normalised(ends[0] * (1 - share) + ends[1] * share))
    out = joints.copy()
    for k, j in enumerate(_ARMS):
        out[:, j] = out[:, PARENTS[j]] + world[:, k] * np.linalg.norm(OFFSETS[j])
    return out


def load_motions(folder: Path, split: str) -> list[Motion]:
    """Every usable clip of a split ('train' or 'test') on the canonical body, bodies calibrated on all their clips."""
    bodies: dict[tuple[str, str], list[Clip]] = defaultdict(list)
    for clip in read_clips(folder):
        if clip.source not in _SHARE_ALIKE:
            bodies[clip.source, "" if clip.source in _ONE_RIG else clip.subject].append(clip)
    fitted: list[tuple[Clip, np.ndarray]] = []
    for clips in bodies.values():
        wanted = [c for c in clips if c.split == split and _wanted(c)]
        if wanted:
            body = calibrate(clips)
            fitted += [(clip, canonical(clip, body)) for clip in wanted]
    rng = np.random.default_rng(7)
    lend = {kind: [j for c, j in fitted if c.category == kind] for kind in ("standing_idle", "seated_chair")}
    motions = []
    for clip, joints in fitted:
        if clip.source in _ARMS_RAISED:
            poses = [clips[i][rng.integers(len(clips[i]))] for clips in lend.values() for i in [rng.integers(len(clips))]]
            joints = _with_arms(joints, *poses)
        motions.append(motion_of(clip.name, clip.source, clip.subject, clip.category, joints))
    return motions


def _approaches(motions: list[Motion]) -> list[Motion]:
    """Composed motions that walk up to a seat (see ``compose``), from every sit-down and its mirror image."""
    rng = np.random.default_rng(11)
    walks = [m for m in motions if m.category in _WALK and len(m.joints) > 60 and m.valid.all()]
    made = []
    for m in motions:
        if m.category not in _SIT or not m.rests or m.source in _ARMS_RAISED or not walks:
            continue
        entry = entrance(m.joints, m.rests[0].start)
        if entry is None:
            continue
        for sit in (m.joints, mirrored(m.joints)):
            kept = 0
            for k in rng.permutation(len(walks))[:_TRIES]:
                at = matches(walks[k].joints, sit[entry : entry + 1])
                if at is None or kept == _JOINS:
                    continue
                whole = joined(walks[k].joints, at, sit, entry)
                motion = motion_of(f"{walks[k].name} + {m.name}", _COMPOSED, m.subject, m.category, whole)
                if motion.rests:
                    made.append(motion)
                    kept += 1
    return made


class _Draws:
    """Where to draw from: weights by kind of moment, clips in proportion to what they hold of it."""

    def __init__(self, motions: list[Motion]) -> None:
        self.motions = motions = motions + _approaches(motions)
        self.focus: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        found: dict[str, list[tuple[int, int, float]]] = {kind: [] for kind in _SHARES}
        for i, m in enumerate(motions):
            if m.source == _COMPOSED:
                found["approach"] += [(i, f, 1.0) for f in range(60, m.rests[0].start + 10, 5)]
            elif m.category in _SIT:
                if not m.rests:
                    continue
                height = m.joints[:, 0, 2]
                moving = np.abs(np.gradient(height)) * 30 > 0.12
                for rest in m.rests:
                    near = np.arange(max(0, rest.start - 75), min(len(height), rest.end + 75))
                    down = near[moving[near]]
                    weight = _WEIGHT.get(m.source, 1.0)
                    if len(down):
                        found["descend"] += [(i, int(f), weight / len(down)) for f in down]
                    found["sit"] += [(i, int(f), 1.0) for f in range(rest.start, rest.end, 10)]
            else:
                kind = "walk" if m.category in _WALK else "stand"
                weight = 0.1 if m.source == "reactidle" else 1.0
                found[kind] += [(i, f, weight) for f in range(0, len(m.joints), 10)]
        for kind, rows in found.items():
            if rows:
                table = np.array(rows)
                self.focus[kind] = (table[:, :2].astype(int), table[:, 2] / table[:, 2].sum())

    def sample(self, rng: np.random.Generator) -> tuple[str, Window]:
        kinds = list(self.focus)
        share = np.array([_SHARES[k] for k in kinds])
        while True:
            kind = kinds[rng.choice(len(kinds), p=share / share.sum())]
            rows, weight = self.focus[kind]
            clip, frame = rows[rng.choice(len(rows), p=weight)]
            window = draw(rng, self.motions[clip], int(frame))
            if window is not None:
                return kind, window


_draws: _Draws | None = None


def _start(folder: Path, split: str) -> None:
    global _draws
    _draws = _Draws(load_motions(folder, split))


def _shard(task: tuple[Path, int, int]) -> Path:
    file, seed, count = task
    if not file.exists():
        assert _draws is not None
        rng = np.random.default_rng(seed)
        kinds, windows = zip(*(_draws.sample(rng) for _ in range(count)), strict=True)
        part = file.with_suffix(".part.npz")
        np.savez_compressed(
            part,
            poses=np.stack([w.poses for w in windows]),
            velocity=np.stack([w.velocity for w in windows]),
            occupancy=np.stack([w.occupancy for w in windows]),
            kinds=np.array(kinds),
        )
        part.rename(file)
    return file


def prepare(
    folder: Path, out: Path, windows: int = 12000, processes: int = 1, seed: int = 0,
    progress: Callable[[float], None] = lambda _: None,
) -> None:
    """Make (or go on making) the dataset ``out`` from the motion files in ``folder``. Finished shards are kept."""
    out.mkdir(parents=True, exist_ok=True)
    shards = max(1, windows // _SHARD)
    train = [(out / f"pool-{i:03d}.npz", seed * 1000 + i, min(_SHARD, windows)) for i in range(shards)]
    for split, tasks in (("test", [(out / "held.npz", 99, min(600, windows))]), ("train", train)):
        with Pool(processes, _start, (folder, split)) as pool:
            for done, _ in enumerate(pool.imap_unordered(_shard, tasks)):
                progress((done + 1) / len(tasks))
    used = {f"{m.source}/{m.subject}" for m in load_motions(folder, "train")}
    held = {f"{m.source}/{m.subject}" for m in load_motions(folder, "test")}
    described = {
        "windows": sum(count for _, _, count in train), "train": sorted(used), "held_out": sorted(held), "shares": _SHARES,
        "composed": _COMPOSITION,
    }
    (out / "dataset.json").write_text(json.dumps(described, indent=1))


def load_pool(files: Iterator[Path] | list[Path]) -> dict[str, np.ndarray]:
    """The windows of several shards, joined: poses (N, 80, 66), velocity (N, 80, 3), occupancy (N, 70, 2640) uint8, kinds."""
    parts = []
    for file in files:
        with np.load(file) as z:
            parts.append({name: z[name] for name in z.files})
    return {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
