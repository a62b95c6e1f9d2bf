"""The figures of the paper (section 6.1), made again with these weights and drawn by Blender.

    dafnet figures -o docs/figures [--weights FILE] [--other MoGlow=FILE …] [--only 10 11]

All motion is the network's own at temperature 0, nothing done to it afterwards (in figure 9, what
training does to what was captured), so there is nothing to choose from. Numbers are those of the
paper's figures; captions are in ``docs/figures/README.md``. Colour says the mode: blue is FREE,
orange EE, green FULL; poses grow darker with time; what was asked of head and hands is red.
"""

import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from dafnet_addon import Controls, InputError, Scene, generate, load_weights
from dafnet_addon.blender.showcase.demo_room import FURNITURE, Part
from dafnet_addon.blender.showcase.stage import Colour, Stage, mixed, solids
from dafnet_addon.core.conditions import PREROLL, shot_steps
from dafnet_addon.core.files import whole_file
from dafnet_addon.core.kinematics import fit, forward_kinematics
from dafnet_addon.core.paths import Route, Stop, facing, route
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import RootPath, root_from_joints, to_world
from dafnet_addon.core.sampler import Sampler
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import END_EFFECTORS, PELVIS, SEAT_TO_PELVIS, UPPER
from dafnet_addon.core.weights import Weights
from dafnet_addon.data.motion.retarget import at_seat_height, at_top_height
from dafnet_addon.data.motion.uses import working
from dafnet_addon.data.synthesis.courses import AT_DESKS
from dafnet_addon.demo import Place
from dafnet_addon.model.systems import sampler_of

__all__ = ["FIGURES", "HEIGHTS", "Motion", "draw", "moved_to", "seated_at", "typing"]

HEIGHTS = (0.32, 0.38, 0.45, 0.52, 0.60, 0.70)
"""Seats of figure 11 (metres)."""

_MODE: dict[str, Colour] = {
    "FREE": (0.20, 0.42, 0.62),
    "EE": (0.82, 0.43, 0.15),
    "FULL": (0.24, 0.53, 0.35),
}
_PALE: Colour = (0.84, 0.85, 0.86)
_WAY: Colour = (0.62, 0.63, 0.65)
_ASKED: Colour = (0.86, 0.06, 0.08)
_WENT: Colour = (0.08, 0.10, 0.16)
_INK, _FAINT = (45, 48, 54), (165, 168, 172)
# pixels: between panels; height of what is written under one; height of letters
_GAP, _STRIP, _LETTERS = 10, 54, 19
_COLOURS = 240  # of a file
_TYPING, _HANDWRITING, _HANDLING = 0, 2, 3  # of AT_DESKS

Piece = tuple[tuple[Part, ...], Place]
_HERE = Place((0.0, 0.0), 0.0)


# What stands about: each piece's origin is where a pelvis rests, or where who works at it stands.


def _raised(parts: Iterable[Part], now: float, height: float) -> tuple[Part, ...]:
    """A piece whose top lies at ``now``, with its top at ``height``: what is under it is stretched,
    what is over it moved.
    """
    out = []
    for part in parts:
        x, y, z = part.center
        width, depth, tall = part.size
        if z > now:
            out.append(replace(part, center=(x, y, z + height - now)))
        else:
            out.append(
                replace(
                    part, center=(x, y, z * height / now), size=(width, depth, tall * height / now)
                )
            )

    return tuple(out)


def _chair(height: float = 0.45) -> tuple[Part, ...]:
    return _raised(FURNITURE["Chair"], 0.45, height)


def _stool(height: float) -> tuple[Part, ...]:
    return _raised(FURNITURE["Stool"], 0.63, height)


def _bench(height: float) -> tuple[Part, ...]:
    ends = [
        Part("Oak", (0.05, 0.36, height - 0.06), (x, 0.0, 0.5 * (height - 0.06)))
        for x in (-0.55, 0.55)
    ]
    return Part("Teal", (1.40, 0.42, 0.06), (0.0, 0.0, height - 0.03), bevel=0.015), *ends


def _desk(height: float, near: float, width: float = 1.20, depth: float = 0.60) -> tuple[Part, ...]:
    """A desk whose edge lies ``near`` metres in front of the origin, and a sheet on it."""
    legs = [
        Part("Graphite", (0.04, 0.04, height - 0.03), (x, near + y, 0.5 * (height - 0.03)))
        for x in (0.05 - width / 2, width / 2 - 0.05)
        for y in (0.05, depth - 0.05)
    ]
    top = Part("Oak", (width, depth, 0.03), (0.0, near + depth / 2, height - 0.015))
    return (
        top,
        Part("Paper", (0.21, 0.30, 0.004), (0.10, near + 0.18, height + 0.002), bevel=0.0),
        *legs,
    )


