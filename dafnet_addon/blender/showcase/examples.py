"""Small scenes to begin with: furniture at the 3D cursor and a character with keyed root, mode and
targets, ready to generate.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...core.errors import InputError
from ...core.paths import Rest, Route, Stop, facing, route
from ...core.root import RootPath
from ...core.rotations import rotate, yaw_matrix
from ...core.series import smoothstep
from ...core.softness import LIES_LOWER, OVER_HARD, SOFTNESS
from ...demo import Place
from ..character.armature import create_character, metres_per_unit
from ..directing.root_keys import write_keys
from ..directing.walking import extend_range
from .demo_room import FURNITURE, Part, add_piece, key_channels, new_collection
from .free_floor import free_floor

__all__ = ["EXAMPLES", "Example", "add_example"]

_BLEND_SECONDS = 0.2
"""Seconds in which hands go to their targets: after the root has come to rest, and before it
leaves.
"""
_BED_TOP = 0.46
"""Metres; height of the mattress."""
_PILLOW = 0.07
"""Metres; thickness of the pillow."""
_MARGIN = 0.5
"""Metres around an example's path that its walker needs."""
_ORIGIN = Place((0.0, 0.0), 0.0)
_WRITING_DESK = (  # the demo's, with a sheet of paper where its computer stands
    *(part for part in FURNITURE["Desk"] if part.center[2] < 0.74 or part.round),
    Part("Paper", (0.21, 0.297, 0.004), (-0.13, 0.19, 0.742), bevel=0.0),
)


@dataclass(frozen=True)
class Plan:
    """What a character does: the root's ``route``, the ``targets`` (T, 3) of some of head and
    hands, and the frames (start, stop) in which its mode is EE; metres from the example's middle.
    """

    route: Route
    targets: dict[str, np.ndarray] = field(default_factory=dict)
    ee_frames: tuple[int, int] | None = None


@dataclass(frozen=True)
class Example:
    """``pieces``: the parts of each piece of furniture by its name, and where it stands; ``plan``:
    what is done with them at so many frames a second.
    """

    label: str
    description: str
    pieces: dict[str, tuple[tuple[Part, ...], Place]]
    plan: Callable[[float], Plan]


def _writing(
    seconds: np.ndarray, width: float, tall: float, line: float = 3.0
) -> tuple[np.ndarray, ...]:
    """A hand that writes, at (N,) ``seconds``: metres (N,) along the line, up the page, and,
    between lines, off it.

    ``width`` of a line and height (``tall``) of its letters, metres; ``line``: seconds for each.
    """
    number, u = np.floor(seconds / line), (seconds % line) / line
    back = np.clip((u - 0.85) / 0.15, 0.0, 1.0)
    ease = smoothstep(back)
    pen = np.sin(np.pi * np.clip(u / 0.85, 0.0, 1.0)) ** 0.25  # still at both ends of a line
    along = width * (np.clip(u / 0.85, 0.0, 1.0) * (1.0 - ease))
    letters = (
        0.5
        * tall
        * pen
        * np.sin(2.0 * np.pi * 1.7 * seconds)
        * (0.7 + 0.3 * np.sin(2.0 * np.pi * 0.45 * seconds))
    )
    return along, letters - 1.4 * tall * (number + ease), np.sin(np.pi * back)


def _ee_seconds(rest: Rest, frames: int, fps: float) -> tuple[np.ndarray, tuple[int, int]]:
    """Seconds (T,) since the hands have reached their targets during a rest, constant before and
    after; and the frames (start, stop) in which they are there.
    """
    first, last = (
        rest.start + round(_BLEND_SECONDS * fps),
        rest.stop - 1 - round(_BLEND_SECONDS * fps),
    )
    return (np.clip(np.arange(frames), first, last) - first) / fps, (first, last)


def _desk(fps: float) -> Plan:
    """Walks up from the side, sits down and writes with the right hand, the left on the paper."""
    walked = route(
        Stop((2.0, -1.2), facing((-0.8, 0.6)), 0.3),
        (0.75, 0.0),
        (0.45, 0.3),
        Stop((0.0, 0.0), 0.0, 7.0, seated=True),
        fps=fps,
    )
    seconds, ee_frames = _ee_seconds(walked.rests[-1], len(walked.path), fps)
    along, up, off = _writing(seconds, 0.15, 0.022)
    right = np.stack([0.07 + along, 0.545 + up, 0.785 + 0.03 * off], axis=1)
    left = np.tile([-0.17, 0.535, 0.785], (len(right), 1))
    return Plan(walked, {"hand_right": right, "hand_left": left}, (ee_frames[0], len(right)))


