"""What fitting to the canonical body does to each source of motion: a table of distances and a
picture of poses.

    dafnet bench canonical FOLDER -o FOLDER

The first holds motion capture, as ``dafnet_addon.data.capture.mocap`` reads it; into the other go
``canonical.json`` and ``canonical.png``.
"""

import argparse
import json
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.files import save_text
from dafnet_addon.core.root import root_from_joints
from dafnet_addon.core.rotations import rotate, transpose
from dafnet_addon.core.series import MODEL_FPS, runs
from dafnet_addon.core.skeleton import FEET, JOINTS, PARENTS, PELVIS, TOE_HEIGHT, WRISTS, joint
from dafnet_addon.data.capture.cuts import bad_frames
from dafnet_addon.data.capture.mocap import Clip, read_clips
from dafnet_addon.data.motion.canonical import Calibration, calibrate, canonical
from dafnet_addon.training.evaluation.markdown import markdown_table

_PLANTED = 0.25
"""Metres a second of a toe on the floor, under which it stands."""
_STILL = 0.04
"""Metres a second of a hand, under which it rests."""
_RESTS = 20
"""Frames that a joint has to stay for."""
_SLIDE, _TOE, _ANKLE, _WRIST, _SEAT = (
    "toe slide",
    "toe moved",
    "ankle moved",
    "wrist wander",
    "seat wander",
)

_HEADS = (
    "toe slides, a frame",
    "toe moved",
    "ankle moved",
    "resting hand wanders",
    "seated pelvis wanders",
)

Pair = tuple[np.ndarray, np.ndarray]


def bodies(clips: list[Clip]) -> list[tuple[Calibration, list[Clip]]]:
    """Clips of one source by body; those of bodies that never stand upright are fitted with the
    rest of their source.
    """
    by_subject: dict[str, list[Clip]] = defaultdict(list)
    for clip in clips:
        by_subject[clip.subject].append(clip)

    fitted = []
    for own in by_subject.values():
        try:
            fitted.append((calibrate(own), own))
        except InputError:
            fitted.append((calibrate(clips), own))

    return fitted


def pairs(clips: list[Clip]) -> list[Pair]:
    """Each clip (T, 22, 3) before, only scaled and on the floor, and after fitting."""
    out = []
    for body, own in bodies(clips):
        for clip in own:
            after = canonical(clip, body)
            before = clip.joints * body.scale
            toes = before[:, FEET, 2].min(1)
            before = before - (0.0, 0.0, float(np.percentile(toes, 8)) - TOE_HEIGHT)
            out.append((before, after))

    return out


def _speed(joints: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(joints, axis=0), axis=-1) * MODEL_FPS


def _wander(joints: np.ndarray) -> float:
    return float(np.linalg.norm(joints - joints.mean(0), axis=-1).max())


def measure(found: list[Pair]) -> dict[str, tuple[float, float, int]]:
    """Mean before and after (millimetres) of each figure of a source, and how many frames or
    episodes it is of.

    Slide: how far a toe base that stands moves along the floor in a frame. Moved: how far from its
    place before fitting (before is zero). Wander: how far a joint that rests for 0.7 s or more
    strays from its mean, of hands while the chest moves by 4 cm, and of the seated pelvis.
    """
    values: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for before, after in found:
        if len(before) < 3:
            continue

        for toe in FEET:
            planted = (before[:-1, toe, 2] < 0.05) & (_speed(before[:, toe]) < _PLANTED)
            steps = [
                np.linalg.norm(np.diff(j[:, toe, :2], axis=0), axis=-1)[planted]
                for j in (before, after)
            ]
            values[_SLIDE] += list(zip(*steps, strict=True))
            for name, moved in ((_TOE, toe), (_ANKLE, toe - 3)):
                away = np.linalg.norm(after[:, moved] - before[:, moved], axis=-1)
                values[name] += [(0.0, each) for each in away]

        for wrist in WRISTS:
            for start, stop in runs(_speed(before[:, wrist]) < _STILL, _RESTS):
                if _wander(before[start:stop, joint("spine3")]) > 0.04:
                    own = [_wander(each[start:stop, wrist]) for each in (before, after)]
                    values[_WRIST].append((own[0], own[1]))

        height = before[:-1, PELVIS, 2]
        seated = (_speed(before[:, PELVIS]) < 0.1) & (height < 0.7) & (height > 0.3)
        for start, stop in runs(seated, _RESTS):
            own = [_wander(each[start:stop, PELVIS]) for each in (before, after)]
            values[_SEAT].append((own[0], own[1]))

    return {
        name: (*(1000 * np.array(pairs).mean(0)).tolist(), len(pairs))
        for name, pairs in values.items()
    }


