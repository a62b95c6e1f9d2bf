"""An animator's first shot, with mouse and keys: from an empty scene to a take on rigs of one's
own.
"""

import sys
from pathlib import Path
from typing import Any

import bpy

from kit.window import Driver, Waits

__all__ = ["first_shot", "look", "new_stool", "only", "progress"]


def progress() -> float | None:
    """How far the running job is, as the panel knows it."""
    module: Any = next(
        m for name, m in sys.modules.items() if name.endswith(".blender.pipeline.running")
    )
    running = module.running_job()
    return None if running is None else running.progress


def look(user: Driver, at: tuple[float, float, float], distance: float) -> None:
    """Turn the view to a point."""
    space = user.view.spaces.active
    space.region_3d.view_location, space.region_3d.view_distance = at, distance
    space.shading.color_type = "OBJECT"


def new_stool() -> bpy.types.Object:
    """Furniture of the animator's own, in a collection of its own."""
    collection = bpy.data.collections.new("Studio")
    bpy.context.scene.collection.children.link(collection)
    bpy.ops.mesh.primitive_cylinder_add(radius=0.24, depth=0.45, location=(1.6, 1.2, 0.225))
    stool = bpy.context.object
    stool.name, stool.color = "Stool", (0.45, 0.25, 0.12, 1.0)
    for each in list(stool.users_collection):
        each.objects.unlink(stool)
    collection.objects.link(stool)
    return stool


def only(*selected: bpy.types.Object) -> None:
    """Select these, the first one active."""
    bpy.context.view_layer.update()
    for each in bpy.context.view_layer.objects:
        each.select_set(each in selected)
    bpy.context.view_layer.objects.active = selected[0]


def first_shot(pictures: Path, builders: Any) -> Waits:
    """Every step by its button, with a picture of each; ``builders``: rigs by script
    (tests/kit/humanoids.py).
    """
    user = Driver(pictures)
    scene = bpy.context.scene
    yield from user.press("ESC")  # the splash screen
    with user.override():
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete()
    bpy.ops.ed.undo_push(message="Empty")

    yield from user.sidebar("DAFNet")
    yield from user.click("dafnet.add_character")
    ann = scene.objects["Character"]
    look(user, (0.9, 0.7, 0.6), 4.5)
    yield from user.picture("add_character")

    with user.override():
        stool = new_stool()
    only(ann, stool)
    yield 0.2
    yield from user.click("dafnet.walk_to(goal='SEAT')")
    yield from user.until(
        lambda: ann.dafnet.root.animation_data is not None, "the way to the stool"
    )
    keys = ann.dafnet.root.animation_data.action
    assert keys is not None and ann.dafnet.furniture.name == "Studio"
    assert scene.frame_end > 100, (
        "the scene's end follows the walk" if scene.frame_end == 250 else ""
    )
    only(ann)
    scene.frame_end = int(keys.frame_range[1])
    yield from user.picture("path_and_furniture")

    yield from user.click("dafnet.generate(task='NEW')")
    yield from user.until(lambda: (progress() or 0.0) > 0.6, "the middle of the job")
    yield from user.picture("generating")
    yield from user.until(lambda: progress() is None, "the take")
    assert len(ann.dafnet.takes) == 1
    scene.frame_set(scene.frame_end - 30)
    pelvis = (ann.matrix_world @ ann.pose.bones["pelvis"].head).z
    assert abs(pelvis - 0.57) < 0.08, f"it sits, the pelvis at {pelvis:.2f} m"
    yield from user.picture("first_take")

    before = len(bpy.data.actions)
    yield from user.click("dafnet.generate(task='NEW')")
    yield from user.until(lambda: (progress() or 0.0) > 0.3, "the middle of the second job")
    yield from user.press("ESC")
    yield from user.until(lambda: progress() is None, "the end of the cancelled job", 2.0)
    assert len(bpy.data.actions) == before and len(ann.dafnet.takes) == 1

    yield from user.click("dafnet.generate(task='NEW')")
    yield from user.until(lambda: (progress() or 0.0) > 0.3, "the middle of the third job")
    yield from user.click("dafnet.cancel")
    yield from user.until(lambda: progress() is None, "the end after the Cancel button", 2.0)
    assert len(bpy.data.actions) == before

    ann.dafnet.take_count = 3
    yield from user.click("dafnet.generate(task='NEW')")
    yield from user.until(
        lambda: progress() is None and len(ann.dafnet.takes) == 4, "three more takes"
    )
    yield from user.click("dafnet.play_take(index=2)", 0.1)
    assert ann.animation_data.action == ann.dafnet.takes[2].action
    chosen = ann.animation_data.action
    yield from user.click_near("dafnet.accepted", user.mouse[1])
    assert chosen.dafnet.accepted, "accepted with the mouse"
    yield from user.picture("takes")

    ann.dafnet.take_count = 1
    scene.frame_set(1)
    yield from user.key_property("dafnet.mode", 0.2)
    scene.frame_set(scene.frame_end - 45)
    ann.dafnet.hand_right.location = stool.location.x + 0.1, stool.location.y - 0.45, 0.95
    yield from user.click("dafnet.mode", 0.5)
    yield from user.key_property("dafnet.mode", 0.5)
    for role in ("head", "hand_left"):
        setattr(ann.dafnet, role, None)
    assert ann.dafnet.mode == "EE"
    scene.frame_set(2)
    assert ann.dafnet.mode == "FREE", "the mode is keyed"
    yield from user.click("dafnet.generate(task='NEW')")
    yield from user.until(
        lambda: progress() is None and len(ann.dafnet.takes) == 5, "the take with two modes"
    )
    scene.frame_set(scene.frame_end - 10)
    wrist = ann.matrix_world @ ann.pose.bones["right_wrist"].head
    assert (wrist - ann.dafnet.hand_right.location).length < 0.02, "the hand is at its target"
    yield from user.picture("mode_on_the_timeline")

    for name, build in (("mixamo", builders.mixamo), ("rigify", builders.rigify)):
        with user.override():
            rig = build(bpy)
        only(rig)
        yield 0.3
        yield from user.click("dafnet.detect_rig")
        yield from user.click("dafnet.bake_to_rig")
        yield from user.until(
            lambda rig=rig: bool(rig.animation_data and rig.animation_data.action), name, 120
        )
        scene.frame_set(scene.frame_end - 10)
        yield 0.3
        yield from user.picture(f"rig_{name}")
        rig.hide_set(True)
    only(ann)
    overlays = bpy.context.window_manager.dafnet_overlays
    switches = [name for name, kind in overlays.bl_rna.properties.items() if kind.type == "BOOLEAN"]
    for name in switches:
        setattr(overlays, name, True)
    scene.frame_set(scene.frame_end - 20)
    yield 0.5
    yield from user.picture("overlays")
    for name in switches:
        setattr(overlays, name, False)

    view = bpy.context.preferences.view
    language = view.language
    view.language, view.use_translate_interface = "de_DE", True
    yield 0.5
    assert bpy.app.translations.pgettext_iface("Vary the Legs") == "Beine variieren"
    yield from user.picture("german")
    view.language = language
