"""Scene reader: what the core is handed is what Blender shows, in metres."""

from types import ModuleType

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import create_character
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.settings import settings_of
from bl_ext.user_default.dafnet.dafnet_addon.blender.compat import action_curves
from bl_ext.user_default.dafnet.dafnet_addon.blender.scene.scene_reader import read_scene
from bl_ext.user_default.dafnet.dafnet_addon.core import skeleton

from kit.stage import Stage, box_corners, key


@pytest.fixture
def stage(blender: ModuleType) -> Stage:
    made = Stage(frames=(1, 10))
    made.own.mode = "EE"
    made.scene.frame_set(4)
    return made


def corners(solid, frame: int = 0) -> np.ndarray:
    matrix = solid.matrix if solid.matrix.ndim == 2 else solid.matrix[frame]
    return solid.vertices @ matrix[:3, :3].T + matrix[:3, 3]


def box(points: np.ndarray) -> np.ndarray:
    return np.stack([points.min(axis=0), points.max(axis=0)])


def test_transformed_and_modified_meshes(stage: Stage) -> None:
    parent = stage.put(bpy.data.objects.new("Parent", None), location=(5, 0, 0), scale=(2, 2, -2))
    stage.box("Child", parent=parent, location=(1, 0, 0), scale=(1, 3, 1))
    array = stage.box("Array", location=(0, 0, 4)).modifiers.new("Array", "ARRAY")
    array.count = 3
    nested = bpy.data.collections.new("Nested")
    stage.furniture.children.link(nested)
    stage.box("Deep", collection=nested, location=(0, 9, 0))
    solids = {solid.name: solid for solid in stage.read().scene.solids}
    assert set(solids) == {"Child", "Array", "Deep"}
    assert np.allclose(box(corners(solids["Child"])), [[5, -6, -2], [9, 6, 2]])
    assert np.linalg.det(solids["Child"].matrix[:3, :3]) < 0
    assert np.allclose(box(corners(solids["Array"])), [[-1, -1, 3], [5, 1, 5]])
    assert np.allclose(box(corners(solids["Deep"])), [[-1, 8, -1], [1, 10, 1]])
    assert all(
        solid.matrix.shape == (4, 4) and len(solid.triangles) % 12 == 0 for solid in solids.values()
    )


def test_collection_and_geometry_nodes_instances(stage: Stage) -> None:
    chairs = bpy.data.collections.new("Chairs")
    stage.box("Leg", collection=chairs, location=(0, 0, 1), scale=(0.1, 0.1, 1))
    stage.box("Seat", collection=chairs, location=(0, 0, 2))
    instancer = stage.put(bpy.data.objects.new("Chair", None), instance_type="COLLECTION")
    instancer.instance_collection = chairs
    key(instancer, "location", (1, (0, 0, 0)), (10, (9, 0, 0)))

    grid = stage.box("Grid")
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    kinds = (
        "NodeGroupInput",
        "GeometryNodeInstanceOnPoints",
        "GeometryNodeMeshUVSphere",
        "NodeGroupOutput",
    )
    source, points, sphere, out = (tree.nodes.new(kind) for kind in kinds)
    tree.links.new(source.outputs[0], points.inputs["Points"])
    tree.links.new(sphere.outputs["Mesh"], points.inputs["Instance"])
    tree.links.new(points.outputs[0], out.inputs[0])
    grid.modifiers.new("Scatter", "NODES").node_group = tree
    grid.location = (0, 0, 10)

    solids = stage.read().scene.solids
    chair = [solid for solid in solids if solid.name == "Chair"]
    spheres = [solid for solid in solids if solid.name == "Grid"]
    assert len(chair) == 2 and len(spheres) == 8 and len(solids) == 10
    for solid in chair:
        assert solid.matrix.shape == (10, 4, 4)
        assert corners(solid, 9).mean(axis=0)[0] == pytest.approx(9.0, abs=1e-5)
    assert len({id(solid.vertices) for solid in spheres}) == 1, "instances share their geometry"
    centres = np.array([solid.matrix[:3, 3] for solid in spheres])
    assert np.allclose(np.sort(centres[:, 2]), [9] * 4 + [11] * 4)


def test_curves_text_and_hidden_objects(stage: Stage) -> None:
    curve = bpy.data.curves.new("Rail", "CURVE")
    curve.dimensions = "3D"
    curve.bevel_depth = 0.1
    curve.splines.new("POLY").points.add(1)
    curve.splines[0].points[1].co = (2, 0, 0, 1)
    stage.put(bpy.data.objects.new("Rail", curve), location=(0, 0, 1))
    stage.box("Hidden").hide_viewport = True
    stage.box("Unrendered").hide_render = True
    assert {solid.name for solid in stage.read().scene.solids} == {"Rail", "Unrendered"}


