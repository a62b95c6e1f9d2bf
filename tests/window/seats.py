"""A sofa, a chair that is tucked under a desk, a bed, and two real characters' rigs: by the panel's
buttons.
"""

from pathlib import Path
from typing import Any

import bpy
from bl_ext.user_default.dafnet.dafnet_addon.blender.delivery.rig_trial import real_rig
from first_shot import progress

from kit.window import Driver, Waits

__all__ = ["seats"]

Numbers = tuple[float, float, float]


def _box(name: str, low: Numbers, high: Numbers, parent: Any = None) -> bpy.types.Object:
    """A box in the scene's own collection."""
    mesh = bpy.data.meshes.new(name)
    corners = [
        (x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])
    ]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh.from_pydata(corners, [], faces)
    made = bpy.data.objects.new(name, mesh)
    made.color = (0.35, 0.24, 0.16, 1.0)
    made.parent = parent
    bpy.context.scene.collection.objects.link(made)
    return made


def _sofa() -> bpy.types.Object:
    """Seat, two back cushions and arms, parts of one piece; it faces -y."""
    sofa = _box("Sofa", (-0.9, -0.3, 0.05), (0.9, 0.5, 0.28))
    for k, x in enumerate((-0.7, 0.0)):
        _box(f"Cushion {k}", (x, -0.3, 0.28), (x + 0.7, 0.28, 0.42), sofa)
        _box(f"Back {k}", (x, 0.28, 0.42), (x + 0.7, 0.42, 0.82), sofa)
    for x in (-0.9, 0.7):
        _box("Arm", (x, -0.3, 0.28), (x + 0.2, 0.5, 0.62), sofa)
    _box("Rest", (-0.9, 0.42, 0.28), (0.9, 0.5, 0.78), sofa)
    sofa.location = (-1.4, 2.4, 0.0)
    return sofa


def _desk() -> bpy.types.Object:
    """A desk, and a chair under it, which faces -y."""
    _box("Desk", (0.9, 1.5, 0.70), (2.3, 2.2, 0.74))
    for x in (0.92, 2.24):
        _box("Leg", (x, 1.52, 0.0), (x + 0.04, 2.18, 0.70))
    chair = _box("Chair", (-0.21, -0.2, 0.41), (0.21, 0.22, 0.45))
    for x in (-0.21, 0.17):
        for y in (-0.2, 0.18):
            _box("Chair Leg", (x, y, 0.0), (x + 0.04, y + 0.04, 0.41), chair)
    _box("Chair Back", (-0.21, 0.22, 0.45), (0.21, 0.25, 0.90), chair)
    chair.location = (1.6, 2.2, 0.0)
    return chair


def _bed() -> bpy.types.Object:
    bed = _box("Bed", (-0.5, -1.0, 0.1), (0.5, 1.0, 0.48))
    _box("Headboard", (-0.5, 1.0, 0.0), (0.5, 1.05, 0.9), bed)
    bed.location = (-1.6, -2.4, 0.0)
    return bed


def _only(*selected: bpy.types.Object) -> None:
    """Select these, the first one active."""
    bpy.context.view_layer.update()
    for each in bpy.context.view_layer.objects:
        each.select_set(each in selected)
    bpy.context.view_layer.objects.active = selected[0]


def _again(user: Driver, ann: Any) -> Waits:
    """Ann stands in the middle, without keys."""
    scene = bpy.context.scene
    ann.dafnet.root.animation_data_clear()
    ann.dafnet.root.location, ann.dafnet.root.rotation_euler = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    scene.frame_set(1)
    scene.frame_end = 250
    user.view.spaces.active.region_3d.view_location = (0.0, 1.2, 0.5)
    user.view.spaces.active.region_3d.view_distance = 5.5
    yield 0.3


