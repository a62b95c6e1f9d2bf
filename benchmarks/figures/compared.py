"""Figures 15 and 16: every system on the same controls."""

import numpy as np
from PIL import Image

from dafnet_addon.blender.showcase.stage import Stage
from dafnet_addon.core.paths import Stop, facing, route
from dafnet_addon.core.sampler import Sampler
from dafnet_addon.demo import Place
from dafnet_addon.model.systems import sampler_of

from . import furniture
from .furniture import HERE
from .motions import free, make_with, target_error
from .studio import MODE_COLOURS, Studio, corners, draw_targets, furnish, moment_picture, put_pose
from .tasks import drawing, sorting

__all__ = ["compared_free", "compared_led"]


def compared_free(studio: Studio) -> Image.Image:
    """Figure 15: every system on one root path among furniture."""
    chair = Stop((0.0, 0.0), 0.0, 2.0, seated=True)
    walked = route(
        Stop((-1.5, 3.0), facing((0.5, -1.0)), 0.5),
        chair,
        Stop((1.6, 2.8), facing((0.6, 1.0)), 0.7),
    )
    pieces = [
        (furniture.chair(), HERE),
        (furniture.desk(0.74, 0.62), Place((0.0, 0.0), -np.pi / 2)),
        (furniture.bookcase(), Place((-0.95, 0.05), -np.pi / 2)),
        (furniture.bench(0.40), Place((1.9, 1.45), 0.3)),
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
        motion = make_with(sampler, pieces, free(walked))
        pictures = (
            moment_picture(studio, pieces, motion, frame, 58.0, 262, 290)
            for frame in moments.values()
        )
        titles = (f"{system}: {name}" for name in moments)
        rows.append([studio.captioned(*each) for each in zip(pictures, titles, strict=True)])

    return studio.grid(rows)


def compared_led(studio: Studio) -> Image.Image:
    """Figure 16: every system, its head and hands led."""
    systems = _systems(studio)
    order = [*(name for name in systems if name != "ours"), "ours"]

    rows = []
    for (pieces, controls), frame, toward, low in (
        (sorting(), 60, 60.0, 0.55),
        (drawing(), 100, -40.0, 0.90),
    ):
        seen = corners((-0.45, 0.45), (-0.15, 0.50), (low, low + 0.85))
        panels = []
        for system in order:
            motion = make_with(systems[system], pieces, controls)

            stage = Stage(toward)
            furnish(stage, pieces)
            put_pose(stage, motion, frame, MODE_COLOURS["EE"])
            draw_targets(stage, motion, controls, [frame])
            picture = studio.photograph(stage, 520, 360, seen, margin=0.0)

            off = target_error(motion, controls)
            panels.append(studio.captioned(picture, system, f"{off:.1f} cm off"))

        rows.append(panels)

    return studio.grid(rows)


def _systems(studio: Studio) -> dict[str, Sampler]:
    return {
        "ours": Sampler(studio.weights),
        **{name: sampler_of(weights) for name, weights in studio.others.items()},
    }
