"""Keys on a character's root: either it follows its route, or nothing is changed and an InputError
says why.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.paths import Route
from ...core.root import yaw_of
from ..character.settings import Settings
from ..compat import action_curves, shares_curves
from ..scene.lookup import find_object
from ..scene.playback import frame_kept

__all__ = [
    "MOVES",
    "first_key",
    "keep_copy",
    "keyable_root",
    "key_route",
    "keys_within",
    "last_key",
    "remove_keys_from",
    "require_keyable",
    "restore_between",
    "unchanged_on_failure",
    "write_keys",
]

MOVES = ("location", "rotation_euler")
"""The channels of a root that are keyed."""
_JOINED_BY = ("interpolation", "handle_left_type", "handle_right_type")
"""What says how keys are joined."""
_KEYS_A_SECOND = 10
"""How many keys a route gets for each second."""
_CHECKED_FRAMES = 12
"""In how many frames it is checked that the root follows its keys."""
_DISTANCE_TOLERANCE = 1e-3
"""Metres from the route that count as rounding."""
_ANGLE_TOLERANCE = 0.01
"""Radians from the route's heading that count as rounding."""


def keyable_root(settings: Settings) -> bpy.types.Object:
    """The root, if its keys alone decide where it is in the world: nothing else moves it, and its
    action plays alone.

    ``InputError``: there is none, or something is in the way.
    """
    if settings.root is None:
        raise InputError(
            f"The character '{settings.armature}' has no root; choose its root object in the "
            "DAFNet panel."
        )

    root = find_object(settings, settings.root, "root")
    require_keyable(root, "root")
    return root


def require_keyable(owner: bpy.types.Object, role: str) -> None:
    """``InputError`` where an object's keys alone do not decide where it is in the world."""
    for reason in _reasons_not_to_key(owner):
        raise InputError(f"The {role} '{owner.name}' {reason}")


def _reasons_not_to_key(root: bpy.types.Object) -> Iterator[str]:
    """Why the root cannot be keyed, and what to do: ends of sentences that begin with the root."""
    if root.parent or any(not c.mute for c in root.constraints):
        yield "follows something; clear its parent and constraints to key it."
    if root.library or len(root.rotation_mode) != 3 or root.rotation_mode[2] != "Z":
        yield "is linked or not in rotation mode XYZ; make it local and set that mode."

    zeros = (*root.delta_location, *root.delta_rotation_euler, *(s - 1.0 for s in root.delta_scale))
    if any(zeros) or any(curve.data_path.startswith("delta_") for curve in action_curves(root)):
        yield "has delta transforms; set them to zero, without keys, to key it."

    data = root.animation_data
    if data is None:
        return

    if any(
        not driver.mute and driver.data_path.startswith((*MOVES, "delta_"))
        for driver in data.drivers
    ):
        yield "has drivers; remove them to key it."

    if data.use_tweak_mode or any(track.is_solo for track in data.nla_tracks):
        yield "plays an NLA strip in tweak or solo mode; leave it to key it."

    if data.action is None:
        return

    if data.action_blend_type != "REPLACE" or data.action_influence < 1.0:
        yield (
            "mixes its action with NLA strips; set the action's blending to Replace and its "
            "influence to 1 to key it."
        )

    if data.action.library or data.action.override_library:
        yield f"has its keys in a linked action; make '{data.action.name}' local to key it."

    users = bpy.data.user_map(subset=[data.action])[data.action] - {root}
    for other in sorted(
        (each for each in users if shares_curves(root, each)), key=lambda each: each.name
    ):
        yield (f"shares its keys with '{other.name}'; make its action a single user to key it.")

    for curve in action_curves(root):
        if curve.data_path in MOVES:
            yield from _reasons_in_curve(curve)


def _reasons_in_curve(curve: bpy.types.FCurve) -> Iterator[str]:
    group = curve.group
    if curve.lock or (group and group.lock):
        yield "has locked curves of location or rotation; unlock them to key it."
    if curve.mute or (group and group.mute):
        yield "has muted curves of location or rotation; unmute them to key it."
    if any(not modifier.mute for modifier in curve.modifiers):
        yield "has modifiers on curves of location or rotation; remove or mute them to key it."
    if len(curve.sampled_points):
        yield "has sampled curves of location or rotation; convert them to keys first."


def last_key(root: bpy.types.Object) -> int | None:
    """The frame of a root's last key, rounded up; None where it has no keys."""
    frames = _key_frames(root)
    return int(np.ceil(max(frames))) if frames else None


def first_key(root: bpy.types.Object) -> float | None:
    """The frame of a root's first key; None where it has no keys."""
    return min(_key_frames(root), default=None)


def _key_frames(root: bpy.types.Object) -> list[float]:
    return [
        float(point.co[0])
        for curve in action_curves(root)
        if curve.data_path in MOVES
        for point in curve.keyframe_points
    ]


def remove_keys_from(
    root: bpy.types.Object, first: int
) -> dict[tuple[str, int], list[tuple[int, float]]]:
    """Remove a root's keys from frame ``first`` on; returns by curve the values of the frames after
    the last key that stays.
    """
    kept: dict[tuple[str, int], list[tuple[int, float]]] = {}
    for curve in action_curves(root):
        if curve.data_path not in MOVES:
            continue

        earlier = [point for point in curve.keyframe_points if point.co[0] < first]
        if earlier:
            last = earlier[-1]
            # The next key would otherwise bend the curve that leads to this one.
            last.handle_left_type = last.handle_right_type = "FREE"
            between = range(int(np.floor(last.co[0])) + 1, first)
            kept[curve.data_path, curve.array_index] = [
                (frame, curve.evaluate(frame)) for frame in between
            ]

        for k in reversed(
            [k for k, point in enumerate(curve.keyframe_points) if point.co[0] >= first]
        ):
            curve.keyframe_points.remove(curve.keyframe_points[k], fast=True)

        curve.update()

    return kept


