"""The scene as plain arrays: evaluated furniture, the root, targets, mode and source pose, frame by
frame, in metres.

One unit of Blender is ``metres_per_unit`` metres; everything that the core gets is in metres. The
evaluated scene is read, so keys, constraints, drivers, modifiers and instances all count; what is
hidden in the viewport does not exist.
"""

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

from ...core.beginning import PREROLL
from ...core.errors import InputError
from ...core.progress import stepwise, within
from ...core.resampling import covering_frames
from ...core.series import MODEL_FPS
from ...core.skeleton import FEET_ASKED, JOINTS, TARGETS
from ...core.solids import Scene
from ...core.take import Controls
from ..character.armature import is_character, metres_per_unit
from ..character.settings import AS_IT_IS, Settings
from ..compat import action_curves, animated_paths
from ..pipeline.baker import has_bone_overrides, require_bakeable
from ..rig.reading import pose_matrices
from .dependencies import Dependencies, Simulation
from .furniture import Furniture, array, furniture_of
from .lookup import find_object, find_scene, require_enabled
from .playback import play_steps
from .upper_body import PARTS, Source, rigid_matrices, source_of, upper_body_of_take

__all__ = ["ReadScene", "read_scene"]

_UNTURNED = np.radians(0.1)
"""Radians of rotation up to which a target counts as not turned."""
_SHAPED = {"MESH", "CURVE", "SURFACE", "FONT", "META", "CURVES", "POINTCLOUD", "VOLUME"}
"""Kinds of objects that have a middle."""
_TARGETS = {
    "head": "head target",
    "hand_left": "left hand target",
    "hand_right": "right hand target",
    "foot_left": "left foot target",
    "foot_right": "right foot target",
}


@dataclass(frozen=True)
class ReadScene:
    """What generation needs: the furniture, the controls at the scene's frame rate, and sentences
    for the user.
    """

    scene: Scene
    controls: Controls
    warnings: tuple[str, ...]


