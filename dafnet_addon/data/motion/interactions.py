"""What a body does to furniture that motion capture did not record: lies, works on a top, strokes a
board, reaches.

Sitting is found by ``furniture.resting``. All joints are (T, 22, 3), world, metres, z up, 30 fps.
"""

from dataclasses import dataclass

import numpy as np

from ...core.root import RootPath, forward_of, to_root
from ...core.rotations import normalised
from ...core.series import MODEL_FPS, runs
from ...core.skeleton import ANKLES, ELBOWS, KNEES, SHOULDERS, WRISTS, joint

__all__ = ["Interaction", "across", "lying", "miming", "working", "stroking", "reaching"]

_PELVIS, _CHEST, _NECK = joint("pelvis"), joint("spine3"), joint("neck")
_KNEES, _ANKLES = KNEES, ANKLES
_SECOND = round(MODEL_FPS)
_SHORT = 8
_OFF_THE_FLOOR = 0.25
_ONE_TOP = 0.08  # hands at heights that differ by less may share a table
_BEFORE_THE_BODY = 0.08  # metres; a wrist that works in the air
_UNDER_SHOULDERS = 0.12  # metres; a hand that is higher eats, or holds a telephone
_MIMES = 0.35  # of the time that a hand is there, so that it counts as working


@dataclass(frozen=True)
class Interaction:
    """In frames ``start`` to ``end`` (exclusive) the body uses a ``kind`` of furniture: bed, desk,
    board or shelf.

    ``points`` (N, 3): the line of pelvis and chest that lies, or the wrists that work. ``yaw``:
    where the piece's +y lies, seen from the body: towards the head in a bed, away from the body
    elsewhere.
    """

    kind: str
    start: int
    end: int
    points: np.ndarray
    yaw: float


