"""Contact sheets: motions as rows of stick figures over time, each row ending in its plan seen from
above.

Axes are equal and in metres. The body's left is blue, its right orange; an arrow on the floor shows
where it faces; furniture is shaded, with the body drawn over it; contacts are green dots. Needs
matplotlib, which is imported when a sheet is drawn.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...core.files import whole_file
from ...core.root import root_from_joints
from ...core.rotations import normalised, rotate, yaw_matrix
from ...core.series import MODEL_FPS
from ...core.skeleton import PARENTS, PELVIS, joint
from ..furnish.flesh import Furnishing
from .picture import picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["Row", "sheet"]

Row = tuple[str, np.ndarray, Furnishing | None]
"""A title, joints (T, 22, 3) at 30 fps in world metres, and the furniture around them."""
Cell = tuple[float, float, float, float]  # left, bottom, width, height

_LEFT, _RIGHT, _TRUNK = "#1f6fb4", "#e0701a", "#3a3a3a"
_CONTACT, _FACING, _FAINT = "#1e9e3e", "#a01860", "#d4d4d4"
# a cell, and how much of it lies under the floor line; metres
_WIDTH, _HEIGHT, _BELOW = 1.8, 2.35, 0.32
_COLOURS_KEPT = 128
_INCHES, _DOTS = 0.68, 82.0  # a metre on paper, and in pictures of furniture
# the camera: from straight ahead towards the body's right side, and up
_TURN, _TILT = np.radians(60), np.radians(12)
_CONTACT_JOINTS = (
    joint("left_foot"),
    joint("right_foot"),
    joint("left_wrist"),
    joint("right_wrist"),
    0,
)
_LEFT_BONES = {
    joint("left_" + n)
    for n in ("hip", "knee", "ankle", "foot", "collar", "shoulder", "elbow", "wrist")
}
_RIGHT_BONES = {
    joint("right_" + n)
    for n in ("hip", "knee", "ankle", "foot", "collar", "shoulder", "elbow", "wrist")
}
_COLOURS = [
    _LEFT if j in _LEFT_BONES else _RIGHT if j in _RIGHT_BONES else _TRUNK for j in range(22)
]


def _camera(yaw: float) -> np.ndarray:
    """(3, 3) rows right, up and towards the viewer, of a camera that sees a body that faces ``yaw``
    from its right front.
    """
    toward = np.array([np.sin(_TURN) * np.cos(_TILT), np.cos(_TURN) * np.cos(_TILT), np.sin(_TILT)])
    right = normalised(np.cross([0.0, 0.0, 1.0], toward))
    return np.stack([right, np.cross(toward, right), toward]) @ yaw_matrix(np.array(-yaw))


def _furniture(
    ax: "Axes", room: Furnishing, camera: np.ndarray, middle: np.ndarray, cell: Cell, scale: float
) -> None:
    """Draw furniture as ``camera`` sees it into a cell, in whose middle ``middle`` (3,) lies,
    ``scale`` units of the sheet a metre.
    """
    dots = scale * _DOTS
    size = round(cell[2] * _DOTS), round(cell[3] * _DOTS)
    seen = picture(room, None, camera, middle, size, dots)
    ax.imshow(
        seen,
        extent=(cell[0], cell[0] + cell[2], cell[1], cell[1] + cell[3]),
        aspect="equal",
        interpolation="antialiased",
        zorder=0,
    )


def _lines(
    ax: "Axes", segments: np.ndarray, colours: str | list[str], width: float, cell: Cell
) -> None:
    """Draw segments (N, 2, 2), clipped to a cell."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Rectangle

    drawn = ax.add_collection(
        LineCollection(list(segments), colors=colours, linewidths=width, capstyle="round")
    )
    drawn.set_clip_path(Rectangle(cell[:2], *cell[2:], transform=ax.transData))


