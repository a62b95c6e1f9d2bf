"""Generate by script in Blender, with the extension enabled: a character comes and sits on a chair.

    blender --background --python examples/sit_on_a_chair.py -- sitting.blend

It presses the buttons that an animator presses; without a file's name the scene stays open.
"""

import sys
from math import radians
from pathlib import Path

import bpy


def add_box(name: str, size: tuple[float, ...], middle: tuple[float, ...]) -> bpy.types.Object:
    """A box of a size, around its middle; metres."""
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=middle)
    box = bpy.context.object
    box.name, box.scale = name, size
    return box


def add_chair() -> bpy.types.Object:
    """A seat and a back as one object that faces −y; its legs make no difference here."""
    seat = add_box("Chair", (0.44, 0.44, 0.06), (0.0, 0.0, 0.43))
    back = add_box("Back", (0.44, 0.04, 0.5), (0.0, 0.24, 0.7))
    for part in (seat, back):
        part.select_set(True)
    bpy.context.view_layer.objects.active = seat
    bpy.ops.object.join()

    # Furniture lies in a collection of its own: all that is in it is seen.
    furniture = bpy.data.collections.new("Furniture")
    bpy.context.scene.collection.children.link(furniture)
    for holder in seat.users_collection:
        holder.objects.unlink(seat)
    furniture.objects.link(seat)
    return seat


def main(file: Path | None) -> None:
    """Build the scene, send the character to the chair, generate, and save."""
    scene = bpy.context.scene
    scene.render.fps = 24
    chair = add_chair()
    chair.rotation_euler.z = radians(20)

    scene.cursor.location = (1.5, -2.0, 0.0)
    bpy.ops.dafnet.add_character(name="Ann", height=1.68)
    ann = bpy.context.object

    chair.select_set(True)
    bpy.ops.dafnet.walk_to(goal="SEAT", seconds=3.0)  # keys the root, and finds the furniture

    ann.dafnet.seed = 4
    ann.dafnet.temperature = 0.5
    bpy.ops.dafnet.generate()
    print(f"'{ann.animation_data.action.name}' is baked, in frames 1 to {scene.frame_end}.")
    if file is not None:
        bpy.ops.wm.save_as_mainfile(filepath=str(file.absolute()))


if __name__ == "__main__":
    given = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    main(Path(given[0]) if given else None)
