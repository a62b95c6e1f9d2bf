"""What the overlays show, as plain arrays: spheres, paths, marks, figures of lines, the circle of
actions, faults by frame.

Nothing here draws. Places are in the world, in Blender units. Everything is looked up anew when it
is asked for, so that what was deleted or undone is simply not there; what was computed is kept
until the frame, the scene or the take changes (``note_edit``, ``note_frame``), so that asking again
costs nothing.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import bpy
import numpy as np
from mathutils import Euler

from ..core.cleanup import standing_still
from ..core.distance import prepared, scaled
from ..core.errors import DafnetError, InputError
from ..core.metrics import BAD_COLLISION_JOINTS, bad_collisions, foot_sliding
from ..core.nearby import REACH_OF_A_BODY, beside
from ..core.occupancy import distance, occupancy
from ..core.resampling import MODEL_FPS, frame_times, resample_nearest, resample_positions
from ..core.root import RootPath, root_from_matrices, to_world
from ..core.rotations import matrix_from_quaternion
from ..core.sensor import SPHERES
from ..core.skeleton import END_EFFECTORS, PARENTS, joint
from ..core.solids import Box, Mesh, Scene
from ..core.take import Controls, Take
from .armature import character_scale, is_character, metres_per_unit, sent
from .compat import action_curves
from .furniture import furniture_now
from .scene_reader import read_scene
from .settings import settings_of
from .takes import PACKED, stored, takes_of

__all__ = [
    "CIRCLE",
    "KINDS",
    "Drawing",
    "Faults",
    "Strip",
    "circle",
    "drawings",
    "faults_of",
    "figure",
    "forget",
    "growing",
    "note_edit",
    "note_frame",
    "playing",
    "root_path",
    "strip",
    "watched",
]

_T = TypeVar("_T")
Colour = tuple[float, float, float, float]
"""Red, green, blue, opacity, as the screen shows them."""

# of a sphere hardly, and all occupied
_FREE, _FULL = np.array((0.35, 0.75, 1.0, 0.6)), np.array((1.0, 0.25, 0.08, 0.95))
_WAY, _FACING, _NOW = (0.95, 0.95, 0.95, 0.8), (0.45, 0.85, 0.45, 0.9), (1.0, 0.85, 0.2, 1.0)
_PLANTED, _TOUCHES, _INSIDE = (
    (0.35, 0.95, 0.45, 1.0),
    (1.0, 0.62, 0.1, 0.95),
    (1.0, 0.12, 0.12, 1.0),
)
_ASKED, _GAP = (1.0, 0.18, 0.22, 0.9), (1.0, 0.85, 0.2, 0.45)
_WENT: dict[str, Colour] = {
    "head": (0.75, 0.60, 1.0, 0.9),
    "hand_left": (0.35, 0.75, 1.0, 0.9),
    "hand_right": (0.35, 0.95, 0.80, 0.9),
}
_GHOSTS: tuple[Colour, ...] = (
    (0.40, 0.80, 1.0, 0.9),
    (0.55, 1.0, 0.60, 0.9),
    (0.95, 0.60, 1.0, 0.9),
    (1.0, 0.95, 0.50, 0.9),
    (1.0, 0.60, 0.60, 0.9),
)
_GROWING: Colour = (1.0, 1.0, 1.0, 0.95)
_INK, _FAINT = (1.0, 1.0, 1.0), (0.62, 0.64, 0.67)
_SLIDES, _BUMPS = (1.0, 0.78, 0.15, 0.45), (1.0, 0.15, 0.15, 0.45)

_SEEN = 0.05  # occupancy from which a sphere is shown
_BEAD = 0.018  # metres; radius of the bead of an empty sphere, which a full one has twice
# metres in which the floor's height counts, so that a swaying root does not have furniture measured
# again
_FLOOR_STEP = 0.02
# metres round the root, under and over it, in which furniture matters
_REACH, _DOWN, _UP = 1.35, 0.3, 2.3
_ABOVE = 0.01  # metres over the floor at which lines lie
_TICKS = 4  # facings and gaps a second
_TICK = 0.14  # metres
_KEPT_TAKES = 24
_TOES = (joint("left_foot"), joint("right_foot"))


@dataclass(frozen=True)
class Drawing:
    """``lines`` (L, 2, 3) with ``line_colours`` (L, 4), ``width`` pixels; ``beads`` (B, 3) with
    ``bead_colours`` (B, 4) and ``radii`` (B,); ``labels``: place (3,), text and colour of each.
    World, Blender units.
    """

    lines: np.ndarray
    line_colours: np.ndarray
    beads: np.ndarray
    bead_colours: np.ndarray
    radii: np.ndarray
    labels: tuple[tuple[np.ndarray, str, Colour], ...] = ()
    width: float = 2.0


def _drawn(
    lines: Iterable[tuple[np.ndarray, Sequence[float] | np.ndarray]] = (),
    beads: Iterable[tuple[np.ndarray, Sequence[float] | np.ndarray, float | np.ndarray]] = (),
    labels: Iterable[tuple[np.ndarray, str, Colour]] = (),
    width: float = 2.0,
) -> Drawing:
    """One drawing of lines (L, 2, 3) and beads (B, 3), each with one colour or one for each, beads
    with a radius likewise.
    """
    ends, hues = [np.zeros((0, 2, 3))], [np.zeros((0, 4))]
    for segment, colour in lines:
        ends.append(segment)
        hues.append(np.broadcast_to(np.asarray(colour, float), (len(segment), 4)))
    places, tints, radii = [np.zeros((0, 3))], [np.zeros((0, 4))], [np.zeros(0)]
    for place, colour, radius in beads:
        places.append(place)
        tints.append(np.broadcast_to(np.asarray(colour, float), (len(place), 4)))
        radii.append(np.broadcast_to(np.asarray(radius, float), len(place)))
    return Drawing(
        np.concatenate(ends),
        np.concatenate(hues),
        np.concatenate(places),
        np.concatenate(tints),
        np.concatenate(radii),
        tuple(labels),
        width,
    )


# What has changed.

_counts = {"edits": 0, "furniture": 0}
_kept: dict[str, tuple[Any, Any]] = {}
_looked_at: list[Any] = [None, ""]


def note_edit(depsgraph: bpy.types.Depsgraph | None) -> None:
    """Something in the scene was changed; None: anything may be."""
    _counts["edits"] += 1
    note_frame(depsgraph)


def note_frame(depsgraph: bpy.types.Depsgraph | None) -> None:
    """The scene was brought to another frame; furniture is read again only if any of it may have
    moved.
    """
    if depsgraph is None or any(_may_be_furniture(update) for update in depsgraph.updates):
        _counts["furniture"] += 1


def forget() -> None:
    """Drop what was computed."""
    _kept.clear()
    _takes.clear()
    _rooms.clear()
    _looked_at[:] = None, ""
    note_edit(None)


def _may_be_furniture(update: bpy.types.DepsgraphUpdate) -> bool:
    changed = update.id.original
    if not isinstance(changed, bpy.types.Object) or not (
        update.is_updated_transform or update.is_updated_geometry
    ):
        return False
    if changed.type in {"ARMATURE", "CAMERA", "LIGHT"} or (
        changed.type == "EMPTY" and changed.instance_type == "NONE"
    ):
        return False
    wearer = changed.parent
    return not (wearer and is_character(wearer))


def _remembered(name: str, key: Any, make: Callable[[], _T]) -> _T:
    """What was made for this key, or is made now."""
    if name not in _kept or _kept[name][0] != key:
        _kept[name] = key, make()
    return _kept[name][1]


# Who is looked at, and what it plays.


def watched(context: bpy.types.Context) -> bpy.types.Object | None:
    """The character that overlays are for: see ``armature.sent``; where that is none, the one they
    were for last.
    """
    scene, active = context.scene, context.object
    key = _counts["edits"], scene.session_uid, active.session_uid if active else 0
    last = scene.objects.get(_looked_at[1])
    if last is not None and _looked_at[0] == key:
        return last
    character, _ = sent(context)
    if character is None and last is not None and is_character(last):
        character = last
    _looked_at[:] = key, character.name if character else ""
    return character


@dataclass(frozen=True)
class _Stored:
    """A take, what was asked for, and ``standing`` (T, 2): whether the left and the right foot are
    planted.
    """

    take: Take
    controls: Controls
    standing: np.ndarray


_takes: dict[int, _Stored] = {}


def _stored(action: bpy.types.Action | None) -> _Stored | None:
    """What the action holds of a take; several are kept unpacked, since ghosts are shown
    together.
    """
    if action is None or PACKED not in action:
        return None
    uid = action.session_uid
    if uid not in _takes:
        take, controls = stored(action)
        while len(_takes) >= _KEPT_TAKES:
            _takes.pop(next(iter(_takes)))
        _takes[uid] = _Stored(take, controls, _standing(take))
    return _takes[uid]


def _standing(take: Take) -> np.ndarray:
    """Whether feet are planted (T, 2) at the take's own rate."""
    own, model = frame_times(len(take), take.fps), frame_times(len(take.path), MODEL_FPS)
    joints = resample_positions(take.joints / take.scale, own, model)
    on = np.zeros((len(model), 2), bool)
    for foot, start, end in standing_still(joints, take.path.position[:, 2]):
        on[start:end, foot] = True
    return resample_nearest(on, model, own)


