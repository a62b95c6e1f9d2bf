"""What a camera without perspective sees of a room and a body: shaded, near before far, and the
body pale where furniture hides it.

Furniture is drawn from its distances, so that a picture shows what the training's sensor meets.
"""

from dataclasses import dataclass

import numpy as np

from ...core.rotations import normalised, yaw_matrix
from ...core.skeleton import PARENTS, joint
from ..furnish.flesh import Furnishing

__all__ = ["Body", "body_of", "picture"]

_DISTANT = 8.0  # metres from the middle of a picture to where its rays begin
_STEPS = 120
_HIT = 0.6  # of a grid's spacing: sheets without thickness have no distance below it
_STRIDE = 0.95  # of the distance: stretched grids are a little off
_FURNITURE = np.array([203.0, 186.0, 160.0])
_FLOOR, _LINE, _PAPER = np.full(3, 246.0), np.full(3, 208.0), np.full(3, 255.0)
_SQUARE, _LINE_WIDTH = 0.5, 0.012  # metres
_LIGHT = normalised(np.array([0.3, 0.5, 0.8]))  # to the right, up, towards the viewer
_SHADES = 5  # few, so that files of pictures are small
_HIDDEN = 0.3  # of a body's colour, where furniture is before it

_SPAN = 0.03  # metres between the balls of a limb
_THICK = {"knee": 0.05, "ankle": 0.045, "foot": 0.035, "elbow": 0.04, "wrist": 0.03}
_LEFT, _RIGHT, _TRUNK = (31.0, 111.0, 180.0), (224.0, 112.0, 26.0), (105.0, 105.0, 110.0)


@dataclass(frozen=True)
class Body:
    """Balls that a body is drawn as: ``centres`` (N, 3), metres, world; ``radii`` (N,);
    ``colours`` (N, 3) from 0 to 255.
    """

    centres: np.ndarray
    radii: np.ndarray
    colours: np.ndarray


def body_of(pose: np.ndarray) -> Body:
    """One pose (22, 3) with some flesh on its bones."""
    rows = []
    names = {
        joint(f"{side}_{part}"): (part, colour)
        for side, colour in (("left", _LEFT), ("right", _RIGHT))
        for part in ("hip", "knee", "ankle", "foot", "collar", "shoulder", "elbow", "wrist")
    }
    for j in range(1, len(pose)):
        part, colour = names.get(j, ("", _TRUNK))
        start, end = pose[PARENTS[j]], pose[j]
        radius = _THICK.get(part, 0.07)
        count = int(np.ceil(np.linalg.norm(end - start) / _SPAN)) + 1
        rows += [(*p, radius, *colour) for p in np.linspace(start, end, count)]

    head, neck = pose[joint("head")], pose[joint("neck")]
    rows.append((*(head + 0.08 * normalised(head - neck)), 0.1, *_TRUNK))
    rows.append((*pose[0], 0.09, *_TRUNK))
    table = np.array(rows)
    return Body(table[:, :3], table[:, 3], table[:, 4:])


