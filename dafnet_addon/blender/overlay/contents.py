"""What each overlay shows of the scene now: sensor spheres, root path, contacts, actions, targets
and ghosts.

Nothing here draws. Places are in the world, in Blender units. Everything is looked up anew when it
is asked for, so that what was deleted or undone is simply not there; what was computed is kept in
``cache`` until the frame, the scene or the take changes.
"""

from collections.abc import Callable, Collection

import bpy
import numpy as np

from ...core.errors import DafnetError, WeightsError
from ...core.metrics import BAD_COLLISION_JOINTS, bad_collisions
from ...core.occupancy import distance, occupancy
from ...core.root import RootPath, root_from_matrices, to_world
from ...core.sensor import RADIUS, SPHERES, narrowed
from ...core.skeleton import END_EFFECTORS, FEET
from ...core.take import Controls
from ...core.weights import load_weights
from ..character.armature import character_scale, metres_per_unit
from ..character.takes import played_take, takes_of
from ..preferences import weights_path
from .cache import cache
from .drawing import (
    ABOVE_FLOOR,
    NOW,
    Colour,
    Drawing,
    circle_of_actions,
    compose,
    figure,
    floor_path,
    ring,
)
from .nearby import furniture_near
from .root_path import root_path
from .watched import played_now, unpacked_take, watched_character

__all__ = [
    "CIRCLE",
    "KINDS",
    "drawings",
    "drawn_way",
    "live_pose",
]

_EMPTY_SPHERE = np.array((0.35, 0.75, 1.0, 0.6))
_FULL_SPHERE = np.array((1.0, 0.25, 0.08, 0.95))

_PLANTED: Colour = (0.35, 0.95, 0.45, 1.0)
_TOUCHING: Colour = (1.0, 0.62, 0.1, 0.95)
_INSIDE: Colour = (1.0, 0.12, 0.12, 1.0)

_TARGET: Colour = (1.0, 0.18, 0.22, 0.9)
_GAP: Colour = (1.0, 0.85, 0.2, 0.45)
_END_EFFECTORS: dict[str, Colour] = {
    "head": (0.75, 0.60, 1.0, 0.9),
    "hand_left": (0.35, 0.75, 1.0, 0.9),
    "hand_right": (0.35, 0.95, 0.80, 0.9),
}

_LIVE_POSE: Colour = (1.0, 1.0, 1.0, 0.95)
_GHOSTS: tuple[Colour, ...] = (
    (0.40, 0.80, 1.0, 0.9),
    (0.55, 1.0, 0.60, 0.9),
    (0.95, 0.60, 1.0, 0.9),
    (1.0, 0.95, 0.50, 0.9),
    (1.0, 0.60, 0.60, 0.9),
)
"""Colours of the takes in the list, in turn."""

_OCCUPIED = 0.05
"""Occupancy above which a sphere is shown."""
_SPHERE_RADIUS = 0.018
"""Metres; radius of the bead of an empty sphere. A full one is twice as large."""
_TICKS_A_SECOND = 4
"""How many facings of the path, and gaps to a target, are drawn for each second."""


# Poses.


def live_pose(context: bpy.types.Context, joints: np.ndarray) -> tuple[Drawing, ...]:
    """The figure of joints (22, 3), world metres, while they are being generated."""
    unit = metres_per_unit(context.scene)
    return (figure(joints / unit, _LIVE_POSE, size=1.0 / unit, width=3.0),)


def drawn_way(context: bpy.types.Context, points: np.ndarray) -> tuple[Drawing, ...]:
    """A way (N, 3), world metres, that is still to be walked."""
    places = (points + np.array([0.0, 0.0, ABOVE_FLOOR])) / metres_per_unit(context.scene)
    return (compose([(np.stack([places[:-1], places[1:]], axis=1), NOW)], width=3.0),)


