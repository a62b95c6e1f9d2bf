"""From motion files to a training set: clips on the canonical body, and a pool of augmented,
furnished windows on disk.

A dataset is a folder: ``train.npz`` and ``test.npz`` (motions, captured and composed),
``dataset.json`` (what they were made from), ``pool-NNNN.npz`` (training windows) and ``held.npz``
(windows of held-out motions, for the likelihood). For people: ``summary.txt`` (what was read, cut
and left out), ``fits.txt`` (how often furniture fits), ``preview.png`` and, where real pieces
train, ``furniture.png`` (every kind of them with bodies on it).
"""

import json
import multiprocessing
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.files import save_text
from ...core.rotations import frame_from, normalised
from ...core.series import MODEL_FPS
from ...core.skeleton import COLLARS, ELBOWS, NECK, OFFSETS, PARENTS, PELVIS, SPINE, WRISTS
from ..capture.archive import read_arrays
from ..capture.mocap import Clip, leaving_out, read_clips
from ..capture.summary import summary
from ..furnish.fits import fit_report
from ..furnish.flesh import NO_BANK
from ..furnish.library import read_library
from ..furnish.shapes import ShapeBank, bank_of
from ..motion.canonical import Calibration, calibrate, canonical
from ..motion.motion import Motion, motion_of
from ..synthesis.compose import composed
from .fit_sheet import fit_sheet
from .motions import Draws, read_motions, write_motions
from .preview import preview
from .splits import role_of_clip, role_of_maker
from .windows import Window, draw

__all__ = ["bank_in", "load_motions", "sample", "prepare", "load_pool", "FURNITURE", "POSE_UNIT"]

_WALK = {"locomotion", "walk", "turn", "run", "carry_other", "door"}
_STAND = {
    "standing",
    "standing_idle",
    "standing_gesture",
    "social_gesture",
    "greeting",
    "work_standing",
    "documents",
    "reach-hand-task",
}
_SIT = {"sit-stand", "sit_down", "stand_up", "seated", "seated_chair", "seated_table"}
_AVOID = (
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
_SHARES = {
    "approach": 0.15,
    "leave": 0.07,
    "wait": 0.07,
    "descend": 0.14,
    "sit": 0.07,
    "work": 0.07,
    "desk": 0.06,
    "counter": 0.03,
    "write": 0.04,
    "lie": 0.04,
    "walk": 0.16,
    "stand": 0.10,
}
"""Shares of windows. Composed: walking up to a seat and sitting down, standing up and walking off,
standing before a seat, hands at work over seated legs, at a desk, a counter or a board, lying down
on a bed or getting up. Captured: around a sit-down or stand-up, seated, walking, standing.
"""
_COMPOSITION = (
    "walks joined to sit-downs and, after stand-ups, walked away; captured gestures, greetings "
    "and reaching over seated legs, "
    "the trunk leant; hands led along desks, counters and boards by inverse kinematics; sitting "
    "on the floor and lying there "
    "raised onto beds, the turn onto the bed made; seats moved to other heights; mirrored, "
    "reversed, re-timed; roughened root "
    "paths; arms lent to the UI-PRMD bodies; all furniture"
)
"""What in the training motion nobody ever did in one piece; said on the weights' card."""

_SHARE_ALIKE = {"hdm05_cuts"}
_ONE_RIG = {"cmu_daz", "cmu_expmap", "cmu_fbx", "gazebo_actors", "snu_tiling", "snu_ys2010"}
_ARMS_RAISED = {"ui_prmd"}
# of a sit-down: the one stands with borrowed arms, the other walks up to it
_WEIGHT = {"ui_prmd": 0.35, "snu_tiling": 3.0}
_ARMS = [ELBOWS[0], WRISTS[0], ELBOWS[1], WRISTS[1]]  # elbow and wrist, left then right
_SHARD, _SHARDS = 1000, 10_000  # seeds of shards are seed * _SHARDS + i
_DRAWS = 2000  # in a row, of which none gives a window
_FIT_TRIES = 60  # moments of each kind that are furnished for the report
_STORED = ("poses", "velocity", "ahead", "root", "boxes", "shapes")
FURNITURE = "furniture.npz"
"""The dataset's file of real pieces (``shapes.ShapeBank``), which its windows name by number."""
POSE_UNIT = 1e-4
"""Poses are stored as whole numbers of these (metres)."""


def _why_not(clip: Clip) -> str:
    """Why a clip is not used; nothing where it is."""
    if clip.source in _SHARE_ALIKE:
        return "under a share-alike licence, which would bind the weights"
    if not clip.split:
        return "of no split, or of no stated licence"
    if clip.category == "lying":
        return ""
    if clip.category not in _WALK | _STAND | _SIT:
        return f"of the activity '{clip.category}', of which no windows are drawn"

    text = f"{clip.name} {clip.description}".lower()
    return next((f"whose name or description says '{word}'" for word in _AVOID if word in text), "")


def _unused(clips: Iterable[Clip]) -> list[str]:
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
        f"Not used: {n / 1800:.1f} minutes {why} ({count[why]} of the clips of "
        f"{', '.join(sorted(sources[why]))})."
        for why, n in frames.most_common()
    ]