def _whiteboard(fps: float) -> Plan:
    """Walks up, writes two lines on the board, and steps aside."""
    walked = route(
        Stop((1.9, -1.6), facing((-0.8, 0.5)), 0.3),
        (0.1, -0.9),
        Stop((0.0, 0.0), 0.0, 6.4),
        (-0.75, -0.7),
        Stop((-1.5, -1.0), facing((0.45, -1.0)), 1.5),
        fps=fps,
    )
    seconds, ee_frames = _ee_seconds(walked.rests[1], len(walked.path), fps)
    along, up, off = _writing(seconds, 0.34, 0.085)
    right = np.stack([0.04 + along, 0.37 - 0.07 * off, 1.43 + up], axis=1)
    return Plan(walked, {"hand_right": right}, ee_frames)


def _sofa(fps: float) -> Plan:
    """Walks up, sits a while, gets up and walks off."""
    return Plan(
        route(
            Stop((-1.7, 2.2), facing((0.8, -0.7)), 0.3),
            (-0.1, 1.5),
            Stop((0.0, 0.0), 0.0, 3.5, seated=True),
            (0.5, 1.2),
            Stop((1.9, 2.0), facing((1.0, 0.4)), 1.0),
            fps=fps,
        )
    )


def _bed(fps: float) -> Plan:
    """Sits down on the edge, swings the legs up and lies down, the head on the pillow, led by
    targets of head and hands.
    """
    turn, inward, lasts, stays = 0.5 * np.pi, 0.34, 3.5, 4.0
    edge = 0.04  # metres ahead of the origin: so near the edge shins pass beside the bed
    sits = route(
        Stop((-1.6, 1.6), facing((0.6, -0.4)), 0.3),
        (-0.9, 1.1),
        Stop((0.0, edge), 0.0, 0.7, seated=True),
        fps=fps,
    )

    start = len(sits.path)
    frames = start + round((lasts + stays) * fps)
    after = (np.arange(frames) - start) / fps

    def eased(begin: float, seconds: float) -> np.ndarray:
        return smoothstep((after - begin) / seconds)

    # The body leans back before it turns, so that the legs come up first and do not swing through
    # the bed.
    turned = eased(0.7, 1.9)
    yaw = np.concatenate([sits.path.yaw, np.zeros(frames - start)])
    yaw[start:] = sits.path.yaw[-1] + turn * turned[start:]
    position = np.concatenate(
        [sits.path.position, np.tile(sits.path.position[-1], (frames - start, 1))]
    )
    position[:, 1] -= inward * turned
    path = RootPath(position, yaw)

    back = 0.6 * eased(0.15, 1.65) + 0.4 * eased(1.4, 2.0)
    angle = np.radians(88.0) * back

    over = _BED_TOP + OVER_HARD - SOFTNESS["bed"] - LIES_LOWER * back
    head = np.stack(
        [
            np.zeros(frames),
            0.06 * (1.0 - back) - 0.60 * np.sin(angle),
            over + 0.60 * np.cos(angle) + (_PILLOW + 0.06) * back,
        ],
        axis=1,
    )
    right = np.stack(
        [0.20 + 0.10 * back, 0.10 - 0.10 * back, _BED_TOP + 0.20 - 0.11 * back], axis=1
    )

    local = {"head": head, "hand_right": right, "hand_left": right * (-1.0, 1.0, 1.0)}
    targets = {role: rotate(yaw_matrix(yaw), place) + position for role, place in local.items()}

    rests = (
        sits.rests[0],
        sits.rests[1],
        Rest(Stop((0.0, edge - inward), turn), frames - round(stays * fps), frames),
    )

    return Plan(Route(path, rests), targets, (start, frames))


