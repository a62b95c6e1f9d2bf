"""From motion files to a training set: clips on the canonical body, and a pool of augmented, furnished windows on disk.

A dataset is a folder: ``train.npz`` and ``test.npz`` (motions, captured and composed), ``dataset.json`` (what they were made
from), ``pool-NNNN.npz`` (training windows) and ``held.npz`` (windows of held-out motions, for the likelihood). For people:
``summary.txt`` (what was read, and what was cut from it), ``fits.txt`` (how often furniture fits) and ``preview.png``.
"""

import json
import multiprocessing
from collections import defaultdict
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.rotations import frame_from, normalised
from ..core.skeleton import OFFSETS, PARENTS
from .canonical import calibrate, canonical
from .compose import composed
from .fits import fit_report
from .mocap import Clip, read_clips
from .motions import Draws, read_motions, write_motions
from .preview import preview
from .summary import summary
from .windows import COMPOSED, Motion, Window, draw, motion_of

__all__ = ["load_motions", "sample", "prepare", "load_pool", "POSE_UNIT", "TRAINED_ON_PARTLY"]

_WALK = {"locomotion", "walk", "turn", "run", "carry_other", "door"}
_STAND = {"standing", "standing_idle", "standing_gesture", "social_gesture", "greeting", "work_standing", "documents",
          "reach-hand-task"}
_SIT = {"sit-stand", "sit_down", "stand_up", "seated", "seated_chair", "seated_table"}
_AVOID = ("jump", "uneven", "hop", "march", "kick", "flip", "squat", "balance", "crouch", "swing legs", "lie")
_SHARES = {
    "approach": 0.15, "leave": 0.07, "wait": 0.07, "descend": 0.14, "sit": 0.07, "work": 0.07, "desk": 0.06, "counter": 0.03,
    "write": 0.04, "lie": 0.04, "walk": 0.16, "stand": 0.10,
}
"""Shares of windows. Composed: walking up to a seat and sitting down, standing up and walking off, standing before a seat,
hands at work over seated legs, at a desk, a counter or a board, lying down on a bed or getting up. Captured: around a sit-down
or stand-up, seated, walking, standing.
"""
_COMPOSITION = (
    "walks joined to sit-downs and, after stand-ups, walked away; captured gestures, greetings and reaching over seated legs, "
    "the trunk leant; hands led along desks, counters and boards by inverse kinematics; sitting on the floor and lying there "
    "raised onto beds, the turn onto the bed made; seats moved to other heights; mirrored, reversed, re-timed; roughened root "
    "paths; arms lent to the UI-PRMD bodies; all furniture"
)
"""What in the training motion nobody ever did in one piece; said on the weights' card."""

_SHARE_ALIKE = {"hdm05_cuts"}
_ONE_RIG = {"cmu_daz", "cmu_expmap", "gazebo_actors", "snu_tiling", "snu_ys2010"}
_ARMS_RAISED = {"ui_prmd"}
_WEIGHT = {"ui_prmd": 0.35, "snu_tiling": 3.0}  # of a sit-down: the one stands with borrowed arms, the other walks up to it
TRAINED_ON_PARTLY = {"cmu69", "snu_tiling/wd2(dir 1)", "snu_ys2010", "gazebo_actors"}
"""Bodies with clips on both sides of the split; figures of their test clips are reported apart."""

_ARMS = [18, 20, 19, 21]  # elbow and wrist, left then right
_SHARD = 1000
_FIT_TRIES = 60  # moments of each kind that are furnished for the report
_STORED = ("poses", "velocity", "ahead", "root", "boxes")
POSE_UNIT = 1e-4
"""Poses are stored as whole numbers of these (metres)."""


def _wanted(clip: Clip) -> bool:
    if clip.category == "lying":
        return True
    if clip.category not in _WALK | _STAND | _SIT:
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


def _captured(motions: list[Motion]) -> dict[str, list[tuple[int, int, float]]]:
    """Moments of captured motions to draw windows around: kind → (motion, frame, weight)."""
    found: dict[str, list[tuple[int, int, float]]] = defaultdict(list)
    for i, m in enumerate(motions):
        if m.category in _SIT:
            height = m.joints[:, 0, 2]
            moving = np.abs(np.gradient(height)) * 30 > 0.12
            for rest in m.rests:
                near = np.arange(max(0, rest.start - 75), min(len(height), rest.end + 75))
                down = near[moving[near]]
                weight = _WEIGHT.get(m.source, 1.0)
                found["descend"] += [(i, int(f), weight / len(down)) for f in down]
                found["sit"] += [(i, int(f), 1.0) for f in range(rest.start, rest.end, 10)]
        elif m.category in _WALK | _STAND:
            kind = "walk" if m.category in _WALK else "stand"
            weight = 0.1 if m.source == "reactidle" else 1.0
            found[kind] += [(i, f, weight) for f in range(0, len(m.joints), 10)]
    return found


