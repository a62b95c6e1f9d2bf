"""Figure 9: how training moves one motion to chairs and desks of other heights."""

from functools import partial

import numpy as np
from PIL import Image

from dafnet_addon.blender.showcase.stage import Stage
from dafnet_addon.core.root import root_from_joints
from dafnet_addon.core.skeleton import END_EFFECTORS, PELVIS
from dafnet_addon.core.weights import Weights
from dafnet_addon.data.motion.interactions import working
from dafnet_addon.data.motion.retarget import at_seat_height, at_top_height

from . import furniture
from .furniture import HERE
from .motions import make, motion_of
from .studio import MODE_COLOURS, Studio, corners, furnish, put_pose
from .tasks import TYPING, at_a_desk, training_course

__all__ = ["augmented", "moved_to", "typing"]


def typing(weights: Weights, seat: float, desk: float) -> np.ndarray:
    """Joints (T, 22, 3) of one who sits on a chair and types at a desk of these heights, in EE."""
    pieces = [(furniture.chair(seat), HERE), (furniture.desk(desk, 0.22), HERE)]
    return make(weights, pieces, at_a_desk(partial(training_course, TYPING), desk)).joints


def moved_to(joints: np.ndarray, seat: float, desk: float) -> np.ndarray:
    """The motion (T, 22, 3) of figure 9, with its seat and its desk as much higher as is said
    (metres): the seat first, which takes the hands along, then the top under them.
    """
    resting = float(np.median(joints[:, PELVIS, 2]))
    sits = at_seat_height(joints, resting, resting + seat)
    (use, *_), (now, *_) = (working(j, root_from_joints(j)) for j in (joints, sits))
    risen = float(np.median(now.points[:, 2]) - np.median(use.points[:, 2]))
    return at_top_height(sits, now, desk - risen)


def augmented(studio: Studio) -> Image.Image:
    """Figure 9: how training moves one motion to chairs and desks of other heights."""
    chairs, desks = {"hc": 0.50, "mc": 0.42}, {"hd": 0.80, "md": 0.72}
    source = typing(studio.weights, chairs["hc"], desks["hd"])
    hands = [END_EFFECTORS["hand_left"], END_EFFECTORS["hand_right"]]
    seen = corners((-0.65, 0.65), (-0.3, 0.82), (0.0, 1.65))

    panels = []
    for chair, desk in (("hc", "hd"), ("hc", "md"), ("mc", "hd"), ("mc", "md")):
        lower = chairs[chair] - chairs["hc"], desks[desk] - desks["hd"]
        motion = motion_of(moved_to(source, *lower) if any(lower) else source, np.zeros((0, 0)))

        stage = Stage(62.0)
        pieces = furniture.chair(chairs[chair]), furniture.desk(desks[desk], 0.22)
        furnish(stage, [(piece, HERE) for piece in pieces])
        put_pose(stage, motion, 75, MODE_COLOURS["FREE" if any(lower) else "EE"])
        picture = studio.photograph(stage, 390, 350, seen, margin=0.02)

        over_desk = motion.joints[:, hands, 2] - desks[desk]
        before = source[:, hands, 2] - desks["hd"]
        off = 100.0 * np.abs(over_desk - before).mean()
        moved = f"hands {off:.1f} cm off their place to it"
        title = f"{chair}, {desk}: chair {chairs[chair]:.2f}, desk {desks[desk]:.2f}"
        words = moved if any(lower) else "source, made by the network in EE"
        panels.append(studio.captioned(picture, title, words))

    return studio.grid([panels])