def _bookcase() -> tuple[Part, ...]:
    boards = [
        Part("Oak", (0.90, 0.28, 0.025), (0.0, 0.0, z)) for z in (0.05, 0.42, 0.80, 1.18, 1.55)
    ]
    sides = [Part("Oak", (0.025, 0.28, 1.57), (x, 0.0, 0.785)) for x in (-0.45, 0.45)]
    books = [
        Part(colour, (width, 0.20, tall), (x, 0.02, z + 0.5 * tall), bevel=0.004)
        for colour, width, tall, x, z in (
            ("Teal", 0.22, 0.24, -0.28, 0.815),
            ("Coral", 0.12, 0.27, -0.09, 0.815),
            ("Slate", 0.30, 0.22, 0.20, 1.195),
            ("Paper", 0.16, 0.25, -0.30, 1.195),
            ("Slate", 0.26, 0.25, -0.24, 0.435),
            ("Coral", 0.18, 0.21, 0.25, 0.435),
        )
    ]
    return Part("Paper", (0.90, 0.01, 1.55), (0.0, -0.135, 0.80)), *boards, *sides, *books


def _scene(pieces: Iterable[Piece]) -> Scene:
    return Scene([solid for parts, place in pieces for solid in solids(parts, place)])


# Motion


@dataclass(frozen=True)
class Motion:
    """Global joint frames (T, 22, 3, 3) and joints (T, 22, 3) on constant bones; action
    probabilities (T, K), K may be 0.
    """

    frames: np.ndarray
    joints: np.ndarray
    action: np.ndarray

    def __len__(self) -> int:
        return len(self.joints)


def _motion(joints: np.ndarray, action: np.ndarray) -> Motion:
    pelvis, frames = fit(joints)
    return Motion(frames, forward_kinematics(frames, pelvis), action)


def _made(weights: Weights, pieces: Iterable[Piece], controls: Controls) -> Motion:
    """One take, as the add-on makes it, but for the clean-up."""
    take = generate(_scene(pieces), controls, weights)
    return _motion(take.joints, take.action)


def _made_by(sampler: Sampler, pieces: Iterable[Piece], controls: Controls) -> Motion:
    """One take of any system, in one mode."""
    shot = run_to_end(shot_steps(_scene(pieces), controls))
    made = run_to_end(sampler.run(shot.conditions, np.zeros((1, 66))))
    return _motion(
        to_world(shot.path, made.poses[PREROLL:, 0].reshape(-1, 22, 3)), made.actions[PREROLL:, 0]
    )


def _free(walked: Route) -> Controls:
    return Controls(fps=MODEL_FPS, root=walked.path.matrices())


def _staying(seconds: float) -> RootPath:
    """A root that stays at the origin and looks along +y."""
    frames = round(MODEL_FPS * seconds)
    return RootPath(np.zeros((frames, 3)), np.zeros(frames))


def _error(motion: Motion, controls: Controls, skipped: int = 0) -> float:
    """Mean distance of head and wrists from what was asked of them, centimetres, but for the first
    ``skipped`` frames of EE.
    """
    asked = np.broadcast_to(np.asarray(controls.mode) == "EE", len(controls)).copy()
    asked[: int(np.argmax(asked)) + skipped] = False
    gaps = [
        np.linalg.norm(motion.joints[:, j] - target, axis=-1)[asked]
        for name, j in END_EFFECTORS.items()
        if (target := getattr(controls, name)) is not None
    ]
    return 100.0 * float(np.nanmean(np.concatenate(gaps)))


def seated_at(weights: Weights, heights: Sequence[float] = HEIGHTS) -> list[Motion]:
    """The takes of figure 11: one root path, chairs of these heights."""
    walked = route(
        Stop((-1.2, 2.8), facing((0.4, -1.0)), 0.5), Stop((0.0, 0.0), 0.0, 2.0, seated=True)
    )
    return [_made(weights, [(_chair(height), _HERE)], _free(walked)) for height in heights]


# Pictures