def _arm_directions(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Chest frames (T, 3, 3) and, in them, unit directions (T, 4, 3) of upper arms and forearms."""
    chest = frame_from(
        joints[:, NECK] - joints[:, SPINE[-1]], joints[:, COLLARS[1]] - joints[:, COLLARS[0]], "zx"
    )
    bones = normalised(joints[:, _ARMS] - joints[:, [PARENTS[j] for j in _ARMS]])
    return chest, np.einsum("tji,tbj->tbi", chest, bones)


def _with_arms(joints: np.ndarray, standing: np.ndarray, seated: np.ndarray) -> np.ndarray:
    """The motion with its arms hung as in one standing and one seated pose (22, 3), blended as the
    pelvis goes down.
    """
    height = joints[:, PELVIS, 2]
    share = np.clip((height.max() - height) / max(float(np.ptp(height)), 0.05), 0.0, 1.0)[
        :, None, None
    ]
    chest, _ = _arm_directions(joints)
    ends = [_arm_directions(pose[None])[1][0] for pose in (standing, seated)]
    world = np.einsum("tij,tbj->tbi", chest, normalised(ends[0] * (1 - share) + ends[1] * share))
    out = joints.copy()
    for k, j in enumerate(_ARMS):
        out[:, j] = out[:, PARENTS[j]] + world[:, k] * np.linalg.norm(OFFSETS[j])

    return out


def _measured(
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


def _motions(
    measured: list[tuple[Clip, Calibration]], roles: Sequence[str], left_out: list[str] | None
) -> list[Motion]:
    fitted = [
        (clip, canonical(clip, body)) for clip, body in measured if role_of_clip(clip) in roles
    ]
    rng = np.random.default_rng(7)
    lend = {
        kind: [j for c, j in fitted if c.category == kind]
        for kind in ("standing_idle", "seated_chair")
    }
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
                joints = _with_arms(joints, *poses)
            motions.append(motion_of(clip.name, clip.source, clip.subject, clip.category, joints))

    return motions


def load_motions(folder: Path, *roles: str) -> list[Motion]:
    """Every usable clip of these roles (``splits``: 'train', 'choose', 'tell') on the canonical
    body, bodies calibrated on all their clips.

    Raises InputError where a file or a body cannot be used.
    """
    return _motions(_measured(read_clips(folder), roles, None), roles, None)


def _captured(motions: list[Motion]) -> dict[str, list[tuple[int, int, float]]]:
    """Moments of captured motions to draw windows around: kind → (motion, frame, weight)."""
    found: dict[str, list[tuple[int, int, float]]] = defaultdict(list)
    for i, m in enumerate(motions):
        if m.category in _SIT:
            height = m.joints[:, PELVIS, 2]
            moving = np.abs(np.gradient(height)) * MODEL_FPS > 0.12
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
    """Captured motions and those composed of them, with the moments of each kind in proportion to
    what there is of it.
    """
    found = _captured(motions)
    for made in composed(motions):
        found[made.kind] += [(len(motions), int(f), 1.0 / len(made.focus)) for f in made.focus]
        motions = [*motions, made.motion]
    tables = {kind: np.array(rows) for kind, rows in found.items() if rows}
    return motions, {
        kind: (t[:, :2].astype(int), t[:, 2] / t[:, 2].sum()) for kind, t in tables.items()
    }


def sample(
    rng: np.random.Generator, motions: list[Motion], draws: Draws, bank: ShapeBank = NO_BANK
) -> tuple[str, Window]:
    """A kind of moment by its share, a moment of that kind, and a window around it.

    Raises InputError where hardly any window can be drawn.
    """
    kinds = [kind for kind in _SHARES if kind in draws]
    share = np.array([_SHARES[kind] for kind in kinds])
    for _ in range(_DRAWS):
        kind = kinds[rng.choice(len(kinds), p=share / share.sum())]
        rows, weight = draws[kind]
        motion, frame = rows[rng.choice(len(rows), p=weight)]
        window = draw(rng, motions[motion], int(frame), bank)
        if window is not None:
            return kind, window

    raise InputError(
        f"In {_DRAWS} tries no window could be drawn from the motion, most likely since its clips "
        "are shorter than three "
        "seconds or have many bad frames; give longer or cleaner ones (see summary.txt)."
    )


_known: tuple[list[Motion], Draws, ShapeBank]


def _start(known: tuple[list[Motion], Draws, ShapeBank]) -> None:
    global _known
    _known = known


def _shard(task: tuple[Path, int, int]) -> Path:
    file, seed, count = task
    rng = np.random.default_rng(seed)
    kinds, windows = zip(*(sample(rng, *_known) for _ in range(count)), strict=True)
    part = file.with_suffix(".part.npz")
    arrays = {
        name: np.stack([getattr(w, name) for w in windows]).astype(np.float32) for name in _STORED
    }
    arrays["poses"] = np.round(arrays["poses"] / POSE_UNIT).astype(np.int16)
    np.savez(part, kinds=np.array(kinds), **arrays)
    part.replace(file)
    return file


def _written(file: Path, text: Callable[[], str]) -> None:
    """Write what ``text`` gives, unless the file is there already."""
    if not file.exists():
        save_text(file, text())


def _read(folder: Path, out: Path) -> dict[str, Any]:
    """Read the motion files; write the training's motions, those that choose weights, and the
    summary.

    Where the project's own bodies that choose are not among them, those of split 'test' do. What is
    known of the training set.
    """
    left_out: list[str] = []
    clips = list(read_clips(folder, left_out))
    chooses = "choose" if any(role_of_clip(clip) == "choose" for clip in clips) else "tell"
    measured = _measured(clips, (chooses, "train"), left_out)
    licence_of = {(clip.source, clip.name): clip.licence for clip, _ in measured}
    licences: dict[str, set[str]] = defaultdict(set)
    described: dict[str, Any] = {}
    for split, role, name in (("test", chooses, "held_out"), ("train", "train", "train")):
        captured = _motions(measured, (role,), left_out)
        motions, draws = _draws(captured)
        if not draws:
            raise InputError(
                f"The folder '{folder}' has no clip of split '{split}' that can be used; state in "
                "its clips.json the "
                "clips' licence, their split ('train', or 'test' for held-out subjects) and "
                "category (as 'locomotion')." + (f" Left out: {left_out[0]}" if left_out else "")
            )

        write_motions(out / f"{split}.npz", motions, draws)
        described[name] = sorted({f"{m.source}/{m.subject}" for m in captured})
        for motion in captured if split == "train" else ():
            licences[licence_of[motion.source, motion.name]].add(motion.source)

    described["licences"] = {
        licence: sorted(sources) for licence, sources in sorted(licences.items())
    }
    text = summary(clips, [*left_out, *_unused(clips)])
    save_text(out / "summary.txt", text)
    return described


def _windows_in(file: Path) -> int:
    """How many windows a shard holds: none where it is not there, or damaged."""
    if not file.exists():
        return 0
    try:
        return len(read_arrays(file, "kinds")[0])
    except InputError:
        return 0


def _asked(described: dict[str, Any], out: Path, windows: int, seed: int) -> None:
    """Raises InputError where what is asked for cannot be made, or is not what ``out`` holds
    already.
    """
    if not 1 <= windows <= _SHARD * _SHARDS:
        raise InputError(
            f"A dataset holds 1 to {_SHARD * _SHARDS} windows; ask for so many instead of "
            f"{windows}."
        )

    if seed < 0:
        raise InputError(f"The seed is {seed}; give 0 or more.")

    if described.get("seed", seed) != seed:
        raise InputError(
            f"The dataset '{out}' was begun with the seed {described['seed']}; give this, or "
            "another folder."
        )

    if described.get("windows", 0) > windows:
        raise InputError(
            f"The dataset '{out}' was begun with {described['windows']} windows; ask for as many "
            "or more, or give another "
            "folder."
        )


def prepare(
    folder: Path,
    out: Path,
    windows: int = 12000,
    processes: int = 1,
    seed: int = 0,
    progress: Callable[[float], None] = lambda _: None,
    furniture: Path | None = None,
) -> None:
    """Make (or go on making) the dataset ``out`` from the motion files in ``folder``. What is
    finished is kept.

    Real pieces of the library in the folder ``furniture`` stand among the furniture, where one is
    given. Files, bodies and clips that cannot be used are left out, which ``summary.txt`` says.
    Raises InputError where the folder holds no motion files, or none to train on or none that are
    held out, and where ``out`` holds another dataset.
    """
    record = out / "dataset.json"
    described = json.loads(record.read_text(encoding="utf-8")) if record.exists() else {}
    _asked(described, out, windows, seed)
    out.mkdir(parents=True, exist_ok=True)
    for left in out.glob("*.part.*"):  # by a run that was ended
        left.unlink()

    if not described:
        described = _read(folder, out)
        if furniture:
            described["furniture"] = _furniture(furniture, out)

    described |= {"windows": windows, "seed": seed, "shares": _SHARES, "composed": _COMPOSITION}
    save_text(record, json.dumps(described, indent=1))

    sizes = [min(_SHARD, windows - done) for done in range(0, windows, _SHARD)]
    train = [(out / f"pool-{i:04d}.npz", seed * _SHARDS + i, size) for i, size in enumerate(sizes)]
    bank = bank_in(out)
    # The training's pieces come first, so that a number means the same piece to both.
    trained = ShapeBank(
        tuple(shape for shape in bank.shapes if role_of_maker(shape.maker) == "train")
    )
    done = 0
    for split, shapes, tasks in (
        ("test", bank, [(out / "held.npz", 99, min(600, windows))]),
        ("train", trained, train),
    ):
        known = read_motions(out / f"{split}.npz")
        missing = [task for task in tasks if _windows_in(task[0]) != task[2]]
        # Forked: the motions are read once and shared by all.
        with multiprocessing.get_context("fork").Pool(
            max(processes, 1), _start, ((*known, shapes),)
        ) as pool:
            for k, _ in enumerate(pool.imap_unordered(_shard, missing)):
                progress((done + k + 1) / (1 + len(train)))

        done += len(tasks)

    rng, known = np.random.default_rng(seed), read_motions(out / "train.npz")
    _written(out / "fits.txt", lambda: fit_report(*known, rng, _FIT_TRIES, trained))
    if not (out / "preview.png").exists():
        preview(out / "preview.png", *known, np.random.default_rng(seed), bank=trained)
    if len(trained) and not (out / "furniture.png").exists():
        fit_sheet(out / "furniture.png", *known, np.random.default_rng(seed), trained)


def _furniture(folder: Path, out: Path) -> dict[str, list[str]]:
    """Read a furniture library and write the shapes of what trains and of what chooses weights:
    whose they are.
    """
    pieces, left_out = read_library(folder)
    wanted = [
        piece
        for role in ("train", "choose")
        for piece in pieces
        if role_of_maker(piece.maker) == role
    ]
    bank_of(wanted).write(out / FURNITURE)
    makers = {
        f"{piece.source}: {piece.maker} ({piece.licence})"
        for piece in wanted
        if role_of_maker(piece.maker) == "train"
    }
    return {"trained_on": sorted(makers), "left_out": left_out}


def bank_in(dataset: Path) -> ShapeBank:
    """The shapes that a dataset's windows name: none where it was made without real furniture."""
    file = dataset / FURNITURE
    return ShapeBank.read(file) if file.exists() else NO_BANK


def load_pool(files: Iterable[Path]) -> dict[str, np.ndarray]:
    """The windows of several shards, joined: the fields of ``Window`` (N, …), poses in
    ``POSE_UNIT``s, and kinds (N,).
    """
    parts = []
    for file in files:
        with np.load(file) as z:
            parts.append({name: z[name] for name in z.files})
    return {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
