"""Figures 12 to 14: upper bodies that are copied, head and hands that are led."""

from dataclasses import replace
from functools import partial

import numpy as np
from PIL import Image

from dafnet_addon.blender.showcase.demo_room import FURNITURE, Part
from dafnet_addon.blender.showcase.stage import Stage, mixed
from dafnet_addon.core.paths import Stop, facing, route
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import SEAT_TO_PELVIS, UPPER
from dafnet_addon.demo import Place

from . import furniture
from .furniture import HERE, Piece
from .motions import free, make, target_error
from .studio import (
    ASKED,
    GAP,
    MODE_COLOURS,
    PALE,
    Studio,
    corners,
    draw_path,
    draw_targets,
    frames_along,
    furnish,
    put_pose,
    put_poses,
)
from .tasks import (
    HANDWRITING,
    at_a_desk,
    carrying,
    drawing,
    figure_of_eight,
    greeting,
    sorting,
    training_course,
)

__all__ = ["copied", "led", "through_a_room"]


def copied(studio: Studio) -> Image.Image:
    """Figure 12: two upper bodies over four combinations of seat and desk."""
    seat, desk = 0.45, 0.73
    standing = 0.95 - SEAT_TO_PELVIS - seat  # metres that a standing pelvis is higher
    combinations: list[tuple[str, float, list[Piece]]] = [
        ("seat 0.36, desk 0.64", -0.09, [(furniture.bench(0.36), HERE)]),
        ("seat 0.45, desk 0.73", 0.0, [(furniture.chair(), HERE)]),
        ("seat 0.60, desk 0.88", 0.15, [(furniture.stool(0.60), HERE)]),
        (f"desk {desk + standing:.2f}", standing, []),
    ]
    seen = corners((-0.65, 0.65), (-0.3, 0.82), (0.0, 1.75))

    rows = []
    for task, course in (("writes", partial(training_course, HANDWRITING)), ("greets", greeting)):
        asked = at_a_desk(course, desk)
        own = [(furniture.chair(seat), HERE), (furniture.desk(desk, 0.22), HERE)]
        source = make(studio.weights, own, asked)

        panels = []
        for name, up, seats in combinations:
            pieces = [*seats, (furniture.desk(desk + up, 0.22), HERE)]
            given = source.joints[:, list(UPPER)] + (0.0, 0.0, up)
            motion = make(studio.weights, pieces, replace(asked, mode="FULL", upper_body=given))

            stage = Stage(48.0)
            furnish(stage, pieces)
            put_pose(stage, motion, 75, MODE_COLOURS["FULL"])
            gap = 100.0 * np.linalg.norm(motion.joints[:, list(UPPER)] - given, axis=-1).mean()
            picture = studio.photograph(stage, 390, 350, seen, margin=0.02)
            panels.append(
                studio.captioned(picture, f"{task}: {name}", f"upper body {gap:.1f} cm off")
            )

        rows.append(panels)

    return studio.grid(rows)


def led(studio: Studio) -> Image.Image:
    """Figure 13: head and hands that are led: on a walk to a chair, at a board, at a desk."""
    panels = []
    tray_room, tray, path = carrying(studio.weights)
    rest = int(np.argmax(np.linalg.norm(path.position - path.position[-1], axis=1) < 1e-6))
    frames = [*frames_along(path, 10, rest - 30, 0.70), len(path) - 10]

    for name, (pieces, controls), at, toward, (width, height) in (
        ("carries something to a chair", (tray_room, tray), frames, 118.0, (700, 430)),
        ("draws on a whiteboard", drawing(), [100], -40.0, (440, 430)),
        ("sorts things on a desk", sorting(), [60], 60.0, (440, 430)),
    ):
        motion = make(studio.weights, pieces, controls)
        stage = Stage(toward)
        furnish(stage, pieces)
        if len(at) > 3:
            draw_path(stage, path)

        put_poses(stage, motion, at, MODE_COLOURS["EE"])
        draw_targets(stage, motion, controls, at)
        picture = studio.photograph(stage, width, height, margin=0.03)
        off = target_error(motion, controls)
        panels.append(studio.captioned(picture, name, f"head and hands {off:.1f} cm off"))

    gap = studio.pixels(GAP)
    out = Image.new("RGB", (sum(p.width for p in panels) + 2 * gap, panels[0].height), "white")
    left = 0
    for panel in panels:
        out.paste(panel, (left, 0))
        left += panel.width + gap

    return out


def through_a_room(studio: Studio) -> Image.Image:
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
        (furniture.chair(), Place(chair.position, chair.yaw)),
        (FURNITURE["Desk"], Place((4.1, 1.65), np.pi)),
        (furniture.bookcase(), Place((-3.75, 1.80), np.pi)),
    ]

    rest = walked.rests[2]
    frames = np.arange(len(walked.path))
    modes = np.where((frames >= rest.start) & (frames < (rest.stop - 1)), "EE", "FREE")
    hand = figure_of_eight(rest.stop - 1 - rest.start) + np.array([*board.position, 0.0])
    target = hand[np.clip(frames - rest.start, 0, len(hand) - 1)]
    controls = replace(free(walked), mode=modes.tolist(), hand_right=target)
    motion = make(studio.weights, pieces, controls)

    stage = Stage(-77.0, 22.0)
    furnish(stage, pieces)
    draw_path(stage, walked.path)
    stage.line(hand, ASKED, 0.010)

    picked: list[int] = []
    for before, after in zip(walked.rests[:-1], walked.rests[1:], strict=True):
        first = (before.stop - 1) + (55 if picked else 0)
        picked += frames_along(walked.path, first, after.start - 30, 0.90)
        picked.append((after.start + after.stop - 1) // 2)

    for k, frame in enumerate(picked):
        share = 0.40 + 0.60 * k / (len(picked) - 1)
        put_pose(stage, motion, frame, mixed(PALE, MODE_COLOURS[modes[frame]], share))

    seen = np.concatenate(stage.seen)
    for wall in (
        Part("Wall", (9.9, 0.08, 2.3), (0.15, 2.15, 1.15)),
        Part("Wall", (0.08, 3.2, 2.3), (-4.75, 0.55, 1.15)),
    ):
        stage.furnish((wall,), HERE)

    off = target_error(motion, controls, 15)
    words = (
        f"blue: FREE; orange: EE, from half a second on the hand is {off:.1f} cm off the red line"
    )
    title = f"{len(motion) / MODEL_FPS:.0f} seconds: sofa, whiteboard, chair"
    return studio.captioned(studio.photograph(stage, 1600, 530, seen, margin=0.02), title, words)
