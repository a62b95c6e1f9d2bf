"""What follows the character is neither its root, nor a target, nor furniture; simulations are read
as they are played.
"""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import create_character
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.settings import settings_of
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing.path_sources import places_over_time
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import job
from bl_ext.user_default.dafnet.dafnet_addon.blender.scene.furniture import furniture_now
from bl_ext.user_default.dafnet.dafnet_addon.blender.scene.scene_reader import read_scene
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError

from kit.stage import Stage


@pytest.fixture
def stage(blender: ModuleType) -> Stage:
    """A character with a root before a chair, whose targets count."""
    made = Stage()
    made.own.mode = "EE"
    made.chair = made.seat("Chair", location=(0, 2, 0))
    made.scene.frame_set(4)
    return made


def drive(owner: Any, path: str, target: Any, read: str, index: int = -1) -> None:
    """Let a property follow another by a driver."""
    curve = owner.driver_add(path, index) if index >= 0 else owner.driver_add(path)
    variable = curve.driver.variables.new()
    variable.name = "read"
    variable.targets[0].id, variable.targets[0].data_path = target, read
    curve.driver.expression = "read"


def falling(stage: Stage, name: str, height: float = 20.0) -> Any:
    """An active rigid body."""
    ball = stage.seat(name, stage.scene.collection, location=(0, 0, height))
    if stage.scene.rigidbody_world is None:
        bpy.ops.rigidbody.world_add()
    stage.select(ball)
    bpy.ops.rigidbody.object_add()
    return ball


def played(stage: Stage, follower: Any, axis: int, first: int, last: int) -> np.ndarray:
    """Where Blender shows an object when the scene is played from its start."""
    places = []
    for frame in range(1, last + 1):
        stage.scene.frame_set(frame)
        evaluated = follower.evaluated_get(bpy.context.evaluated_depsgraph_get())
        places.append(evaluated.matrix_world.translation[axis])
    stage.scene.frame_set(4)
    return np.array(places[first - 1 :])


def names(stage: Stage) -> set[str]:
    """Of the furniture that is read."""
    return {solid.name for solid in stage.read().scene.solids}


def copies(
    stage: Stage, follower: Any, target: Any, kind: str = "COPY_LOCATION", bone: str = ""
) -> Any:
    constraint = follower.constraints.new(kind)
    if kind == "ARMATURE":
        each = constraint.targets.new()
        each.target, each.subtarget = target, bone
    else:
        constraint.target, constraint.subtarget = target, bone
    return constraint


def by_copy_location(stage: Stage, follower: Any) -> None:
    copies(stage, follower, stage.ann, "COPY_LOCATION", "left_wrist")


def by_child_of(stage: Stage, follower: Any) -> None:
    copies(stage, follower, stage.ann, "CHILD_OF", "left_wrist")


def by_armature_constraint(stage: Stage, follower: Any) -> None:
    copies(stage, follower, stage.ann, "ARMATURE", "left_wrist")


def by_a_constraint_switched_on_later(stage: Stage, follower: Any) -> None:
    constraint = copies(stage, follower, stage.ann, "COPY_TRANSFORMS", "left_wrist")
    for frame, value in ((1, 0.0), (20, 1.0)):
        constraint.influence = value
        constraint.keyframe_insert("influence", frame=frame)
    constraint.influence = 0.0


def by_driver(stage: Stage, follower: Any) -> None:
    drive(follower, "location", stage.ann, 'pose.bones["left_wrist"].location[0]', 0)


def by_driven_distance(stage: Stage, follower: Any) -> None:
    curve = follower.driver_add("rotation_euler", 2)
    variable = curve.driver.variables.new()
    variable.type = "TRANSFORMS"
    variable.targets[0].id, variable.targets[0].bone_target = stage.ann, "head"


def by_a_driver_script(stage: Stage, follower: Any) -> None:
    follower.driver_add("location", 0).driver.expression = "bpy.data.objects['Ann'].location[0]"


def by_a_driven_property(stage: Stage, follower: Any) -> None:
    middle = stage.empty("Middle")
    middle["height"] = 0.0
    drive(middle, '["height"]', stage.ann, "location[2]")
    drive(follower, "location", middle, '["height"]', 2)


def by_a_chain(stage: Stage, follower: Any) -> None:
    first, second = stage.empty("First"), stage.empty("Second")
    copies(stage, first, stage.ann, bone="head")
    second.parent = first
    copies(stage, follower, second)


def by_another_rig(stage: Stage, follower: Any) -> None:
    stage.scene.cursor.location = (3, 3, 0)
    rig = create_character(bpy.context, "Rig")
    constraint = rig.pose.bones["head"].constraints.new("COPY_LOCATION")
    constraint.target, constraint.subtarget = stage.ann, "head"
    copies(stage, follower, rig, bone="left_wrist")