def test_moving_furniture_has_a_matrix_for_each_frame(stage: Stage) -> None:
    chair = stage.box("Chair")
    key(chair, "location", (1, (0, 0, 0)), (10, (9, 0, 0)))
    for curve in action_curves(chair):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    still = stage.box("Still")
    still.scale = (2, 1, 1)
    read = {solid.name: solid for solid in stage.read(frame_start=2, frame_end=6).scene.solids}
    assert read["Chair"].matrix.shape == (5, 4, 4)
    assert np.allclose(read["Chair"].matrix[:, 0, 3], [1, 2, 3, 4, 5])
    assert read["Still"].matrix.shape == (4, 4)
    assert stage.scene.frame_current == 4


def test_the_character_and_its_empties_are_no_furniture(stage: Stage) -> None:
    for made in (stage.ann, *stage.ann.children, stage.ann.dafnet.root, stage.ann.dafnet.head):
        stage.furniture.objects.link(made)
    hat = stage.box("Hat")
    hat.parent, hat.parent_type, hat.parent_bone = stage.ann, "BONE", "head"
    coat = stage.box("Coat")
    coat.modifiers.new("Armature", "ARMATURE").object = stage.ann
    stage.box("Chair")
    assert [solid.name for solid in stage.read().scene.solids] == ["Chair"]


def test_units(stage: Stage) -> None:
    stage.scene.unit_settings.system = "METRIC"
    stage.scene.unit_settings.scale_length = 0.01
    bob = create_character(bpy.context, "Bob", 1.75)
    bob.dafnet.furniture, bob.dafnet.mode, stage.ann = stage.furniture, "EE", bob
    bob.dafnet.root.location = (100, 200, 0)
    bob.dafnet.head.location = (0, 0, 150)
    stage.box("Chair", location=(300, 0, 0), scale=(50, 50, 50))
    read = stage.read()
    assert read.controls.scale == pytest.approx(1.0, abs=1e-5)
    assert np.allclose(read.controls.root[0, :3, 3], (1, 2, 0))
    assert np.allclose(read.controls.root[0, :3, :3], np.eye(3))
    assert np.allclose(read.controls.head[0], (0, 0, 1.5))
    assert np.allclose(box(corners(read.scene.solids[0])), [[2.5, -0.5, -0.5], [3.5, 0.5, 0.5]])
    stage.scene.unit_settings.system = "NONE"
    assert np.allclose(stage.read().controls.root[0, :3, 3], (100, 200, 0))


def test_the_root_follows_whatever_drives_it(stage: Stage) -> None:
    cart = stage.put(bpy.data.objects.new("Cart", None), stage.scene.collection, scale=(3, 3, 3))
    key(cart, "rotation_euler", (1, (0, 0, 0)), (10, (0, 0, 3)))
    key(cart, "location", (1, (0, 0, 0)), (10, (9, 0, 0)))
    constraint = stage.ann.dafnet.root.constraints.new("COPY_TRANSFORMS")
    constraint.target = cart
    stage.ann.dafnet.furniture = None
    read = stage.read()
    expected = []
    for frame in range(1, 11):
        stage.scene.frame_set(frame)
        expected.append(np.array(cart.matrix_world.normalized()))
    assert np.allclose(read.controls.root, expected, atol=1e-5)
    assert len(read.controls) == 10 and read.scene.solids == ()
    stage.scene.render.fps, stage.scene.render.fps_base = 30, 1.001
    assert stage.read().controls.fps == pytest.approx(30 / 1.001)


def test_a_hidden_root_moves_and_a_disabled_one_is_refused(stage: Stage) -> None:
    stage.ann.dafnet.furniture = None
    root = stage.ann.dafnet.root
    key(root, "location", (1, (0, 0, 0)), (10, (9, 0, 0)))
    root.hide_set(True)
    assert np.ptp(stage.read().controls.root[:, 0, 3]) == pytest.approx(9.0)
    root.hide_viewport = True
    stage.cannot_be_read("'Ann Root'.*disabled in viewports")
    root.hide_viewport = False
    bpy.context.view_layer.layer_collection.children["Ann"].exclude = True
    stage.cannot_be_read("'Ann'.*disabled in viewports")