def _figure(
    ax: "Axes",
    pose: np.ndarray,
    yaw: float,
    room: Furnishing | None,
    contacts: np.ndarray | None,
    camera: np.ndarray,
    cell: Cell,
) -> None:
    """One pose (22, 3) in its cell, the camera following the pelvis along the floor."""
    ground = pose[0] * (1, 1, 0)
    corner = np.array([cell[0] + cell[2] / 2, cell[1] + _BELOW])

    def seen(points: np.ndarray) -> np.ndarray:
        return (points - ground) @ camera[:2].T + corner

    # The floor's lines are those of the world, so that travel shows although the camera follows.
    middle = ground + (cell[3] / 2 - _BELOW) * camera[1]
    _furniture(ax, room or Furnishing(), camera, middle, cell, 1.0)

    forward = rotate(yaw_matrix(np.array(yaw)), np.array([0.0, 1.0, 0.0]))
    start, end = seen(np.stack([ground, ground + 0.38 * forward]))
    ax.annotate(
        "",
        end,
        start,
        arrowprops={"arrowstyle": "-|>", "color": _FACING, "lw": 1.0, "shrinkA": 0, "shrinkB": 0},
    )

    bones = np.stack([pose[list(PARENTS[1:])], pose[1:]], axis=1)
    order = np.argsort((bones.mean(1) - ground) @ camera[2])
    _lines(ax, seen(bones)[order], [_COLOURS[j + 1] for j in order], 2.2, cell)
    top, neck = pose[joint("head")], pose[joint("neck")]
    skull = top + normalised(top - neck) * 0.08
    angle = np.linspace(0, 2 * np.pi, 17)
    ring = seen(skull) + 0.10 * np.stack([np.cos(angle), np.sin(angle)], -1)
    nose = seen(np.stack([skull + 0.09 * forward, skull + 0.16 * forward]))
    _lines(ax, np.concatenate([np.stack([ring[:-1], ring[1:]], 1), nose[None]]), _TRUNK, 1.4, cell)
    if contacts is not None:
        touching = [j for j, on in zip(_CONTACT_JOINTS, contacts, strict=True) if on]
        ax.plot(
            *seen(pose[touching]).T,
            "o",
            color=_CONTACT,
            markersize=4.5,
            markeredgecolor="white",
            zorder=4,
        )


def _plan(
    ax: "Axes",
    joints: np.ndarray,
    yaw: np.ndarray,
    room: Furnishing | None,
    frames: np.ndarray,
    cell: Cell,
) -> None:
    """The pelvis' path from above, with hips, shoulders and facing at the frames shown, and a bar
    of one metre.
    """
    path = joints[:, PELVIS, :2]
    middle = (path.min(0) + path.max(0)) / 2
    reach = max(float(np.ptp(path, axis=0).max()) / 2 + 0.55, 0.8)
    scale = min(cell[2], cell[3] - _BELOW) / (2 * reach)
    corner = np.array([cell[0] + cell[2] / 2, cell[1] + _BELOW + (cell[3] - _BELOW) / 2])

    def seen(points: np.ndarray) -> np.ndarray:
        return (points[..., :2] - middle) * scale + corner

    if room is not None and len(room):
        square = (corner[0] - cell[2] / 2, corner[1] - cell[2] / 2, cell[2], cell[2])
        _furniture(ax, room, np.eye(3), np.array([*middle, 0.0]), square, scale)

    _lines(ax, seen(np.stack([path[:-1], path[1:]], 1)), _TRUNK, 0.8, cell)
    for frame in frames:
        pose = joints[frame]
        pairs = [(joint("left_" + n), joint("right_" + n)) for n in ("hip", "shoulder")]
        spans = np.array([(pose[a], (pose[a] + pose[b]) / 2, pose[b]) for a, b in pairs])
        feet = pose[[[joint(s + "ankle"), joint(s + "foot")] for s in ("left_", "right_")]]
        _lines(ax, seen(np.concatenate([spans[:, :2], feet[:1]])), _LEFT, 1.2, cell)
        _lines(ax, seen(np.concatenate([spans[:, 1:], feet[1:]])), _RIGHT, 1.2, cell)
        forward = rotate(yaw_matrix(yaw[frame]), np.array([0.0, 1.0, 0.0]))
        start, end = seen(np.stack([pose[0], pose[0] + 0.4 * forward]))
        ax.annotate(
            "",
            end,
            start,
            arrowprops={
                "arrowstyle": "-|>",
                "color": _FACING,
                "lw": 0.7,
                "shrinkA": 0,
                "shrinkB": 0,
            },
        )

    ax.plot(*seen(path[0]), "o", color=_TRUNK, markersize=3)
    bar = np.array([corner[0] - scale / 2, cell[1] + 0.2])
    ax.plot([bar[0], bar[0] + scale], [bar[1], bar[1]], color="black", lw=1.2)
    ax.text(corner[0], cell[1] + 0.04, "1 m, from above", ha="center", va="bottom", fontsize=6)


