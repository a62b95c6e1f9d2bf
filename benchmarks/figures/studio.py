"""Pictures: a stage photographed, titled and put together; what is drawn into one."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from dafnet_addon import Controls
from dafnet_addon.blender.showcase.stage import Colour, Stage, mixed
from dafnet_addon.core.root import RootPath
from dafnet_addon.core.skeleton import END_EFFECTORS, PELVIS
from dafnet_addon.core.weights import Weights

from .furniture import Piece
from .motions import Motion

__all__ = [
    "ASKED",
    "GAP",
    "GREY",
    "INK",
    "MODE_COLOURS",
    "PALE",
    "STRIP",
    "Studio",
    "corners",
    "draw_path",
    "draw_targets",
    "frames_along",
    "furnish",
    "moment_picture",
    "put_pose",
    "put_poses",
]

MODE_COLOURS: dict[str, Colour] = {
    "FREE": (0.20, 0.42, 0.62),
    "EE": (0.82, 0.43, 0.15),
    "FULL": (0.24, 0.53, 0.35),
}


PALE: Colour = (0.84, 0.85, 0.86)
"""Of poses long before the last."""
ASKED: Colour = (0.86, 0.06, 0.08)
"""Of what is asked of head and hands."""
_WENT: Colour = (0.08, 0.10, 0.16)
"""Of the ways that they went."""
_PATH: Colour = (0.62, 0.63, 0.65)
"""Of the root's way."""
INK = (45, 48, 54)
GREY = (110, 114, 120)
_FAINT = (165, 168, 172)
GAP = 10
"""Pixels between panels."""
STRIP = 54
"""Pixels of what is written under one."""
_LETTERS = 19
"""Pixels of a letter's height."""


@dataclass(frozen=True)
class Studio:
    """What every figure is made with: ``weights``, other systems' weights by name, and the size of
    the pictures.
    """

    weights: Weights
    others: dict[str, Weights]
    scale: float = 1.0

    @cached_property
    def font(self) -> "ImageFont.FreeTypeFont | ImageFont.ImageFont":
        return ImageFont.load_default(max(8.0, self.scale * _LETTERS))

    def pixels(self, length: float) -> int:
        return max(1, round(self.scale * length))

    def photograph(
        self,
        stage: Stage,
        width: int,
        height: int,
        seen: np.ndarray | None = None,
        margin: float = 0.04,
    ) -> Image.Image:
        """The stage as a picture; see ``Stage.look``."""
        stage.look(self.pixels(width), self.pixels(height), margin, seen)
        with TemporaryDirectory() as folder:
            file = Path(folder, "picture.png")
            stage.render(file)
            with Image.open(file) as picture:
                return picture.convert("RGB")

    def captioned(self, picture: Image.Image, *lines: str) -> Image.Image:
        """A picture with up to two centred lines under it."""
        out = Image.new("RGB", (picture.width, picture.height + self.pixels(STRIP)), "white")
        out.paste(picture)
        pen = ImageDraw.Draw(out)
        for row, line in enumerate(lines):
            middle = picture.height + self.pixels(
                STRIP * (0.5 if len(lines) == 1 else 0.28 + 0.44 * row)
            )
            pen.text(
                (picture.width / 2, middle),
                line,
                INK if row == 0 else GREY,
                self.font,
                anchor="mm",
            )

        return out

    def grid(self, rows: Sequence[Sequence[Image.Image]]) -> Image.Image:
        """Pictures of one size, row by row."""
        gap = self.pixels(GAP)
        width, height = rows[0][0].size
        columns = max(len(row) for row in rows)
        out = Image.new(
            "RGB", (columns * (width + gap) - gap, len(rows) * (height + gap) - gap), "white"
        )
        for r, row in enumerate(rows):
            for c, picture in enumerate(row):
                out.paste(picture, (c * (width + gap), r * (height + gap)))

        return out

    def with_circle(self, picture: Image.Image, action: np.ndarray) -> Image.Image:
        """The picture with the paper's circle in its upper right corner: K labels, a line to each
        as opaque as it is likely.
        """
        fine, radius = 4, max(4, round(0.105 * picture.width))
        size = 2 * round(1.45 * radius)
        disc = Image.new("RGBA", (fine * size, fine * size))
        middle, rim = fine * size / 2, fine * radius

        pen = ImageDraw.Draw(disc)
        pen.ellipse([middle - 1.4 * rim] * 2 + [middle + 1.4 * rim] * 2, (255, 255, 255, 235))
        pen.ellipse([middle - rim] * 2 + [middle + rim] * 2, outline=(*_FAINT, 255), width=fine)

        font = ImageFont.load_default(0.34 * rim)
        for k, share in enumerate(action):
            angle = 2.0 * np.pi * k / len(action) - 0.5 * np.pi
            ray = np.array([np.cos(angle), np.sin(angle)])

            line = Image.new("RGBA", disc.size)
            ends = [(middle, middle), tuple((middle + rim * ray).tolist())]
            ImageDraw.Draw(line).line(ends, (*INK, round(255 * float(share))), round(0.13 * rim))
            disc.alpha_composite(line)

            colour = INK if float(share) >= float(action.max()) else _FAINT
            label = middle + 1.2 * rim * ray
            place = label[0], label[1]
            ImageDraw.Draw(disc).text(place, str(k + 1), (*colour, 255), font, anchor="mm")

        disc = disc.resize((size, size), Image.Resampling.LANCZOS)
        out = picture.copy()
        edge = self.pixels(6)
        out.paste(disc, (out.width - size - edge, edge), disc)
        return out


