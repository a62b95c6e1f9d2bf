"""From motion files to a training set: clips on the canonical body, and a pool of augmented,
furnished windows on disk.

A dataset is a folder: ``train.npz`` and ``test.npz`` (motions, captured and composed),
``dataset.json`` (what they were made from), ``pool-NNNN.npz`` (training windows) and ``held.npz``
(windows of held-out motions, for the likelihood). For people: ``summary.txt`` (what was read, cut
and left out), ``fits.txt`` (how often furniture fits), ``preview.png``, ``postures.png`` and
``sources.png`` (every kind of moment, posture and source) and, where real pieces train,
``furniture.png`` (every kind of them with bodies on it).
"""

import json
import multiprocessing
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.files import save_text
from ..capture.archive import read_arrays
from ..capture.mocap import read_clips
from ..capture.summary import summary
from ..furnish.fits import fit_report
from ..furnish.flesh import NO_BANK
from ..furnish.library import read_library
from ..furnish.shapes import ShapeBank, bank_of
from ..motion.motion import Motion
from .fit_sheet import fit_sheet
from .moments import SHARES, moments_of, sample
from .motions import Draws, read_motions, write_motions
from .preview import by_posture, by_source, preview
from .splits import role_of_clip, role_of_maker
from .usable import calibrated, motions_of, not_used
from .windows import AS_PEOPLE_DO, Augmentation

__all__ = ["bank_in", "prepare", "load_pool", "FURNITURE", "POSE_UNIT"]

_COMPOSITION = (
    "walks joined to sit-downs and, after stand-ups, walked away; captured gestures, greetings, "
    "reaching and desk work mimed standing, over seated legs; postures of sitting (leaning back, "
    "slouching, on the edge, turned, forearms on arms, hands on the seat or on a desk, one leg "
    "forward, ankles crossed) led from captured sitting; hands led along desks, counters and "
    "boards, or let down onto them from where their work was mimed, by inverse kinematics; sitting "
    "on the floor and lying there raised onto beds, the turn onto the bed made; seats moved to "
    "other heights; sitting down and getting up in other times; mirrored, reversed, re-timed; "
    "smoothed and roughened root paths; arms lent to the UI-PRMD bodies; all furniture"
)
"""What in the training motion nobody ever did in one piece; said on the weights' card."""

_SHARD, _SHARDS = 1000, 10_000  # seeds of shards are seed * _SHARDS + i
_FIT_TRIES = 60  # moments of each kind that are furnished for the report
_STORED = ("poses", "velocity", "ahead", "root", "boxes", "shapes")
FURNITURE = "furniture.npz"
"""The dataset's file of real pieces (``shapes.ShapeBank``), which its windows name by number."""
POSE_UNIT = 1e-4
"""Poses are stored as whole numbers of these (metres)."""


Known = tuple[list[Motion], Draws, ShapeBank, Augmentation]
"""What every window is drawn from."""

_known: Known


def _start(known: Known) -> None:
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


def _read(folder: Path, out: Path, leave_out: Collection[str]) -> dict[str, Any]:
    """Read the motion files; write the training's motions, those that choose weights, and the
    summary.

    Where the project's own bodies that choose are not among them, those of split 'test' do. What is
    known of the training set.
    """
    left_out: list[str] = []
    clips = [clip for clip in read_clips(folder, left_out) if clip.source not in leave_out]
    chooses = "choose" if any(role_of_clip(clip) == "choose" for clip in clips) else "tell"
    found = calibrated(clips, (chooses, "train"), left_out)
    licence_of = {(clip.source, clip.name): clip.licence for clip, _ in found}
    licences: dict[str, set[str]] = defaultdict(set)
    described: dict[str, Any] = {}
    for split, role, name in (("test", chooses, "held_out"), ("train", "train", "train")):
        captured = motions_of(found, (role,), left_out)
        motions, draws, without = moments_of(captured)
        if not draws:
            raise InputError(
                f"The folder '{folder}' has no clip of split '{split}' that can be used; state in "
                "its clips.json the "
                "clips' licence, their split ('train', or 'test' for held-out subjects) and "
                "category (as 'locomotion')." + (f" Left out: {left_out[0]}" if left_out else "")
            )

        left_out += without if role == "train" else []
        write_motions(out / f"{split}.npz", motions, draws)
        described[name] = sorted({f"{m.source}/{m.subject}" for m in captured})
        for motion in captured if split == "train" else ():
            licences[licence_of[motion.source, motion.name]].add(motion.source)

    described["licences"] = {
        licence: sorted(sources) for licence, sources in sorted(licences.items())
    }
    text = summary(clips, [*left_out, *not_used(clips)])
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
    augmentation: Augmentation = AS_PEOPLE_DO,
    leave_out: Collection[str] = (),
) -> None:
    """Make (or go on making) the dataset ``out`` from the motion files in ``folder``. What is
    finished is kept.

    Real pieces of the library in the folder ``furniture`` stand among the furniture, where one is
    given. ``leave_out``: sources whose clips are not used. Files, bodies and clips that cannot be
    used are left out, which ``summary.txt`` says. Raises InputError where the folder holds no
    motion files, or none to train on or none that are held out, and where ``out`` holds another
    dataset.
    """
    record = out / "dataset.json"
    described = json.loads(record.read_text(encoding="utf-8")) if record.exists() else {}
    _asked(described, out, windows, seed)
    out.mkdir(parents=True, exist_ok=True)
    for left in out.glob("*.part.*"):  # by a run that was ended
        left.unlink()

    if not described:
        described = _read(folder, out, leave_out)
        if furniture:
            described["furniture"] = _furniture(furniture, out)

    described |= {"windows": windows, "seed": seed, "shares": SHARES, "composed": _COMPOSITION}
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
            max(processes, 1), _start, ((*known, shapes, augmentation),)
        ) as pool:
            for k, _ in enumerate(pool.imap_unordered(_shard, missing)):
                progress((done + k + 1) / (1 + len(train)))

        done += len(tasks)

    rng, known = np.random.default_rng(seed), read_motions(out / "train.npz")
    _written(out / "fits.txt", lambda: fit_report(*known, rng, _FIT_TRIES, trained))
    motions, draws = known
    for name, shown in (
        ("preview", draws),
        ("postures", by_posture(motions, draws)),
        ("sources", by_source(motions, draws)),
    ):
        if shown and not (out / f"{name}.png").exists():
            rng = np.random.default_rng(seed)
            preview(out / f"{name}.png", motions, shown, rng, bank=trained)
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
