"""Humanoid rigs built by script, each with its convention's names, rest pose, bone axes, helpers
and object transform.

Every builder takes the module ``bpy`` and gives the armature object. Proportions are those of
people of 1.75 m; spines and shoulders differ from rig to rig as they do among real ones. ``arms``
and ``legs`` stretch the limbs' bones.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = [
    "BUILDERS",
    "RESTS",
    "character_body",
    "mixamo",
    "odd",
    "rest_pose",
    "rested",
    "rigify",
    "rigify_metarig",
    "smpl_x",
    "unreal",
    "vrm",
]

Point = Sequence[float] | np.ndarray
# Facing -y, left at +x, metres; the left side only.
_TRUNK = {
    "pelvis": (0, 0.0, 0.99),
    "spine1": (0, 0.01, 1.09),
    "spine2": (0, 0.0, 1.21),
    "spine3": (0, 0.0, 1.32),
    "neck": (0, 0.03, 1.5),
    "head": (0, 0.0, 1.61),
    "top": (0, 0.0, 1.78),
}
_LEG = {
    "hip": (0.09, 0.0, 0.92),
    "knee": (0.092, -0.012, 0.51),
    "ankle": (0.09, 0.0, 0.1),
    "foot": (0.105, -0.13, 0.04),
    "toe_end": (0.11, -0.21, 0.03),
}
_FINGERS = ("Index", "Middle", "Ring", "Pinky")


@dataclass
class Bone:
    """A bone to build; ``z``: direction of its local z, near enough."""

    name: str
    parent: str | None
    head: Point
    tail: Point
    z: Point = (0, -1, 0.1)
    connect: bool = False


def character_body(
    down: float = 0.0,
    bent: float = 4.0,
    arms: float = 1.0,
    legs: float = 1.0,
    trunk: dict[str, Point] | None = None,
) -> dict[str, np.ndarray]:
    """Joints by name, arms turned ``down`` and elbows ``bent`` by degrees; soles on the floor."""
    joints = {name: np.array(point, float) for name, point in (_TRUNK | (trunk or {})).items()}
    a, b = np.radians(down), np.radians(down + bent * 0.3)
    shoulder = np.array([0.18, 0.02, 1.45])
    elbow = shoulder + arms * 0.26 * np.array([np.cos(a), 0.02, -np.sin(a)])
    wrist = elbow + arms * 0.25 * np.array([np.cos(b), -np.sin(np.radians(bent)), -np.sin(b)])
    tip = wrist + (wrist - elbow) / np.linalg.norm(wrist - elbow) * 0.1
    left = {
        "collar": np.array([0.03, 0.0, 1.44]),
        "shoulder": shoulder,
        "elbow": elbow,
        "wrist": wrist,
        "tip": tip,
    }
    leg = {name: np.array(point, float) for name, point in _LEG.items()}
    lift = np.zeros(3)
    for lower, upper in (("knee", "hip"), ("ankle", "knee")):
        lift[2] += (legs - 1.0) * (leg[upper][2] - leg[lower][2])
    knee = leg["ankle"] + legs * (leg["knee"] - leg["ankle"])
    leg["hip"] = knee + legs * (leg["hip"] - leg["knee"])
    leg["knee"] = knee
    joints = {name: point + lift for name, point in joints.items()}
    left = {name: point + lift for name, point in left.items()} | leg
    for name, point in left.items():
        joints[f"left_{name}"], joints[f"right_{name}"] = point, point * (-1, 1, 1)
    return joints


def made(
    bpy: Any,
    name: str,
    bones: Sequence[Bone],
    to_rig: np.ndarray | None = None,
    scale: float = 1.0,
    origin: Point = (0, 0, 0),
) -> Any:
    """An armature object of bones that are given in the room, standing where they are: ``to_rig``
    (3, 3) turns the room into its own space, its unit is ``scale`` metres, its origin lies at
    ``origin``.
    """
    turn = np.eye(3) if to_rig is None else to_rig
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    bpy.context.scene.collection.objects.link(armature)
    if bpy.context.object is not None and bpy.context.object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in bones:
        edit = armature.data.edit_bones.new(bone.name)
        edit.head = turn @ (np.array(bone.head, float) - origin) / scale
        edit.tail = turn @ (np.array(bone.tail, float) - origin) / scale
        edit.align_roll(tuple(turn @ np.array(bone.z, float)))
        if bone.parent:
            edit.parent = armature.data.edit_bones[bone.parent]
            edit.use_connect = bone.connect
    bpy.ops.object.mode_set(mode="OBJECT")
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = scale * turn.T, origin
    armature.matrix_world = _matrix(matrix)
    for bone in armature.pose.bones:
        bone.rotation_mode = "QUATERNION"
    return armature


def _matrix(values: np.ndarray) -> Any:
    from mathutils import Matrix

    return Matrix(values.tolist())


def _humanoid(
    body: dict[str, np.ndarray],
    trunk: dict[str, str],
    side: dict[str, Callable[[str], str]],
    limbs: dict[str, str],
    root: str | None = None,
    connect: bool = True,
) -> list[Bone]:
    """Bones from joint to joint under the names of a convention; joints without a name are left
    out.
    """
    bones = [Bone(root, None, (0, 0, 0), (0, 0.2, 0))] if root else []
    column: list[str] = [
        joint
        for joint in ("pelvis", "spine1", "spine2", "spine3", "neck", "head")
        if joint in trunk
    ]
    for k, joint in enumerate(column):
        onward: str = column[k + 1] if k + 1 < len(column) else "top"
        bones.append(
            Bone(
                trunk[joint],
                trunk[column[k - 1]] if k else root,
                body[joint],
                body[onward],
                (0, -1, 0),
                connect and k > 0,
            )
        )
    chest = trunk[
        next(joint for joint in ("spine3", "spine2", "spine1", "pelvis") if joint in trunk)
    ]
    chains: tuple[tuple[tuple[str, ...], str], ...] = (
        (("collar", "shoulder", "elbow", "wrist", "tip"), chest),
        (("hip", "knee", "ankle", "foot", "toe_end"), trunk["pelvis"]),
    )
    for word, named in side.items():
        for chain, start in chains:
            there = [joint for joint in chain if joint in limbs]
            for k, joint in enumerate(there):
                onward = (
                    there[k + 1]
                    if k + 1 < len(there)
                    else chain[-1]
                    if joint != "ankle"
                    else "foot"
                )
                z = (0, -1, 0) if chain[0] == "hip" and joint in ("hip", "knee") else (0, 0, 1)
                parent = named(limbs[there[k - 1]]) if k else start
                bones.append(
                    Bone(
                        named(limbs[joint]),
                        parent,
                        body[f"{word}_{joint}"],
                        body[f"{word}_{onward}"],
                        z,
                        connect and k > 0,
                    )
                )
    return bones


def _fingers(body: dict[str, np.ndarray], hand: str, word: str, names: Sequence[str]) -> list[Bone]:
    """The first bones of four fingers, of these names."""
    bones = []
    at, ahead = body[f"{word}_wrist"], body[f"{word}_tip"] - body[f"{word}_wrist"]
    for k, name in enumerate(names):
        start = at + 0.9 * ahead + np.array([0, -0.03 + 0.02 * k, 0])
        bones.append(Bone(name, hand, start, start + 0.4 * ahead, (0, 0, 1)))
    return bones


def mixamo(bpy: Any, prefix: str = "mixamorig:", **body: Any) -> Any:
    """As Blender imports Mixamo's FBX: T-pose, y up and centimetres inside, the object turned and
    scaled by 0.01.
    """
    joints = character_body(
        trunk={"spine2": (0, 0.02, 1.22), "spine3": (0, 0.03, 1.33), "neck": (0, 0.05, 1.49)},
        **body,
    )
    trunk = dict(
        zip(
            ("pelvis", "spine1", "spine2", "spine3", "neck", "head"),
            (prefix + name for name in ("Hips", "Spine", "Spine1", "Spine2", "Neck", "Head")),
            strict=True,
        )
    )
    limbs = {
        "collar": "Shoulder",
        "shoulder": "Arm",
        "elbow": "ForeArm",
        "wrist": "Hand",
        "hip": "UpLeg",
        "knee": "Leg",
        "ankle": "Foot",
        "foot": "ToeBase",
    }
    side = {
        "left": lambda name: f"{prefix}Left{name}",
        "right": lambda name: f"{prefix}Right{name}",
    }
    bones = _humanoid(joints, trunk, side, limbs, connect=False)
    for word, named in side.items():
        bones += _fingers(
            joints, named("Hand"), word, [named(f"Hand{finger}1") for finger in _FINGERS]
        )
        bones.append(
            Bone(
                named("Toe_End"),
                named("ToeBase"),
                joints[f"{word}_toe_end"],
                joints[f"{word}_toe_end"] + (0, -0.05, 0),
            )
        )
    bones.append(
        Bone(f"{prefix}HeadTop_End", trunk["head"], joints["top"], joints["top"] + (0, 0, 0.1))
    )
    return made(bpy, "Mixamo", bones, np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), 0.01)


def unreal(bpy: Any, spines: int = 3, **body: Any) -> Any:
    """An Unreal mannequin: A-pose, bones that do not point along the limbs, twist bones beside
    them, a root bone, 0.01.
    """
    given: dict[str, Any] = {"down": 48.0, "bent": 12.0, "trunk": {"neck": (0, 0.04, 1.51)}}
    joints = character_body(**given | body)
    names = [f"spine_0{k + 1}" for k in range(spines)]
    trunk = {
        "pelvis": "pelvis",
        **dict(zip(("spine1", "spine2", "spine3"), names[:: (spines + 1) // 3], strict=False)),
        "neck": "neck_01",
        "head": "head",
    }
    limbs = {
        "collar": "clavicle",
        "shoulder": "upperarm",
        "elbow": "lowerarm",
        "wrist": "hand",
        "hip": "thigh",
        "knee": "calf",
        "ankle": "foot",
        "foot": "ball",
    }
    side = {"left": lambda name: f"{name}_l", "right": lambda name: f"{name}_r"}
    bones = _humanoid(joints, trunk, side, limbs, root="root", connect=False)
    for bone in bones[1:]:  # as FBX gives them: not along the limb
        along = np.subtract(bone.tail, bone.head)
        bone.tail = np.array(bone.head) + np.cross(along, (0.3, 1.0, 0.2)) * 0.5 + 0.01
    if spines == 5:
        between = {"spine_02": ("spine_01", "spine_03"), "spine_04": ("spine_03", "spine_05")}
        for name, (below, above) in between.items():
            ends = {bone.name: bone for bone in bones}
            middle = 0.5 * (np.array(ends[below].head) + ends[above].head)
            bones.insert(
                bones.index(ends[above]),
                Bone(name, below, middle, middle + np.array([0, 0.03, 0.05])),
            )
            ends[above].parent = name
    for word, named in side.items():
        for upper, lower, joint, end in (
            ("upperarm", "upperarm_twist_01", "shoulder", "elbow"),
            ("thigh", "thigh_twist_01", "hip", "knee"),
        ):
            middle = 0.5 * (joints[f"{word}_{joint}"] + joints[f"{word}_{end}"])
            bones.append(Bone(named(lower), named(upper), middle, middle + np.array([0, 0.05, 0])))
        bones += _fingers(
            joints, named("hand"), word, [named(f"{finger.lower()}_01") for finger in _FINGERS]
        )
    return made(bpy, "Unreal", bones, scale=0.01)


def vrm(bpy: Any, **body: Any) -> Any:
    """A VRM 1.0 humanoid without the optional upper chest; T-pose, connected bones."""
    joints = character_body(trunk={"spine1": (0, 0.0, 1.08), "spine2": (0, 0.0, 1.22)}, **body)
    trunk = {"pelvis": "hips", "spine1": "spine", "spine2": "chest", "neck": "neck", "head": "head"}
    limbs = {
        "collar": "Shoulder",
        "shoulder": "UpperArm",
        "elbow": "LowerArm",
        "wrist": "Hand",
        "hip": "UpperLeg",
        "knee": "LowerLeg",
        "ankle": "Foot",
        "foot": "Toes",
    }
    side = {"left": lambda name: f"left{name}", "right": lambda name: f"right{name}"}
    return made(bpy, "VRM", _humanoid(joints, trunk, side, limbs, root="root"))


def smpl_x(bpy: Any, **body: Any) -> Any:
    """SMPL-X: long names, the origin at the pelvis, short bones that all point up."""
    joints = character_body(trunk={"spine2": (0, 0.02, 1.22), "spine3": (0, 0.0, 1.28)}, **body)
    trunk = {joint: joint for joint in ("pelvis", "spine1", "spine2", "spine3", "neck", "head")}
    limbs = {
        joint: joint
        for joint in ("collar", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot")
    }
    side = {"left": lambda name: f"left_{name}", "right": lambda name: f"right_{name}"}
    bones = _humanoid(joints, trunk, side, limbs, connect=False)
    for bone in bones:
        bone.tail = np.add(bone.head, (0, 0, 0.1))
    for word, named in side.items():
        bones += _fingers(
            joints, named("wrist"), word, [named(f"{finger.lower()}1") for finger in _FINGERS]
        )
    bones.append(
        Bone("jaw", "head", joints["head"] + (0, -0.03, 0.02), joints["head"] + (0, -0.03, 0.12))
    )
    return made(bpy, "SMPL-X", bones, origin=joints["pelvis"])


ODD = {
    "pelvis": "Becken",
    "spine1": "Lende",
    "spine3": "Brust",
    "neck": "Hals",
    "head": "Kopf",
    "left_shoulder": "Oberarm li",
    "left_elbow": "Unterarm li",
    "left_wrist": "Hand li",
    "left_hip": "Schenkel li",
    "left_knee": "Wade li",
    "left_ankle": "Fuss li",
    "right_shoulder": "Oberarm re",
    "right_elbow": "Unterarm re",
    "right_wrist": "Hand re",
    "right_hip": "Schenkel re",
    "right_knee": "Wade re",
    "right_ankle": "Fuss re",
}
"""The bones of ``odd`` by joint; it has neither collars nor toes."""


def odd(bpy: Any, **body: Any) -> Any:
    """Odd names, rolls and rotation modes, bones between mapped ones, some that inherit no
    rotation, no collars, no toes.
    """
    joints = character_body(**{"down": 25.0, "bent": 20.0} | body)
    trunk = {joint: ODD[joint] for joint in ("pelvis", "spine1", "spine3", "neck", "head")}
    limbs = {
        "shoulder": "Oberarm",
        "elbow": "Unterarm",
        "wrist": "Hand",
        "hip": "Schenkel",
        "knee": "Wade",
        "ankle": "Fuss",
    }
    side = {"left": lambda name: f"{name} li", "right": lambda name: f"{name} re"}
    bones = _humanoid(joints, trunk, side, limbs, root="Wurzel", connect=False)
    rng = np.random.default_rng(3)
    for bone in bones:
        bone.z = rng.normal(size=3)
    for word, named in side.items():
        middle = 0.5 * (joints[f"{word}_hip"] + joints[f"{word}_knee"])
        bones.insert(
            [bone.name for bone in bones].index(named("Wade")),
            Bone(
                named("Drehung"), named("Schenkel"), middle, middle + np.array([0.02, 0.05, -0.05])
            ),
        )
        next(bone for bone in bones if bone.name == named("Wade")).parent = named("Drehung")
    rig = made(bpy, "Odd", bones, scale=0.5)
    modes = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "AXIS_ANGLE", "QUATERNION")
    for k, bone in enumerate(rig.pose.bones):
        bone.rotation_mode = modes[k % len(modes)]
    rig.data.bones["Hals"].use_inherit_rotation = False
    rig.data.bones["Oberarm li"].use_inherit_rotation = False
    rig.data.bones["Becken"].use_local_location = False
    return rig


_METARIG = {
    "spine": ("pelvis", "spine1"),
    "spine.001": ("spine1", "spine2"),
    "spine.002": ("spine2", "spine3"),
    "spine.003": ("spine3", "neck"),
    "spine.006": ("head", "top"),
    "shoulder.L": ("left_collar", "left_shoulder"),
    "upper_arm.L": ("left_shoulder", "left_elbow"),
    "forearm.L": ("left_elbow", "left_wrist"),
    "hand.L": ("left_wrist", "left_tip"),
    "thigh.L": ("left_hip", "left_knee"),
    "shin.L": ("left_knee", "left_ankle"),
    "foot.L": ("left_ankle", "left_foot"),
    "toe.L": ("left_foot", "left_toe_end"),
}


def rigify_metarig(bpy: Any, **body: Any) -> Any:
    """Rigify's human metarig, its bones moved to a body of 1.75 m in A-pose; no face.
    ``RuntimeError`` without Rigify.
    """
    import addon_utils

    if addon_utils.enable("rigify", default_set=True) is None:
        raise RuntimeError("Rigify cannot be enabled")
    bpy.ops.object.armature_human_metarig_add()
    rig = bpy.context.object
    joints = character_body(**{"down": 35.0, "bent": 10.0} | body)
    bpy.ops.object.mode_set(mode="EDIT")
    edit = rig.data.edit_bones
    for bone in list(edit["face"].children_recursive):
        edit.remove(bone)
    edit.remove(edit["face"])
    hands = {side: np.array(edit[f"hand.{side}"].head) for side in "LR"}
    for name, (head, tail) in _METARIG.items():
        for side, word in (("L", "left"), ("R", "right")):
            bone = edit[name.replace(".L", f".{side}")]
            bone.head, bone.tail = (joints[joint.replace("left", word)] for joint in (head, tail))
    for k, name in enumerate(("spine.004", "spine.005")):
        share = np.linspace(0, 1, 3)[:, None]
        points = (1 - share) * joints["neck"] + share * joints["head"]
        edit[name].head, edit[name].tail = points[k], points[k + 1]
    for side, word in (("L", "left"), ("R", "right")):
        shift = joints[f"{word}_wrist"] - hands[side]
        for bone in edit[f"hand.{side}"].children_recursive:
            if not bone.use_connect:
                bone.head = np.array(bone.head) + shift
            bone.tail = np.array(bone.tail) + shift
        for name in ("breast", "pelvis", "heel.02"):
            bone = edit[f"{name}.{side}"]
            base = {
                "breast": joints["spine3"],
                "pelvis": joints["pelvis"],
                "heel.02": joints[f"{word}_ankle"],
            }[name]
            sign = 1 if side == "L" else -1
            start = np.array(base) * (1, 1, 1 if name != "heel.02" else 0) + (
                0 if name != "heel.02" else -0.03 * sign,
                0.04,
                0,
            )
            bone.head, bone.tail = start, np.add(start, (0.07 * sign, 0, 0))
    bpy.ops.object.mode_set(mode="OBJECT")
    return rig


def rigify(bpy: Any, **body: Any) -> Any:
    """The control rig that Rigify generates from ``rigify_metarig``. ``RuntimeError`` where it
    cannot.
    """
    meta = rigify_metarig(bpy, **body)
    bpy.ops.pose.rigify_generate()
    rig = bpy.context.object
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.objects.remove(meta)
    return rig


BUILDERS: dict[str, Callable[..., Any]] = {
    "mixamo": mixamo,
    "rigify": rigify,
    "rigify_metarig": rigify_metarig,
    "smpl_x": smpl_x,
    "unreal": unreal,
    "vrm": vrm,
    "odd": odd,
}
"""Builders by the convention's name."""