@dataclass(frozen=True)
class _Studio:
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
        out = Image.new("RGB", (picture.width, picture.height + self.pixels(_STRIP)), "white")
        out.paste(picture)
        pen = ImageDraw.Draw(out)
        for row, line in enumerate(lines):
            middle = picture.height + self.pixels(
                _STRIP * (0.5 if len(lines) == 1 else 0.28 + 0.44 * row)
            )
            pen.text(
                (picture.width / 2, middle),
                line,
                _INK if row == 0 else (110, 114, 120),
                self.font,
                anchor="mm",
            )

        return out

    def grid(self, rows: Sequence[Sequence[Image.Image]]) -> Image.Image:
        """Pictures of one size, row by row."""
        gap = self.pixels(_GAP)
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
        pen = ImageDraw.Draw(disc)
        middle, rim = fine * size / 2, fine * radius
        pen.ellipse(
            [middle - 1.4 * rim, middle - 1.4 * rim, middle + 1.4 * rim, middle + 1.4 * rim],
            (255, 255, 255, 235),
        )
        pen.ellipse(
            [middle - rim, middle - rim, middle + rim, middle + rim],
            outline=(*_FAINT, 255),
            width=fine,
        )
        font = ImageFont.load_default(0.34 * rim)
        for k, share in enumerate(action):
            angle = 2.0 * np.pi * k / len(action) - 0.5 * np.pi
            ray = np.array([np.cos(angle), np.sin(angle)])
            line = Image.new("RGBA", disc.size)
            ends = [(middle, middle), tuple((middle + rim * ray).tolist())]
            ImageDraw.Draw(line).line(ends, (*_INK, round(255 * float(share))), round(0.13 * rim))
            disc.alpha_composite(line)
            likely = float(share) >= float(action.max())
            label = middle + 1.2 * rim * ray
            ImageDraw.Draw(disc).text(
                (label[0], label[1]),
                str(k + 1),
                (*(_INK if likely else _FAINT), 255),
                font,
                anchor="mm",
            )

        disc = disc.resize((size, size), Image.Resampling.LANCZOS)
        out = picture.copy()
        edge = self.pixels(6)
        out.paste(disc, (out.width - size - edge, edge), disc)
        return out


def _put(
    stage: Stage,
    motion: Motion,
    frame: int,
    colour: Colour,
    offset: Sequence[float] = (0.0, 0.0, 0.0),
) -> None:
    stage.pose(motion.frames[frame], motion.joints[frame, PELVIS] + offset, colour)


def _strobe(stage: Stage, motion: Motion, frames: Sequence[int], colour: Colour) -> None:
    """Poses at these frames, from pale to the full colour."""
    for k, frame in enumerate(frames, 1):
        _put(stage, motion, frame, mixed(_PALE, colour, 0.30 + 0.70 * (k / len(frames)) ** 1.5))


def _spaced(path: RootPath, first: int, last: int, step: float) -> list[int]:
    """Frames from ``first`` to before ``last`` at every ``step`` metres of the path."""
    way = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(path.position[first:last], axis=0), axis=1))]
    )
    return [
        first + int(np.searchsorted(way, at)) for at in np.arange(0.0, way[-1] - 0.4 * step, step)
    ]


def _furnish(stage: Stage, pieces: Iterable[Piece]) -> None:
    for parts, place in pieces:
        stage.furnish(parts, place)


def _floor_line(stage: Stage, path: RootPath) -> None:
    """The root's way, drawn on the floor."""
    moved = np.concatenate([[True], np.linalg.norm(np.diff(path.position, axis=0), axis=1) > 1e-4])
    stage.line(path.position[moved] + (0.0, 0.0, 0.004), _WAY, 0.010)


def _around(motion: Motion, frame: int) -> np.ndarray:
    """Corners of the room that a body takes, standing at this frame."""
    ground = motion.joints[frame, PELVIS] * (1.0, 1.0, 0.0)
    return ground + np.array(
        [(x, y, z) for x in (-0.7, 0.7) for y in (-0.7, 0.7) for z in (0.0, 1.8)]
    )


