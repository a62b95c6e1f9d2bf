"""Figures 3, 10 and 11: what one root path becomes among furniture."""

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw

from dafnet_addon.blender.showcase.demo_room import FURNITURE
from dafnet_addon.blender.showcase.stage import Stage, mixed
from dafnet_addon.core.paths import Stop, facing, route
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import PELVIS, SEAT_TO_PELVIS
from dafnet_addon.core.weights import Weights
from dafnet_addon.demo import Place

from . import furniture
from .furniture import HERE, Piece
from .motions import Motion, free, make
from .studio import (
    GREY,
    INK,
    MODE_COLOURS,
    PALE,
    STRIP,
    Studio,
    draw_path,
    frames_along,
    furnish,
    moment_picture,
    put_pose,
    put_poses,
)

__all__ = ["HEIGHTS", "actions", "by_furniture", "by_height", "seated_at"]

HEIGHTS = (0.32, 0.38, 0.45, 0.52, 0.60, 0.70)
"""Seats of figure 11 (metres)."""
_HALF_WAY = 0.78
"""Metres: a pelvis half-way down to a chair, or up from it."""


def seated_at(weights: Weights, heights: Sequence[float] = HEIGHTS) -> list[Motion]:
    """The takes of figure 11: one root path, chairs of these heights."""
    walked = route(
        Stop((-1.2, 2.8), facing((0.4, -1.0)), 0.5), Stop((0.0, 0.0), 0.0, 2.0, seated=True)
    )
    return [make(weights, [(furniture.chair(height), HERE)], free(walked)) for height in heights]


def actions(studio: Studio) -> Image.Image:
    """Figure 3: action probabilities at moments of one take."""
    stand = Stop((1.2, 3.2), facing((-0.3, -1.0)), 1.0)
    chair = Stop((0.0, 0.0), 0.0, 2.0, seated=True)
    stool = Stop((3.0, 1.8), facing((-1.0, 0.0)), 2.0, seated=True)
    walked = route(stand, (0.12, 1.5), chair, (1.2, 1.3), stool)
    pieces = [(furniture.chair(), HERE), (furniture.stool(0.55), Place(stool.position, stool.yaw))]
    motion = make(studio.weights, pieces, free(walked))

    _, chair_rest, last = walked.rests
    half_way = motion.joints[:, PELVIS, 2] < _HALF_WAY
    seated_from = int(np.argmax(half_way))
    gets_up = seated_from + int(np.argmin(half_way[seated_from:]))
    moments = {
        "stands": 15,
        "walks": seated_from - 70,
        "turns to the chair": seated_from - 25,
        "sits down": seated_from,
        "sits": (chair_rest.start + chair_rest.stop - 1) // 2,
        "gets up": gets_up,
        "walks on": (chair_rest.stop - 1 + last.start) // 2 + 5,
        "sits on the stool": last.stop - 11,
    }

    panels = [
        studio.captioned(
            moment_picture(studio, pieces, motion, frame, 48.0, 390, 330),
            f"{frame / MODEL_FPS:.1f} s: {name}",
        )
        for name, frame in moments.items()
    ]
    return studio.grid([panels[:4], panels[4:]])


def by_furniture(studio: Studio) -> Image.Image:
    """Figure 10: one root path, six kinds of furniture."""
    walked = route(
        Stop((2.9, 0.95), facing((-1.0, -0.1)), 0.3), Stop((0.0, 0.0), 0.0, 2.5, seated=True)
    )
    rest = walked.rests[-1]
    # None of the last second before the seat, which would stand between it and the camera.
    frames = [
        *frames_along(walked.path, walked.rests[0].stop - 1, rest.start - 30, 0.70),
        rest.stop - 16,
    ]
    kinds: dict[str, tuple[float, list[Piece]]] = {
        "nothing": (0.0, []),
        "chair": (0.45, [(furniture.chair(), HERE)]),
        "stool": (0.63, [(furniture.stool(0.63), HERE)]),
        "bench": (0.36, [(furniture.bench(0.36), HERE)]),
        # less the cushion that lies where one sits
        "sofa": (0.42, [(FURNITURE["Sofa"][:-1], Place((0.405, 0.0), 0.0))]),
        "chair and desk": (0.45, [(furniture.chair(), HERE), (furniture.desk(0.74, 0.92), HERE)]),
    }

    panels = []
    for name, (height, pieces) in kinds.items():
        motion = make(studio.weights, pieces, free(walked))
        stage = Stage(118.0)
        furnish(stage, pieces)
        draw_path(stage, walked.path)
        put_poses(stage, motion, frames, MODE_COLOURS["FREE"])

        # From the first step to the seat and the near edge of the desk, the same in all panels.
        seen = np.array(
            [
                (3.2, 1.0, 0.0),
                (3.2, 1.0, 1.8),
                (-0.75, 0.0, 0.0),
                (-0.75, 0.0, 1.8),
                (-0.65, 1.6, 0.0),
            ]
        )
        picture = studio.photograph(stage, 525, 300, seen, margin=0.02)
        words = _pelvis(motion.joints[frames[-1], PELVIS, 2], height)
        title = f"{name}, {height:.2f} m" if height else name
        panels.append(studio.captioned(picture, title, words))

    return studio.grid([panels[:3], panels[3:]])


def by_height(studio: Studio) -> Image.Image:
    """Figure 11: the last poses of one root path on chairs of several heights."""
    stage = Stage(52.0)
    feet, words = [], []
    for k, (height, motion) in enumerate(zip(HEIGHTS, seated_at(studio.weights), strict=True)):
        offset = 1.02 * k * stage.axes[0]
        colour = mixed(PALE, MODE_COLOURS["FREE"], 0.5 + 0.1 * k)
        last = len(motion) - 15
        stage.furnish(furniture.chair(height), Place((offset[0], offset[1]), 0.0))
        put_pose(stage, motion, last, colour, offset.tolist())

        feet.append(offset + np.array([0.0, 0.25, 0.0]))
        pelvis = float(motion.joints[last, PELVIS, 2])
        words.append((f"seat {height:.2f} m", _pelvis(pelvis, height)))

    picture = studio.captioned(studio.photograph(stage, 1600, 430, margin=0.03))
    pen = ImageDraw.Draw(picture)
    for at, lines in zip(stage.pixels(np.array(feet)), words, strict=True):
        for row, line in enumerate(lines):
            down = picture.height - studio.pixels(STRIP * (0.72 - 0.44 * row))
            pen.text((at[0], down), line, INK if row == 0 else GREY, studio.font, anchor="mm")

    return picture


def _pelvis(pelvis: float, seat: float) -> str:
    """Where a pelvis is, and how far that is from where it would sit; ``seat``: height of the top,
    0 for none.
    """
    off = round(100.0 * (pelvis - seat - SEAT_TO_PELVIS))
    return f"pelvis {pelvis:.2f} m" + (f" ({off:+d} cm)" if seat else "")