def playing(armature: bpy.types.Object) -> bpy.types.Action | None:
    """The take that the armature plays, None where it plays none."""
    data = armature.animation_data
    return data.action if data and data.action and PACKED in data.action else None


def _now(
    context: bpy.types.Context, armature: bpy.types.Object
) -> tuple[bpy.types.Action, _Stored, int | None] | None:
    """The playing take and which frame of it the current one is, None outside it; None where none
    plays.
    """
    plays = playing(armature)
    known = _stored(plays)
    if plays is None or known is None:
        return None
    at = context.scene.frame_current - plays.dafnet.frame_start
    return plays, known, at if 0 <= at < len(known.take) else None


# Figures of lines.


def figure(
    joints: np.ndarray, colour: Colour, size: float = 1.0, width: float = 2.0, name: str = ""
) -> Drawing:
    """Lines along the bones of ``joints`` (22, 3), a bead for the head, a ``name`` over it;
    ``size``: units a metre of body.
    """
    head = joints[joint("head")]
    labels = [(head + np.array((0.0, 0.0, 0.25 * size)), name, colour)] if name else []
    bones = np.stack([joints[list(PARENTS[1:])], joints[1:]], axis=1)
    return _drawn([(bones, colour)], [(head[None], colour, 0.05 * size)], labels, width)