EXAMPLES = {
    "DESK": Example(
        "Chair and Desk",
        "Walks up to a desk, sits down and writes",
        {
            "Chair": (FURNITURE["Chair"], _ORIGIN),
            "Desk": (_WRITING_DESK, Place((0.0, 0.80), np.pi)),
        },
        _desk,
    ),
    "WHITEBOARD": Example(
        "Whiteboard",
        "Walks up to a whiteboard, writes on it and steps aside",
        {"Whiteboard": (FURNITURE["Whiteboard"], Place((0.10, 0.53), np.pi))},
        _whiteboard,
    ),
    "SOFA": Example(
        "Sofa",
        "Walks up to a sofa, sits down, gets up and walks off",
        {"Sofa": (FURNITURE["Sofa"], Place((-0.405, 0.0), 0.0))},
        _sofa,
    ),
    "BED": Example(
        "Bed", "Sits down on a bed and lies down on it", {"Bed": (FURNITURE["Bed"], _ORIGIN)}, _bed
    ),
}
"""What the Add menu offers in addition to a bare character."""


def add_example(context: bpy.types.Context, kind: str) -> bpy.types.Object:
    """Add an example at the 3D cursor, or on the nearest floor that is free, from the scene's first
    frame on, and return its character.

    The furniture goes into a new collection; the scene's end is moved if the example is longer.
    ``InputError``: Blender is not in object mode; nothing is changed then.
    """
    if context.mode != "OBJECT":
        raise InputError(
            "An example can only be added in object mode; leave the current mode first."
        )

    scene, example = context.scene, EXAMPLES[kind]
    unit, fps = metres_per_unit(scene), scene.render.fps / scene.render.fps_base
    plan = example.plan(fps)
    cursor = scene.cursor.location.copy()

    furniture = new_collection(scene, example.label)
    made = []
    for name, (parts, place) in example.pieces.items():
        piece = add_piece(furniture, name, parts, place)
        piece.data.transform(Matrix.Scale(1.0 / unit, 4))
        piece.location /= unit
        made.append(piece)
    middle = free_floor(scene, *_floor_of(plan, made, unit), unit, but=made)
    for piece in made:
        piece.location += middle

    path, first = plan.route.path, scene.frame_start
    try:
        scene.cursor.location = middle + Vector(path.position[0]) / unit
        armature = create_character(context)
    finally:
        scene.cursor.location = cursor

    armature.rotation_euler.z += float(path.yaw[0])
    own = armature.dafnet
    own.furniture = furniture
    placed = Route(RootPath(path.position + np.array(middle) * unit, path.yaw), plan.route.rests)

    write_keys(own.root, placed, first=first, scale=1.0 / unit, fps=fps)
    _direct(armature, plan, first=first, middle=np.array(middle), unit=unit)
    extend_range(scene, armature, first + len(path) - 1)
    scene.frame_set(first)

    return armature


def _floor_of(
    plan: Plan, pieces: Sequence[bpy.types.Object], unit: float
) -> tuple[np.ndarray, np.ndarray]:
    """The floor from one corner to the other (2,), metres, that an example needs whose furniture
    stands at the world's middle.
    """
    places = [
        np.array([piece.matrix_basis @ Vector(corner) for corner in piece.bound_box])[:, :2] * unit
        for piece in pieces
    ]
    walked = plan.route.path.position[:, :2]
    places += [walked - _MARGIN, walked + _MARGIN]
    every = np.concatenate(places)
    return every.min(axis=0), every.max(axis=0)


def _direct(
    armature: bpy.types.Object, plan: Plan, *, first: int, middle: np.ndarray, unit: float
) -> None:
    """Key the mode, and the targets while they count; targets that the plan does not use stay, but
    have no influence.
    """
    own = armature.dafnet
    for role in ("head", "hand_left", "hand_right"):
        target = getattr(own, role)
        if plan.ee_frames is None or role not in plan.targets:
            setattr(own, f"{role}_influence", 0.0 if plan.ee_frames else 1.0)
            continue

        begin, end = plan.ee_frames
        frames = np.arange(begin, end)
        key_channels(target, first + frames, location=middle + plan.targets[role][frames] / unit)

    if plan.ee_frames is not None:
        modes = [(0, "FREE"), (plan.ee_frames[0], "EE")]
        if plan.ee_frames[1] < len(plan.route.path):
            modes.append((plan.ee_frames[1], "FREE"))
        for frame, mode in modes:
            own.mode = mode
            armature.keyframe_insert("dafnet.mode", frame=first + frame)