def by_a_vertex_of_the_body(stage: Stage, follower: Any) -> None:
    constraint = copies(stage, follower, stage.body, bone=stage.body.vertex_groups[0].name)
    assert constraint.subtarget


def by_shrinkwrap(stage: Stage, follower: Any) -> None:
    follower.constraints.new("SHRINKWRAP").target = stage.body


WAYS = [
    by_copy_location,
    by_child_of,
    by_armature_constraint,
    by_a_constraint_switched_on_later,
    by_driver,
    by_driven_distance,
    by_a_driver_script,
    by_a_driven_property,
    by_a_chain,
    by_another_rig,
    by_a_vertex_of_the_body,
    by_shrinkwrap,
]
Way = Callable[[Stage, Any], None]


@pytest.mark.parametrize("way", WAYS)
def test_what_follows_the_character_is_no_furniture(stage: Stage, way: Way) -> None:
    prop = stage.seat("Cup", location=(0.3, 0.3, 1.0))
    assert names(stage) == {"Chair", "Cup"}
    way(stage, prop)
    read = stage.read()
    assert {solid.name for solid in read.scene.solids} == {"Chair"}
    assert [each for each in read.warnings if "'Cup'" in each] == [
        "Ignored as furniture, since the character moves it: 'Cup'."
    ]
    found = furniture_now(bpy.context, stage.settings())
    assert set(found) == {"Chair"}, "the same for the overlays and for ways round the furniture"


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("role", ["root", "head"])
def test_what_leads_the_character_may_not_follow_it(stage: Stage, way: Way, role: str) -> None:
    way(stage, getattr(stage.ann.dafnet, role))
    stage.cannot_be_read(f"{role}.* follows the character itself")


def test_the_mode_may_not_be_driven_by_the_character(stage: Stage) -> None:
    drive(stage.ann, "dafnet.head_influence", stage.chair, "location[0]")
    stage.read()
    drive(stage.ann, "dafnet.mode", stage.ann, "location[1]")
    stage.cannot_be_read("driver of the mode or an influence of 'Ann' reads the character itself")


def test_the_source_of_the_upper_body_may_not_follow_the_character(stage: Stage) -> None:
    stage.scene.cursor.location = (3, 3, 0)
    bob = create_character(bpy.context, "Bob")
    stage.ann.dafnet.upper_body_source = bob
    constraint = bob.pose.bones["left_wrist"].constraints.new("IK")
    constraint.target, constraint.subtarget = stage.ann, "right_wrist"
    stage.read()  # FREE: nothing is copied
    stage.ann.dafnet.mode = "FULL"
    stage.cannot_be_read("source 'Bob' follows the character itself")
    constraint.mute = True
    stage.read()


def test_a_character_of_another_scene_is_said(stage: Stage) -> None:
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(stage.ann)
    settings = settings_of(stage.ann, other)
    with pytest.raises(InputError, match="scene 'Other' is not the active one; make it active"):
        read_scene(bpy.context, settings)


def shaped_by_armature(stage: Stage, prop: Any) -> None:
    prop.modifiers.new("Armature", "ARMATURE").object = stage.ann


def shaped_by_surface(stage: Stage, prop: Any) -> None:
    prop.modifiers.new("Bound", "SURFACE_DEFORM").target = stage.body


def shaped_by_lattice(stage: Stage, prop: Any) -> None:
    lattice = stage.put(
        bpy.data.objects.new("Cage", bpy.data.lattices.new("Cage")),
        stage.scene.collection,
    )
    lattice.parent = stage.ann
    prop.modifiers.new("Lattice", "LATTICE").object = lattice


def shaped_by_nodes(stage: Stage, prop: Any) -> None:
    tree = bpy.data.node_groups.new("Group", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Object", in_out="INPUT", socket_type="NodeSocketObject")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes = [tree.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput")]
    tree.links.new(nodes[0].outputs[0], nodes[1].inputs[0])
    modifier = prop.modifiers.new("Nodes", "NODES")
    modifier.node_group = tree
    socket = tree.interface.items_tree["Object"].identifier
    if bpy.app.version < (5, 2, 0):
        modifier[socket] = stage.ann
    else:
        getattr(modifier.properties.inputs, socket).value = stage.ann