def _through(
    start: np.ndarray, way: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """How far along ``way`` (3,) rays from ``start`` (N, 3) enter and leave a box."""
    safe = np.where(np.abs(way) < 1e-9, 1e-9, way)
    a, b = (low - start) / safe, (high - start) / safe
    return np.minimum(a, b).max(-1), np.maximum(a, b).min(-1)


def _draw_boxes(
    room: Furnishing, start: np.ndarray, way: np.ndarray, far: np.ndarray, normal: np.ndarray
) -> None:
    for row in room.boxes:
        turn = yaw_matrix(np.array(row[6]))
        local, along = (start - row[:3]) @ turn, way @ turn
        enter, leave = _through(local, along, -row[3:6], row[3:6])
        hit = np.flatnonzero((enter < leave) & (enter < far))
        at = (local[hit] + enter[hit, None] * along) / np.maximum(row[3:6], 1e-6)
        side = np.abs(at).argmax(-1)
        own = np.zeros((len(hit), 3))
        own[np.arange(len(hit)), side] = np.sign(at[np.arange(len(hit)), side])
        far[hit], normal[hit] = enter[hit], own @ turn.T


def _draw_shapes(
    room: Furnishing, start: np.ndarray, way: np.ndarray, far: np.ndarray, normal: np.ndarray
) -> None:
    """Rays go on by what is free around them (sphere tracing) until they meet a shape."""
    for row in room.shapes:
        shape = room.bank.shapes[int(row[0])]
        tall = np.array([1.0, 1.0, row[4]])
        end = shape.origin + shape.spacing * (np.array(shape.values.shape) - 1)
        turn = yaw_matrix(np.array(row[3]))
        local, along = (start - (row[1], row[2], 0.0)) @ turn, way @ turn
        enter, leave = _through(local, along, shape.origin * tall, end * tall)
        rays = np.flatnonzero((enter < leave) & (enter < far))
        at, touch = enter[rays] + 1e-3, _HIT * shape.spacing
        for _ in range(_STEPS):
            gap = room.bank.distances(row[None], start[rays] + at[:, None] * way)
            hit = gap < touch
            far[rays[hit]] = at[hit]
            points = start[rays[hit]] + at[hit, None] * way
            normal[rays[hit]] = _slope(room, row, points, shape.spacing)
            at = at + _STRIDE * np.maximum(gap - touch, 0.2 * touch)
            going = ~hit & (at < np.minimum(leave[rays], far[rays]))
            rays, at = rays[going], at[going]
            if not len(rays):
                break


def _slope(room: Furnishing, row: np.ndarray, points: np.ndarray, step: float) -> np.ndarray:
    """Unit normals (N, 3) of a placed shape near ``points`` (N, 3) of its surface."""
    found = [
        room.bank.distances(row[None], points + s) - room.bank.distances(row[None], points - s)
        for s in step * np.eye(3)
    ]
    return normalised(np.stack(found, axis=-1) + 1e-6)


def picture(
    room: Furnishing,
    body: Body | None,
    camera: np.ndarray,
    middle: np.ndarray,
    size: tuple[int, int],
    scale: float,
) -> np.ndarray:
    """A picture (H, W, 3) uint8 of ``size`` (W, H) pixels, ``scale`` of them a metre, about the
    point ``middle`` (3,) of the world. ``camera`` (3, 3): rows right, up and towards the viewer.
    """
    width, height = size
    across, up = np.meshgrid(
        np.arange(width) + 0.5 - width / 2, height / 2 - np.arange(height) - 0.5
    )
    places = np.stack([across, up], axis=-1).reshape(-1, 2) / scale
    start = middle + places @ camera[:2] + _DISTANT * camera[2]
    way = -camera[2]

    far, normal = np.full(len(start), np.inf), np.zeros_like(start)
    _draw_boxes(room, start, way, far, normal)
    _draw_shapes(room, start, way, far, normal)
    colour = np.tile(_PAPER, (len(start), 1))
    if camera[2, 2] > 1e-6:
        floor = start[:, 2] / camera[2, 2]
        at = start + floor[:, None] * way
        line = (np.abs(at[:, :2] / _SQUARE - np.rint(at[:, :2] / _SQUARE)) * _SQUARE).min(-1)
        colour[:] = np.where((line < _LINE_WIDTH / 2)[:, None], _LINE, _FLOOR)
        far, ground = np.minimum(far, floor), far >= floor
    else:
        ground = np.isinf(far)

    colour[~ground] = _lit(_FURNITURE, normal[~ground] @ camera.T)
    if body is not None:
        _draw_body(body, start, camera, far, colour)

    return np.clip(colour, 0, 255).astype(np.uint8).reshape(height, width, 3)


def _lit(colour: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """A colour (3,) on surfaces whose normals (N, 3) are given to the right, up, and towards the
    viewer.
    """
    light = np.rint(_SHADES * np.clip(normals @ _LIGHT, 0.0, 1.0)) / _SHADES
    return colour * (0.45 + 0.55 * light)[:, None]


def _draw_body(
    body: Body, start: np.ndarray, camera: np.ndarray, far: np.ndarray, colour: np.ndarray
) -> None:
    """Draw the balls, each where it is the nearest of them."""
    near = np.full(len(start), np.inf)
    flesh = np.zeros_like(colour)
    for centre, radius, own in zip(body.centres, body.radii, body.colours, strict=True):
        to_it = start - centre
        x, y, z = (to_it @ axis for axis in camera)
        inside = radius**2 - x**2 - y**2
        rays = np.flatnonzero(inside > 0)
        depth = z[rays] - np.sqrt(inside[rays])
        first = depth < near[rays]
        rays, depth = rays[first], depth[first]
        ball = np.stack([x[rays], y[rays], z[rays] - depth], axis=-1) / radius
        near[rays] = depth
        flesh[rays] = _lit(own, ball)

    seen = np.isfinite(near)
    share = np.where(near < far, 1.0, _HIDDEN)[seen, None]
    colour[seen] += share * (flesh[seen] - colour[seen])