def _draws(motions: list[Motion]) -> tuple[list[Motion], Draws]:
    """Captured motions and those composed of them, with the moments of each kind in proportion to what there is of it."""
    found = _captured(motions)
    for made in composed(motions):
        found[made.kind] += [(len(motions), int(f), 1.0 / len(made.focus)) for f in made.focus]
        motions = [*motions, made.motion]
    tables = {kind: np.array(rows) for kind, rows in found.items() if rows}
    return motions, {kind: (t[:, :2].astype(int), t[:, 2] / t[:, 2].sum()) for kind, t in tables.items()}


def sample(rng: np.random.Generator, motions: list[Motion], draws: Draws) -> tuple[str, Window]:
    """A kind of moment by its share, a moment of that kind, and a window around it."""
    kinds = [kind for kind in _SHARES if kind in draws]
    share = np.array([_SHARES[kind] for kind in kinds])
    while True:
        kind = kinds[rng.choice(len(kinds), p=share / share.sum())]
        rows, weight = draws[kind]
        motion, frame = rows[rng.choice(len(rows), p=weight)]
        window = draw(rng, motions[motion], int(frame))
        if window is not None:
            return kind, window


_known: tuple[list[Motion], Draws]


def _start(known: tuple[list[Motion], Draws]) -> None:
    global _known
    _known = known


def _shard(task: tuple[Path, int, int]) -> Path:
    file, seed, count = task
    rng = np.random.default_rng(seed)
    kinds, windows = zip(*(sample(rng, *_known) for _ in range(count)), strict=True)
    part = file.with_suffix(".part.npz")
    arrays = {name: np.stack([getattr(w, name) for w in windows]).astype(np.float32) for name in _STORED}
    arrays["poses"] = np.round(arrays["poses"] / POSE_UNIT).astype(np.int16)
    np.savez(part, kinds=np.array(kinds), **arrays)
    part.rename(file)
    return file


def _written(file: Path, text: Callable[[], str]) -> None:
    """Write what ``text`` gives, unless the file is there already."""
    if not file.exists():
        file.write_text(text() + "\n", encoding="utf-8")


def prepare(
    folder: Path, out: Path, windows: int = 12000, processes: int = 1, seed: int = 0,
    progress: Callable[[float], None] = lambda _: None,
) -> None:
    """Make (or go on making) the dataset ``out`` from the motion files in ``folder``. What is finished is kept.

    Raises InputError where the folder holds no motion files, or none to train on or none that are held out.
    """
    out.mkdir(parents=True, exist_ok=True)
    size = min(_SHARD, windows)
    train = [(out / f"pool-{i:04d}.npz", seed * 10000 + i, size) for i in range(max(1, windows // _SHARD))]
    described: dict[str, Any] = {"windows": size * len(train), "shares": _SHARES, "composed": _COMPOSITION}
    done = 0
    for split, tasks in (("test", [(out / "held.npz", 99, min(600, windows))]), ("train", train)):
        file = out / f"{split}.npz"
        if not file.exists():
            motions, draws = _draws(load_motions(folder, split))
            if not draws:
                raise InputError(
                    f"The folder '{folder}' has no clip of split '{split}' that can be used; state in its clips.json the "
                    "clips' licence, their split ('train', or 'test' for held-out subjects) and category (as 'locomotion')."
                )
            write_motions(file, motions, draws)
        known = read_motions(file)
        described["train" if split == "train" else "held_out"] = sorted(
            {f"{m.source}/{m.subject}" for m in known[0] if m.source != COMPOSED}
        )
        missing = [task for task in tasks if not task[0].exists()]
        # Forked: the motions are read once and shared by all.
        with multiprocessing.get_context("fork").Pool(processes, _start, (known,)) as pool:
            for k, _ in enumerate(pool.imap_unordered(_shard, missing)):
                progress((done + k + 1) / (1 + len(train)))
        done += len(tasks)
    _written(out / "summary.txt", lambda: summary(read_clips(folder)))
    _written(out / "fits.txt", lambda: fit_report(*read_motions(out / "train.npz"), np.random.default_rng(seed), _FIT_TRIES))
    if not (out / "preview.png").exists():
        preview(out / "preview.png", *read_motions(out / "train.npz"), np.random.default_rng(seed))
    (out / "dataset.json").write_text(json.dumps(described, indent=1), encoding="utf-8")


def load_pool(files: Iterable[Path]) -> dict[str, np.ndarray]:
    """The windows of several shards, joined: the fields of ``Window`` (N, …), poses in ``POSE_UNIT``s, and kinds (N,)."""
    parts = []
    for file in files:
        with np.load(file) as z:
            parts.append({name: z[name] for name in z.files})
    return {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