def put_pose(
    stage: Stage,
    motion: Motion,
    frame: int,
    colour: Colour,
    offset: Sequence[float] = (0.0, 0.0, 0.0),
) -> None:
    stage.pose(motion.frames[frame], motion.joints[frame, PELVIS] + offset, colour)


def put_poses(stage: Stage, motion: Motion, frames: Sequence[int], colour: Colour) -> None:
    """Poses at these frames, from pale to the full colour."""
    for k, frame in enumerate(frames, 1):
        put_pose(stage, motion, frame, mixed(PALE, colour, 0.30 + 0.70 * (k / len(frames)) ** 1.5))


def frames_along(path: RootPath, first: int, last: int, step: float) -> list[int]:
    """Frames from ``first`` to before ``last`` at every ``step`` metres of the path."""
    way = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(path.position[first:last], axis=0), axis=1))]
    )
    return [
        first + int(np.searchsorted(way, at)) for at in np.arange(0.0, way[-1] - 0.4 * step, step)
    ]


def furnish(stage: Stage, pieces: Iterable[Piece]) -> None:
    for parts, place in pieces:
        stage.furnish(parts, place)


def draw_path(stage: Stage, path: RootPath) -> None:
    """The root's way, drawn on the floor."""
    moved = np.concatenate([[True], np.linalg.norm(np.diff(path.position, axis=0), axis=1) > 1e-4])
    stage.line(path.position[moved] + (0.0, 0.0, 0.004), _PATH, 0.010)


def draw_targets(stage: Stage, motion: Motion, controls: Controls, frames: Sequence[int]) -> None:
    """What is asked of head and hands as red lines, and as balls at some frames; the ways that they
    went as dark lines.
    """
    for name, j in END_EFFECTORS.items():
        target = getattr(controls, name)
        if target is not None:
            stage.line(target, ASKED, 0.008)
            stage.line(motion.joints[:, j], _WENT, 0.006)
            for frame in frames:
                stage.ball(target[frame], ASKED, 0.035)


def corners(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> np.ndarray:
    """Corners (8, 3) of an upright box between these coordinates: what a picture is to show."""
    return np.array(list(product(x, y, z)))


def corners_around(motion: Motion, frame: int) -> np.ndarray:
    """Corners of the room that a body takes, standing at this frame."""
    ground = motion.joints[frame, PELVIS] * (1.0, 1.0, 0.0)
    return ground + corners((-0.7, 0.7), (-0.7, 0.7), (0.0, 1.8))


def moment_picture(
    studio: Studio,
    pieces: Sequence[Piece],
    motion: Motion,
    frame: int,
    toward: float,
    width: int,
    height: int,
) -> Image.Image:
    """One pose in its surroundings, with the circle of its action probabilities where the system
    has any.
    """
    stage = Stage(toward)
    furnish(stage, pieces)
    put_pose(stage, motion, frame, MODE_COLOURS["FREE"])
    picture = studio.photograph(stage, width, height, corners_around(motion, frame), margin=0.02)
    return studio.with_circle(picture, motion.action[frame]) if motion.action.size else picture