def _generated(user: Driver, ann: Any, at: Numbers, picture: str) -> Waits:
    """What is keyed is generated; a picture of how it ends, near ``at``."""
    scene, before = bpy.context.scene, len(ann.dafnet.takes)
    _only(ann)
    root = ann.dafnet.root.animation_data.action
    scene.frame_end = int(root.frame_range[1])
    yield from user.click("dafnet.generate(task='NEW')")
    yield from user.until(
        lambda: progress() is None and len(ann.dafnet.takes) == before + 1, picture
    )
    scene.frame_set(scene.frame_end - 10)
    user.view.spaces.active.region_3d.view_location = at
    user.view.spaces.active.region_3d.view_distance = 3.2
    yield 0.5
    yield from user.picture(picture)


def seats(pictures: Path, rigs: Path) -> Waits:
    """Sit on a sofa, on a chair that has to be pulled out, lie on a bed, and bake onto ``rigs``:
    rest poses of real characters.
    """
    user = Driver(pictures)
    scene = bpy.context.scene
    yield from user.press("ESC")
    with user.override():
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete()
    yield from user.sidebar("DAFNet")
    yield from user.click("dafnet.add_character")
    ann = scene.objects["Character"]
    with user.override():
        sofa, chair, bed = _sofa(), _desk(), _bed()
    user.view.spaces.active.shading.color_type = "OBJECT"
    ann.dafnet.seconds = 1.0
    scene.cursor.location = (0.0, -9.0, 0.0)

    yield from _again(user, ann)
    _only(ann, sofa)
    yield from user.click("dafnet.walk_to(goal='SEAT')")
    yield from user.until(lambda: ann.dafnet.root.animation_data is not None, "the way to the sofa")
    assert "Desk" in ann.dafnet.furniture.all_objects, "all that stands around is furniture"
    yield from _generated(user, ann, (-1.4, 2.2, 0.5), "sofa")
    pelvis = ann.matrix_world @ ann.pose.bones["pelvis"].head
    assert abs(pelvis.z - 0.45) < 0.04, f"on the sofa, the pelvis at {pelvis.z:.2f} m"

    yield from _again(user, ann)
    _only(ann, chair)
    yield 0.3
    yield from user.click("dafnet.walk_to(goal='SEAT')")
    yield 2.0
    assert ann.dafnet.root.animation_data is None, "it is tucked under the desk"
    yield from user.picture("tucked")
    row, region = user.mouse[1], user.region("UI")
    user.move(region.x - 500, row - 300)  # away from the message, which closes
    yield 0.5
    yield from user.press("ESC")
    user.move(region.x + region.width - 55, row)
    yield 0.2
    yield from user.press("LEFTMOUSE")
    yield 0.5
    yield from user.picture("ways_to_sit")
    for key in ("DOWN_ARROW", "DOWN_ARROW", "RET"):  # to pulling it out with keys
        yield from user.press(key)
    yield from user.until(lambda: ann.dafnet.root.animation_data is not None, "the way to the desk")
    assert chair.animation_data.action is not None, "its location is keyed"
    yield from _generated(user, ann, (1.6, 2.2, 0.5), "desk")
    pelvis = ann.matrix_world @ ann.pose.bones["pelvis"].head
    assert abs(pelvis.z - 0.56) < 0.04, f"at the desk, the pelvis at {pelvis.z:.2f} m"

    for file in sorted(rigs.glob("*.json")):
        with user.override():
            rig = real_rig(file)
        rig.data.display_type, rig.show_in_front = "STICK", True
        _only(rig)
        yield 0.3
        yield from user.click("dafnet.detect_rig")
        yield from user.click("dafnet.bake_to_rig")
        yield from user.until(
            lambda rig=rig: bool(rig.animation_data and rig.animation_data.action), file.stem, 120
        )
        scene.frame_set(scene.frame_end - 10)
        yield 0.5
        yield from user.picture(f"rig_{file.stem}")
        rig.hide_set(True)

    yield from _again(user, ann)
    _only(ann, bed)
    yield 0.3
    yield from user.click("dafnet.lie_on")
    yield from user.until(lambda: ann.dafnet.root.animation_data is not None, "the way to the bed")
    yield from _generated(user, ann, (-1.6, -2.4, 0.5), "bed")