def shaped_inside_nodes(stage: Stage, prop: Any) -> None:
    inner, outer = (
        bpy.data.node_groups.new(name, "GeometryNodeTree") for name in ("Inner", "Outer")
    )
    inner.nodes.new("GeometryNodeObjectInfo").inputs[0].default_value = stage.body
    outer.nodes.new("GeometryNodeGroup").node_tree = inner
    for tree in (inner, outer):
        tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    outer.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    nodes = [outer.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput")]
    outer.links.new(nodes[0].outputs[0], nodes[1].inputs[0])
    prop.modifiers.new("Nodes", "NODES").node_group = outer


def shaped_by_driven_key(stage: Stage, prop: Any) -> None:
    prop.shape_key_add(name="Basis")
    drive(
        prop.shape_key_add(name="Pressed"), "value", stage.ann, 'pose.bones["pelvis"].location[1]'
    )


@pytest.mark.parametrize(
    "way",
    [
        shaped_by_armature,
        shaped_by_surface,
        shaped_by_lattice,
        shaped_by_nodes,
        shaped_inside_nodes,
        shaped_by_driven_key,
    ],
)
def test_what_the_character_shapes_is_no_furniture_and_may_carry_a_root(
    stage: Stage, way: Way
) -> None:
    prop = stage.seat("Cup")
    assert names(stage) == {"Chair", "Cup"}
    way(stage, prop)
    assert names(stage) == {"Chair"}
    stage.root.parent = prop
    stage.read()  # its place does not depend on its shape
    stage.root.parent_type = "VERTEX"
    stage.cannot_be_read("root.* follows the character itself")


def test_what_only_knows_the_character_is_furniture_and_may_lead_it(stage: Stage) -> None:
    muted = copies(stage, stage.root, stage.ann)
    muted.mute = True
    off = copies(stage, stage.chair, stage.ann)
    off.influence = 0.0
    stage.chair["owner"] = stage.ann
    drive(stage.chair, "color", stage.ann, "location[0]", 0)
    stage.ann["speed"] = 1.0
    stage.ann.update_tag()  # or its evaluated copy would not know the new property
    drive(stage.head, "location", stage.ann, '["speed"]', 2)
    drive(stage.chair, "location", stage.ann, "dafnet.head_influence", 2)
    stage.scene.cursor.location = (3, 3, 0)
    bob = create_character(bpy.context, "Bob")
    bob.dafnet.upper_body_source = stage.ann
    bob.dafnet.hand_left.constraints.new("COPY_LOCATION").target = stage.ann
    copies(stage, stage.ann.dafnet.hand_left, bob, bone="left_wrist")
    cart = stage.seat("Cart")
    cart.parent = stage.root
    read = stage.read()
    assert {solid.name for solid in read.scene.solids} == {"Chair", "Cart"}
    assert read.controls.head[0, 2] == pytest.approx(1.0)


def test_a_held_prop_leaves_the_next_take_as_it_was(stage: Stage) -> None:
    """It was furniture before: pressed twice with one seed, wrists were 17.6 cm apart."""
    stage.scene.frame_end = 60
    for frame, y in ((1, 0.0), (60, 1.2)):
        stage.root.location.y = y
        stage.root.keyframe_insert("location", frame=frame)
    tray = stage.seat("Tray", scale=(1, 1, 0.2))
    copies(stage, tray, stage.ann, "COPY_LOCATION", "left_wrist")
    first, second = (
        job.run(bpy.context, stage.settings(temperature=1.0)).take.joints for _ in range(2)
    )
    assert np.abs(first - second).max() == 0.0


def test_a_root_on_a_rigid_body_is_read_as_it_falls(stage: Stage) -> None:
    copies(stage, stage.root, falling(stage, "Ball"))
    read = stage.read()
    assert np.allclose(read.controls.root[:, 2, 3], played(stage, stage.root, 2, 1, 40), atol=1e-5)
    assert np.ptp(read.controls.root[:, 2, 3]) > 6.0


def test_the_shot_may_begin_while_a_rigid_body_falls(stage: Stage) -> None:
    ball = falling(stage, "Ball")
    stage.furniture.objects.link(ball)
    read = stage.read(frame_start=18)
    falls = next(solid for solid in read.scene.solids if solid.name == "Ball").matrix[:, 2, 3]
    assert np.allclose(falls, played(stage, ball, 2, 18, 40), atol=1e-5) and np.ptp(falls) > 4.0
    assert stage.scene.frame_current == 4


def test_a_root_on_a_cloth_is_read_as_it_hangs(stage: Stage) -> None:
    bpy.ops.mesh.primitive_grid_add(
        x_subdivisions=6, y_subdivisions=6, size=1.0, location=(0, 0, 30)
    )
    cloth = bpy.context.object
    cloth.vertex_groups.new(name="Middle").add([24], 1.0, "REPLACE")
    cloth.modifiers.new("Cloth", "CLOTH")
    copies(stage, stage.root, cloth, bone="Middle")
    read = stage.read(frame_start=5)
    assert np.allclose(read.controls.root[:, 2, 3], played(stage, stage.root, 2, 5, 40), atol=1e-4)
    assert np.ptp(read.controls.root[:, 2, 3]) > 1.0


def test_a_tablecloth_has_the_shape_that_it_has_fallen_into(stage: Stage) -> None:
    bpy.ops.mesh.primitive_grid_add(
        x_subdivisions=6, y_subdivisions=6, size=1.0, location=(0, 0, 2)
    )
    cloth = bpy.context.object
    cloth.modifiers.new("Cloth", "CLOTH")
    stage.furniture.objects.link(cloth)
    read = stage.read(frame_start=20)
    low = (
        next(solid for solid in read.scene.solids if solid.name == cloth.name).vertices[:, 2].min()
    )
    for frame in range(1, 21):
        stage.scene.frame_set(frame)
    evaluated = cloth.evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert (
        low == pytest.approx(min(vertex.co.z for vertex in evaluated.data.vertices), abs=1e-4)
        and low < -0.5
    )
    assert [each for each in read.warnings if "shape" in each and cloth.name in each]


def test_a_simulation_zone_is_read_as_it_grows(stage: Stage) -> None:
    """Each frame lifts a plate's vertices by a centimetre; the root hangs on one of them."""
    tree = bpy.data.node_groups.new("Grows", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    kinds = (
        "NodeGroupInput",
        "GeometryNodeSimulationInput",
        "GeometryNodeSetPosition",
        "GeometryNodeSimulationOutput",
        "NodeGroupOutput",
    )
    source, begin, lift, end, out = (tree.nodes.new(kind) for kind in kinds)
    begin.pair_with_output(end)
    lift.inputs["Offset"].default_value = (0, 0, 0.01)
    for a, b in (
        (source.outputs[0], begin.inputs[0]),
        (begin.outputs["Geometry"], lift.inputs["Geometry"]),
        (lift.outputs[0], end.inputs["Geometry"]),
        (end.outputs["Geometry"], out.inputs[0]),
    ):
        tree.links.new(a, b)
    plate = stage.seat("Plate", stage.scene.collection)
    plate.modifiers.new("Grows", "NODES").node_group = tree
    stage.root.parent, stage.root.parent_type = plate, "VERTEX"
    read = stage.read(frame_start=10)
    assert np.allclose(read.controls.root[:, 2, 3], played(stage, stage.root, 2, 10, 40), atol=1e-5)
    assert np.ptp(read.controls.root[:, 2, 3]) == pytest.approx(0.30, abs=1e-4)


def test_reading_a_simulation_may_be_cancelled_and_notices_a_changed_frame(stage: Stage) -> None:
    copies(stage, stage.root, falling(stage, "Ball"))
    steps = read_scene.steps(bpy.context, stage.settings())
    for _ in range(2):
        next(steps)
    steps.close()
    assert stage.scene.frame_current == 4
    steps = read_scene.steps(bpy.context, stage.settings())
    next(steps)
    stage.scene.frame_set(2)
    with pytest.raises(InputError, match="frame was changed"):
        list(steps)
    assert stage.scene.frame_current == 4


def test_a_simulation_that_the_character_pushes_is_to_be_baked(stage: Stage) -> None:
    ball = falling(stage, "Ball")
    stage.furniture.objects.link(ball)
    assert not stage.read().warnings
    shin = stage.seat("Shin", stage.scene.collection)
    shin.parent, shin.parent_type, shin.parent_bone = stage.ann, "BONE", "left_knee"
    falling(stage, "Other").rigid_body.type = "PASSIVE"
    stage.scene.rigidbody_world.collection.objects.link(shin)
    assert any(
        "push 'Ball'" in each and "bake the simulation" in each for each in stage.read().warnings
    )
    copies(stage, stage.root, ball)
    stage.cannot_be_read("push 'Ball', which moves the root 'Ann Root'; bake the simulation")
    stage.scene.rigidbody_world.point_cache.frame_end = 40
    bpy.ops.ptcache.bake_all(bake=True)
    stage.scene.frame_set(4)
    assert not any("bake" in each for each in stage.read().warnings)


def test_find_furniture_and_root_from_object_see_what_is_played(stage: Stage) -> None:
    ball = falling(stage, "Ball")
    found = places_over_time(bpy.context, ball, [10, 25, 40])[:, 2]
    shown = played(stage, ball, 2, 1, 40)
    assert np.allclose(found, shown[[9, 24, 39]], atol=1e-5) and np.ptp(found) > 4.0