def test_targets_and_when_their_rotation_counts(stage: Stage) -> None:
    own = stage.ann.dafnet
    stage.box("Chair")
    own.hand_right = None
    cart = stage.put(
        bpy.data.objects.new("Cart", None), stage.scene.collection, rotation_euler=(0, 0, 1)
    )
    own.hand_left.parent = cart
    own.hand_left.location = (1, 0, 0)
    own.head.rotation_euler = (0, 0, 0.5)
    controls = stage.read().controls
    assert controls.hand_right is None and controls.hand_right_rotation is None
    assert np.allclose(controls.hand_left[3], (np.cos(1), np.sin(1), 0), atol=1e-6)
    assert controls.hand_left_rotation is None, "turned with its parent only"
    assert np.allclose(controls.head_rotation[3, :, 1], (-np.sin(0.5), np.cos(0.5), 0), atol=1e-6)
    own.hand_left.keyframe_insert("rotation_euler", frame=1)
    assert stage.read().controls.hand_left_rotation.shape == (10, 3, 3), "keyed, so meant"


def test_feet_are_read_as_hands_are(stage: Stage) -> None:
    own = stage.ann.dafnet
    stage.box("Chair")
    assert stage.read().controls.foot_left is None
    for role in ("foot_left", "foot_right"):
        empty = bpy.data.objects.new(role, None)
        setattr(own, role, stage.put(empty, stage.scene.collection, location=(1.0, 2.0, 0.1)))
    own.foot_right.rotation_euler = (0.0, 0.0, 0.5)
    key(own, "foot_left_influence", (1, 0.0), (10, 1.0))
    own.foot_left_influence = 0.0
    controls = stage.read().controls
    assert np.allclose(controls.foot_left[3], (1.0, 2.0, 0.1), atol=1e-6)
    assert controls.foot_left_rotation is None and controls.foot_right_influence is None
    turned = controls.foot_right_rotation[3, :, 1]
    assert np.allclose(turned, (-np.sin(0.5), np.cos(0.5), 0), atol=1e-6)
    own.foot_left.parent = stage.ann
    stage.cannot_be_read("left foot target .*follows the character itself")


def test_furniture_says_how_soft_it_is(stage: Stage) -> None:
    sofa = stage.box("Sofa")
    (solid,) = stage.read().scene.solids
    assert solid.softness is None, "to be guessed"
    sofa.dafnet.guess_softness, sofa.dafnet.softness = False, 6.0
    (solid,) = stage.read().scene.solids
    assert abs(solid.softness - 0.06) < 1e-7


def test_the_mode_of_each_frame(stage: Stage) -> None:
    stage.box("Chair")
    stage.own.mode = "FREE"
    assert stage.read().controls.mode == "FREE"
    stage.ann.dafnet.mode = "EE"
    assert stage.read().controls.mode == "EE"
    for frame, mode in ((1, "FREE"), (5, "EE"), (8, "FREE")):
        stage.ann.dafnet.mode = mode
        stage.ann.dafnet.keyframe_insert("mode", frame=frame)
    assert stage.read().controls.mode == ("FREE",) * 4 + ("EE",) * 3 + ("FREE",) * 3
    assert stage.read(mode="EE").controls.mode == "EE"


def test_the_upper_body_of_another_character(stage: Stage) -> None:
    """A source on its own root is carried to ours; its size and its place do not matter."""
    stage.scene.cursor.location = (4, 5, 0.2)
    bob = create_character(bpy.context, "Bob", 1.4)
    bob.rotation_euler.z += 0.7
    bob.pose.bones["left_shoulder"].rotation_quaternion = (0.9, 0.1, 0.4, 0.1)
    stage.ann.dafnet.root.location = (1, 0, 0)
    stage.ann.dafnet.upper_body_source = bob
    stage.box("Chair")
    stage.ann.dafnet.mode = "FULL"
    upper = stage.read().controls.upper_body
    assert upper.shape == (10, 14, 3)
    rest = skeleton.REST[list(skeleton.UPPER)] + np.array([1, 0, 0])
    arm = [skeleton.UPPER.index(j) for j in (18, 20)]
    others = [k for k in range(14) if k not in arm]
    assert np.abs(upper[0][others] - rest[others]).max() < 1e-4
    assert np.abs(upper[0][arm] - rest[arm]).max() > 0.1

    bob.dafnet.root = None
    found = stage.read().controls.upper_body
    assert np.abs(found[0][others] - rest[others]).max() < 0.02, (
        "the root is found from hips and shoulders"
    )
    stage.ann.dafnet.upper_body_source = None
    stage.cannot_be_read("no source")