def _ghosts(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """The takes ticked as ghosts, except the one that plays; before and after themselves they stand
    as at their ends.
    """
    unit = metres_per_unit(context.scene)
    frame = context.scene.frame_current
    plays = played_take(armature)
    shown = [
        (row, action)
        for row, action in enumerate(takes_of(armature))
        if action.dafnet.ghost and action != plays
    ]
    identities = tuple((row, a.session_uid, a.dafnet.frame_start, a.name) for row, a in shown)

    def draw() -> tuple[Drawing, ...]:
        figures = []
        for row, action in shown:
            unpacked = unpacked_take(action)
            if unpacked is None:
                continue

            take = unpacked.take
            index = min(max(frame - action.dafnet.frame_start, 0), len(take) - 1)
            figures.append(
                figure(
                    take.joints[index] / unit,
                    _GHOSTS[row % len(_GHOSTS)],
                    size=take.scale / unit,
                    width=2.5,
                    name=action.name,
                )
            )

        return tuple(figures)

    return cache.recall("ghosts", (unit, frame, identities), draw)


# The root's path.


def _path(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """The root's path on the floor with where it faces, and where it is now."""
    action, scene, own = played_take(armature), context.scene, armature.dafnet
    unit = metres_per_unit(scene)
    fps = scene.render.fps / scene.render.fps_base

    ranges = (
        scene.frame_start,
        scene.frame_end,
        own.use_scene_range,
        own.frame_start,
        own.frame_end,
    )
    source = (action.session_uid, action.dafnet.frame_start) if action else cache.edits
    key = armature.session_uid, unit, fps, ranges, source

    def draw() -> tuple[Drawing, ...]:
        found = cache.recall("root path", key, lambda: root_path(context, armature))
        if found is None:
            return ()
        path, first = found
        facing_every = max(1, round(fps / _TICKS_A_SECOND))
        return (floor_path(path, unit, facing_every, scene.frame_current - first),)

    return cache.recall("path", (key, scene.frame_current), draw)


# What the network sees.


def _floor_of(context: bpy.types.Context, armature: bpy.types.Object, place: np.ndarray) -> float:
    """The floor's height, world metres, under the take that plays, else under the root at ``place``
    (3,).
    """
    played = played_now(context, armature)
    return float(place[2] if played is None else np.median(played.take.root[:, 2, 3]))


def _sphere_radius(context: bpy.types.Context) -> float:
    """How far the spheres of the weights in use see, canonical metres; of weights that cannot be
    read as far as any: *Generate* says what is wrong with them.
    """
    file = weights_path(context)

    def read() -> float:
        try:
            return load_weights(file).sphere_radius
        except WeightsError:
            return RADIUS

    return cache.recall("sphere radius", file, read)


def _spheres(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """The sensor's spheres that the furniture occupies, in the root's frame, both as they are
    now.
    """
    root, scene = armature.dafnet.root, context.scene
    if root is None:
        return ()

    frame, radius = (scene.frame_current, scene.frame_subframe), _sphere_radius(context)
    key = cache.edits, cache.furniture, scene.session_uid, armature.session_uid, frame, radius

    def draw() -> tuple[Drawing, ...]:
        unit = metres_per_unit(scene)
        size = character_scale(armature, unit)
        matrix = np.array(root.evaluated_get(context.evaluated_depsgraph_get()).matrix_world)
        if not np.isfinite(matrix).all():
            return ()

        here, _ = root_from_matrices(matrix[None])
        place = here.position[0] * unit
        floor = _floor_of(context, armature, place)
        solids = furniture_near(context, armature, place=place, size=size, floor=floor)
        path = RootPath(here.position * unit / size, here.yaw)
        occupied = narrowed(occupancy(solids, path)[0], radius)

        shown = occupied > _OCCUPIED
        share = occupied[shown].astype(float)
        places = to_world(path, SPHERES[None, shown])[0] * size / unit
        colours = _EMPTY_SPHERE + share[:, None] * (_FULL_SPHERE - _EMPTY_SPHERE)
        return (compose(beads=[(places, colours, _SPHERE_RADIUS * (1.0 + share) * size / unit)]),)

    return cache.recall("spheres", key, draw)


def _circle(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """The circle of the played take's action at the current frame."""
    played = played_now(context, armature)
    if played is None or played.frame is None or not played.take.action.size:
        return ()
    shares = played.take.action[played.frame]
    key = played.action.session_uid, played.frame
    return cache.recall(CIRCLE, key, lambda: circle_of_actions(shares))


# The played take at the current frame.


def _contacts(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """Rings around planted feet; beads on joints that touch the furniture as it is now, or are
    inside it.
    """
    played = played_now(context, armature)
    if played is None or played.frame is None:
        return ()

    frame, take = played.frame, played.take
    key = (
        cache.edits,
        cache.furniture,
        armature.session_uid,
        played.action.session_uid,
        frame,
    )

    def draw() -> tuple[Drawing, ...]:
        unit = metres_per_unit(context.scene)
        joints, root, size = take.joints[frame], take.root[frame, :3, 3], take.scale
        floor = _floor_of(context, armature, root)
        solids = furniture_near(context, armature, place=root, size=size, floor=floor)
        judged = joints[list(BAD_COLLISION_JOINTS)]
        distances = distance(solids, judged[None] / size, root[2] / size)[0]

        lines, beads = [], []
        for toe, planted in zip(FEET, played.unpacked.planted[frame], strict=True):
            if planted:
                place = np.append(joints[toe, :2], root[2] + ABOVE_FLOOR)
                lines.append((ring(place, 0.08 * size) / unit, _PLANTED))
                beads.append((joints[toe, None] / unit, _PLANTED, 0.02 * size / unit))

        for place, gap in zip(judged, distances, strict=True):
            if bad_collisions(gap[None, None])[0]:
                colour = _INSIDE if gap < 0.0 else _TOUCHING
                beads.append((place[None] / unit, colour, 0.045 * size / unit))

        return (compose(lines, beads, width=2.5),)

    return cache.recall("contacts", key, draw)


def _reach(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """The paths of head and hands and of their targets, and how far apart the two are now, in
    centimetres.
    """
    played = played_now(context, armature)
    if played is None:
        return ()

    frame, take = played.frame, played.take
    unit = metres_per_unit(context.scene)

    def draw() -> tuple[Drawing, ...]:
        lines, beads, labels = [], [], []
        gap_every = max(1, round(take.fps / _TICKS_A_SECOND))
        radius = 0.02 * take.scale / unit
        for name, index in END_EFFECTORS.items():
            path = take.joints[:, index] / unit
            lines.append((np.stack([path[:-1], path[1:]], axis=1), _END_EFFECTORS[name]))
            if frame is not None:
                beads.append((path[frame, None], _END_EFFECTORS[name], radius))

            target = _target_of(played.unpacked.controls, name)
            if target is None:
                continue

            target = target / unit
            counts = np.isfinite(target).all(-1)
            both = counts[:-1] & counts[1:]
            lines.append((np.stack([target[:-1], target[1:]], axis=1)[both], _TARGET))
            gaps = np.stack([path, target], axis=1)[::gap_every]
            lines.append((gaps[counts[::gap_every]], _GAP))

            if frame is not None and counts[frame]:
                beads.append((target[frame, None], _TARGET, radius))
                lines.append((np.array([[path[frame], target[frame]]]), NOW))
                apart = 100.0 * unit * float(np.linalg.norm(path[frame] - target[frame]))
                labels.append((target[frame], f"{apart:.1f} cm", NOW))

        return (compose(lines, beads, labels),)

    return cache.recall("reach", (played.action.session_uid, unit, frame), draw)


def _target_of(controls: Controls, name: str) -> np.ndarray | None:
    """A target's places (T, 3), world metres, NaN where it did not count; None where it never
    did.
    """
    target, influence = getattr(controls, name), getattr(controls, f"{name}_influence")
    if target is None:
        return None

    modes = (
        [controls.mode] * len(controls) if isinstance(controls.mode, str) else list(controls.mode)
    )
    counts = np.array(modes) == "EE"
    if influence is not None:
        counts &= influence > 0.0

    places = np.where(counts[:, None], target, np.nan)
    return places if np.isfinite(places).any() else None


CIRCLE = "circle"
"""The one kind that is drawn in a corner of the view, not in the scene."""
KINDS: dict[str, Callable[[bpy.types.Context, bpy.types.Object], tuple[Drawing, ...]]] = {
    "spheres": _spheres,
    "path": _path,
    "marks": _contacts,
    CIRCLE: _circle,
    "reach": _reach,
    "ghosts": _ghosts,
}


def drawings(context: bpy.types.Context, kinds: Collection[str]) -> dict[str, tuple[Drawing, ...]]:
    """What there is to draw now, by kind; the same objects as before where nothing has changed.

    What cannot be shown (no take, furniture that is gone, an edited armature) is left out: a view
    is no place for errors.
    """
    armature = watched_character(context) if context.scene else None
    if armature is None:
        return {}

    found = {}
    for kind in kinds:
        try:
            found[kind] = KINDS[kind](context, armature)
        except (DafnetError, ReferenceError):
            found[kind] = ()

    return found