@stepwise
def read_scene(context: bpy.types.Context, settings: Settings) -> Generator[float, None, ReadScene]:
    """Read the scene; yields progress in [0, 1], at which the current frame is as it was.

    Where a simulation that is not baked moves what is read, though, the frames are played in order
    from the simulation's start, and the current one comes back at the end, or when the generator is
    closed.

    Furniture: every mesh of the collection and of the collections in it, as the viewport evaluates
    it at the first frame, with its matrix for each frame if it moves; shapes that change over time
    are warned about. The character, whatever follows it in any way, the root and the targets are
    never furniture, nor are helpers: see ``furniture``.

    What is looked at: the face of another character, else the middle of an object.

    Only what counts in a mode that may play is read, or missed: targets in EE, those of the feet in
    FULL as well, sources in FULL.

    Targets: the empties' places. Their rotations count where they are keyed, or where a target was
    ever turned in its parent's space; a target that was only moved leaves head, hands and
    feet free to turn.

    Upper and lower body: a source's bones, carried from its root onto this character's and to its
    size. The source is another character or any rig whose bones are known (``rig.properties``).
    Its root is its object if it is one of our characters, else it is found from hips and shoulders.

    ``InputError``: something that is needed is missing, gone, linked, empty or not a number, or
    follows the character itself.
    """
    scene = _require_scene(context, settings)
    unit = metres_per_unit(scene)
    armature = find_object(settings, settings.armature, "character")
    size = require_bakeable(armature, unit)

    if settings.root is None:
        raise InputError(
            f"The character '{armature.name}' has no root; choose its root object in the DAFNet "
            "panel."
        )

    root = find_object(settings, settings.root, "root")
    played = {settings.mode} if settings.mode else _modes_played(armature)
    asked = TARGETS if "EE" in played else FEET_ASKED if "FULL" in played else ()
    names = {role: name for role in asked if (name := getattr(settings, role))}
    targets = {role: find_object(settings, name, _TARGETS[role]) for role, name in names.items()}

    frames = range(settings.frame_start, settings.frame_end + 1)
    parts = PARTS if "FULL" in played else ()
    copied = [
        each for part in parts if (each := source_of(settings, part, armature, frames)) is not None
    ]

    dependencies = Dependencies(scene)
    leading = {f"root '{root.name}'": root}
    leading |= {f"{_TARGETS[role]} '{target.name}'": target for role, target in targets.items()}
    look_at = settings.look_at and find_object(settings, settings.look_at, "target of Look At")
    if look_at:
        leading[f"target of Look At '{look_at.name}'"] = look_at
    led = [root, *targets.values(), *([look_at] if look_at else [])]
    _require_independent(dependencies, armature, leading)

    furniture = furniture_of(settings, dependencies)
    members = furniture.members if furniture else set()
    sources = [*dict.fromkeys(each.armature for each in copied)]
    simulations = dependencies.simulations([*led, *members], shaped=False)
    simulations += dependencies.simulations(sources)

    # Furniture is read at the first frame; simulations that began earlier have shaped it by then.
    simulations += [each for each in dependencies.simulations(members) if each.since < frames[0]]
    tracks = _Tracks(armature, root=root, targets=targets, look_at=look_at)
    # Sources may play at other frames than the scene; those that do are seen by themselves.
    shifted = [each for each in copied if each.seen != frames]

    def look(frame: int, depsgraph: bpy.types.Depsgraph, shaped: set[bpy.types.Object]) -> None:
        if frame == frames[0]:
            require_enabled(depsgraph, [armature, *led, *sources])
        if furniture and frame == frames[0]:
            furniture.begin(depsgraph)
        elif furniture:
            furniture.add(depsgraph, shaped)
        tracks.add(depsgraph)
        for each in copied:
            if each not in shifted:
                each.add(depsgraph)

    job = play_steps(context, frames, simulations, look)
    yield from within(job, 0.0, 0.5 if shifted else 0.9)
    for k, each in enumerate(shifted):

        def look_at_source(
            _frame: int, depsgraph: bpy.types.Depsgraph, _shaped: Any, each: Source = each
        ) -> None:
            each.add(depsgraph)

        job = play_steps(context, each.seen, dependencies.simulations(sources), look_at_source)
        low, one = 0.5 + 0.4 * k / len(shifted), 0.4 / len(shifted)
        yield from within(job, low, low + one)

    fps = scene.render.fps / scene.render.fps_base
    given: dict[str, Any] = tracks.given(unit)
    if settings.begins == AS_IT_IS and settings.begins_as is None:
        earlier = covering_frames(PREROLL + 1, MODEL_FPS, fps)
        before = range(frames[0] - earlier + 1, frames[0] + 1)
        earlier_root, bodies, poses = [], [], []

        def look_before(_frame: int, depsgraph: bpy.types.Depsgraph, _shaped: Any) -> None:
            earlier_root.append(array(root.evaluated_get(depsgraph).matrix_world))
            shown = armature.evaluated_get(depsgraph)
            bodies.append(array(shown.matrix_world))
            poses.append(pose_matrices(shown, [*JOINTS]))

        yield from within(play_steps(context, before, simulations, look_before), 0.9, 1.0)
        joints = (np.array(bodies)[:, None] @ np.array(poses))[..., :3, 3]
        given["before"] = unit * joints
        given["before_root"] = rigid_matrices(np.array(earlier_root), unit, f"root '{root.name}'")

    modes = [settings.mode] * len(frames) if settings.mode else tracks.modes
    warnings = tuple(_warnings(armature, furniture, dependencies, simulations))
    root_matrices = rigid_matrices(np.array(tracks.root), unit, f"root '{root.name}'")

    if "FULL" in modes:
        if not copied and not settings.upper_body_take:
            raise InputError(
                f"The mode of '{armature.name}' is FULL but no source is set; choose one to copy "
                "from."
            )
        full = np.array([mode == "FULL" for mode in modes])
        if settings.upper_body_source is None and settings.upper_body_take:
            given["upper_body"] = upper_body_of_take(
                settings, full=full, root=root_matrices, size=size, fps=fps
            )
        for each in copied:
            if dependencies.follows(each.armature, armature):
                raise InputError(
                    f"The {each.what} follows the character itself; mute what links the two."
                )
            given[each.part], off = each.joints(unit=unit, root=root_matrices, size=size, fps=fps)
            if off:
                name = each.armature.name
                warnings += (f"'{name}' is copied, but {off}; check its bones in Your Rig.",)

    mode = modes[0] if len(set(modes)) == 1 else tuple(modes)
    controls = Controls(
        fps=fps,
        root=root_matrices,
        mode=mode,
        blend=settings.blend_frames / fps,
        scale=size,
        **given,
    )

    solids = furniture.solids(unit) if furniture else ()
    yield 1.0
    return ReadScene(Scene(solids), controls, warnings)


