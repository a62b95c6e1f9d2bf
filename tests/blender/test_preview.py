"""Previews: a film that plays at the scene's speed and a sheet whose cells are the frames asked
for.
"""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.showcase.preview import (
    look_at,
    render_film,
    render_sheet,
)


@pytest.fixture
def sliding_cube(blender: ModuleType) -> Any:
    """A scene of six frames, in which a red cube slides from left to right before a camera."""
    bpy = blender
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 6
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    cube = bpy.context.object
    red = bpy.data.materials.new("Red")
    red.diffuse_color = (0.8, 0.05, 0.05, 1.0)
    cube.data.materials.append(red)
    for frame, x in ((1, -3.0), (6, 3.0)):
        cube.location.x = x
        cube.keyframe_insert("location", frame=frame)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    look_at(camera, (0.0, -12.0, 0.0), (0.0, 0.0, 0.0))
    return scene


def red_column(cell: np.ndarray) -> float:
    """Middle of what is red in a picture (height, width, 4), from 0 at its left to 1 at its
    right.
    """
    red = (cell[..., 0] > 2 * cell[..., 1]) & (cell[..., 0] > 0.2)
    assert red.any()
    return float(np.nonzero(red)[1].mean() / cell.shape[1])


def test_sheet_shows_its_frames_row_by_row(
    blender: ModuleType, sliding_cube: Any, tmp_path: Path
) -> None:
    file = tmp_path / "sheet.png"
    render_sheet(sliding_cube, file, [1, 6, 3], columns=2)
    image = blender.data.images.load(str(file))
    assert tuple(image.size) == (1280, 720)
    pixels = np.array(image.pixels[:]).reshape(720, 1280, 4)[::-1]
    first, last, third = pixels[:360, :640], pixels[:360, 640:], pixels[360:, :640]
    assert red_column(first) < 0.25 < red_column(third) < 0.5 < 0.75 < red_column(last)
    np.testing.assert_array_equal(pixels[360:, 640:], 1.0)


def test_film_is_an_mp4_at_the_scenes_speed(
    blender: ModuleType, sliding_cube: Any, tmp_path: Path
) -> None:
    file = tmp_path / "film.mp4"
    seen: list[float] = []
    speed = sliding_cube.render.fps, sliding_cube.render.fps_base
    render_film(sliding_cube, file, 2, seen.append)
    assert file.read_bytes()[4:8] == b"ftyp"
    assert b"avc1" in file.read_bytes(), "H.264"
    clip = blender.data.movieclips.load(str(file))
    assert clip.frame_duration == 3
    assert clip.fps == pytest.approx(speed[0] / speed[1] / 2)
    assert seen == pytest.approx([0.0, 0.4, 0.8])
    assert (sliding_cube.render.fps, sliding_cube.render.fps_base) == speed
    assert sliding_cube.frame_step == 1
