"""Live, with the mouse: a character follows a dragged root onto a stool and away, a way is drawn,
what was recorded is a take, and all of it is one step of undo.
"""

from pathlib import Path

import bpy
from bpy_extras import view3d_utils
from first_shot import look, new_stool, only
from mathutils import Vector

from kit.window import Driver, Waits

__all__ = ["drag", "draw", "live", "pelvis_of", "running"]


def _at(user: Driver, place: tuple[float, float, float]) -> tuple[int, int]:
    """Where the window shows a place of the scene."""
    region = user.region("WINDOW")
    view = user.view.spaces.active.region_3d
    x, y = view3d_utils.location_3d_to_region_2d(region, view, Vector(place))
    return region.x + int(x), region.y + int(y)


def _slide(user: Driver, *places: tuple[float, float, float], steps: int = 12) -> Waits:
    """Move the mouse over places of the scene, as a hand does."""
    for place in places:
        start, goal = user.mouse, _at(user, place)
        for k in range(1, steps + 1):
            share = k / steps
            user.move(
                *(round((1 - share) * a + share * b) for a, b in zip(start, goal, strict=True))
            )
            yield 0.04


def drag(user: Driver, *places: tuple[float, float, float]) -> Waits:
    """Move what is selected with G, over the floor, and let it go at the last place."""
    user.move(*_at(user, tuple(bpy.context.object.location)))
    yield 0.1
    yield from user.press("G")
    yield from user.press("Z", shift=True)
    yield from _slide(user, *places)
    yield from user.press("LEFTMOUSE")


def draw(user: Driver, start: tuple[float, float, float], *places: tuple[float, ...]) -> Waits:
    """Press *Draw a Way* and draw one over the floor."""
    yield from user.click("dafnet.live_draw")
    user.move(*_at(user, start))
    user.window.event_simulate("LEFTMOUSE", "PRESS", x=user.mouse[0], y=user.mouse[1])
    yield 0.1
    yield from _slide(user, *places)
    user.window.event_simulate("LEFTMOUSE", "RELEASE", x=user.mouse[0], y=user.mouse[1])


def pelvis_of(character: bpy.types.Object) -> Vector:
    """Where a character's pelvis is, in the world."""
    return character.matrix_world @ character.pose.bones["pelvis"].head


def running() -> bool:
    """Whether Live runs."""
    return bool(bpy.ops.dafnet.live_record.poll())


def live(pictures: Path) -> Waits:
    """Every step with the mouse, and a picture of some."""
    user = Driver(pictures)
    scene = bpy.context.scene
    yield from user.press("ESC")  # the splash screen
    with user.override():
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete()
        bpy.ops.dafnet.add_character()
        stool = new_stool()
    ann = scene.objects["Character"]
    own = ann.dafnet
    own.furniture = bpy.data.collections["Studio"]
    root = own.root
    look(user, (0.6, 0.7, 0.6), 5.0)
    only(root)
    bpy.ops.ed.undo_push(message="Studio")
    yield from user.sidebar("DAFNet")

    def pelvis() -> Vector:
        return pelvis_of(ann)

    def nothing_moved() -> None:
        assert tuple(own.root.location) == (0.0, 0.0, 0.0)
        assert all(tuple(b.rotation_quaternion) == (1, 0, 0, 0) for b in ann.pose.bones)
        assert bpy.context.preferences.edit.use_global_undo

    def started() -> Waits:
        yield from user.click("dafnet.live()")
        yield from user.until(running, "Live")

    # Dragged, and put back with Esc; while the preferences are shown, they are the user's.
    yield from started()
    edit = bpy.context.preferences.edit
    area = next(each for each in user.window.screen.areas if each.type == "OUTLINER")
    for kind, undoes in (("PREFERENCES", True), ("OUTLINER", False)):
        area.type = kind
        yield from user.until(
            lambda undoes=undoes: edit.use_global_undo == undoes, f"undo with {kind}", 5.0
        )
    yield from drag(user, (1.2, 0.0, 0.0), (1.4, 1.0, 0.0))
    yield from user.until(
        lambda: (pelvis().xy - root.location.xy).length < 0.2, "the character", 60.0
    )
    yield from user.press("ESC")
    yield from user.until(lambda: not running(), "the end of Live", 3.0)
    nothing_moved()
    print("Live: dragged and put back", flush=True)

    # Recorded: away, onto the stool, and a way that is drawn.
    yield from started()
    yield from user.click("dafnet.live_record", 0.8)
    yield from drag(user, (1.4, 0.2, 0.0), (1.0, -0.8, 0.0))
    yield 1.0
    yield from user.picture("live_walks")
    yield from drag(user, (*stool.location.xy, 0.0))
    yield from user.until(lambda: pelvis().z < 0.68, "sitting", 60.0)
    yield 1.0
    yield from user.picture("live_sits")
    yield from draw(user, (1.2, 0.4, 0.0), (1.3, -0.4, 0.0), (0.3, -1.0, 0.0), (-0.6, -0.6, 0.0))
    yield from user.until(
        lambda: (pelvis().xy - Vector((-0.6, -0.6))).length < 0.4, "the end of the way", 60.0
    )
    yield from user.click("dafnet.live_record", 0.8)
    yield from user.click("dafnet.live()", 0.2)
    yield from user.until(lambda: not running(), "the end of Live", 60.0)
    yield 0.5
    ann = scene.objects["Character"]
    assert len(ann.dafnet.takes) == 1 and ann.animation_data.action == ann.dafnet.takes[0].action
    keys = ann.dafnet.root.animation_data.action
    print(f"Recorded {keys.frame_range[1]:.0f} frames", flush=True)
    only(ann)
    scene.frame_set(int(keys.frame_range[1] / 2))
    yield from user.picture("live_take")

    with user.override():
        bpy.ops.ed.undo()
    yield 0.3
    ann = bpy.context.scene.objects["Character"]
    own = ann.dafnet
    assert not len(own.takes), "one undo takes the recording back"
    assert own.root.animation_data is None or own.root.animation_data.action is None
    nothing_moved()

    print("Live: recorded, and undone in one step", flush=True)

    # Undone, saved and closed while it runs.
    only(own.root)
    yield from started()
    yield from drag(user, (1.2, 0.0, 0.0))
    with user.override():
        bpy.ops.wm.save_as_mainfile(filepath=str(pictures / "live.blend"))
    yield from user.until(lambda: not running(), "the end of Live after saving", 3.0)
    nothing_moved()
    yield 0.3
    yield from started()
    yield from drag(user, (1.2, 0.0, 0.0))
    with user.override():
        bpy.ops.wm.open_mainfile(filepath=str(pictures / "live.blend"))
    yield 0.5
    user = Driver(pictures)
    assert not running() and bpy.context.preferences.edit.use_global_undo
    ann = bpy.context.scene.objects["Character"]
    own = ann.dafnet
    nothing_moved()
    only(own.root)
    yield from user.sidebar("DAFNet")
    yield from started()
    yield from drag(user, (1.2, 0.0, 0.0))
    with user.override():
        bpy.ops.object.select_all(action="DESELECT")
        ann.select_set(True)
        bpy.ops.object.delete()
    yield from user.until(lambda: not running(), "the end of Live without a character", 3.0)