def _require_scene(context: bpy.types.Context, settings: Settings) -> bpy.types.Scene:
    """The scene that the settings are of; ``InputError`` where it is not the one that plays, or its
    time is stretched.
    """
    scene = find_scene(settings)
    if context.scene != scene:
        raise InputError(
            f"The scene '{settings.scene}' is not the active one; make it active and generate "
            "again."
        )

    if scene.render.frame_map_old != scene.render.frame_map_new:
        raise InputError(
            f"The scene '{settings.scene}' uses time stretching; set it back to 100 : 100."
        )

    return scene


def _modes_played(armature: bpy.types.Object) -> set[str]:
    """The modes that a character's own settings may come to: the one that is set, those that are
    keyed, and all of them where drivers or NLA strips change it.
    """
    own, path = armature.dafnet, "dafnet.mode"
    if path not in animated_paths(armature):
        return {own.mode}

    named = {item.value: item.identifier for item in own.bl_rna.properties["mode"].enum_items}
    curves = [curve for curve in action_curves(armature) if curve.data_path == path]
    keyed = {round(point.co[1]) for curve in curves for point in curve.keyframe_points}
    data = armature.animation_data
    changed = data.drivers or data.nla_tracks or any(each.mute or each.modifiers for each in curves)
    if changed or not keyed or not keyed <= named.keys():
        return {*named.values()}
    return {named[value] for value in keyed}