def growing(context: bpy.types.Context, joints: np.ndarray) -> tuple[Drawing, ...]:
    """The figure of joints (22, 3) in world metres."""
    unit = metres_per_unit(context.scene)
    return (figure(joints / unit, _GROWING, 1.0 / unit, 3.0),)


def _ghosts(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """Takes that are ticked as ghosts, but not the one that plays; before and after themselves they
    stand as at their ends.
    """
    unit, frame, plays = (
        metres_per_unit(context.scene),
        context.scene.frame_current,
        playing(armature),
    )
    shown = [(k, a) for k, a in enumerate(takes_of(armature)) if a.dafnet.ghost and a != plays]
    key = unit, frame, tuple((k, a.session_uid, a.dafnet.frame_start, a.name) for k, a in shown)

    def make() -> tuple[Drawing, ...]:
        out = []
        for row, action in shown:
            known = _stored(action)
            if known is not None:
                at = min(max(frame - action.dafnet.frame_start, 0), len(known.take) - 1)
                colour = _GHOSTS[row % len(_GHOSTS)]
                out.append(
                    figure(
                        known.take.joints[at] / unit,
                        colour,
                        known.take.scale / unit,
                        2.5,
                        action.name,
                    )
                )
        return tuple(out)

    return _remembered("ghosts", key, make)


# The root's way.


def root_path(
    context: bpy.types.Context, armature: bpy.types.Object
) -> tuple[RootPath, int] | None:
    """The root's path and its first frame: the playing take's, in metres; else the root's own keys
    over the frame range.

    None where there is neither, or where constraints or drivers move the root, which only playing
    the scene could tell.
    """
    now = _now(context, armature)
    if now is not None:
        return root_from_matrices(now[1].take.root)[0], now[0].dafnet.frame_start
    root, own, scene = armature.dafnet.root, armature.dafnet, context.scene
    if root is None:
        return None
    first, last = (
        (scene.frame_start, scene.frame_end)
        if own.use_scene_range
        else (own.frame_start, own.frame_end)
    )
    matrices = _keyed(root, range(first, last + 1))
    if matrices is None:
        return None
    path, _ = root_from_matrices(matrices)
    return RootPath(path.position * metres_per_unit(scene), path.yaw), first


def _keyed(root: bpy.types.Object, frames: range) -> np.ndarray | None:
    """World matrices (T, 4, 4) of the root by its keys alone, Blender units; a parent counts as it
    stands now.
    """
    curves = {(c.data_path, c.array_index): c for c in action_curves(root) if not c.mute}
    data = root.animation_data
    if (
        not curves
        or not len(frames)
        or (data and data.drivers)
        or any(not c.mute for c in root.constraints)
    ):
        return None

    def values(path: str, now: Sequence[float]) -> np.ndarray:
        found = [curves.get((path, k)) for k in range(len(now))]
        return np.array(
            [[c.evaluate(f) if c else x for c, x in zip(found, now, strict=True)] for f in frames]
        )

    basis = np.tile(np.eye(4), (len(frames), 1, 1))
    basis[:, :3, 3] = values("location", root.location)
    if root.rotation_mode == "QUATERNION":
        basis[:, :3, :3] = matrix_from_quaternion(
            values("rotation_quaternion", root.rotation_quaternion)
        )
    elif root.rotation_mode == "AXIS_ANGLE":
        basis[:, :3, :3] = np.array(root.matrix_basis.to_3x3().normalized())
    else:
        turns = values("rotation_euler", root.rotation_euler)
        basis[:, :3, :3] = [np.array(Euler(turn, root.rotation_mode).to_matrix()) for turn in turns]
    around = np.array(root.matrix_world @ root.matrix_basis.inverted_safe())
    return around @ basis if np.isfinite(around).all() else None


def _way(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """The root's path on the floor with its facing every few frames, and where it is now."""
    plays, scene, own = playing(armature), context.scene, armature.dafnet
    unit = metres_per_unit(scene)
    moved = (plays.session_uid, plays.dafnet.frame_start) if plays else _counts["edits"]
    frames = (
        scene.frame_start,
        scene.frame_end,
        own.use_scene_range,
        own.frame_start,
        own.frame_end,
    )
    key = armature.session_uid, unit, scene.render.fps / scene.render.fps_base, frames, moved

    def make() -> tuple[Drawing, ...]:
        found = _remembered("root path", key, lambda: root_path(context, armature))
        if found is None:
            return ()
        path, first = found
        every = max(1, round(scene.render.fps / scene.render.fps_base / _TICKS))
        return (_path_drawn(path, unit, every, scene.frame_current - first),)

    return _remembered("path", (key, scene.frame_current), make)


def _path_drawn(path: RootPath, unit: float, every: int, now: int) -> Drawing:
    """A path in metres, its facing ``every`` few frames and at its frame ``now``, if that is in
    it.
    """
    places = path.position + np.array((0.0, 0.0, _ABOVE))
    ahead = places + _TICK * path.rotation[:, :, 1]
    lines = [
        (np.stack([places[:-1], places[1:]], axis=1) / unit, _WAY),
        (np.stack([places, ahead], axis=1)[::every] / unit, _FACING),
    ]
    beads = []
    if 0 <= now < len(path):
        lines.append((np.array([[places[now], 2.5 * ahead[now] - 1.5 * places[now]]]) / unit, _NOW))
        beads.append((places[now, None] / unit, _NOW, 0.03 / unit))
    return _drawn(lines, beads)


# The furniture as it is now.


class _Piece:
    """One mesh of the furniture: its corners in the world, metres, and its distance field once it
    is near enough to matter.
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        points = np.asarray(mesh.vertices) @ mesh.matrix[:3, :3].T + mesh.matrix[:3, 3]
        self.low, self.high = points.min(axis=0), points.max(axis=0)
        self.ready: Mesh | Box | None = None

    def measured(self, floor: float, size: float) -> Mesh | Box:
        """The mesh with its distance field, canonical metres."""
        if self.ready is None:
            self.ready = prepared(scaled(Scene((self.mesh,)), 1.0 / size), floor / size)[0].solids[
                0
            ]
        return self.ready


_rooms: dict[Any, list[_Piece]] = {}


def _around(
    context: bpy.types.Context, armature: bpy.types.Object, place: np.ndarray, size: float
) -> Scene:
    """The furniture round a root at ``place`` (3,), world metres; canonical metres; empty where
    none is to be seen.
    """
    furniture = armature.dafnet.furniture
    if furniture is None:
        return Scene()
    now = _now(context, armature)
    height = float(place[2] if now is None else np.median(now[1].take.root[:, 2, 3]))
    floor = _FLOOR_STEP * round(height / _FLOOR_STEP)
    members = tuple((o.session_uid, o.visible_get()) for o in furniture.all_objects)
    key = (
        _counts["furniture"],
        context.scene.session_uid,
        armature.session_uid,
        members,
        floor,
        round(size, 6),
    )
    if key not in _rooms:
        settings = settings_of(armature, context.scene, frame_start=0, frame_end=0)
        try:
            found = furniture_now(context, settings)
        except InputError:
            found = {}
        while len(_rooms) > 1:  # a take may be of another size than the character is now
            _rooms.pop(next(iter(_rooms)))
        _rooms[key] = [_Piece(mesh) for meshes in found.values() for mesh in meshes]
    low, high = (
        place - size * np.array((_REACH, _REACH, _DOWN)),
        place + size * np.array((_REACH, _REACH, _UP)),
    )
    near = [piece for piece in _rooms[key] if (piece.low < high).all() and (piece.high > low).all()]
    return Scene(tuple(piece.measured(floor, size) for piece in near))


def _spheres(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """The sensor's spheres that the furniture occupies, in the root's frame, both as they are
    now.
    """
    root, scene = armature.dafnet.root, context.scene
    if root is None:
        return ()
    frame = scene.frame_current, scene.frame_subframe
    key = _counts["edits"], _counts["furniture"], scene.session_uid, armature.session_uid, frame

    def make() -> tuple[Drawing, ...]:
        unit = metres_per_unit(scene)
        size = character_scale(armature, unit)
        matrix = np.array(root.evaluated_get(context.evaluated_depsgraph_get()).matrix_world)
        if not np.isfinite(matrix).all():
            return ()
        here, _ = root_from_matrices(matrix[None])
        surroundings = _around(context, armature, here.position[0] * unit, size)
        path = RootPath(here.position * unit / size, here.yaw)
        seen = occupancy(surroundings, path)[0]
        shown = seen > _SEEN
        places = to_world(path, SPHERES[None, shown])[0] * size / unit
        share = seen[shown].astype(float)
        colours = _FREE + share[:, None] * (_FULL - _FREE)
        return (_drawn(beads=[(places, colours, _BEAD * (1.0 + share) * size / unit)]),)

    return _remembered("spheres", key, make)


# The playing take at the current frame.


def _marks(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """Rings round planted feet; beads on joints that touch the furniture as it is now, or are
    inside it.
    """
    now = _now(context, armature)
    if now is None or now[2] is None:
        return ()
    plays, known, at = now
    key = _counts["edits"], _counts["furniture"], armature.session_uid, plays.session_uid, at

    def make() -> tuple[Drawing, ...]:
        unit, take = metres_per_unit(context.scene), known.take
        joints, root, size = take.joints[at], take.root[at, :3, 3], take.scale
        surroundings = _around(context, armature, root, size)
        judged = joints[list(BAD_COLLISION_JOINTS)]
        apart = distance(surroundings, judged[None] / size, root[2] / size)
        lines, beads = [], []
        for toe, planted in zip(_TOES, known.standing[at], strict=True):
            if planted:
                place = np.append(joints[toe, :2], root[2] + _ABOVE)
                lines.append((_ring(place, 0.08 * size) / unit, _PLANTED))
                beads.append((joints[toe, None] / unit, _PLANTED, 0.02 * size / unit))
        for each, gap in zip(judged, apart[0], strict=True):
            if bad_collisions(gap[None, None])[0]:
                colour = _INSIDE if gap < 0.0 else _TOUCHES
                beads.append((each[None] / unit, colour, 0.045 * size / unit))
        return (_drawn(lines, beads, width=2.5),)

    return _remembered("marks", key, make)


def _ring(middle: np.ndarray, radius: float, corners: int = 24) -> np.ndarray:
    """(corners, 2, 3) lines of a level circle."""
    angle = np.linspace(0.0, 2.0 * np.pi, corners + 1)
    points = middle + radius * np.stack(
        [np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1
    )
    return np.stack([points[:-1], points[1:]], axis=1)


def _reach(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """The ways of head and hands, where they were asked to be, and how far apart the two are, in
    centimetres now.
    """
    now = _now(context, armature)
    if now is None:
        return ()
    plays, known, at = now
    unit = metres_per_unit(context.scene)
    key = plays.session_uid, unit, at

    def make() -> tuple[Drawing, ...]:
        take, lines, beads, labels = known.take, [], [], []
        every = max(1, round(take.fps / _TICKS))
        for name, j in END_EFFECTORS.items():
            way, goal = take.joints[:, j] / unit, _goal(known.controls, name)
            lines.append((np.stack([way[:-1], way[1:]], axis=1), _WENT[name]))
            if at is not None:
                beads.append((way[at, None], _WENT[name], 0.02 * take.scale / unit))
            if goal is None:
                continue
            goal = goal / unit
            asked = np.isfinite(goal).all(-1)
            steps = asked[:-1] & asked[1:]
            lines.append((np.stack([goal[:-1], goal[1:]], axis=1)[steps], _ASKED))
            lines.append((np.stack([way, goal], axis=1)[::every][asked[::every]], _GAP))
            if at is not None and asked[at]:
                beads.append((goal[at, None], _ASKED, 0.02 * take.scale / unit))
                lines.append((np.array([[way[at], goal[at]]]), _NOW))
                apart = 100.0 * unit * float(np.linalg.norm(way[at] - goal[at]))
                labels.append((goal[at], f"{apart:.1f} cm", _NOW))
        return (_drawn(lines, beads, labels),)

    return _remembered("reach", key, make)


def _goal(controls: Controls, name: str) -> np.ndarray | None:
    """The target (T, 3), world metres, NaN where it did not count; None where it never did."""
    goal, influence = getattr(controls, name), getattr(controls, f"{name}_influence")
    if goal is None:
        return None
    mode = (
        [controls.mode] * len(controls) if isinstance(controls.mode, str) else list(controls.mode)
    )
    counts = np.array(mode) == "EE"
    if influence is not None:
        counts &= influence > 0.0
    out = np.where(counts[:, None], goal, np.nan)
    return out if np.isfinite(out).any() else None


def circle(shares: np.ndarray) -> tuple[Drawing, Drawing]:
    """The paper's circle of action probabilities ``shares`` (K,), round the origin with radius 1,
    in the plane z = 0.

    Its rim with K labels round it, the likeliest bright; and a ray to each label, as opaque as the
    action is likely.
    """
    angle = 0.5 * np.pi - 2.0 * np.pi * np.arange(len(shares)) / len(shares)
    rays = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    labels = [
        (1.2 * ray, str(k + 1), (*(_INK if share >= shares.max() else _FAINT), 1.0))
        for k, (ray, share) in enumerate(zip(rays, shares, strict=True))
    ]
    rim = _drawn([(_ring(np.zeros(3), 1.0, 64), (*_FAINT, 0.8))], labels=labels, width=1.5)
    ends = np.stack([np.zeros_like(rays), rays], axis=1)
    colours = np.concatenate(
        [np.tile(_INK, (len(shares), 1)), np.clip(shares, 0.0, 1.0)[:, None]], axis=1
    )
    return rim, _drawn([(ends, colours)], width=6.0)


def _circle(context: bpy.types.Context, armature: bpy.types.Object) -> tuple[Drawing, ...]:
    """The circle of the playing take's action at the current frame."""
    now = _now(context, armature)
    if now is None or now[2] is None or not now[1].take.action.size:
        return ()
    plays, known, at = now
    return _remembered(CIRCLE, (plays.session_uid, at), lambda: circle(known.take.action[at]))


CIRCLE = "circle"
"""The one kind that is drawn in a corner of the view, not in the scene."""
KINDS: dict[str, Callable[[bpy.types.Context, bpy.types.Object], tuple[Drawing, ...]]] = {
    "spheres": _spheres,
    "path": _way,
    "marks": _marks,
    CIRCLE: _circle,
    "reach": _reach,
    "ghosts": _ghosts,
}


def drawings(context: bpy.types.Context, kinds: Collection[str]) -> dict[str, tuple[Drawing, ...]]:
    """What of these ``kinds`` there is to draw now, by kind; the same objects as before where
    nothing has changed.

    What cannot be shown (no take, furniture that is gone, an edited armature) is left out: a view
    is no place for errors.
    """
    armature = watched(context) if context.scene else None
    if armature is None:
        return {}
    out = {}
    for kind in kinds:
        try:
            out[kind] = KINDS[kind](context, armature)
        except (DafnetError, ReferenceError):
            out[kind] = ()
    return out


# Faults by frame.


@dataclass(frozen=True)
class Faults:
    """Of each frame of a take: ``sliding`` (T,), feet that slide; ``collisions`` (T,), joints that
    touch furniture.
    """

    sliding: np.ndarray
    collisions: np.ndarray


@dataclass(frozen=True)
class Strip:
    """Bars over time: ``first`` and ``last`` frame (R,); ``row`` (R,): 0 sliding, 1 collisions;
    ``colours`` (R, 4).
    """

    first: np.ndarray
    last: np.ndarray
    row: np.ndarray
    colours: np.ndarray


def faults_of(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    actions: Iterable[bpy.types.Action],
) -> dict[int, Faults]:
    """Faults of takes by their actions' ``session_uid``, among the furniture as the scene has it in
    each frame.

    ``InputError`` as for ``read_scene``, and where an action holds no take.
    """
    found, scenes = {}, {}
    for action in actions:
        take, _ = stored(action)
        first, last = action.dafnet.frame_start, action.dafnet.frame_start + len(take) - 1
        if (first, last) not in scenes:
            settings = settings_of(
                armature, context.scene, frame_start=first, frame_end=last, mode="FREE"
            )
            scenes[first, last] = read_scene(context, settings).scene
        floor = take.root[:, 2, 3] / take.scale
        joints = take.joints / take.scale
        near = beside(scenes[first, last], take.root[:, :3, 3], REACH_OF_A_BODY, take.scale)
        room, _ = prepared(scaled(near, 1.0 / take.scale), float(np.median(floor)))
        apart = distance(room, joints[:, list(BAD_COLLISION_JOINTS)], floor)
        found[action.session_uid] = Faults(
            foot_sliding(joints, take.fps, floor), bad_collisions(apart)
        )
    return found


def strip(faults: Faults, frame_start: int) -> Strip:
    """Bars for the runs of frames with as many faults, the more the stronger."""
    rows: list[tuple[int, int, int]] = []
    colours = []
    for row, (counts, colour) in enumerate(
        ((faults.sliding, _SLIDES), (faults.collisions, _BUMPS))
    ):
        edges = np.concatenate([[0], np.flatnonzero(np.diff(counts)) + 1, [len(counts)]])
        for start, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            if end > start and counts[start] > 0:
                rows.append((frame_start + start, frame_start + end - 1, row))
                colours.append(
                    (*colour[:3], min(1.0, colour[3] + 0.25 * (float(counts[start]) - 1.0)))
                )
    table = np.array(rows, int).reshape(-1, 3)
    return Strip(table[:, 0], table[:, 1], table[:, 2], np.array(colours).reshape(-1, 4))
