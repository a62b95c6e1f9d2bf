"""A contact sheet of what carries bodies in training: every kind of furniture from its lowest to
its highest, with motion of the training's bodies fitted to it.

Each cell shows one moment twice, from the body's right side and from its left front; below it, what
piece it is and how high, in centimetres, its surface lies and the pelvis rests.
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from ...core.files import whole_file
from ...core.root import root_from_joints
from ...core.rotations import normalised, yaw_matrix
from ..furnish.flesh import Furnishing, probes
from ..furnish.real_pieces import bed_shape_for, desk_shape_for, seat_shape_for
from ..furnish.seats import seat_for
from ..furnish.shapes import ShapeBank
from ..motion.interactions import Interaction, lying, working
from ..motion.motion import Motion
from ..motion.rests import Rest, resting
from ..motion.retarget import at_seat_height
from .motions import Draws
from .picture import body_of, picture
from .windows import HIGHEST, LOWEST, lowest_pelvis

__all__ = ["fit_sheet"]

_COLUMNS, _TRIES = 5, 80
_SITTING = ("descend", "sit", "approach", "leave", "work")
_AROUND = 110  # frames before and after a moment
_NEAR = 0.05  # metres by which a pelvis may rest off the height that was asked for
_SIZE, _SCALE, _MIDDLE = (140, 156), 88, 0.68  # pixels; of a metre; metres over the floor
_VIEWS = ((90.0, 4.0), (-40.0, 22.0))  # degrees from where the body faces to its right, and up
_LINE, _COLOURS = 14, 32  # pixels of a line of text; of the palette

Cell = tuple[float, np.ndarray, float, Furnishing, str]
"""What cells are sorted by, a pose (22, 3), where it faces, the furniture, a line of text."""


def _camera(yaw: float, turn: float, tilt: float) -> np.ndarray:
    """(3, 3) rows right, up and towards the viewer, who stands ``turn`` degrees to the right of
    where a body faces and looks ``tilt`` degrees down.
    """
    up = np.radians(tilt)
    ahead = yaw_matrix(np.array(yaw - np.radians(turn))) @ np.array([0.0, 1.0, 0.0])
    toward = np.cos(up) * ahead + np.sin(up) * np.array([0.0, 0.0, 1.0])
    right = normalised(np.cross([0.0, 0.0, 1.0], toward))
    return np.stack([right, np.cross(toward, right), toward])


def _moment(
    rng: np.random.Generator, motions: list[Motion], draws: Draws, kinds: Sequence[str]
) -> np.ndarray | None:
    """What a body does (T, 22, 3) around a moment of one of these kinds."""
    known = [kind for kind in kinds if kind in draws]
    if not known:
        return None
    rows, weight = draws[known[rng.integers(len(known))]]
    number, frame = rows[rng.choice(len(rows), p=weight)]
    frames = slice(max(0, frame - _AROUND), frame + _AROUND)
    motion = motions[number]
    return motion.joints[frames] if motion.valid[frames].all() else None


def _name(room: Furnishing) -> str:
    return room.bank.shapes[int(room.shapes[0, 0])].name if len(room.shapes) else "boxes"


def _sits(
    joints: np.ndarray, wanted: float, fit: Callable[[Rest, np.ndarray], Furnishing | None]
) -> Cell | None:
    """The motion with its rest moved to a height of the pelvis, as windows move it, on a seat."""
    found = resting(joints, root_from_joints(joints))
    if not found or wanted < lowest_pelvis(float(found[0].position[2])):
        return None

    moved = at_seat_height(joints, float(found[0].position[2]), wanted)
    path = root_from_joints(moved)
    for rest in resting(moved, path):
        room = fit(rest, probes(moved)) if abs(rest.position[2] - wanted) < _NEAR else None
        if room is not None:
            frame = (rest.start + rest.end) // 2
            text = f"{_name(room)}: pelvis {100 * moved[frame, 0, 2]:.0f}"
            return wanted, moved[frame], float(path.yaw[frame]), room, text

    return None


def _lies(
    joints: np.ndarray, fit: Callable[[Interaction, np.ndarray], Furnishing | None]
) -> Cell | None:
    for use in lying(joints)[:1]:
        room = fit(use, probes(joints))
        if room is not None:
            frame, height = (use.start + use.end) // 2, float(use.points[:, 2].mean())
            text = f"{_name(room)}: lies at {100 * height:.0f}"
            return height, joints[frame], use.yaw, room, text
    return None


def _works(
    joints: np.ndarray, fit: Callable[[Interaction, np.ndarray], Furnishing | None]
) -> Cell | None:
    path = root_from_joints(joints)
    for use in working(joints, path)[:1]:
        room = fit(use, probes(joints))
        if room is not None:
            frame, height = (use.start + use.end) // 2, float(use.points[:, 2].min())
            text = f"{_name(room)}: wrists {100 * height:.0f}"
            return height, joints[frame], float(path.yaw[frame]), room, text
    return None


def _rows(
    rng: np.random.Generator, motions: list[Motion], draws: Draws, bank: ShapeBank
) -> dict[str, list[Cell]]:
    """Cells by what they show, from low to high."""

    def first(kinds: Sequence[str], make: Callable[[np.ndarray], Cell | None]) -> list[Cell]:
        """The first cell that can be made of moments of these kinds, if any."""
        for _ in range(_TRIES):
            joints = _moment(rng, motions, draws, kinds)
            made = None if joints is None else make(joints)
            if made:
                return [made]
        return []

    def seats(low: float, high: float, fit: Callable[..., Furnishing | None]) -> list[Cell]:
        heights = np.linspace(max(low, LOWEST), min(high, HIGHEST), _COLUMNS)
        return [c for h in heights for c in first(_SITTING, partial(_sits, wanted=h, fit=fit))]

    rows: dict[str, list[Cell]] = {}
    for kind in dict.fromkeys(shape.kind for shape in bank.shapes if shape.seats):
        own = ShapeBank(tuple(shape for shape in bank.shapes if shape.kind == kind))
        pelvis = [seat.pelvis for shape in own.shapes for seat in shape.seats]
        rows[kind] = seats(min(pelvis), max(pelvis), partial(seat_shape_for, rng, own))

    rows["boxes"] = seats(LOWEST, HIGHEST, lambda *at: _of(seat_for(rng, *at)))

    def lies(joints: np.ndarray) -> Cell | None:
        return _lies(joints, lambda use, points: bed_shape_for(rng, bank, use, points, []))

    def works(joints: np.ndarray) -> Cell | None:
        return _works(joints, partial(desk_shape_for, rng, bank))

    for title, kind, make in (("lying", "lie", lies), ("working", "desk", works)):
        cells = [cell for _ in range(_COLUMNS) for cell in first((kind,), make)]
        rows[title] = sorted(cells, key=lambda cell: cell[0])

    return {title: cells for title, cells in rows.items() if cells}


def _of(boxes: np.ndarray | None) -> Furnishing | None:
    return None if boxes is None else Furnishing(boxes)


def fit_sheet(
    file: Path,
    motions: list[Motion],
    draws: Draws,
    rng: np.random.Generator,
    bank: ShapeBank,
) -> None:
    """Draw the sheet into ``file`` (.png). Needs Pillow."""
    from PIL import Image, ImageDraw

    rows = _rows(rng, motions, draws, bank)
    width, height = 2 * _SIZE[0], _SIZE[1] + _LINE
    paper = Image.new("RGB", (_COLUMNS * width, len(rows) * height), "white")
    ink = ImageDraw.Draw(paper)
    for r, (title, cells) in enumerate(rows.items()):
        for c, (_, pose, yaw, room, text) in enumerate(cells):
            middle = np.array([*pose[0, :2], _MIDDLE])
            for v, view in enumerate(_VIEWS):
                seen = picture(room, body_of(pose), _camera(yaw, *view), middle, _SIZE, _SCALE)
                at = c * width + v * _SIZE[0], r * height + _LINE
                paper.paste(Image.fromarray(seen), at)
            ink.text((c * width + 3, r * height + 1), f"{title}: {text}", fill="black")

    with whole_file(file) as part:
        paper.quantize(_COLOURS, dither=Image.Dither.NONE).save(part, format="PNG", optimize=True)