class _Tracks:
    """What is read, frame by frame, about a character and about what leads it; matrices (4, 4) in
    Blender units.
    """

    def __init__(
        self,
        armature: bpy.types.Object,
        root: bpy.types.Object,
        targets: dict[str, bpy.types.Object],
        look_at: bpy.types.Object | None,
    ) -> None:
        self.armature = armature
        self._root = root
        self._targets = targets
        self._look_at = look_at

        self.modes: list[str] = []
        self.head_follows: list[str] = []
        self.influences: dict[str, list[float]] = {role: [] for role in targets}
        self.root: list[np.ndarray] = []
        self.targets: dict[str, list[np.ndarray]] = {role: [] for role in targets}
        self.local: dict[str, list[np.ndarray]] = {role: [] for role in targets}
        self.looked_at: list[np.ndarray] = []
        self.looks: list[float] = []
        self.leans: list[float] = []

    def add(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Note the frame that the scene shows now."""
        own = self.armature.dafnet
        self.modes.append(own.mode)
        self.head_follows.append(own.head_follows)
        self.leans.append(own.lean)
        self.root.append(array(self._root.evaluated_get(depsgraph).matrix_world))
        for role, target in self._targets.items():
            evaluated = target.evaluated_get(depsgraph)
            self.influences[role].append(getattr(own, f"{role}_influence"))
            self.targets[role].append(array(evaluated.matrix_world))
            self.local[role].append(array(evaluated.matrix_local))
        if self._look_at:
            self.looked_at.append(_middle(self._look_at.evaluated_get(depsgraph)))
            self.looks.append(own.look_at_influence)

    def given(self, unit: float) -> dict[str, np.ndarray]:
        """The targets as ``Controls`` takes them, in metres: places, rotations where they count,
        and influences where they are ever less than 1; and the lean, where there is any.
        """
        given = {}
        for role, target in self._targets.items():
            matrices = rigid_matrices(
                np.array(self.targets[role]), unit, f"{_TARGETS[role]} '{target.name}'"
            )
            follows = np.array(self.head_follows if role == "head" else ["ALL"])
            given[role] = np.where((follows != "TURN")[:, None], matrices[:, :3, 3], np.nan)
            turned = _is_turned(target, np.array(self.local[role]))
            turns = (follows == "TURN") | ((follows == "ALL") & turned)
            if turns.any():
                given[f"{role}_rotation"] = np.where(
                    turns[:, None, None], matrices[:, :3, :3], np.nan
                )
            if min(self.influences[role]) < 1.0:
                given[f"{role}_influence"] = np.array(self.influences[role])

        if self._look_at:
            given["look_at"] = unit * np.array(self.looked_at)
            if min(self.looks) < 1.0:
                given["look_at_influence"] = np.array(self.looks)
        if any(self.leans):
            given["lean"] = np.degrees(self.leans)
        return given


def _middle(seen: bpy.types.Object) -> np.ndarray:
    """Where somebody is looked at who looks at an evaluated object: into the face of a character,
    else the middle of what has a shape; world, Blender units.
    """
    if is_character(seen):
        head = seen.pose.bones["head"]
        return np.array(seen.matrix_world @ (0.5 * (head.head + head.tail)))
    corners = np.array(seen.bound_box) if seen.type in _SHAPED else np.zeros((1, 3))
    return np.array(seen.matrix_world @ Vector(corners.mean(axis=0).tolist()))


def _require_independent(
    dependencies: Dependencies,
    armature: bpy.types.Object,
    leading: dict[str, bpy.types.Object],
) -> None:
    """``InputError`` where what leads the character follows it, or may be pushed by it: each take
    would change the next.
    """
    if dependencies.setting_follows(armature, "dafnet.", armature):
        raise InputError(
            f"A driver of the mode or an influence of '{armature.name}' reads the character "
            "itself; remove the driver."
        )

    for what, leader in leading.items():
        if dependencies.follows(leader, armature, shaped=False):
            raise InputError(
                f"The {what} follows the character itself; let it follow something else."
            )
        for simulation in dependencies.simulations([leader], shaped=False):
            if _may_push(simulation, dependencies, armature):
                raise InputError(
                    f"The character itself may push '{simulation.name}', which moves the {what}; "
                    "bake the simulation first."
                )


def _may_push(
    simulation: Simulation, dependencies: Dependencies, armature: bpy.types.Object
) -> bool:
    return any(dependencies.follows(each, armature) for each in simulation.colliders)


def _warnings(
    armature: bpy.types.Object,
    furniture: Furniture | None,
    dependencies: Dependencies,
    simulations: list[Simulation],
) -> Iterator[str]:
    """About what can be used, but hardly as it was meant."""
    if has_bone_overrides(armature):
        yield (
            f"Bones of '{armature.name}' have constraints or drivers, which change the take; mute "
            "them to see it as generated."
        )

    if furniture:
        yield from furniture.warnings()

    pushed = (
        simulation.name
        for simulation in simulations
        if _may_push(simulation, dependencies, armature)
    )
    for name in dict.fromkeys(pushed):
        yield (
            f"The character itself may push '{name}', so each take would change the next; bake "
            "the simulation first."
        )


def _is_turned(target: bpy.types.Object, local: np.ndarray) -> bool:
    """Whether a target's rotation is meant to count: it is keyed, or differs from its parent's."""
    if any("rotation" in curve.data_path for curve in action_curves(target)):
        return True
    axes = local[:, :3, :3] / np.maximum(
        np.linalg.norm(local[:, :3, :3], axis=1, keepdims=True), 1e-9
    )
    return bool(np.abs(axes - np.eye(3)).max() > _UNTURNED)
