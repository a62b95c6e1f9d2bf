"""Does *Rest on Seats* bring a body to where a piece of furniture carries it? Takes that hover over
every kind of seat, and takes that sink into it.

Run as ``dafnet bench rest``, or with ``--furniture LIBRARY`` for real pieces. A character is sent
to each piece, and what it does there is generated once; then the piece is raised or lowered under
it, so that it sinks in, or hovers, by a known amount, and the take is cleaned up. Where it should
rest is told by the piece's kind over the surface that ``surface_under`` finds; what the clean-up is
told is the piece's mesh and its title.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dafnet_addon import Box, CleanUp, Controls, InputError, Mesh, Scene, load_weights
from dafnet_addon.core.conditions import shot_steps
from dafnet_addon.core.distance import grid_of
from dafnet_addon.core.draws import Draw
from dafnet_addon.core.finishing import cleaned_up
from dafnet_addon.core.generate import takes_steps
from dafnet_addon.core.metrics import jerk
from dafnet_addon.core.occupancy import distance
from dafnet_addon.core.paths import Stop
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import forward_of
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import ANKLES, FEET, HIPS, KNEES, PELVIS
from dafnet_addon.core.softness import OVER_HARD, SOFTNESS
from dafnet_addon.core.weights import Weights
from dafnet_addon.director.seats import seat_of
from dafnet_addon.director.walks import walk_to

if TYPE_CHECKING:
    from dafnet_addon.data.furnish.library import Piece

OVER = (-0.10, -0.06, -0.02, 0.03, 0.07, 0.11, 0.15)
"""Metres by which a take is over where its piece carries it, before the clean-up."""
DRAWS = (Draw(), Draw(seed=1, temperature=1.0))

_WITHIN = 0.015  # metres from where the piece carries the pelvis
_MOST_JERK = 1.1  # of the raw take's
_FEET_MOVE = 0.01  # metres
_LEGROOM = 0.02  # metres: shins that are nearer to a seat are moved with their feet
_KNEES_BEND = np.radians(150.0)  # at most, as people's do
_KNEES_ASIDE = np.radians(15.0)  # beside where they were
_THIGH = np.linspace(0.2, 1.0, 5)  # places along the bone that must not be in the seat
_SHIN = np.array([0.35, 0.55, 0.75, 1.0])  # the same of a shin
_TRUNK = (3, 6, 9, 12)  # joints that must not be in a back
_RAISED = 0.20  # metres by which a piece is raised or lowered at most
_NARROWEST = 0.3  # metres across: a table fan is not a table
_AWAY = 2.3  # metres from which one is sent to a seat
_SETTLES = 15  # frames from where the root rests, until the body has to


@dataclass(frozen=True)
class Placed:
    """A piece of furniture to sit on: its ``kind``, its ``solids``, and the height of the surface
    that carries whoever sits where ``seat_of`` says; metres, floor at zero.
    """

    name: str
    kind: str
    solids: tuple[Box | Mesh, ...]
    stop: Stop
    surface: float


def made_pieces() -> list[Placed]:
    """Seats made of boxes: a stool, a bench, a chair and a sofa with backs, a bed."""

    def box(name: str, low: tuple[float, ...], high: tuple[float, ...]) -> Box:
        a, b = np.array(low), np.array(high)
        return Box(center=(a + b) / 2, half_size=(b - a) / 2, name=name)

    def seat(kind: str, height: float, wide: float, deep: float, back: bool) -> Placed:
        name, half = kind.capitalize(), wide / 2
        solids = [box(name, (-half, -0.25, height - 0.08), (half, deep - 0.25, height))]
        if back:
            solids.append(box(name, (-half, -0.33, height - 0.08), (half, -0.25, height + 0.42)))
        place = Stop((0.0, 0.0), 0.0, 3.0, seated=True, name=name)
        return Placed(name, kind, tuple(solids), place, height)

    return [
        seat("stool", 0.46, 0.40, 0.45, back=False),
        seat("bench", 0.44, 1.20, 0.45, back=False),
        seat("chair", 0.46, 0.46, 0.50, back=True),
        seat("armchair", 0.43, 0.70, 0.58, back=True),
        seat("sofa", 0.42, 1.80, 0.62, back=True),
        seat("bed", 0.45, 2.00, 0.60, back=False),
    ]


def real_pieces(library: Path) -> list[Placed]:
    """The pieces of a furniture library that one can be sent to, and that carry somebody there."""
    from dafnet_addon.data.furnish.library import read_library

    found = (real_piece(piece) for piece in read_library(library)[0])
    return [piece for piece in found if piece is not None]


def real_piece(piece: "Piece") -> Placed | None:
    """A piece of a library, None where nobody can be sent to it, or nothing carries one there."""
    from dafnet_addon.data.furnish.shapes import surface_under

    if piece.kind not in SOFTNESS or np.ptp(piece.vertices[:, :2], axis=0).max() < _NARROWEST:
        return None

    mesh = Mesh(piece.vertices, piece.triangles, name=piece.title)
    try:
        place = seat_of([mesh], np.array([0.0, -3.0]), 0.0, piece.title, tables=True)
    except InputError:
        return None

    grid = grid_of(mesh, 0.0)
    surface = surface_under(grid, place.position, place.yaw, place.height)
    if surface is None:
        return None

    x, y = place.position.tolist()
    stop = Stop((x, y), place.yaw, 3.0, seated=True, name=piece.name)
    return Placed(piece.name, piece.kind, (replace(mesh, grid=grid),), stop, surface)


def _raised(solid: Box | Mesh, height: float) -> Box | Mesh:
    up = np.array([0.0, 0.0, height])
    if isinstance(solid, Box):
        return replace(solid, center=solid.center + up)
    matrix = solid.matrix.copy()
    matrix[..., :3, 3] += up
    return replace(solid, matrix=matrix)


def rests_of(
    piece: Placed, weights: Weights, draws: Sequence[Draw], over: Sequence[float]
) -> Iterator[dict[str, Any]]:
    """What becomes of takes that are ``over`` a piece by so much; those that never sat are left
    out, and so are pieces to which there is no way.
    """
    x, y = piece.stop.position
    ahead = forward_of(piece.stop.yaw)
    aside = np.array([ahead[1], -ahead[0]])
    begin = np.array([x, y]) + _AWAY * ahead + 0.5 * aside
    try:
        start = Stop((float(begin[0]), float(begin[1])), piece.stop.yaw + np.pi, 0.2)
        made = walk_to(list(piece.solids), start, piece.stop)
    except InputError:
        return

    controls = Controls(fps=MODEL_FPS, root=made.path.matrices())
    shot = run_to_end(shot_steps(Scene(piece.solids), controls))
    takes = run_to_end(takes_steps(Scene(piece.solids), controls, weights, draws))
    carried = piece.surface + OVER_HARD - SOFTNESS[piece.kind]
    frames = slice(made.rests[-1].start + _SETTLES, made.rests[-1].stop)
    for draw, take in zip(draws, takes, strict=True):
        for wanted in over:
            height = float(np.median(take.joints[frames, PELVIS, 2])) - carried - wanted
            if abs(height) > _RAISED:
                continue

            scene = Scene(tuple(_raised(solid, height) for solid in shot.scene.solids))
            moved = replace(shot, scene=scene)
            raw = take.joints
            clean = run_to_end(cleaned_up.steps(raw, moved, CleanUp(seat=1.0)))
            yield {
                "piece": piece.name,
                "kind": piece.kind,
                "temperature": draw.temperature,
                "over": wanted,
                "raised": height,
            } | _compared(raw, clean, scene, frames, carried + height, SOFTNESS[piece.kind])


def _compared(
    raw: np.ndarray,
    clean: np.ndarray,
    scene: Scene,
    frames: slice,
    carried: float,
    softness: float,
) -> dict[str, float]:
    """What the clean-up did to a take, in ``frames`` of rest and in all of it."""
    depths = {}
    for name, joints in (("raw", raw), ("clean", clean)):
        for part, points in (("thighs", _thighs(joints)), ("trunk", joints[:, _TRUNK])):
            gap = distance(scene, points[frames], 0.0)
            depths[f"{part}_{name}"] = float(np.median(np.maximum(-gap, 0.0).max(axis=1)))
    shins = raw[:, KNEES, None] + _SHIN[:, None] * (raw[:, ANKLES] - raw[:, KNEES])[:, :, None]
    shins = np.concatenate([shins.reshape(len(raw), -1, 3), raw[:, FEET]], axis=1)
    feet = (clean - raw)[:, FEET]
    return {
        "error": float(np.median(clean[frames, PELVIS, 2])) - carried,
        "shins_raw": float(-distance(scene, shins, 0.0).min()),
        "feet": float(np.linalg.norm(feet, axis=-1).max()),
        "heels": float((clean - raw)[:, ANKLES, 2].max()),
        "feet_down": float(-feet[..., 2].min()),
        "jerk": jerk(clean, MODEL_FPS) / jerk(raw, MODEL_FPS),
        "knees_bend": float(_bends(clean).max()),
        "knees_bend_raw": float(_bends(raw).max()),
        "knees_aside": float(np.abs(_asides(clean) - _asides(raw)).max()),
        "softness": softness,
    } | depths


def _thighs(joints: np.ndarray) -> np.ndarray:
    """Points (T, 2 · S, 3) along both thighs."""
    start, end = joints[:, HIPS, None], joints[:, KNEES, None]
    return (start + _THIGH[:, None] * (end - start)).reshape(len(joints), -1, 3)


def _bends(joints: np.ndarray) -> np.ndarray:
    """By how much (T, 2) knees are bent, radians."""
    thigh, shin = joints[:, KNEES] - joints[:, HIPS], joints[:, ANKLES] - joints[:, KNEES]
    cosine = (thigh * shin).sum(-1) / (
        np.linalg.norm(thigh, axis=-1) * np.linalg.norm(shin, axis=-1)
    )
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def _asides(joints: np.ndarray) -> np.ndarray:
    """By how much (T, 2) thighs point to the side of where the hips face, radians; 0 where they
    hang.
    """
    left, right = (joints[:, hip] for hip in HIPS)
    across = (right - left) / np.linalg.norm(right - left, axis=-1, keepdims=True)
    thigh = joints[:, KNEES] - joints[:, HIPS]
    length = np.linalg.norm(thigh, axis=-1)
    return np.arcsin(np.clip((thigh * across[:, None]).sum(-1) / length, -1.0, 1.0))


def measure(
    file: Path | None,
    progress: Callable[[float], None],
    library: Path | None = None,
    over: Sequence[float] = OVER,
    draws: Sequence[Draw] = DRAWS,
) -> tuple[dict[str, Any], str]:
    """Run the benchmark with the weights in ``file`` (None: those that ship) over the pieces of a
    ``library``, or seats made of boxes; the report and its summary in words.
    """
    weights = load_weights(file)
    pieces = made_pieces() if library is None else real_pieces(library)
    rows: list[dict[str, Any]] = []
    for k, piece in enumerate(pieces):
        progress(k / len(pieces))
        rows += rests_of(piece, weights, draws, over)

    progress(1.0)
    of_all = _summary(rows)
    kinds = {
        kind: _summary([row for row in rows if row["kind"] == kind])
        for kind in sorted({row["kind"] for row in rows})
    }
    lines = [f"{len(rows)} takes over {len({row['piece'] for row in rows})} pieces"]
    for name, found in {"all": of_all, **kinds}.items():
        lines.append(
            f"  {name}: "
            + ", ".join(f"{what.replace('_', ' ')} {value:g}" for what, value in found.items())
        )
    return {"takes": len(rows), "all": of_all, "kinds": kinds, "rows": rows}, "\n".join(lines)


def _summary(rows: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Of some takes: shares in per cent, metres in centimetres."""

    def of(name: str) -> np.ndarray:
        return np.array([row[name] for row in rows])

    def share(flags: np.ndarray) -> float:
        return round(100.0 * float(flags.mean()), 1)

    return {
        "takes": len(rows),
        "within_1.5_cm": share(np.abs(of("error")) <= _WITHIN),
        "within_1.5_cm_raw": share(np.abs(of("over")) <= _WITHIN),
        "median_error_cm": round(100.0 * float(np.median(np.abs(of("error")))), 2),
        "feet_stay": share((of("feet") <= _FEET_MOVE) | (of("shins_raw") > -_LEGROOM)),
        "heels_lift": share(of("heels") > _FEET_MOVE),
        "feet_hang": share((of("feet") > _FEET_MOVE) & (of("feet_down") <= _FEET_MOVE)),
        "knees_as_people": share(
            (of("knees_bend") <= np.maximum(_KNEES_BEND, of("knees_bend_raw")))
            & (of("knees_aside") <= _KNEES_ASIDE)
        ),
        "jerk_right": share(of("jerk") <= _MOST_JERK),
        "jerk_median": round(float(np.median(of("jerk"))), 3),
        "thighs_in_cm_raw": round(100.0 * float(of("thighs_raw").mean()), 2),
        "thighs_in_cm": round(100.0 * float(of("thighs_clean").mean()), 2),
        "trunk_in_cm_raw": round(100.0 * float(of("trunk_raw").mean()), 2),
        "trunk_in_cm": round(100.0 * float(of("trunk_clean").mean()), 2),
    }