def _moment(
    studio: _Studio,
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
    _furnish(stage, pieces)
    _put(stage, motion, frame, _MODE["FREE"])
    picture = studio.photograph(stage, width, height, _around(motion, frame), margin=0.02)
    return studio.with_circle(picture, motion.action[frame]) if motion.action.size else picture


# The figures


def _actions(studio: _Studio) -> Image.Image:
    """Figure 3: action probabilities at moments of one take."""
    stand = Stop((1.2, 3.2), facing((-0.3, -1.0)), 1.0)
    chair = Stop((0.0, 0.0), 0.0, 2.0, seated=True)
    stool = Stop((3.0, 1.8), facing((-1.0, 0.0)), 2.0, seated=True)
    walked = route(stand, (0.12, 1.5), chair, (1.2, 1.3), stool)
    pieces = [(_chair(), _HERE), (_stool(0.55), Place(stool.position, stool.yaw))]
    motion = _made(studio.weights, pieces, _free(walked))
    _, down, last = walked.rests
    moments = {
        "stands": 15,
        "walks": down.start - 75,
        "turns to the chair": down.start - 28,
        "sits down": down.start - 6,
        "sits": (down.start + down.stop - 1) // 2,
        "gets up": down.stop + 17,
        "walks on": (down.stop - 1 + last.start) // 2 + 5,
        "sits on the stool": last.stop - 11,
    }
    panels = [
        studio.captioned(
            _moment(studio, pieces, motion, frame, 48.0, 390, 330),
            f"{frame / MODEL_FPS:.1f} s: {name}",
        )
        for name, frame in moments.items()
    ]
    return studio.grid([panels[:4], panels[4:]])


def typing(weights: Weights, seat: float, desk: float) -> np.ndarray:
    """Joints (T, 22, 3) of one who sits on a chair and types at a desk of these heights, in EE."""
    pieces = [(_chair(seat), _HERE), (_desk(desk, 0.22), _HERE)]
    return _made(weights, pieces, _at_a_desk(partial(_made_up, _TYPING), desk)).joints


def moved_to(joints: np.ndarray, seat: float, desk: float) -> np.ndarray:
    """The motion (T, 22, 3) of figure 9, with its seat and its desk as much higher as is said
    (metres): the seat first, which takes the hands along, then the top under them.
    """
    resting = float(np.median(joints[:, PELVIS, 2]))
    sits = at_seat_height(joints, resting, resting + seat)
    (use, *_), (now, *_) = (working(j, root_from_joints(j)) for j in (joints, sits))
    risen = float(np.median(now.points[:, 2]) - np.median(use.points[:, 2]))
    return at_top_height(sits, now, desk - risen)


def _augmented(studio: _Studio) -> Image.Image:
    """Figure 9: how training moves one motion to chairs and desks of other heights."""
    chairs, desks = {"hc": 0.50, "mc": 0.42}, {"hd": 0.80, "md": 0.72}
    source = typing(studio.weights, chairs["hc"], desks["hd"])
    panels = []
    for chair, desk in (("hc", "hd"), ("hc", "md"), ("mc", "hd"), ("mc", "md")):
        lower = chairs[chair] - chairs["hc"], desks[desk] - desks["hd"]
        motion = _motion(moved_to(source, *lower) if any(lower) else source, np.zeros((0, 0)))
        stage = Stage(62.0)
        _furnish(stage, [(_chair(chairs[chair]), _HERE), (_desk(desks[desk], 0.22), _HERE)])
        _put(stage, motion, 75, _MODE["FREE" if any(lower) else "EE"])
        seen = np.array(
            [(x, y, z) for x in (-0.65, 0.65) for y in (-0.3, 0.82) for z in (0.0, 1.65)]
        )
        picture = studio.photograph(stage, 390, 350, seen, margin=0.02)
        hands = [END_EFFECTORS["hand_left"], END_EFFECTORS["hand_right"]]
        keep = motion.joints[:, hands, 2] - desks[desk]
        was = source[:, hands, 2] - desks["hd"]
        panels.append(
            studio.captioned(
                picture,
                f"{chair}, {desk}: chair {chairs[chair]:.2f}, desk {desks[desk]:.2f}",
                f"hands {100.0 * np.abs(keep - was).mean():.1f} cm off their place to it"
                if any(lower)
                else "source, made by the network in EE",
            )
        )

    return studio.grid([panels])


def _pelvis(pelvis: float, seat: float) -> str:
    """Where a pelvis is, and how far that is from where it would sit; ``seat``: height of the top,
    0 for none.
    """
    off = round(100.0 * (pelvis - seat - SEAT_TO_PELVIS))
    return f"pelvis {pelvis:.2f} m" + (f" ({off:+d} cm)" if seat else "")


def _by_furniture(studio: _Studio) -> Image.Image:
    """Figure 10: one root path, six kinds of furniture."""
    walked = route(
        Stop((2.9, 0.95), facing((-1.0, -0.1)), 0.3), Stop((0.0, 0.0), 0.0, 2.5, seated=True)
    )
    rest = walked.rests[-1]
    # None of the last second before the seat, which would stand between it and the camera.
    frames = [
        *_spaced(walked.path, walked.rests[0].stop - 1, rest.start - 30, 0.70),
        rest.stop - 16,
    ]
    kinds: dict[str, tuple[float, list[Piece]]] = {
        "nothing": (0.0, []),
        "chair": (0.45, [(_chair(), _HERE)]),
        "stool": (0.63, [(_stool(0.63), _HERE)]),
        "bench": (0.36, [(_bench(0.36), _HERE)]),
        # less the cushion that lies where one sits
        "sofa": (0.42, [(FURNITURE["Sofa"][:-1], Place((0.405, 0.0), 0.0))]),
        "chair and desk": (0.45, [(_chair(), _HERE), (_desk(0.74, 0.92), _HERE)]),
    }
    panels = []
    for name, (height, pieces) in kinds.items():
        motion = _made(studio.weights, pieces, _free(walked))
        stage = Stage(118.0)
        _furnish(stage, pieces)
        _floor_line(stage, walked.path)
        _strobe(stage, motion, frames, _MODE["FREE"])
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
        words = _pelvis(motion.joints[frames[-1], PELVIS, 2], height)
        title = f"{name}, {height:.2f} m" if height else name
        panels.append(
            studio.captioned(studio.photograph(stage, 525, 300, seen, margin=0.02), title, words)
        )

    return studio.grid([panels[:3], panels[3:]])


def _by_height(studio: _Studio) -> Image.Image:
    """Figure 11: the last poses of one root path on chairs of several heights."""
    stage = Stage(52.0)
    feet, words = [], []
    for k, (height, motion) in enumerate(zip(HEIGHTS, seated_at(studio.weights), strict=True)):
        offset = 1.02 * k * stage.axes[0]
        stage.furnish(_chair(height), Place((offset[0], offset[1]), 0.0))
        _put(
            stage,
            motion,
            len(motion) - 15,
            mixed(_PALE, _MODE["FREE"], 0.5 + 0.1 * k),
            offset.tolist(),
        )
        feet.append(offset + np.array([0.0, 0.25, 0.0]))
        words.append(
            (
                f"seat {height:.2f} m",
                _pelvis(float(motion.joints[len(motion) - 15, PELVIS, 2]), height),
            )
        )

    picture = studio.captioned(studio.photograph(stage, 1600, 430, margin=0.03))
    pen = ImageDraw.Draw(picture)
    for at, lines in zip(stage.pixels(np.array(feet)), words, strict=True):
        for row, line in enumerate(lines):
            down = picture.height - studio.pixels(_STRIP * (0.72 - 0.44 * row))
            pen.text(
                (at[0], down), line, _INK if row == 0 else (110, 114, 120), studio.font, anchor="mm"
            )

    return picture


def _at_a_desk(course: Callable[[int], tuple[np.ndarray, np.ndarray]], desk: float) -> Controls:
    """Someone who stays where he is and whose two hands are led over a desk of this height."""
    path = _staying(4.0)
    left, right = course(len(path))
    over = np.array([0.0, 0.0, desk])
    return Controls(
        fps=MODEL_FPS,
        root=path.matrices(),
        mode="EE",
        hand_left=left + over,
        hand_right=right + over,
    )


def _made_up(kind: int, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Courses (T, 3) of both hands over a desk, of a kind that training makes up, too."""
    rng = np.random.default_rng(0)
    left, right = AT_DESKS[kind]
    assert left is not None and right is not None
    return left(rng, frames, -1.0), right(rng, frames, 1.0)


def _greets(frames: int) -> tuple[np.ndarray, np.ndarray]:
    """The right hand waves twice a second, the left one lies on the desk."""
    wave = np.sin(2.0 * np.pi * 2.0 * np.arange(frames) / MODEL_FPS)
    lying = np.tile([-0.20, 0.32, 0.05], (frames, 1))
    return lying, np.stack([0.40 + 0.08 * wave, 0.24 + 0.0 * wave, 0.60 - 0.02 * wave**2], axis=1)


def _copied(studio: _Studio) -> Image.Image:
    """Figure 12: two upper bodies over four combinations of seat and desk."""
    seat, desk = 0.45, 0.73
    standing = 0.95 - SEAT_TO_PELVIS - seat  # metres that a standing pelvis is higher
    combinations: list[tuple[str, float, list[Piece]]] = [
        ("seat 0.36, desk 0.64", -0.09, [(_bench(0.36), _HERE)]),
        ("seat 0.45, desk 0.73", 0.0, [(_chair(), _HERE)]),
        ("seat 0.60, desk 0.88", 0.15, [(_stool(0.60), _HERE)]),
        (f"desk {desk + standing:.2f}", standing, []),
    ]
    rows = []
    for task, course in (("writes", partial(_made_up, _HANDWRITING)), ("greets", _greets)):
        asked = _at_a_desk(course, desk)
        source = _made(studio.weights, [(_chair(seat), _HERE), (_desk(desk, 0.22), _HERE)], asked)
        panels = []
        for name, up, seats in combinations:
            pieces = [*seats, (_desk(desk + up, 0.22), _HERE)]
            given = source.joints[:, list(UPPER)] + (0.0, 0.0, up)
            motion = _made(studio.weights, pieces, replace(asked, mode="FULL", upper_body=given))
            stage = Stage(48.0)
            _furnish(stage, pieces)
            _put(stage, motion, 75, _MODE["FULL"])
            seen = np.array(
                [(x, y, z) for x in (-0.65, 0.65) for y in (-0.3, 0.82) for z in (0.0, 1.75)]
            )
            gap = 100.0 * np.linalg.norm(motion.joints[:, list(UPPER)] - given, axis=-1).mean()
            picture = studio.photograph(stage, 390, 350, seen, margin=0.02)
            panels.append(
                studio.captioned(picture, f"{task}: {name}", f"upper body {gap:.1f} cm off")
            )

        rows.append(panels)

    return studio.grid(rows)


def _carries(weights: Weights) -> tuple[list[Piece], Controls, RootPath]:
    """A tray is carried to a chair: head and pelvis as the network itself moves them, the hands
    before them.
    """
    walked = route(
        Stop((2.6, 1.3), facing((-1.0, -0.2)), 0.5), Stop((0.0, 0.0), 0.0, 1.5, seated=True)
    )
    pieces = [(_chair(), _HERE)]
    free = _made(weights, pieces, _free(walked))
    tray = [
        np.stack(
            [np.full(len(free), x), np.full(len(free), 0.34), free.joints[:, PELVIS, 2] + 0.16], 1
        )
        for x in (-0.17, 0.17)
    ]
    hands = [to_world(walked.path, each) for each in tray]
    controls = replace(
        _free(walked),
        mode="EE",
        head=free.joints[:, END_EFFECTORS["head"]],
        hand_left=hands[0],
        hand_right=hands[1],
    )
    return pieces, controls, walked.path


def _lying_eight(frames: int) -> np.ndarray:
    """The right hand's course (T, 3) on a board, seen from a root at the origin."""
    a = 2.0 * np.pi * np.arange(frames) / frames
    return np.stack(
        [0.12 + 0.24 * np.sin(a), np.full(frames, 0.38), 1.38 + 0.15 * np.sin(2.0 * a)], axis=1
    )


def _draws() -> tuple[list[Piece], Controls]:
    """The right hand draws a lying eight on a whiteboard."""
    path = _staying(4.0)
    board = (FURNITURE["Whiteboard"], Place((0.0, 0.46), np.pi))
    return [board], Controls(
        fps=MODEL_FPS, root=path.matrices(), mode="EE", hand_right=_lying_eight(len(path))
    )


def _sorts() -> tuple[list[Piece], Controls]:
    """Both hands move things about a desk, the head leans over it."""
    asked = _at_a_desk(partial(_made_up, _HANDLING), 0.73)
    slow = 2.0 * np.pi * np.arange(len(asked)) / len(asked)
    head = np.stack(
        [0.06 * np.sin(slow), 0.16 + 0.03 * np.sin(2.0 * slow), np.full(len(asked), 1.14)], axis=1
    )
    return [(_chair(), _HERE), (_desk(0.73, 0.22), _HERE)], replace(asked, head=head)


def _asked(stage: Stage, motion: Motion, controls: Controls, frames: Sequence[int]) -> None:
    """What is asked of head and hands as red lines, and as balls at some frames; the ways that they
    went as dark lines.
    """
    for name, j in END_EFFECTORS.items():
        target = getattr(controls, name)
        if target is not None:
            stage.line(target, _ASKED, 0.008)
            stage.line(motion.joints[:, j], _WENT, 0.006)
            for frame in frames:
                stage.ball(target[frame], _ASKED, 0.035)


def _led(studio: _Studio) -> Image.Image:
    """Figure 13: head and hands that are led: on a walk to a chair, at a board, at a desk."""
    panels = []
    pieces, controls, path = _carries(studio.weights)
    rest = int(np.argmax(np.linalg.norm(path.position - path.position[-1], axis=1) < 1e-6))
    frames = [*_spaced(path, 10, rest - 30, 0.70), len(path) - 10]
    for name, told, at, toward, (width, height) in (
        ("carries something to a chair", (pieces, controls), frames, 118.0, (700, 430)),
        ("draws on a whiteboard", _draws(), [100], -40.0, (440, 430)),
        ("sorts things on a desk", _sorts(), [60], 60.0, (440, 430)),
    ):
        motion = _made(studio.weights, *told)
        stage = Stage(toward)
        _furnish(stage, told[0])
        if len(at) > 3:
            _floor_line(stage, path)

        _strobe(stage, motion, at, _MODE["EE"])
        _asked(stage, motion, told[1], at)
        picture = studio.photograph(stage, width, height, margin=0.03)
        panels.append(
            studio.captioned(picture, name, f"head and hands {_error(motion, told[1]):.1f} cm off")
        )

    gap = studio.pixels(_GAP)
    out = Image.new("RGB", (sum(p.width for p in panels) + 2 * gap, panels[0].height), "white")
    left = 0
    for panel in panels:
        out.paste(panel, (left, 0))
        left += panel.width + gap

    return out


def _through_a_room(studio: _Studio) -> Image.Image:
    """Figure 14: one long shot, its mode FREE, then EE at the whiteboard, then FREE."""
    sofa = Stop((-2.3, 1.25), np.pi, 2.0, seated=True)
    board = Stop((0.6, 1.35), 0.0, 4.0)
    chair = Stop((3.1, 1.0), facing((-0.5, -1.0)), 2.0, seated=True)
    walked = route(
        Stop((-4.3, -0.7), facing((1.0, 0.1)), 0.5),
        (-2.6, -0.5),
        sofa,
        (-1.0, 0.2),
        board,
        (1.8, 0.1),
        chair,
    )
    pieces = [
        (FURNITURE["Sofa"], Place((-1.9, 1.25), np.pi)),
        (FURNITURE["Whiteboard"], Place((0.6, 1.81), np.pi)),
        (_chair(), Place(chair.position, chair.yaw)),
        (FURNITURE["Desk"], Place((4.1, 1.65), np.pi)),
        (_bookcase(), Place((-3.75, 1.80), np.pi)),
    ]
    rest = walked.rests[2]
    frames = np.arange(len(walked.path))
    modes = np.where((frames >= rest.start) & (frames < (rest.stop - 1)), "EE", "FREE")
    hand = _lying_eight(rest.stop - 1 - rest.start) + np.array([*board.position, 0.0])
    target = hand[np.clip(frames - rest.start, 0, len(hand) - 1)]
    controls = replace(_free(walked), mode=modes.tolist(), hand_right=target)
    motion = _made(studio.weights, pieces, controls)

    stage = Stage(-77.0, 22.0)
    _furnish(stage, pieces)
    _floor_line(stage, walked.path)
    stage.line(hand, _ASKED, 0.010)
    picked: list[int] = []
    for before, after in zip(walked.rests[:-1], walked.rests[1:], strict=True):
        picked += _spaced(
            walked.path, (before.stop - 1) + (55 if picked else 0), after.start - 30, 0.90
        )
        picked.append((after.start + after.stop - 1) // 2)

    for k, frame in enumerate(picked):
        _put(
            stage,
            motion,
            frame,
            mixed(_PALE, _MODE[modes[frame]], 0.40 + 0.60 * k / (len(picked) - 1)),
        )

    seen = np.concatenate(stage.seen)
    for wall in (
        Part("Wall", (9.9, 0.08, 2.3), (0.15, 2.15, 1.15)),
        Part("Wall", (0.08, 3.2, 2.3), (-4.75, 0.55, 1.15)),
    ):
        stage.furnish((wall,), _HERE)

    words = (
        "blue: FREE; orange: EE, from half a second on the hand is "
        f"{_error(motion, controls, 15):.1f} cm off the red line"
    )
    title = f"{len(motion) / MODEL_FPS:.0f} seconds: sofa, whiteboard, chair"
    return studio.captioned(studio.photograph(stage, 1600, 530, seen, margin=0.02), title, words)


def _systems(studio: _Studio) -> dict[str, Sampler]:
    return {
        "ours": Sampler(studio.weights),
        **{name: sampler_of(weights) for name, weights in studio.others.items()},
    }


def _compared_free(studio: _Studio) -> Image.Image:
    """Figure 15: every system on one root path among furniture."""
    chair = Stop((0.0, 0.0), 0.0, 2.0, seated=True)
    walked = route(
        Stop((-1.5, 3.0), facing((0.5, -1.0)), 0.5),
        chair,
        Stop((1.6, 2.8), facing((0.6, 1.0)), 0.7),
    )
    pieces = [
        (_chair(), _HERE),
        (_desk(0.74, 0.62), Place((0.0, 0.0), -np.pi / 2)),
        (_bookcase(), Place((-0.95, 0.05), -np.pi / 2)),
        (_bench(0.40), Place((1.9, 1.45), 0.3)),
    ]
    down = walked.rests[1]
    moments = {
        "walks": down.start - 70,
        "turns": down.start - 36,
        "sits down": down.start - 16,
        "sits": (down.start + down.stop - 1) // 2,
        "gets up": down.stop + 17,
        "leaves": down.stop + 54,
    }
    rows = []
    for system, sampler in _systems(studio).items():
        motion = _made_by(sampler, pieces, _free(walked))
        rows.append(
            [
                studio.captioned(
                    _moment(studio, pieces, motion, frame, 58.0, 262, 290), f"{system}: {name}"
                )
                for name, frame in moments.items()
            ]
        )

    return studio.grid(rows)


def _compared_led(studio: _Studio) -> Image.Image:
    """Figure 16: every system, its head and hands led."""
    systems = _systems(studio)
    order = [*(name for name in systems if name != "ours"), "ours"]
    rows = []
    for (pieces, controls), frame, toward, low in (
        (_sorts(), 60, 60.0, 0.55),
        (_draws(), 100, -40.0, 0.90),
    ):
        seen = np.array(
            [(x, y, z) for x in (-0.45, 0.45) for y in (-0.15, 0.50) for z in (low, low + 0.85)]
        )
        panels = []
        for system in order:
            motion = _made_by(systems[system], pieces, controls)
            stage = Stage(toward)
            _furnish(stage, pieces)
            _put(stage, motion, frame, _MODE["EE"])
            _asked(stage, motion, controls, [frame])
            picture = studio.photograph(stage, 520, 360, seen, margin=0.0)
            panels.append(
                studio.captioned(picture, system, f"{_error(motion, controls):.1f} cm off")
            )

        rows.append(panels)

    return studio.grid(rows)


FIGURES: dict[str, Callable[[_Studio], Image.Image]] = {
    "3": _actions,
    "9": _augmented,
    "10": _by_furniture,
    "11": _by_height,
    "12": _copied,
    "13": _led,
    "14": _through_a_room,
    "15": _compared_free,
    "16": _compared_led,
}
"""The figures by their numbers in the paper."""
_OF_SEVERAL = ("15", "16")


def draw(
    output: Path,
    weights: Path | None,
    others: dict[str, Path],
    only: Sequence[str] | None,
    progress: Callable[[float], None],
    scale: float = 1.0,
) -> list[Path]:
    """Write the figures ``only`` (None: all) as PNGs into ``output``; returns the files.

    ``weights``: a file, or None for those that ship. ``others``: files of other systems, by their
    names; without any, figures that compare are left out. ``progress`` is called with the part
    done, in [0, 1]. ``scale``: 1 makes pictures about 1600 pixels wide. Raises InputError for a
    figure that there is not, WeightsError for a file that cannot be used.
    """
    chosen = list(FIGURES) if only is None else list(only)
    for number in chosen:
        if number not in FIGURES:
            raise InputError(f"There is no figure {number}; choose among {', '.join(FIGURES)}.")

    if not others and any(number in _OF_SEVERAL for number in chosen):
        print(
            "Figures 15 and 16 compare systems and no other system's weights were given: left out.",
            file=sys.stderr,
        )
        chosen = [number for number in chosen if number not in _OF_SEVERAL]

    studio = _Studio(
        load_weights(weights), {name: load_weights(file) for name, file in others.items()}, scale
    )
    files = []
    for done, number in enumerate(chosen):
        progress(done / len(chosen))
        picture = FIGURES[number](studio)
        files.append(output / f"figure_{int(number):02d}.png")
        flat = picture.quantize(_COLOURS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        with whole_file(files[-1]) as part:
            flat.save(part, format="PNG", optimize=True)

    progress(1.0)
    return files