def restore_between(
    root: bpy.types.Object, kept: dict[tuple[str, int], list[tuple[int, float]]]
) -> None:
    """Key what ``remove_keys_from`` has returned, where the root would move otherwise now."""
    for curve in action_curves(root):
        for frame, value in kept.get((curve.data_path, curve.array_index), []):
            if abs(curve.evaluate(frame) - value) > 1e-5:
                curve.keyframe_points.insert(frame, value).interpolation = "LINEAR"
        curve.update()


def keep_copy(owner: bpy.types.Object, tail: str) -> bpy.types.Action:
    """A copy of an object's action, kept in the file, whose name ends in ``tail``."""
    action = owner.animation_data.action
    copy = action.copy()
    copy.name = f"{action.name[: 60 - len(tail)]}{tail}"
    copy.use_fake_user = True
    return copy


def keys_within(
    owner: bpy.types.Object, paths: Sequence[str], first: float, last: float = np.inf
) -> Iterator[bytes]:
    """The keys of these data paths from frame ``first`` to ``last``, as bytes, curve by curve:
    frames and values, and by which kinds of handles and interpolation they are joined.
    """
    for curve in action_curves(owner):
        if curve.data_path in paths and len(points := curve.keyframe_points):
            values = np.empty(2 * len(points), np.float32)
            points.foreach_get("co", values)
            found = values.reshape(-1, 2)
            within = (found[:, 0] >= first) & (found[:, 0] <= last)
            if within.any():
                joints = np.empty((len(_JOINED_BY), len(points)), np.int32)
                for kind, each in zip(_JOINED_BY, joints, strict=True):
                    points.foreach_get(kind, each)
                name = f"{curve.data_path}[{curve.array_index}]".encode()
                yield name + found[within].tobytes() + joints[:, within].tobytes()


@contextmanager
def unchanged_on_failure(root: bpy.types.Object) -> Iterator[None]:
    """A block that writes keys: if it fails, the root's keys and place are as they were.

    Such blocks may be within each other, and their roots may share an action.
    """
    data = root.animation_data
    action = data.action if data else None
    kept = action.copy() if action else None
    name, fake_user = (action.name, action.use_fake_user) if action else ("", False)
    place, turn = root.location.copy(), root.rotation_euler.copy()
    try:
        yield
    except BaseException:
        # A block within this one that failed has put its own copy in the action's place.
        now = root.animation_data.action if root.animation_data else None
        if now and kept:
            now.user_remap(kept)
        if now:
            bpy.data.actions.remove(now)
        if kept:
            kept.name, kept.use_fake_user = name, fake_user
        if data is None:
            root.animation_data_clear()
        root.location, root.rotation_euler = place, turn
        raise

    if kept:
        bpy.data.actions.remove(kept)


def key_route(
    context: bpy.types.Context,
    root: bpy.types.Object,
    route: Route,
    *,
    first: int,
    scale: float,
    fps: float,
) -> None:
    """``write_keys``, and check that the root follows them.

    To be called within ``unchanged_on_failure``. ``InputError``: something else moves the root.
    """
    frames = write_keys(root, route, first=first, scale=scale, fps=fps)
    checked = frames[np.unique(np.linspace(0, len(frames) - 1, _CHECKED_FRAMES).astype(int))]
    with frame_kept(context.scene):
        for k in checked:
            context.scene.frame_set(first + int(k))
            matrix = np.array(
                root.evaluated_get(context.evaluated_depsgraph_get()).matrix_world, float
            )
            off = np.linalg.norm(matrix[:3, 3] - route.path.position[k] * scale) / scale
            wrong = yaw_of(matrix[:2, 1]) - route.path.yaw[k]
            if (
                not off < _DISTANCE_TOLERANCE
                or not abs(np.angle(np.exp(1j * wrong))) < _ANGLE_TOLERANCE
            ):
                raise InputError(
                    f"Something other than its keys moves the root '{root.name}', so nothing was "
                    "keyed; look for physics, NLA strips or scripts."
                )


def write_keys(
    root: bpy.types.Object, route: Route, *, first: int, scale: float, fps: float
) -> np.ndarray:
    """Key location and heading about ten times a second from frame ``first`` on, and where the root
    comes to rest.

    ``scale``: the route's metres in Blender units. Returns the frames of the route that are keyed.
    ``InputError``: Blender takes no keys.
    """
    frames = set(range(0, len(route.path), max(1, round(fps / _KEYS_A_SECOND))))
    frames |= {
        len(route.path) - 1,
        *(k for rest in route.rests for k in (rest.start, rest.stop - 1)),
    }
    for k in sorted(frames):
        root.location = route.path.position[k] * scale
        root.rotation_euler = (0.0, 0.0, float(route.path.yaw[k]))
        if not all(root.keyframe_insert(path, frame=first + k) for path in MOVES):
            raise InputError(
                f"The root '{root.name}' cannot be keyed; unlock its action and curves."
            )

    _smooth_keys(action_curves(root), first)
    return np.array(sorted(frames))


def _smooth_keys(curves: Iterable[bpy.types.FCurve], first: int) -> None:
    for curve in curves:
        if curve.data_path in MOVES:
            for point in curve.keyframe_points:
                if point.co[0] >= first:
                    point.interpolation = "BEZIER"
                    point.handle_left_type = point.handle_right_type = "AUTO_CLAMPED"
            curve.update()
