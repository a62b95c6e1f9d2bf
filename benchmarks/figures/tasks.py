"""What hands and heads are led to do: at desks, at a board, carrying a tray."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from dafnet_addon import Controls
from dafnet_addon.blender.showcase.demo_room import FURNITURE
from dafnet_addon.core.paths import Stop, facing, route
from dafnet_addon.core.root import RootPath, to_world
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import END_EFFECTORS, PELVIS
from dafnet_addon.core.weights import Weights
from dafnet_addon.data.synthesis.hand_paths import AT_DESKS
from dafnet_addon.demo import Place

from . import furniture
from .furniture import HERE, Piece
from .motions import free, make, staying

__all__ = [
    "HANDLING",
    "HANDWRITING",
    "TYPING",
    "at_a_desk",
    "carrying",
    "drawing",
    "figure_of_eight",
    "greeting",
    "sorting",
    "training_course",
]

TYPING, HANDWRITING, HANDLING = 0, 2, 3
"""Courses of ``AT_DESKS``."""


def at_a_desk(course: Callable[[int], tuple[np.ndarray, np.ndarray]], desk: float) -> Controls:
    """Someone who stays where he is and whose two hands are led over a desk of this height."""
    path = staying(4.0)
    left, right = course(len(path))
    over = np.array([0.0, 0.0, desk])
    return Controls(
        fps=MODEL_FPS,
        root=path.matrices(),
        mode="EE",
        hand_left=left + over,
        hand_right=right + over,
    )


def training_course(kind: int, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Courses (T, 3) of both hands over a desk, of a kind that training makes up, too."""
    rng = np.random.default_rng(0)
    left, right = AT_DESKS[kind]
    assert left is not None and right is not None
    return left(rng, frames, -1.0), right(rng, frames, 1.0)


def greeting(frames: int) -> tuple[np.ndarray, np.ndarray]:
    """The right hand waves twice a second, the left one lies on the desk."""
    wave = np.sin(2.0 * np.pi * 2.0 * np.arange(frames) / MODEL_FPS)
    lying = np.tile([-0.20, 0.32, 0.05], (frames, 1))
    return lying, np.stack([0.40 + 0.08 * wave, 0.24 + 0.0 * wave, 0.60 - 0.02 * wave**2], axis=1)


def carrying(weights: Weights) -> tuple[list[Piece], Controls, RootPath]:
    """A tray is carried to a chair: head and pelvis as the network itself moves them, the hands
    before them.
    """
    walked = route(
        Stop((2.6, 1.3), facing((-1.0, -0.2)), 0.5), Stop((0.0, 0.0), 0.0, 1.5, seated=True)
    )
    pieces = [(furniture.chair(), HERE)]
    walking = make(weights, pieces, free(walked))
    frames = len(walking)
    height = walking.joints[:, PELVIS, 2] + 0.16
    tray = [
        np.stack([np.full(frames, x), np.full(frames, 0.34), height], axis=1) for x in (-0.17, 0.17)
    ]
    hands = [to_world(walked.path, each) for each in tray]
    controls = replace(
        free(walked),
        mode="EE",
        head=walking.joints[:, END_EFFECTORS["head"]],
        hand_left=hands[0],
        hand_right=hands[1],
    )
    return pieces, controls, walked.path


def figure_of_eight(frames: int) -> np.ndarray:
    """The right hand's course (T, 3) on a board, seen from a root at the origin."""
    a = 2.0 * np.pi * np.arange(frames) / frames
    return np.stack(
        [0.12 + 0.24 * np.sin(a), np.full(frames, 0.38), 1.38 + 0.15 * np.sin(2.0 * a)], axis=1
    )


def drawing() -> tuple[list[Piece], Controls]:
    """The right hand draws a lying eight on a whiteboard."""
    path = staying(4.0)
    board = (FURNITURE["Whiteboard"], Place((0.0, 0.46), np.pi))
    return [board], Controls(
        fps=MODEL_FPS, root=path.matrices(), mode="EE", hand_right=figure_of_eight(len(path))
    )


def sorting() -> tuple[list[Piece], Controls]:
    """Both hands move things about a desk, the head leans over it."""
    asked = at_a_desk(partial(training_course, HANDLING), 0.73)
    slow = 2.0 * np.pi * np.arange(len(asked)) / len(asked)
    head = np.stack(
        [0.06 * np.sin(slow), 0.16 + 0.03 * np.sin(2.0 * slow), np.full(len(asked), 1.14)], axis=1
    )
    return [(furniture.chair(), HERE), (furniture.desk(0.73, 0.22), HERE)], replace(
        asked, head=head
    )
