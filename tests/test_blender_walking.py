"""Sending a character to a seat or to the 3D cursor: keys on the root, and the take that follows them."""

from types import ModuleType

import numpy as np
import pytest


class Room:
    """A character of 1.6 m, and a chair that looks at it from 3 m away, at 24 frames a second."""

    def __init__(self, bpy: ModuleType, addon) -> None:
        self.bpy, self.addon, self.scene = bpy, addon, bpy.context.scene
        self.scene.render.fps, self.scene.frame_end = 24, 40
        assert bpy.ops.dafnet.add_character(name="Ann", height=1.6) == {"FINISHED"}
        self.ann = bpy.context.object
        self.furniture = bpy.data.collections.new("Furniture")
        self.scene.collection.children.link(self.furniture)
        self.chair = self.box("Chair", (-0.22, 3.0, 0.0), (0.22, 3.44, 0.45))
        back = self.box("Back", (-0.22, 3.44, 0.0), (0.22, 3.48, 0.95))
        back.parent = self.chair
        self.root = self.ann.dafnet.root

    def box(self, name: str, low: tuple[float, float, float], high: tuple[float, float, float]):
        mesh = self.bpy.data.meshes.new(name)
        corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
        mesh.from_pydata(corners, [], [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
        made = self.bpy.data.objects.new(name, mesh)
        self.furniture.objects.link(made)
        return made

    def select(self, *objects) -> None:
        for o in self.scene.objects:
            o.select_set(o in objects)
        self.bpy.context.view_layer.objects.active = objects[0] if objects else None

    def place(self, frame: float) -> np.ndarray:
        self.scene.frame_set(int(frame))
        return np.array([*self.root.location, self.root.rotation_euler[2]])


@pytest.fixture
def room(blender, addon) -> Room:
    return Room(blender, addon)


def test_sent_to_a_chair_the_character_sits_on_it(room: Room) -> None:
    room.scene.frame_set(7)
    room.select(room.chair)
    assert room.bpy.ops.dafnet.walk_to(goal="SEAT", seconds=2.0) == {"FINISHED"}
    assert room.ann.dafnet.furniture == room.furniture, "it had none"
    assert room.scene.frame_current == 7 and room.scene.frame_end > 80
    first, last = room.place(7), room.place(room.scene.frame_end)
    assert np.allclose(first, 0.0, atol=1e-5)
    assert abs(last[0]) < 0.05 and 3.1 < last[1] < 3.35 and abs(np.cos(last[3]) + 1.0) < 0.01, "it looks back"
    assert np.allclose(room.place(room.scene.frame_end - 40), last, atol=1e-4), "it rests for two seconds"
    room.select(room.ann)
    assert room.bpy.ops.dafnet.generate() == {"FINISHED"}
    room.scene.frame_set(room.scene.frame_end)
    pelvis = room.ann.matrix_world @ room.ann.pose.bones["pelvis"].head
    assert abs(pelvis.z - (0.45 + 0.12 * 1.6 / 1.75)) < 0.1


def test_walks_go_on_from_the_last_key_and_leave_the_earlier_ones(room: Room) -> None:
    room.select(room.chair, room.ann)
    assert room.bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0) == {"FINISHED"}
    end = room.scene.frame_end
    before = [room.place(frame) for frame in range(1, end + 1)]
    room.scene.cursor.location = (2.0, 1.0, 0.0)
    room.select(room.ann)
    assert room.bpy.ops.dafnet.walk_to(goal="CURSOR", seconds=0.5) == {"FINISHED"}
    assert np.allclose([room.place(frame) for frame in range(1, end + 1)], before, atol=1e-3)
    assert np.allclose(room.place(room.scene.frame_end)[:2], (2.0, 1.0), atol=1e-3)
    path = np.array([room.place(frame) for frame in range(1, room.scene.frame_end + 1)])
    assert np.abs(np.diff(path[:, :2], axis=0)).max() < 0.1 and np.abs(np.diff(path[:, 3])).max() < 0.35


def test_what_cannot_be_walked_to_changes_nothing(room: Room) -> None:
    def refused(words: str, goal: str = "SEAT") -> None:
        with pytest.raises(RuntimeError, match=words):
            room.bpy.ops.dafnet.walk_to(goal=goal)
        assert not room.root.animation_data or not room.root.animation_data.action
        assert room.scene.frame_end == 40

    room.select(room.ann)
    refused("Select the one object")
    tower = room.box("Tower", (2.0, 2.0, 0.0), (2.5, 2.5, 1.2))
    room.ann.dafnet.furniture = room.furniture
    room.select(tower, room.ann)
    refused("'Tower' has no level surface")
    other = room.bpy.data.collections.new("Other")
    room.scene.collection.children.link(other)
    room.ann.dafnet.furniture = other
    other.objects.link(tower)
    room.select(room.chair, room.ann)
    refused("not in the character's furniture")
    room.ann.dafnet.furniture = room.furniture
    room.root.parent = tower
    refused("follows something")
    room.root.parent = None
    room.root.rotation_mode = "QUATERNION"
    refused("rotation mode")
    room.root.rotation_mode = "XYZ"
    room.scene.cursor.location = (0.0, 0.0, 0.0)
    refused("there already", goal="CURSOR")
    room.ann.dafnet.root = None
    refused("has no root")


def test_the_panel_offers_the_selected_seat(room: Room) -> None:
    sent = room.addon("dafnet_addon.blender.armature").sent
    room.select(room.chair)
    assert sent(room.bpy.context) == (room.ann, room.chair)
    room.select(room.ann, room.chair)
    assert sent(room.bpy.context) == (room.ann, room.chair)
    room.select(room.ann)
    assert sent(room.bpy.context) == (room.ann, None)
    room.bpy.ops.dafnet.add_character(name="Bob")
    room.select(room.chair)
    assert sent(room.bpy.context)[0] is None and not room.bpy.ops.dafnet.walk_to.poll()
