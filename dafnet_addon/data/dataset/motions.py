"""The file of motions that training windows are drawn from: canonical joints as millimetre
differences, and where to draw.
"""

import json
from pathlib import Path

import numpy as np

from ..motion.motion import Motion
from ..motion.rests import Rest

__all__ = ["Draws", "write_motions", "read_motions"]

Draws = dict[str, tuple[np.ndarray, np.ndarray]]
"""For each kind of moment: (N, 2) rows of motion and frame, and their probabilities (N,)."""


def write_motions(file: Path, motions: list[Motion], draws: Draws) -> None:
    """Write motions, rounded to a millimetre, and the moments to draw; written whole or not at
    all.
    """
    rounded = [np.round(m.joints * 1000.0).astype(np.int32) for m in motions]
    rests = [
        (i, r.start, r.end, *r.position, r.yaw) for i, m in enumerate(motions) for r in m.rests
    ]
    words = {
        "motions": [(m.name, m.source, m.subject, m.category) for m in motions],
        "kinds": {kind: len(rows) for kind, (rows, _) in draws.items()},
    }
    part = file.with_suffix(".part.npz")
    np.savez_compressed(
        part,
        words=json.dumps(words),
        frames=[len(j) for j in rounded],
        first=np.stack([j[0] for j in rounded]),
        delta=np.concatenate([np.diff(j, axis=0) for j in rounded]).astype(np.int16),
        valid=np.packbits(np.concatenate([m.valid for m in motions])),
        rests=np.array(rests).reshape(-1, 7),
        draws=np.concatenate([rows for rows, _ in draws.values()]).astype(np.int32),
        weights=np.concatenate([weight for _, weight in draws.values()]),
    )
    part.replace(file)


def read_motions(file: Path) -> tuple[list[Motion], Draws]:
    """What ``write_motions`` wrote."""
    with np.load(file) as z:
        words = json.loads(str(z["words"]))
        frames, first, delta, rests, rows, weights = (
            z[n] for n in ("frames", "first", "delta", "rests", "draws", "weights")
        )
        valid = np.unpackbits(z["valid"], count=int(frames.sum())).astype(bool)

    motions, steps, at = [], 0, 0
    for i, (name, source, subject, category) in enumerate(words["motions"]):
        joints = (
            np.concatenate([first[i][None], delta[steps : steps + frames[i] - 1]]).cumsum(0)
            / 1000.0
        )
        own = tuple(
            Rest(int(r[1]), int(r[2]), r[3:6], float(r[6])) for r in rests[rests[:, 0] == i]
        )
        motions.append(
            Motion(name, source, subject, category, joints, valid[at : at + frames[i]], own)
        )
        steps, at = steps + frames[i] - 1, at + frames[i]

    draws: Draws = {}
    at = 0
    for kind, count in words["kinds"].items():
        draws[kind] = rows[at : at + count], weights[at : at + count]
        at += count

    return motions, draws
