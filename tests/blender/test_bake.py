"""Character and baker: what plays in Blender is the take, at any frame rate, and nothing that was
there is lost.
"""

import itertools
import sys
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender import compat
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import (
    character_scale,
    create_character,
)
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.baker import bake
from bl_ext.user_default.dafnet.dafnet_addon.core import root, rotations, skeleton
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.take import Take

from kit.stage import bone_heads


def made_take(frames: int = 40, fps: float = 30.0, scale: float = 1.0, seed: int = 0):
    """A take of smooth random rotations on a curved root path that turns more than once."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, frames)[:, None, None]
    q = rotations.normalised(rng.normal(size=(22, 4)) * (1 - t) + rng.normal(size=(22, 4)) * t)
    q = rotations.continuous_signs(q)
    yaw = np.linspace(-1.0, 8.0, frames)
    path = root.RootPath(np.stack([2 * np.cos(yaw / 3), yaw, 0.3 * yaw / yaw.max()], axis=1), yaw)
    local = rotations.matrix_from_quaternion(q)
    frame, joints = np.empty((frames, 22, 3, 3)), np.empty((frames, 22, 3))
    frame[:, 0], joints[:, 0] = local[:, 0], path.position + np.array([0.02, -0.1, 0.9 * scale])
    for j in range(1, 22):
        parent = skeleton.PARENTS[j]
        frame[:, j] = frame[:, parent] @ local[:, j]
        joints[:, j] = joints[:, parent] + frame[:, parent] @ (scale * skeleton.OFFSETS[j])
    return Take(
        fps=fps,
        joints=joints,
        rotations=q,
        root=path.matrices(),
        action=np.zeros((frames, 10)),
        scale=scale,
        poses=np.zeros((frames, 66)),
        path=path,
    )


def character(bpy: ModuleType, **options):
    return create_character(bpy.context, "Ann", **options)


def test_character_stands_in_the_rest_pose(blender) -> None:
    blender.context.scene.cursor.location = (1.0, 2.0, 0.5)
    ann = character(blender, height=1.4)
    heads = bone_heads(ann, 1)
    assert sorted(bone.name for bone in ann.data.bones) == sorted(skeleton.JOINTS)
    assert np.abs(heads - (0.8 * skeleton.REST + np.array([1.0, 2.0, 0.5]))).max() < 1e-5, (
        "looks along +y, left at -x"
    )
    assert ann.data.bones["left_wrist"].head_local.x > 0.0, (
        "the rig itself looks along -y, left at +x"
    )
    for bone in ann.data.bones:
        assert bone.length > 0.04 * 0.8
    assert tuple(ann.scale) == (1.0, 1.0, 1.0)
    assert ann.dafnet.root.location == blender.context.scene.cursor.location
    assert None not in (ann.dafnet.head, ann.dafnet.hand_left, ann.dafnet.hand_right)


def test_build_makes_the_body_stouter_and_leaves_the_bones(blender) -> None:
    wide = {}
    for build in (0.8, 1.0, 1.4):
        ann = character(blender, build=build)
        body = next(child for child in ann.children if child.type == "MESH")
        points = np.array([v.co for v in body.data.vertices])
        waist = points[(np.abs(points[:, 2] - 1.1) < 0.05) & (np.abs(points[:, 0]) < 0.3)]
        wide[build] = (
            np.ptp(waist[:, 0]),
            np.ptp(points[:, 2]),
            ann.data.bones["spine1"].head_local.copy(),
        )
    assert wide[0.8][0] < 0.9 * wide[1.0][0] and wide[1.4][0] > 1.3 * wide[1.0][0]
    assert wide[0.8][1:] == wide[1.0][1:] == wide[1.4][1:], "as tall, on the same bones"


@pytest.mark.parametrize("build", [0.7, 1.0, 1.4])
def test_body_is_a_closed_person_of_the_stature(blender, build: float) -> None:
    ann = character(blender, height=1.6, build=build)
    body = next(child for child in ann.children if child.type == "MESH")
    points = np.array([v.co for v in body.data.vertices])
    assert np.ptp(points[:, 2]) == pytest.approx(1.6, abs=0.01)
    assert points[:, 2].min() == pytest.approx(0.0, abs=0.003)
    assert all(len(v.groups) == 1 and v.groups[0].weight == 1.0 for v in body.data.vertices)
    assert {group.name for group in body.vertex_groups} == {bone.name for bone in ann.data.bones}
    edges: dict[tuple[int, int], int] = {}
    for face in body.data.polygons:
        for edge in face.edge_keys:
            edges[edge] = edges.get(edge, 0) + 1
    assert set(edges.values()) == {2}
    outward = 0
    for group in body.vertex_groups:
        members = {v.index for v in body.data.vertices if v.groups[0].group == group.index}
        faces = [f for f in body.data.polygons if f.vertices[0] in members]
        volume = sum(np.dot(f.center, f.normal) * f.area for f in faces) / 3.0
        outward += volume > 0.0
    assert outward == 22, "every part has its faces outward"


@pytest.mark.parametrize(("fps", "base"), [(24, 1.0), (25, 1.0), (30, 1.001), (60, 1.0)])
def test_bone_heads_play_the_joints(blender, fps: int, base: float) -> None:
    scene = blender.context.scene
    scene.render.fps, scene.render.fps_base = fps, base
    ann = character(blender)
    take = made_take(fps=fps / base)
    bake(take, ann, 7, "Walk")
    for i in range(len(take)):
        assert np.abs(bone_heads(ann, 7 + i) - take.joints[i]).max() < 1e-3
    assert (scene.render.fps, scene.render.fps_base) == (fps, pytest.approx(base))


SIZES = [(0.01, 1.75, 1.0), (1.0, 1.4, 1.0), (1.0, 1.75, 1.3), (0.5, 1.9, 0.7)]


@pytest.mark.parametrize(("unit", "height", "object_scale"), SIZES)
def test_units_and_sizes(blender, unit: float, height: float, object_scale: float) -> None:
    blender.context.scene.unit_settings.scale_length = unit
    ann = character(blender, height=height)
    ann.scale = (object_scale,) * 3
    size = character_scale(ann, unit)
    assert size == pytest.approx(object_scale * height / 1.75, rel=1e-5)
    take = made_take(scale=size)
    bake(take, ann, 1, "Walk", unit)
    for i in (0, 11, len(take) - 1):
        assert np.abs(unit * bone_heads(ann, 1 + i) - take.joints[i]).max() < 1e-3


def test_bones_may_have_other_rolls_and_tails(blender) -> None:
    ann = character(blender)
    blender.ops.object.mode_set(mode="EDIT")
    for k, bone in enumerate(ann.data.edit_bones):
        bone.roll += 0.3 * k
    ann.data.edit_bones["head"].tail.y -= 0.1
    blender.ops.object.mode_set(mode="OBJECT")
    take = made_take()
    bake(take, ann, 1, "Walk")
    assert np.abs(bone_heads(ann, 20) - take.joints[19]).max() < 1e-3


def test_it_is_smooth_between_frames(blender) -> None:
    """Quaternions and the heading keep their signs, so half-way poses lie between their
    neighbours.
    """
    ann = character(blender)
    take = made_take()
    bake(take, ann, 1, "Walk")
    for i in range(len(take) - 1):
        heads = bone_heads(ann, 1 + i, subframe=0.5)
        assert (
            np.linalg.norm(heads - 0.5 * (take.joints[i] + take.joints[i + 1]), axis=1).max() < 0.06
        )


def test_every_take_is_kept_and_mode_keys_stay(blender) -> None:
    ann = character(blender)
    ann.dafnet.mode = "FREE"
    ann.dafnet.keyframe_insert("mode", frame=1)
    ann.dafnet.mode = "EE"
    ann.dafnet.keyframe_insert("mode", frame=20)
    mine = ann.animation_data.action
    first = bake(made_take(seed=1), ann, 1, "Take")
    second = bake(made_take(seed=2), ann, 1, "Take")
    assert len({mine.name, first.name, second.name}) == 3
    assert ann.animation_data.action == second
    assert all(action.use_fake_user for action in (mine, first, second))
    mode = next(curve for curve in compat.action_curves(ann) if curve.data_path == "dafnet.mode")
    assert [tuple(point.co) for point in mode.keyframe_points] == [(1.0, 0.0), (20.0, 1.0)]
    compat.assign_action(ann, first)
    assert np.abs(bone_heads(ann, 5) - made_take(seed=1).joints[4]).max() < 1e-3


def test_all_other_curves_play_on_as_they_did(blender) -> None:
    """Muted ones, modifiers, extrapolation, handles, groups, samples, custom properties and bones
    that are not joints.
    """
    ann = character(blender)
    own = ann.dafnet
    blender.ops.object.mode_set(mode="EDIT")
    tail = ann.data.edit_bones.new("tail")
    tail.tail = (0, 0.3, 0)
    blender.ops.object.mode_set(mode="OBJECT")
    ann["sparkle"] = ann["shine"] = 0.0
    for path, keys in {
        "mode": ((1, "FREE"), (20, "EE")),
        "head_influence": ((1, 0.0), (6, 1.0), (11, 0.0)),
        "hand_left_influence": ((1, 0.2), (30, 0.8)),
        "hand_right_influence": ((1, 0.9), (9, 0.1)),
    }.items():
        for frame, value in keys:
            setattr(own, path, value)
            ann.keyframe_insert(f"dafnet.{path}", frame=frame, group="Asked For")
    for owner, path in (
        (ann, '["sparkle"]'),
        (ann, '["shine"]'),
        (ann.pose.bones["tail"], "location"),
        (ann, "hide_render"),
    ):
        for frame in (1, 12, 25):
            owner.keyframe_insert(path, frame=frame, group="pelvis")

    curves = {(c.data_path, c.array_index): c for c in compat.action_curves(ann)}
    curves["dafnet.mode", 0].mute = True
    curves["dafnet.head_influence", 0].modifiers.new("CYCLES").mode_after = "REPEAT_OFFSET"
    noise = curves["dafnet.head_influence", 0].modifiers.new("NOISE")
    noise.strength, noise.use_restricted_range, noise.frame_start, noise.frame_end = (
        0.3,
        True,
        5,
        60,
    )
    envelope = curves["dafnet.hand_left_influence", 0].modifiers.new("ENVELOPE")
    for frame in (1.0, 30.0):
        envelope.control_points.add(frame)
    envelope.control_points.foreach_set("min", [-0.2, -2.0])
    right = curves["dafnet.hand_right_influence", 0]
    right.extrapolation = "LINEAR"
    first, last = right.keyframe_points
    first.handle_right_type, first.handle_right = "FREE", (4.0, 1.4)
    last.interpolation, last.easing, last.amplitude, last.period = "ELASTIC", "EASE_IN", 0.7, 3.0
    generator = curves['["sparkle"]', 0].modifiers.new("GENERATOR")
    generator.poly_order, generator.use_additive = 3, True
    generator.coefficients = (0.1, -0.2, 0.03, 0.001)
    stepped = curves['["sparkle"]', 0].modifiers.new("STEPPED")
    stepped.frame_step = 4
    limits = curves['["sparkle"]', 0].modifiers.new("LIMITS")
    limits.use_max_y, limits.max_y = True, 30.0
    curves['["shine"]', 0].keyframe_points[1].co.y = 5.0
    curves['["shine"]', 0].convert_to_samples(1, 25)
    curves['pose.bones["tail"].location', 2].lock = True
    curves["dafnet.mode", 0].group.color_set = "THEME04"
    blender.context.view_layer.update()

    def scene_says() -> list[tuple[Any, ...]]:
        said = []
        for frame in range(-5, 70, 5):
            blender.context.scene.frame_set(frame)
            influences = own.head_influence, own.hand_left_influence, own.hand_right_influence
            said.append((own.mode, *influences, ann["sparkle"], ann["shine"]))
        return said

    times = np.arange(-20.0, 120.0, 0.5)
    played = {place: [curve.evaluate(time) for time in times] for place, curve in curves.items()}
    said = scene_says()
    bake(made_take(), ann, 1, "Take")
    assert scene_says() == said, "the properties that the curves move"
    found = {(c.data_path, c.array_index): c for c in compat.action_curves(ann)}
    for place, values in played.items():
        assert (
            np.abs(np.array([found[place].evaluate(time) for time in times]) - values).max() < 1e-5
        ), place
    assert found["dafnet.mode", 0].mute and found['pose.bones["tail"].location', 2].lock
    group = found["dafnet.mode", 0].group
    assert (
        group.name == "Asked For" and group.color_set == "THEME04" and not found["location", 0].mute
    )
    assert [m.type for m in found['["sparkle"]', 0].modifiers] == ["GENERATOR", "STEPPED", "LIMITS"]


def test_a_muted_group_mutes_what_is_carried_and_not_the_take(blender) -> None:
    ann = character(blender)
    ann.keyframe_insert("dafnet.mode", frame=1, group="pelvis")
    ann.keyframe_insert("dafnet.head_influence", frame=1, group="Own")
    curves = {c.data_path: c for c in compat.action_curves(ann)}
    curves["dafnet.mode"].group.mute = curves["dafnet.head_influence"].group.mute = True
    take = made_take()
    bake(take, ann, 1, "Take")
    curves = {c.data_path: c for c in compat.action_curves(ann)}
    assert curves["dafnet.mode"].mute and curves["dafnet.head_influence"].group.mute
    assert np.abs(bone_heads(ann, 5) - take.joints[4]).max() < 1e-3


def test_what_cannot_be_baked_is_refused_and_left_alone(blender, tmp_path) -> None:
    take = made_take(frames=3)
    ann = character(blender)

    def refused(match: str, character=ann, take=take) -> None:
        actions = set(blender.data.actions)
        with pytest.raises(InputError, match=match):
            bake(take, character, 1, "Walk")
        assert set(blender.data.actions) == actions
        assert character.animation_data is None

    ann.scale = (1.0, 1.0, 2.0)
    refused("unevenly")
    ann.scale = (1.2, 1.2, 1.2)
    refused("size")
    ann.scale = (1.0, 1.0, 1.0)
    ann.parent = ann.dafnet.root
    refused("parent")
    ann.parent = None
    constraint = ann.constraints.new("COPY_LOCATION")
    refused("constraints")
    constraint.mute = True
    ann.delta_location.x = 1.0
    refused("delta")
    ann.delta_location.x = 0.0
    refused("armature", character=ann.dafnet.root)
    joints = take.joints.copy()
    joints[1, 3, 0] = np.nan
    refused("not numbers", take=made_take(frames=3).__class__(**{**vars(take), "joints": joints}))

    blender.context.view_layer.objects.active = ann
    blender.ops.object.mode_set(mode="EDIT")
    refused("edit mode")
    ann.data.edit_bones["left_knee"].tail.z -= 0.1
    ann.data.edit_bones["left_ankle"].head.z -= 0.1
    blender.ops.object.mode_set(mode="OBJECT")
    refused("were moved")

    library = str(tmp_path / "library.blend")
    blender.data.libraries.write(library, {ann})
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with blender.data.libraries.load(library, link=True) as (_, wanted):
        wanted.objects = ["Ann"]
    linked = wanted.objects[0]
    blender.context.scene.collection.objects.link(linked)
    refused("linked", character=linked)
    refused("were moved", character=linked.override_create())


def test_a_longer_take_is_baked_in_as_many_calls(blender) -> None:
    """Keys are handed to Blender curve by curve; one by one they would take a hundred times as
    long.
    """
    ann = character(blender)
    calls = []
    for frames in (30, 30, 300):
        take, count = made_take(frames=frames), itertools.count()
        sys.setprofile(
            lambda frame, event, argument, count=count: (
                next(count) if event.endswith("call") else None
            )
        )
        try:
            bake(take, ann, 1, "Walk")
        finally:
            sys.setprofile(None)
        calls.append(next(count))
    assert calls[2] < calls[1] + 300, "fewer calls more than frames more"