def canonical_page(sources: dict[str, dict[str, tuple[float, float, int]]]) -> str:
    """The section of docs/data.md about fitting, of what ``measure`` says of each source."""

    def cell(figures: dict[str, tuple[float, float, int]], name: str) -> str:
        if name not in figures:
            return "–"
        before, after, count = figures[name]
        text = f"{after:.1f}" if name in (_TOE, _ANKLE) else f"{before:.2f} → {after:.2f}"
        return f"{text} ({count})" if name in (_WRIST, _SEAT) else text

    rows = [
        (source, *(cell(figures, name) for name in (_SLIDE, _TOE, _ANKLE, _WRIST, _SEAT)))
        for source, figures in sources.items()
    ]
    return f"""## Fitted to one body

What fitting does to each source, by `dafnet bench canonical` (millimetres, as captured → fitted;
in brackets how many rests). Ankles move since the sources put them elsewhere in the foot; the
pelvis wanders more where a chair turns or rolls.

{markdown_table(("source", *_HEADS), rows)}"""


def _poses(found: list[Pair]) -> list[Pair]:
    """A standing, a striding and a low pose of a source, before and after, seen from the body's
    right front, (22, 2).
    """
    good = [(b, a, ~np.any(list(bad_frames(b).values()), axis=0)) for b, a in found if len(b) > 2]

    def kinds(joints: np.ndarray) -> list[np.ndarray]:
        """How far each frame is from each kind of pose, metres: feet so far apart under a high
        pelvis, and a pelvis so low.
        """
        stride = np.linalg.norm(
            joints[:, joint("left_ankle")] - joints[:, joint("right_ankle")], axis=-1
        )
        height = joints[:, PELVIS, 2]
        unfit = (height < 0.85) | (joints[:, FEET, 2].min(1) > 0.04)
        return [
            *(np.abs(stride - apart) + 9.0 * unfit for apart in (0.2, 0.65)),
            np.abs(height - 0.55),
        ]

    shown = []
    for kind in range(3):
        scores = [np.where(ok, -kinds(b)[kind], -99.0) for b, _, ok in good]
        clip = int(np.argmax([s.max() for s in scores]))
        frame = int(np.argmax(scores[clip]))
        before, after = good[clip][0], good[clip][1]
        path = root_from_joints(before)
        seen = []
        for joints in (before, after):
            local = rotate(transpose(path.rotation[frame]), joints[frame] - path.position[frame])
            turn = np.radians(60)
            across = local[:, 1] * np.sin(turn) - local[:, 0] * np.cos(turn)
            seen.append(np.stack([across, local[:, 2]], -1))

        shown.append((seen[0], seen[1]))

    return shown


def picture(sources: dict[str, list[Pair]], file: Path) -> None:
    """Poses of each source before (grey) and after fitting (blue the left, orange the right) in one
    picture.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = 4
    lines = -(-len(sources) // columns)
    figure = Figure(figsize=(columns * 2.9, lines * 2.0), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(lines, columns).ravel()
    for ax in axes:
        ax.axis("off")

    for ax, (source, found) in zip(axes, sources.items(), strict=False):
        ax.set(xlim=(-0.6, 2.9), ylim=(-0.1, 1.85), aspect="equal")
        ax.axhline(0.0, color="#c8c8c8", lw=0.8)
        ax.set_title(source, fontsize=8)
        for place, (before, after) in enumerate(_poses(found)):
            shift = np.array([1.1 * place, 0.0])
            for pose, fitted in ((before, False), (after, True)):
                for j, parent in enumerate(PARENTS[1:], start=1):
                    side = "#1f6fb4" if JOINTS[j].startswith("left_") else "#3a3a3a"
                    colour = "#e0701a" if JOINTS[j].startswith("right_") else side
                    ends = pose[[parent, j]] + shift
                    ax.plot(
                        *ends.T,
                        color=colour if fitted else "#b4b4b4",
                        lw=1.4 if fitted else 3.0,
                        solid_capstyle="round",
                    )

    key = "grey: as captured,\nscaled to our legs\ncoloured: fitted\n(blue left, orange right)"
    axes[-1].text(0.02, 0.5, key, fontsize=8, va="center")
    figure.savefig(file)


def main(arguments: Sequence[str]) -> str:
    """Measure and draw the compact sources in a folder; the section of docs/data.md as text."""
    parser = argparse.ArgumentParser(
        "dafnet bench canonical",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args(arguments)

    clips: dict[str, list[Clip]] = defaultdict(list)
    for clip in read_clips(options.folder):
        if clip.split:
            clips[clip.source].append(clip)

    sources = {source: pairs(own) for source, own in clips.items()}
    figures = {source: measure(found) for source, found in sources.items()}
    save_text(options.output / "canonical.json", json.dumps(figures, indent=2))
    picture(sources, options.output / "canonical.png")
    return canonical_page(figures)