def test_the_lower_body_of_another_character(stage: Stage) -> None:
    """Alone, and beside another one's upper body; carried to our root and size as that is."""
    stage.scene.cursor.location = (4, 5, 0.2)
    bob = create_character(bpy.context, "Bob", 1.4)
    bob.pose.bones["left_knee"].rotation_quaternion = (0.9, 0.4, 0.0, 0.0)
    stage.ann.dafnet.root.location = (1, 0, 0)
    stage.ann.dafnet.lower_body_source = bob
    stage.box("Chair")
    stage.ann.dafnet.mode = "FULL"
    controls = stage.read().controls
    assert controls.lower_body.shape == (10, 8, 3) and controls.upper_body is None
    rest = skeleton.REST[list(skeleton.LOWER)] + np.array([1, 0, 0])
    shin = [skeleton.LOWER.index(skeleton.joint(f"left_{name}")) for name in ("ankle", "foot")]
    others = [k for k in range(8) if k not in shin]
    assert np.abs(controls.lower_body[0][others] - rest[others]).max() < 1e-4
    assert np.abs(controls.lower_body[0][shin] - rest[shin]).max() > 0.1

    stage.ann.dafnet.upper_body_source = bob
    both = stage.read().controls
    assert both.upper_body.shape == (10, 14, 3)
    assert np.array_equal(both.lower_body, controls.lower_body)
    stage.ann.dafnet.lower_body_source = stage.ann.dafnet.upper_body_source = None
    stage.cannot_be_read("no source")


@pytest.mark.parametrize(
    "values",
    [((1, 0.0), (10, 1.0)), ((1, 0.0), (3, 1.0), (5, 0.0)), ((1, 0.0), (9, 1.0), (10, 0.0))],
)
def test_changing_shapes_are_warned_about(
    stage: Stage, values: tuple[tuple[int, float], ...]
) -> None:
    """Also where the shape is the first one again in the middle and at the end."""
    stage.box("Rigid")
    soft = stage.box("Soft")
    soft.shape_key_add(name="Basis")
    pressed = soft.shape_key_add(name="Pressed")
    pressed.data[0].co.z += 0.5
    key(pressed, "value", *values)
    assert stage.read().warnings == (
        "The shape of 'Soft' changes during the shot; its shape at the first frame is used.",
    )


def test_shapes_that_others_change_and_instances_are_warned_about(stage: Stage) -> None:
    """A modifier's object moves; a node group builds another mesh from frame 4 on."""
    plate = stage.box("Plate")
    hook = stage.put(bpy.data.objects.new("Hook", None), stage.scene.collection)
    key(hook, "location", (1, (0, 0, 0)), (4, (0, 0, 1)), (5, (0, 0, 0)))
    modifier = plate.modifiers.new("Hook", "HOOK")
    modifier.object, modifier.strength = hook, 1.0
    modifier.vertex_indices_set([0, 1, 2])
    chairs = bpy.data.collections.new("Chairs")
    seat = stage.box("Seat", collection=chairs)
    seat.shape_key_add(name="Basis")
    sunk = seat.shape_key_add(name="Sunk")
    sunk.data[0].co.z -= 0.5
    key(sunk, "value", (1, 0.0), (6, 1.0), (7, 0.0))
    chair = stage.put(bpy.data.objects.new("Chair", None), instance_type="COLLECTION")
    chair.instance_collection = chairs
    array = stage.box("Row").modifiers.new("Array", "ARRAY")
    key(array, "count", (1, 2), (8, 3), (9, 2))
    changed = [each for each in stage.read().warnings if "shape" in each]
    assert len(changed) == 3 and all(
        any(f"'{name}'" in each for each in changed) for name in ("Plate", "Chair", "Row")
    )


def test_what_is_shown_or_hidden_during_the_shot_is_said(stage: Stage) -> None:
    stage.box("Always")
    leaves, comes, flickers = (stage.box(name) for name in ("Leaves", "Comes", "Flickers"))
    key(leaves, "hide_viewport", (1, False), (6, True))
    key(comes, "hide_viewport", (1, True), (6, False))
    key(flickers, "hide_viewport", (1, False), (4, True), (5, False))
    read = stage.read()
    assert {solid.name for solid in read.scene.solids} == {"Always", "Leaves", "Flickers"}
    assert set(read.warnings) == {
        f"'{name}' is shown or hidden during the shot; it counts throughout as it does at the "
        "first frame."
        for name in ("Leaves", "Comes", "Flickers")
    }
    assert not stage.read(frame_start=6).warnings, "nothing of it changes any more"


