"""Previews of a scene by the Workbench renderer: an H.264 film and a contact sheet, in seconds and
without a screen.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np
from mathutils import Vector

from ...core.files import whole_file
from ..compat import output_image, output_video

__all__ = ["look_at", "render_film", "render_sheet", "use_workbench"]


def look_at(ob: bpy.types.Object, position: Sequence[float], target: Sequence[float]) -> None:
    """Place a camera or light at ``position`` so that it looks at ``target``."""
    ob.location = position
    ob.rotation_euler = (Vector(target) - Vector(position)).to_track_quat("-Z", "Y").to_euler()


def use_workbench(scene: bpy.types.Scene, width: int = 640, height: int = 360) -> None:
    """Set the scene up for quick renders that look good: studio light, shadows, cavities, smooth
    edges.
    """
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    scene.display.render_aa = "FXAA"
    scene.display.light_direction = (0.35, 0.85, 0.55)
    shading = scene.display.shading
    shading.light, shading.studio_light = "STUDIO", "paint.sl"
    shading.color_type = "MATERIAL"
    shading.show_shadows, shading.shadow_intensity = True, 0.40
    # The other kind is noisy without many samples.
    shading.show_cavity, shading.cavity_type = True, "SCREEN"
    if scene.world is None:
        scene.world = bpy.data.worlds.new("World")

    scene.world.color = (0.60, 0.62, 0.64)


def render_film(
    scene: bpy.types.Scene,
    path: Path,
    every: int = 2,
    progress: Callable[[float], None] = lambda _: None,
) -> None:
    """Render every ``every``-th frame of the scene to an H.264 MP4 that plays at the scene's speed.

    ``progress`` is called with the part done, in [0, 1]; the KeyboardInterrupt that it may raise is
    raised after the frame. The scene's render settings are left as the film needed them.
    """
    use_workbench(scene)
    output_video(scene)
    scene.frame_step = every
    scene.render.fps_base *= every
    scene.render.use_file_extension = False
    span = max(scene.frame_end - scene.frame_start, 1)
    stops: list[KeyboardInterrupt] = []

    def report(rendered: bpy.types.Scene, *_: object) -> None:
        try:
            progress((rendered.frame_current - rendered.frame_start) / span)
        except KeyboardInterrupt as stop:  # which Blender would print and forget
            stops.append(stop)
            rendered.frame_current = rendered.frame_end

    bpy.app.handlers.render_write.append(report)
    try:
        with whole_file(path) as part:
            scene.render.filepath = str(part)
            bpy.ops.render.render(animation=True, scene=scene.name)
            if stops:
                raise stops[0]
    finally:
        bpy.app.handlers.render_write.remove(report)
        scene.frame_step = 1
        scene.render.fps_base /= every


def render_sheet(
    scene: bpy.types.Scene, path: Path, frames: Sequence[int], columns: int = 4
) -> None:
    """Render ``frames`` and lay them out in a grid, row by row, as one PNG; missing cells stay
    white.
    """
    use_workbench(scene)
    output_image(scene)
    scene.display.render_aa = "8"  # few frames that may take longer
    images = []
    with TemporaryDirectory() as folder:
        for frame in frames:
            scene.frame_set(frame)
            scene.render.filepath = str(Path(folder, f"{frame}.png"))
            bpy.ops.render.render(write_still=True, scene=scene.name)
            images.append(_pixels(Path(scene.render.filepath)))

    height, width, _ = images[0].shape
    rows = -(-len(images) // columns)
    grid = np.ones((rows * height, columns * width, 4), np.float32)
    for i, image in enumerate(images):
        top = (rows - 1 - i // columns) * height  # pixels run from the bottom row up
        left = (i % columns) * width
        grid[top : top + height, left : left + width] = image

    _write(path, grid)


def _pixels(path: Path) -> np.ndarray:
    """(height, width, 4) of an image file, bottom row first."""
    image = bpy.data.images.load(str(path))
    width, height = image.size
    flat = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(flat)
    bpy.data.images.remove(image)
    return flat.reshape(height, width, 4)


def _write(path: Path, pixels: np.ndarray) -> None:
    height, width, _ = pixels.shape
    image = bpy.data.images.new("Sheet", width, height)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    with whole_file(path) as part:
        image.filepath_raw, image.file_format = str(part), "PNG"
        image.save()
    bpy.data.images.remove(image)