def sheet(
    file: Path,
    rows: Sequence[Row],
    columns: int = 8,
    contacts: Sequence[np.ndarray | None] | None = None,
) -> None:
    """Draw a contact sheet into ``file`` (.png or .svg).

    A row is a title, joints (T, 22, 3) at 30 fps in world metres, and furniture or None; it is
    shown at ``columns`` times spread over its length. ``contacts`` holds (T, 5) booleans for each
    row (left foot, right foot, left hand, right hand, pelvis), or None.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    across, down = columns * _WIDTH + _HEIGHT, len(rows) * _HEIGHT
    figure = Figure(figsize=(across * _INCHES, down * _INCHES), dpi=120)
    canvas = FigureCanvasAgg(figure)
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set(xlim=(0, across), ylim=(-down, 0), aspect="equal")
    ax.axis("off")
    for r, (title, joints, room) in enumerate(rows):
        yaw = root_from_joints(joints).yaw
        frames = np.linspace(0, len(joints) - 1, columns).round().astype(int)
        # One camera a row, set by where the body mostly faces.
        camera = _camera(float(np.angle(np.exp(1j * yaw[frames]).sum())))
        bottom = -(r + 1) * _HEIGHT
        touching = None if contacts is None else contacts[r]
        for c, frame in enumerate(frames):
            cell = (c * _WIDTH, bottom, _WIDTH, _HEIGHT)
            _figure(
                ax,
                joints[frame],
                float(yaw[frame]),
                room,
                None if touching is None else touching[frame],
                camera,
                cell,
            )
            ax.text(
                (c + 0.5) * _WIDTH,
                bottom + 0.04,
                f"{frame / MODEL_FPS:.1f} s",
                ha="center",
                va="bottom",
                fontsize=6,
            )

        _plan(ax, joints, yaw, room, frames, (columns * _WIDTH, bottom, _HEIGHT, _HEIGHT - 0.15))
        ax.text(
            0.05, bottom + _HEIGHT - 0.03, title, ha="left", va="top", fontsize=8, weight="bold"
        )
        ax.plot([0, across], [bottom, bottom], color=_FAINT, lw=0.8)

    with whole_file(file) as part:
        if file.suffix == ".png":
            canvas.draw()
            _save_picture(np.asarray(canvas.buffer_rgba()), part)
        else:
            figure.savefig(part, format=file.suffix[1:])


def _save_picture(pixels: np.ndarray, file: Path) -> None:
    """Save pixels (H, W, 4) in few colours, which a sheet has anyway: a fifth of the bytes."""
    from PIL import Image

    picture = Image.fromarray(pixels).convert("RGB")
    # An octree keeps the few vivid colours as they are, a median cut those of large areas.
    few = picture.quantize(
        _COLOURS_KEPT, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE
    )
    few.save(file, format="PNG", optimize=True)