def test_instances_that_come_and_go_are_said(stage: Stage) -> None:
    chairs = bpy.data.collections.new("Chairs")
    blinking = stage.box("Seat", collection=chairs)
    stage.box("Leg", collection=chairs)
    key(blinking, "hide_viewport", (1, False), (5, True), (6, False))
    chair = stage.put(bpy.data.objects.new("Chair", None), instance_type="COLLECTION")
    chair.instance_collection = chairs
    read = stage.read()
    assert len(read.scene.solids) == 2
    assert [each for each in read.warnings if "shown or hidden" in each and "'Chair'" in each]


def test_helpers_are_no_furniture_and_doubtful_objects_are_named(stage: Stage) -> None:
    """What no picture shows and the viewport draws through, or what cuts, is there for the modeller
    alone.
    """
    wall = stage.box("Wall")
    modifier = wall.modifiers.new("Door", "BOOLEAN")
    modifier.object = stage.box("Cutter", display_type="WIRE", hide_render=True)
    cutters = bpy.data.collections.new("Cutters")
    stage.furniture.children.link(cutters)
    cutters.hide_render = True
    stage.box("Window Cutter", collection=cutters)
    second = wall.modifiers.new("Windows", "BOOLEAN")
    second.operand_type, second.collection = "COLLECTION", cutters
    stage.box("Cage", display_type="BOUNDS", hide_render=True)
    stage.box("Heavy Sofa", display_type="BOUNDS")
    stage.box("Proxy", hide_render=True)
    union = wall.modifiers.new("Shelf", "BOOLEAN")
    union.object, union.operation = stage.box("Shelf"), "UNION"
    read = stage.read()
    assert {solid.name for solid in read.scene.solids} == {"Wall", "Heavy Sofa", "Proxy", "Shelf"}
    helpers, doubtful = read.warnings
    assert "'Cage', 'Cutter', 'Window Cutter'; let" in helpers
    assert "'Heavy Sofa', 'Proxy'; hide" in doubtful


def test_bad_input_is_refused_in_one_sentence(stage: Stage) -> None:
    stage.cannot_be_read("no visible mesh")
    stage.mesh("Wire", box_corners((-1, -1, -1), (1, 1, 1)), [])
    stage.cannot_be_read("no faces")
    chair = stage.box("Chair")
    chair.location.x = np.nan
    stage.cannot_be_read("'Chair'.*not a number")
    chair.location.x = 0.0
    own = stage.ann.dafnet
    own.root.location.x = np.nan
    stage.cannot_be_read("root.*not a number")
    own.root.location.x = 0.0
    own.head.location.x = np.nan
    stage.cannot_be_read("head target.*not a number")
    own.head.location.x = 0.0
    stage.cannot_be_read("before its start", frame_start=10, frame_end=9)
    stage.cannot_be_read("unknown", mode="FRE")
    stage.cannot_be_read("no root", root=None)
    stage.cannot_be_read("'Gone' is not in the scene", root="Gone")
    stage.cannot_be_read("'Gone' is not in this file", furniture="Gone")
    bpy.ops.object.select_all(action="DESELECT")
    own.head.select_set(True)
    bpy.ops.object.delete()
    assert own.head is not None, "the property still holds the deleted object"
    stage.cannot_be_read("head target.*is not in the scene")
    assert len(stage.read(mode="FREE").scene.solids) == 1, "nothing asks for her head there"
    own.head = None
    assert len(stage.read().scene.solids) == 1


def test_what_no_mode_that_plays_asks_for_is_not_missed(stage: Stage) -> None:
    """A head that is gone and a rig whose bones nobody knows, left over from other modes."""
    stage.box("Chair")
    own, rig = stage.own, stage.put(bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig")))
    bpy.data.objects.remove(own.hand_left)
    for collection in own.head.users_collection:
        collection.objects.unlink(own.head)
    own.upper_body_source = rig

    stage.cannot_be_read("head target.*is not in the scene", mode="EE")
    stage.cannot_be_read("'Rig'", mode="FULL")
    assert stage.read(mode="FREE").controls.head is None

    own.mode = "FREE"
    assert stage.read().controls.mode == "FREE"
    key(own, "mode", (1, "FREE"))
    assert stage.read().controls.mode == "FREE", "keyed, but to nothing else"
    key(own, "mode", (5, "EE"))
    stage.cannot_be_read("head target.*is not in the scene")


def test_the_frame_is_kept_while_reading(stage: Stage) -> None:
    stage.box("Chair")
    stage.scene.frame_set(3, subframe=0.25)
    settings = settings_of(stage.ann, stage.scene, frame_end=100)
    progress = []
    for share in read_scene.steps(bpy.context, settings):
        progress.append(share)
        assert (stage.scene.frame_current, stage.scene.frame_subframe) == (3, 0.25)
    assert len(progress) > 5 and progress == sorted(progress) and progress[-1] == 1.0