def across(use: Interaction, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the use's points lie to the right of ``origin`` (2,) and away from the body."""
    offset = use.points[:, :2] - origin
    c, s = np.cos(use.yaw), np.sin(use.yaw)
    return offset @ (c, s), offset @ (-s, c)


def _speed(points: np.ndarray) -> np.ndarray:
    """Metres per second of points (T, …, 3)."""
    if len(points) < 2:
        return np.zeros(points.shape[:-1])
    return np.linalg.norm(np.gradient(points, axis=0), axis=-1) * MODEL_FPS


def _over_a_second(values: np.ndarray) -> np.ndarray:
    """(T − 29, …, 30) views of every second of ``values`` (T, …), T at least 30."""
    return np.lib.stride_tricks.sliding_window_view(values, _SECOND, axis=0)


def _spread(seconds: np.ndarray) -> np.ndarray:
    return seconds.max(-1) - seconds.min(-1)


def _within(seconds: np.ndarray, frames: int) -> np.ndarray:
    """Frames (T,) that lie in any of the flagged seconds (T − 29,)."""
    flags = np.zeros(frames, dtype=bool)
    for a, b in runs(seconds):
        flags[a : b + _SECOND - 1] = True
    return flags


def _away(rows: np.ndarray) -> float:
    """Yaw whose +y is the mean of directions (N, 2)."""
    x, y = rows.mean(0)
    return float(np.arctan2(-x, y))


def lying(joints: np.ndarray) -> list[Interaction]:
    """Where the body lies off the floor, or is about to: the trunk within 30 degrees of level, the
    pelvis still, for 0.25 s.

    Lying on the floor itself needs no bed; a body that bends down stands on feet far under its
    pelvis, and one that bows on a seat has its chest over its knees. Places within half a metre and
    a hand's breadth in height are one bed: ``points`` are its medians of pelvis and chest.
    """
    trunk = joints[:, _NECK] - joints[:, _PELVIS]
    level = np.abs(trunk[:, 2]) < 0.5 * np.linalg.norm(trunk, axis=-1)
    height = joints[:, _PELVIS, 2]
    off_floor = (height > _OFF_THE_FLOOR) & (_speed(joints[:, _PELVIS]) < 0.4)
    knees, feet = (joints[:, rows].mean(1) - joints[:, _PELVIS] for rows in (_KNEES, _ANKLES))
    back = (trunk * knees)[:, :2].sum(-1) < 0
    stands = (np.linalg.norm(feet[:, :2], axis=-1) < 0.3) & (feet[:, 2] < -0.2)
    found: list[Interaction] = []
    for a, b in runs(level & off_floor & back & (knees[:, 2] > -0.2) & ~stands, _SHORT):
        lowest = a + np.argsort(np.abs(trunk[a:b, 2]))[: max(_SHORT, (b - a) // 2)]
        line = np.median(joints[lowest][:, [_PELVIS, _CHEST]], axis=0)
        line[1, 2] = min(line[1, 2], line[0, 2] + 0.05)  # a chest that is still on its way down
        known = any(
            np.linalg.norm((u.points - line).mean(0)[:2]) < 0.5
            and abs((u.points - line)[:, 2].mean()) < 0.1
            for u in found
        )
        if not known:
            found.append(Interaction("bed", a, b, line, _away(normalised(trunk[a:b, :2]))))

    return found


def working(joints: np.ndarray, path: RootPath) -> list[Interaction]:
    """Hands that rest or work in a horizontal plane before a body that stays, for a second or more:
    on a desk or table.
    """
    frames = len(joints)
    if frames < _SECOND:
        return []

    local = to_root(path, joints[:, WRISTS])
    forearm = normalised(joints[:, WRISTS] - joints[:, ELBOWS])[..., 2]
    height = joints[:, WRISTS, 2]
    stays = _speed(path.position[:, :2]) < 0.25
    # Arms that hang are steep and beside the body; folded or raised ones rise from the elbow.
    level = (forearm > np.where(local[..., 1] > 0.2, -0.95, -0.75)) & (forearm < 0.45)
    before = (local[..., 1] > 0.12) & (height > 0.60) & (height < 1.15) & level & stays[:, None]
    seconds = _over_a_second(before).all(-1) & (_spread(_over_a_second(height)) < 0.06)
    seconds &= (_spread(_over_a_second(local[..., :2])) < 0.5).all(-1)
    tops: list[list[tuple[int, int, np.ndarray]]] = []
    for hand in (0, 1):
        for a, b in runs(_within(seconds[:, hand], frames)):
            part = a, b, joints[a:b, WRISTS[hand]]
            for top in tops:
                _, _, other = top[0]
                if abs(other[:, 2].min() - part[2][:, 2].min()) < _ONE_TOP and (
                    np.linalg.norm((np.median(other, axis=0) - np.median(part[2], axis=0))[:2])
                    < 0.9
                ):
                    top.append(part)
                    break
            else:
                tops.append([part])

    found = []
    for top in tops:
        wrists = np.concatenate([w for _, _, w in top])
        away = np.concatenate([w[:, :2] - joints[a:b, _PELVIS, :2] for a, b, w in top])
        # A table stands square to the body, not to the hand that reaches across it.
        heading = np.concatenate([forward_of(path.yaw[a:b]) for a, b, _ in top])
        found.append(
            Interaction(
                "desk",
                min(a for a, _, _ in top),
                max(b for _, b, _ in top),
                wrists,
                _away(heading + 0.1 * away),
            )
        )

    return found


def miming(joints: np.ndarray, path: RootPath) -> Interaction | None:
    """Hands of a body that stays, which work in the air before it and mostly come back to one
    level: where a top would have been. None where no hand does.

    ``points`` are where wrists were within a hand's breadth of that level.
    """
    local = to_root(path, joints[:, WRISTS])
    wrists, shoulders = joints[:, WRISTS], joints[:, SHOULDERS]
    before = (
        (local[..., 1] > _BEFORE_THE_BODY)
        & (wrists[..., 2] < shoulders[..., 2] - _UNDER_SHOULDERS)
        & (wrists[..., 2] > joints[:, [_PELVIS], 2])
    )
    low = []
    for hand in (0, 1):
        own = wrists[before[:, hand], hand]
        if len(own) > _MIMES * len(joints):
            level = np.quantile(own[:, 2], 0.15)
            low.append(own[np.abs(own[:, 2] - level) < _ONE_TOP / 2])

    if not low:
        return None
    away = _away(forward_of(path.yaw))
    return Interaction("desk", 0, len(joints), np.concatenate(low), away)


def stroking(joints: np.ndarray, path: RootPath) -> list[Interaction]:
    """A hand that moves over a vertical plane before the body, between waist and reach, for a
    second or more: on a board.
    """
    frames = len(joints)
    if frames < _SECOND:
        return []

    local = to_root(path, joints[:, WRISTS])
    stays = _speed(path.position[:, :2]) < 0.45
    moves = _speed(joints[:, WRISTS]) > 0.05
    found = []
    for hand, wrist in enumerate(WRISTS):
        high = (
            (joints[:, wrist, 2] > 0.95)
            & (joints[:, wrist, 2] < 1.9)
            & (local[:, hand, 1] > 0.18)
            & stays
        )
        seconds = _over_a_second(high).all(-1) & (_over_a_second(moves[:, hand]).mean(-1) > 0.5)
        for a, b in runs(_within(seconds, frames), _SECOND):
            points = joints[a:b, wrist]
            normal, thickness, extent = _vertical_plane(points)
            forward = np.array([-np.sin(path.yaw[a:b]).mean(), np.cos(path.yaw[a:b]).mean()])
            if normal @ forward < 0:
                normal = -normal
            reach = float(((points - joints[a:b, SHOULDERS[hand]])[:, :2] @ normal).mean())
            if (
                thickness < 0.06
                and extent > max(0.15, 3 * thickness)
                and normal @ forward > 0.7
                and reach > 0.22
            ):
                found.append(Interaction("board", a, b, points, _away(normal[None])))

    return found


def _vertical_plane(points: np.ndarray) -> tuple[np.ndarray, float, float]:
    """The upright plane nearest to points (N, 3): unit normal (2,), standard deviation along it,
    and extent within it.
    """
    offset = points[:, :2] - points[:, :2].mean(0)
    values, vectors = np.linalg.eigh(offset.T @ offset / len(points))
    extent = max(float(np.ptp(offset @ vectors[:, 1])), float(np.ptp(points[:, 2])))
    return vectors[:, 0], float(np.sqrt(max(values[0], 0.0))), extent


def reaching(joints: np.ndarray, path: RootPath) -> list[Interaction]:
    """Hands that come, stop on a stretched arm for a quarter of a second or more, and were or will
    be moved: at a shelf.
    """
    if len(joints) < _SHORT:
        return []

    wrists, shoulders = joints[:, WRISTS], joints[:, SHOULDERS]
    arm = wrists - shoulders
    stretched = np.linalg.norm(arm, axis=-1) > 0.42
    out = np.linalg.norm(arm[..., :2], axis=-1) > 0.25
    height, speed = wrists[..., 2], _speed(wrists)
    stays = (_speed(path.position[:, :2]) < 0.5)[:, None]
    stopped = (
        stretched
        & out
        & (to_root(path, wrists)[..., 1] > 0.2)
        & (height > 0.35)
        & (height < 1.7)
        & (speed < 0.3)
        & stays
    )
    found = []
    for hand in (0, 1):
        for a, b in runs(stopped[:, hand], _SHORT):
            around = speed[max(0, a - 20) : b + 20, hand]
            if b - a > 2 * _SECOND or around.max() < 0.5:
                continue
            points = wrists[a:b, hand]
            heading = forward_of(path.yaw[a:b])
            found.append(
                Interaction(
                    "shelf", a, b, points, _away(heading + 0.5 * normalised(arm[a:b, hand, :2]))
                )
            )

    return found
