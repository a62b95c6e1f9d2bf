"""Seats of every kind, each drawn anew in its measures and shapes from what makers of furniture
keep to, and where people sit on them: nothing that finds seats was ever tuned on these.

A person's thigh is 36 cm from the hip joint to the hollow of the knee, and the joint is 16 cm
before the back that he leans against: the pelvis is that far before a seat's back, or, on a deep
seat, that far behind its edge. Pieces face −y before they are turned; floor at zero, metres.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from dafnet_addon import Mesh
from dafnet_addon.core.rotations import rotate, yaw_matrix
from dafnet_addon.core.solids import BOX_CORNERS, BOX_TRIANGLES

__all__ = ["KINDS", "MadeSeat", "made_seat"]

_THIGH, _FROM_BACK = 0.36, 0.16  # metres
_LEG = 0.04  # metres across, of a piece's leg
_ANYWHERE = 0.25  # metres beside the pelvis that a body needs on a wide seat

Numbers = Sequence[float]


@dataclass(frozen=True)
class MadeSeat:
    """A piece of a ``kind``; ``marks``: where people sit on it, as in ``marks.toml``."""

    name: str
    kind: str
    mesh: Mesh
    marks: Sequence[dict[str, Any]]


@dataclass
class _Maker:
    """A mesh as it grows, by measures that ``rng`` draws."""

    rng: np.random.Generator
    vertices: list[np.ndarray] = field(default_factory=list)
    triangles: list[np.ndarray] = field(default_factory=list)
    marks: list[dict[str, Any]] = field(default_factory=list)

    def between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def add(self, vertices: np.ndarray, triangles: np.ndarray) -> None:
        self.triangles.append(triangles + sum(map(len, self.vertices)))
        self.vertices.append(vertices)

    def box(self, low: Numbers, high: Numbers, tilt: float = 0.0) -> None:
        """A box, tilted backwards by degrees about the lower end of its front."""
        a, b = np.array(low), np.array(high)
        corners = BOX_CORNERS * (b - a) / 2 + (a + b) / 2
        about = np.array([0.0, a[1], a[2]])
        c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
        turn = np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
        self.add((corners - about) @ turn.T + about, BOX_TRIANGLES)

    def round(self, low: float, high: float, radius: float, x: float = 0.0, y: float = 0.0) -> None:
        """A cylinder between two heights."""
        count = 24
        turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
        ring = np.stack([x + radius * np.cos(turn), y + radius * np.sin(turn)], axis=1)
        ends = [np.column_stack([ring, np.full(count, z)]) for z in (low, high)]
        middle = np.array([[x, y, low], [x, y, high]])
        k = np.arange(count)
        after = (k + 1) % count
        bottom, top = np.full(count, 2 * count), np.full(count, 2 * count + 1)
        faces = [
            (k, after, k + count),
            (after, after + count, k + count),
            (after, k, bottom),
            (k + count, after + count, top),
        ]
        self.add(
            np.concatenate([*ends, middle]),
            np.concatenate([np.stack(face, axis=1) for face in faces]),
        )

    def hollow(self, low: Numbers, high: Numbers, deep: float) -> None:
        """A slab whose top is hollowed out by so many metres in its middle."""
        self.box(low, (*high[:2], high[2] - deep - 0.02))
        count = 13
        x, y = (np.linspace(low[k], high[k], count) for k in range(2))
        across, along = np.meshgrid(np.linspace(-1, 1, count), np.linspace(-1, 1, count))
        z = high[2] - deep * (1.0 - across**2) * (1.0 - along**2)
        points = np.stack([*np.meshgrid(x, y), z], axis=-1).reshape(-1, 3)
        corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
        one = np.stack([corner, corner + 1, corner + count], axis=1)
        two = np.stack([corner + 1, corner + count + 1, corner + count], axis=1)
        self.add(points, np.concatenate([one, two]))

    def legs(self, half: float, front: float, back: float, high: float) -> None:
        for x in (-half + _LEG, half - _LEG):
            for y in (front + _LEG, back - _LEG):
                self.box((x - _LEG / 2, y - _LEG / 2, 0.0), (x + _LEG / 2, y + _LEG / 2, high))

    def mark(
        self, x: Numbers | float, y: Numbers | float, top: float, facing: Numbers = ()
    ) -> None:
        """People sit there; metres, degrees."""
        place = {"x": 100.0 * np.array(x), "y": 100.0 * np.array(y), "top": 100.0 * top}
        self.marks.append({**place, "facing": list(facing)} if facing else place)

    def sits(self, front: float, back: float, top: float, half: float = 0.0) -> None:
        """People sit between a front and a back, up to ``half`` metres beside the middle."""
        room = max(0.0, half - _ANYWHERE)
        y = front + _THIGH if back - front > _THIGH + _FROM_BACK else back - _FROM_BACK
        self.mark([-room, room], y, top, [180.0])


def _chair(make: _Maker) -> None:
    """A dining chair; one in two has arms, one in two slats for a back."""
    half, deep = make.between(0.20, 0.24), make.between(0.38, 0.45)
    high, tilt = make.between(0.43, 0.48), make.between(4.0, 14.0)
    front, back = -deep / 2, deep / 2
    make.box((-half, front, high - 0.04), (half, back, high))
    make.legs(half, front, back, high)
    tall = make.between(0.36, 0.52)
    if make.rng.random() < 0.5:
        make.box((-half, back, high), (half, back + 0.03, high + tall), tilt)
    else:
        for x in np.linspace(-half + 0.02, half - 0.02, 5):
            make.box((x - 0.015, back, high), (x + 0.015, back + 0.02, high + tall), tilt)
    if make.rng.random() < 0.5:
        for x in (-half - 0.04, half):
            make.box((x, front + 0.1, high + 0.17), (x + 0.04, back, high + 0.21))
            make.box((x, front + 0.1, high - 0.04), (x + 0.04, front + 0.14, high + 0.17))
    make.sits(front, back, high)


def _shell(make: _Maker) -> None:
    """A chair with a hollowed seat and a back over a gap."""
    half, deep, high = make.between(0.20, 0.25), make.between(0.40, 0.46), make.between(0.43, 0.47)
    hollow = make.between(0.015, 0.03)
    make.hollow((-half, -deep / 2, high - 0.06), (half, deep / 2, high), hollow)
    make.legs(half, -deep / 2, deep / 2, high - 0.06)
    gap = make.between(0.10, 0.18)
    make.box((-half, deep / 2, high + gap), (half, deep / 2 + 0.03, high + 0.45), 10.0)
    for x in (-half, half - 0.03):
        make.box((x, deep / 2, high - 0.05), (x + 0.03, deep / 2 + 0.03, high + gap), 5.0)
    make.sits(-deep / 2, deep / 2, high - 0.8 * hollow)


def _office(make: _Maker) -> None:
    """A swivel chair with a column, five feet and arms on posts."""
    half, deep, high = make.between(0.23, 0.26), make.between(0.42, 0.48), make.between(0.44, 0.52)
    make.box((-half, -deep / 2, high - 0.07), (half, deep / 2, high))
    make.round(0.06, high - 0.07, 0.04)
    for turn in np.radians(np.arange(5) * 72.0):
        x, y = 0.3 * np.cos(turn), 0.3 * np.sin(turn)
        make.round(0.0, 0.07, 0.03, x, y)
        make.box(
            (min(0, x) - 0.02, min(0, y) - 0.02, 0.06), (max(0, x) + 0.02, max(0, y) + 0.02, 0.09)
        )
    make.box((-half + 0.04, deep / 2, high + 0.1), (half - 0.04, deep / 2 + 0.05, high + 0.6), 8.0)
    make.box((-0.03, deep / 2 - 0.03, high - 0.05), (0.03, deep / 2 + 0.02, high + 0.15))
    for x in (-half - 0.06, half + 0.02):
        make.box((x, -0.12, high + 0.18), (x + 0.04, 0.12, high + 0.21))
        make.box((x, -0.02, high - 0.05), (x + 0.04, 0.02, high + 0.18))
    make.sits(-deep / 2, deep / 2, high)


def _stool(make: _Maker) -> None:
    """A round or square stool, low or at a bar; without a front."""
    high, half = make.between(0.42, 0.50), make.between(0.17, 0.21)
    if make.rng.random() < 0.5:
        high = make.between(0.64, 0.78)
    if make.rng.random() < 0.5:
        make.round(high - 0.05, high, half)
        make.round(0.02, high - 0.05, 0.03)
        make.round(0.0, 0.02, half)
    else:
        make.box((-half, -half, high - 0.04), (half, half, high))
        make.legs(half, -half, half, high)
    make.mark([-0.06, 0.06], [-0.06, 0.06], high)


def _bench(make: _Maker) -> None:
    """A bench, with a back of slats or without one."""
    half, deep, high = make.between(0.55, 0.95), make.between(0.34, 0.44), make.between(0.42, 0.47)
    for k in range(4):
        y = -deep / 2 + k * deep / 4
        make.box((-half, y, high - 0.03), (half, y + deep / 4 - 0.012, high))
    make.legs(half, -deep / 2, deep / 2, high - 0.03)
    if make.rng.random() < 0.5:
        for k in range(3):
            z = high + 0.12 + 0.12 * k
            make.box((-half, deep / 2, z), (half, deep / 2 + 0.03, z + 0.08), 8.0)
        make.sits(-deep / 2, deep / 2, high, half)
    else:
        room = half - _ANYWHERE
        make.mark([-room, room], [-0.08, 0.08], high, [0.0, 180.0])


def _sofa(make: _Maker, wide: Numbers = (0.75, 1.1)) -> None:
    """Seat cushions, back cushions that lean, arms."""
    half, deep, high = make.between(*wide), make.between(0.52, 0.62), make.between(0.40, 0.46)
    front, back, arm = -deep / 2, deep / 2, make.between(0.10, 0.2)
    make.box((-half - arm, front, 0.06), (half + arm, back + 0.25, high - 0.14))
    count = max(1, round(half / 0.35))
    edges = np.linspace(-half, half, count + 1)
    for a, b in pairwise(edges):
        make.box((a + 0.004, front, high - 0.14), (b - 0.004, back, high))
        make.box((a + 0.004, back, high), (b - 0.004, back + 0.16, high + 0.40), 12.0)
    make.box((-half - arm, back + 0.12, 0.06), (half + arm, back + 0.25, high + 0.30))
    for x in (-half - arm, half):
        make.box((x, front, 0.06), (x + arm, back + 0.2, high + make.between(0.14, 0.22)))
    make.sits(front, back, high, half)


def _armchair(make: _Maker) -> None:
    _sofa(make, (0.26, 0.34))


def _corner(make: _Maker) -> None:
    """A corner sofa: a seat along the back and one along the right side."""
    half, deep, high = make.between(0.9, 1.2), make.between(0.55, 0.62), make.between(0.40, 0.44)
    front = -deep / 2
    long = make.between(1.5, 1.9)
    make.box((-half, front, 0.05), (half, deep / 2, high))
    make.box((half - deep, deep / 2 - long, 0.05), (half, front, high))
    make.box((-half, deep / 2, 0.05), (half + 0.2, deep / 2 + 0.2, high + 0.4))
    make.box((half, deep / 2 - long, 0.05), (half + 0.2, deep / 2, high + 0.4))
    y = front + _THIGH
    make.mark([-half + _ANYWHERE, half - deep - 0.2], y, high, [180.0])
    make.mark(half - deep + _THIGH, [deep / 2 - long + _ANYWHERE, front - 0.2], high, [90.0])


def _bed(make: _Maker) -> None:
    """A mattress on a frame, a headboard, pillows; one sits on a long side."""
    half, long, high = make.between(0.45, 0.85), make.between(1.95, 2.1), make.between(0.42, 0.56)
    make.box((-half, -long / 2, 0.08), (half, long / 2, high))
    make.box((-half, long / 2, 0.0), (half, long / 2 + 0.06, high + make.between(0.3, 0.6)))
    for x in np.linspace(-half, half, 1 + max(1, round(half / 0.4)))[:-1]:
        make.box((x + 0.05, long / 2 - 0.4, high), (x + 0.7, long / 2 - 0.05, high + 0.1))
    along = [-long / 2 + 0.2, long / 2 - 0.65]
    for side in (-1.0, 1.0):
        into = sorted([side * (half - 0.12), side * (half - 0.34)])
        make.mark(into, along, high, [-90.0 * side])
    if half > 0.6:
        make.mark([-half + 0.3, half - 0.3], [-long / 2 + 0.12, -long / 2 + 0.34], high, [180.0])


def _pouf(make: _Maker) -> None:
    """An ottoman, round or square, a good deal wider than a stool."""
    high, half = make.between(0.38, 0.46), make.between(0.24, 0.32)
    if make.rng.random() < 0.5:
        make.round(0.02, high, half)
    else:
        make.box((-half, -half, 0.02), (half, half, high))
    make.mark([-0.14, 0.14], [-0.14, 0.14], high)


def _toilet(make: _Maker) -> None:
    """A bowl with a ring over it, and a tank."""
    high = make.between(0.39, 0.43)
    make.round(0.0, high - 0.06, 0.16)
    count = 32
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    for k in range(count):
        x, y = 0.16 * np.cos(turn[k]), 0.19 * np.sin(turn[k])
        make.box((x - 0.035, y - 0.035, high - 0.05), (x + 0.035, y + 0.035, high))
    make.box((-0.2, 0.24, 0.0), (0.2, 0.42, high + 0.4))
    make.mark(0.0, [0.0, 0.08], high, [180.0])


def _lounger(make: _Maker) -> None:
    """A sun lounger whose head end is raised; one sits on its long sides."""
    half, long, high = make.between(0.28, 0.34), make.between(1.2, 1.4), make.between(0.30, 0.40)
    make.box((-half, -long, high - 0.05), (half, 0.0, high))
    make.box((-half, 0.0, high - 0.05), (half, 0.6, high), -make.between(30.0, 45.0))
    make.legs(half, -long, 0.3, high - 0.05)
    for side in (-1.0, 1.0):
        into = sorted([side * (half - 0.36), side * (half - 0.12)])
        make.mark(into, [-long + 0.2, -0.1], high, [-90.0 * side])
    make.mark(0.0, [-long + 0.12, -long + 0.36], high, [180.0])
    make.mark(0.0, [-0.4, -0.12], high, [180.0])


KINDS: dict[str, tuple[Callable[[_Maker], None], str]] = {
    "chair": (_chair, "chair"),
    "shell": (_shell, "chair"),
    "office chair": (_office, "armchair"),
    "stool": (_stool, "stool"),
    "bench": (_bench, "bench"),
    "sofa": (_sofa, "sofa"),
    "armchair": (_armchair, "armchair"),
    "corner sofa": (_corner, "sofa"),
    "bed": (_bed, "bed"),
    "pouf": (_pouf, "armchair"),
    "toilet": (_toilet, "toilet"),
    "lounger": (_lounger, "armchair"),
}
"""How each piece is made, and as which kind of ``core.softness`` it carries a body."""


def made_seat(name: str, seed: int) -> MadeSeat:
    """A piece of one of the ``KINDS``, turned by right angles as it is drawn."""
    make = _Maker(np.random.default_rng([seed, sorted(KINDS).index(name)]))
    build, kind = KINDS[name]
    build(make)
    quarters = int(make.rng.integers(4))
    vertices = rotate(yaw_matrix(np.array(np.radians(90.0 * quarters))), _joined(make))
    mesh = Mesh(vertices, np.concatenate(make.triangles), name=name.title())
    marks = [_turned(mark, quarters) for mark in make.marks]
    return MadeSeat(f"{name} {seed}", kind, mesh, marks)


def _joined(make: _Maker) -> np.ndarray:
    return np.concatenate(make.vertices)


def _turned(mark: dict[str, Any], quarters: int) -> dict[str, Any]:
    """A mark of a piece that is turned by right angles."""
    ends = np.stack([np.resize(mark["x"], 2), np.resize(mark["y"], 2), np.zeros(2)], axis=1)
    there = rotate(yaw_matrix(np.array(np.radians(90.0 * quarters))), ends)[:, :2]
    low, high = there.min(axis=0), there.max(axis=0)
    out = {"x": [low[0], high[0]], "y": [low[1], high[1]], "top": mark["top"]}
    if "facing" in mark:
        out["facing"] = [each + 90.0 * quarters for each in mark["facing"]]
    return out