Turn = tuple[str, str, Point]
"""A bone, a joint further along its limb, and where in the room the way from the one to the other
is to point.
"""


def rested(
    bpy: Any, rig: Any, turns: Sequence[Turn], more: Sequence[tuple[str, Point, float]] = ()
) -> Any:
    """The same rig at rest in another pose: its bones aimed by ``turns``, and turned by ``more``:
    bone, axis, degrees.

    The axes are the room's; the pose becomes the rest pose, as *Apply Pose as Rest Pose* makes it.
    """
    from mathutils import Matrix, Vector

    def turned(name: str, turn: Any) -> None:
        bone, world = rig.pose.bones[name], rig.matrix_world
        here = Matrix.Translation(world @ bone.head)
        bone.matrix = (
            world.inverted() @ here @ turn.to_4x4() @ here.inverted() @ world @ bone.matrix
        )
        bpy.context.view_layer.update()

    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="POSE")
    for name, axis, degrees in more:
        turned(name, Matrix.Rotation(np.radians(degrees), 3, Vector(axis)))
    for name, along, direction in turns:
        bpy.context.view_layer.update()
        way = (
            rig.matrix_world @ rig.pose.bones[along].head
            - rig.matrix_world @ rig.pose.bones[name].head
        )
        turned(name, way.rotation_difference(Vector(direction)).to_matrix())
    bpy.ops.pose.armature_apply(selected=False)
    bpy.ops.object.mode_set(mode="OBJECT")
    return rig


