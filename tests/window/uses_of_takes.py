"""What is done with takes, with mouse and keys: a middle part anew, somebody looks at something,
feet on their targets, a strip, an asset, a file.
"""

from pathlib import Path

import bpy
from first_shot import progress

from kit.window import Driver, Waits

__all__ = ["uses_of_takes"]


def uses_of_takes(pictures: Path) -> Waits:
    """Every step by its button, with pictures of what comes of it."""
    user = Driver(pictures)
    yield from user.press("ESC")  # the splash screen
    with user.override():
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete()
        bpy.ops.dafnet.add_example(kind="DESK")
    scene, ann = bpy.context.scene, bpy.context.object
    own = ann.dafnet
    own.mode, own.temperature = "FREE", 1.0
    space = user.view.spaces.active.region_3d
    space.view_location, space.view_distance = (0.3, 0.0, 0.7), 5.0
    yield from user.sidebar("DAFNet")

    def generated(count: int) -> Waits:
        yield from user.until(
            lambda: progress() is None and len(own.takes) == count, f"take {count}"
        )

    yield from user.click("dafnet.generate(task='NEW')")
    yield from generated(1)

    middle = scene.frame_start + (scene.frame_end - scene.frame_start) // 2
    scene.use_preview_range = True
    scene.frame_preview_start, scene.frame_preview_end = middle - 40, middle + 30
    own.seed = 5
    yield from user.click("dafnet.generate(task='BETWEEN')")
    yield from generated(2)
    scene.frame_set(middle + 31)
    yield from user.picture("middle_part_anew")
    scene.use_preview_range = False

    lamp = bpy.data.objects.new("Lamp", None)
    lamp.location = (-2.0, 2.5, 1.9)
    scene.collection.objects.link(lamp)
    own.look_at = lamp
    yield from user.click("dafnet.generate(task='NEW')")
    yield from generated(3)
    scene.frame_set(scene.frame_end - 20)
    yield from user.picture("look_at")
    own.look_at = None

    own.mode = "EE"
    for role in ("head", "hand_left", "hand_right"):
        setattr(own, role, None)
    yield from user.click("dafnet.add_foot_targets")
    own.foot_right.location.z += 0.15
    own.foot_right.location.y += 0.12
    yield from user.click("dafnet.generate(task='NEW')")
    yield from generated(4)
    scene.frame_set(scene.frame_end - 20)
    ankle = ann.matrix_world @ ann.pose.bones["right_ankle"].head
    off = (ankle - own.foot_right.location).length
    print(f"the right foot is {100 * off:.1f} cm off its target", flush=True)
    yield from user.picture("foot_targets")
    assert off < 0.02

    take = ann.animation_data.action
    yield from user.click("dafnet.take_to_nla", 0.15)
    (track,) = ann.animation_data.nla_tracks
    assert track.strips[0].action == take and ann.animation_data.action is None
    yield from user.click("dafnet.mark_take", 0.5)
    assert take.asset_data is not None and "DAFNet" in {tag.name for tag in take.asset_data.tags}
    yield from user.picture("to_nla")
    actions = len(bpy.data.actions)
    with user.override():
        bpy.ops.dafnet.export_take(directory=str(pictures), kind="fbx")
        bpy.ops.dafnet.export_take(directory=str(pictures), kind="gltf")
    written = sorted(each.suffix for each in pictures.iterdir() if each.suffix in {".fbx", ".glb"})
    assert written == [".fbx", ".glb"] and len(bpy.data.actions) == actions
    assert bpy.context.scene == scene and ann.mode == "OBJECT"
