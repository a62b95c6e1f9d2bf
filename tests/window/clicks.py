"""How many clicks a first shot takes, from the menu to a kept take, and a walk that is made anew
after the seat was moved.
"""

from math import degrees, radians
from pathlib import Path

import bpy
from first_shot import progress
from mathutils import Vector

from kit.window import Driver, Waits

__all__ = ["clicks"]

_MOST = 12
"""Clicks and keys of a first shot, at most; a typed word counts as one."""


def _generated(user: Driver, takes: int) -> Waits:
    """Press Generate, and wait for the take."""
    yield from user.click("dafnet.generate(task='NEW')")
    character = next(o for o in bpy.context.scene.objects if len(o.dafnet.walks) or o.dafnet.root)
    yield from user.until(
        lambda: progress() is None and len(character.dafnet.takes) == takes, "the take", 600.0
    )


def _kept(user: Driver, character: bpy.types.Object) -> Waits:
    """Tick the box of the take that plays."""
    yield from user.find("dafnet.play_take(", across=0.1)
    yield from user.click_near("dafnet.accepted", user.mouse[1])
    take = character.dafnet.takes[0].action
    yield from user.until(lambda: bool(take.dafnet.accepted), "the tick of the mouse", 10.0)


def _example(user: Driver) -> Waits:
    """The example of the Add menu beside the default cube."""
    yield from user.menu("A", "Chair and Desk")
    character = bpy.context.object
    assert character is not None and character.type == "ARMATURE", "the example is added"
    cube = bpy.data.objects["Cube"]
    assert all(
        abs(o.location.y) + abs(o.location.x) > 1.5 for o in character.dafnet.furniture.objects
    )
    assert cube.location.length == 0.0
    yield from user.sidebar("DAFNet")
    yield from _generated(user, 1)
    yield from user.picture("first_take_of_the_example")
    yield from _kept(user, character)
    print(f"The example: {user.clicks} clicks", flush=True)
    assert user.clicks <= _MOST


def _own_room(user: Driver) -> Waits:
    """A seat of one's own: sent there, generated, kept; then the seat is moved."""
    with user.override():
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete()
        bpy.ops.mesh.primitive_cylinder_add(radius=0.24, depth=0.45, location=(1.6, 1.2, 0.225))
    stool = bpy.context.object
    stool.name = "Stool"
    bpy.ops.ed.undo_push(message="Room")
    user.clicks = 0
    yield from user.menu("A", "Character")
    character = bpy.context.object
    assert character is not stool and character.type == "ARMATURE", "the character is added"
    yield from user.sidebar("DAFNet")
    user.select(stool)
    yield 0.3
    yield from user.click("dafnet.walk_to(goal='SEAT'")
    yield from user.until(
        lambda: len(character.dafnet.walks) == 1, "the walk, with the seat alone selected", 60.0
    )
    assert bpy.context.window_manager.dafnet_overlays.path, "the path is drawn at once"
    yield from user.picture("path_of_a_walk")
    yield from _generated(user, 1)
    yield from _kept(user, character)
    print(f"In one's own room: {user.clicks} clicks", flush=True)
    assert user.clicks <= _MOST

    before = user.clicks
    assert bpy.context.object == stool, "the seat is still the active object"
    stool.location.x -= 1.0
    bpy.ops.ed.undo_push(message="Move")
    place = character.dafnet.walks[0].digest
    yield from user.click("dafnet.redo_walk")
    yield from user.until(
        lambda: progress() is None and character.dafnet.walks[0].digest != place, "the walk", 60.0
    )
    end = character.dafnet.walks[0].last
    bpy.context.scene.frame_set(end)
    assert (character.dafnet.root.location.xy - stool.location.xy).length < 0.3, "to where it is"
    character.dafnet.lean = radians(20.0)
    yield from _generated(user, 2)
    bpy.context.scene.frame_set(end)
    pelvis = character.matrix_world @ character.pose.bones["pelvis"].head
    assert (pelvis.xy - stool.location.xy).length < 0.3 and abs(pelvis.z - 0.57) < 0.1
    assert user.clicks - before == 2
    trunk = character.matrix_world @ character.pose.bones["neck"].head - pelvis
    print(f"Leans {degrees(trunk.angle(Vector((0.0, 0.0, 1.0)))):.0f} degrees", flush=True)
    yield from user.picture("redone_walk")

    # Keys that were edited are asked about: not by Esc, but by the button are they replaced.
    edited, names = character.dafnet.root, {each.name for each in bpy.data.actions}
    edited.location.x += 0.3
    edited.keyframe_insert("location", frame=end - 60)
    bpy.ops.ed.undo_push(message="Edit")
    yield from user.click("dafnet.redo_walk")
    yield 0.7
    yield from user.picture("replace_edited_keys")
    yield from user.press("ESC")
    yield 0.7
    assert {each.name for each in bpy.data.actions} == names
    yield from user.click("dafnet.redo_walk")
    yield 0.7
    yield from user.press("RET")
    yield from user.until(
        lambda: any(each.name.endswith(" before redo") for each in bpy.data.actions),
        "the copy of the keys",
        30.0,
    )

    with user.override():
        bpy.ops.dafnet.add_character(name="Bob")
    user.select(next(child for child in character.children if child.type == "MESH"))
    yield 0.5
    user.select(stool)
    yield 0.5
    assert character.dafnet.chosen, "the tab is whose body was selected last"


def clicks(pictures: Path) -> Waits:
    """Count them."""
    user = Driver(pictures)
    yield from user.press("ESC")  # the splash screen
    user.clicks = 0
    yield from _example(user)
    bpy.ops.wm.read_homefile(app_template="")
    yield 0.5
    user = Driver(pictures)
    yield from user.press("ESC")
    yield from _own_room(user)