RESTS = ("hanging", "forward", "sitting", "twisted", "bent", "leaning")


def rest_pose(
    kind: str, joints: dict[str, str]
) -> tuple[list[Turn], list[tuple[str, Point, float]]]:
    """What ``rested`` needs for one of ``RESTS``, for a rig whose bones by joint are ``joints``."""
    turns: list[Turn] = []
    spine = [joints[joint] for joint in ("spine1", "spine2", "spine3") if joint in joints]
    more: dict[str, list[tuple[str, Point, float]]] = {
        "twisted": [(spine[-1], (0, 0, 1), 40.0)],
        "bent": [(bone, (1, 0, 0), 75.0 / len(spine)) for bone in spine],
        "leaning": [(joints["pelvis"], (0, 1, 0), 7.0), (joints["pelvis"], (0, 0, 1), 25.0)],
    }
    for side, out in (("left", 1.0), ("right", -1.0)):
        led: dict[str, tuple[Point | None, Point]] = {
            "hanging": ((0.08 * out, 0.05, -1), (0.08 * out, 0.05, -1)),
            "forward": ((0, -1, 0.05), (0, -1, 0.05)),
            "sitting": ((0.15 * out, -0.3, -1), (-0.1 * out, -1, -0.1)),
            "twisted": ((0.3 * out, -0.2, -1), (0.6 * out, -0.8, 0.3)),
            "bent": ((0.15 * out, -0.3, -1), (0.15 * out, -0.3, -1)),
            "leaning": (None, ()),
        }
        upper, lower = led[kind]
        limb = [
            joints[f"{side}_{joint}"]
            for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
        ]
        if upper is not None:
            turns += [(limb[0], limb[1], upper), (limb[1], limb[2], lower)]
        if kind == "sitting":
            turns += [(limb[3], limb[4], (0.2 * out, -1, -0.05)), (limb[4], limb[5], (0, 0.1, -1))]
            if f"{side}_foot" in joints:
                turns.append((limb[5], joints[f"{side}_foot"], (0.1 * out, -1, -0.45)))
    return turns, more.get(kind, [])
