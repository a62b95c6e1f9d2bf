"""A short shot in Blender with a camera, somebody to look at, and what is delivered of it."""

import json
import struct
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bl_ext.user_default.dafnet.dafnet_addon.blender.delivery.deliver import deliver
from bl_ext.user_default.dafnet.dafnet_addon.blender.delivery.people import Played
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import job
from bl_ext.user_default.dafnet.dafnet_addon.blender.showcase.preview import look_at
from bl_ext.user_default.dafnet.dafnet_addon.core.wishes import Wishes

from kit.stage import Stage

__all__ = ["Shot", "glb", "numbers_in"]


class Shot:
    """Ann walks half a metre past a stool in 13 frames, seen from the right and from above."""

    def __init__(self, *, takes: int = 1, unit: float = 1.0, fps: int = 24) -> None:
        self.stage = Stage(frames=(5, 17), unit=unit, fps=fps)
        self.scene, self.unit = self.stage.scene, unit
        self.stage.walk((5, 0.0), (17, 0.5 / unit))
        self.stage.box("Stool", self._at(0.5, 0.2, 0.0), self._at(0.9, 0.6, 0.45))
        self.camera = self.add_camera("Side", (3.5, 0.3, 1.2), (0.0, 0.3, 0.9))
        self.scene.camera = self.camera
        self.scene.render.resolution_x, self.scene.render.resolution_y = 160, 120
        self.scene.frame_set(7)
        settings = self.stage.settings(take_count=takes)
        result = job.run(bpy.context, settings)
        self.ann = Played(self.stage.ann, result.takes, result.actions)

    def _at(self, *place: float) -> tuple[float, ...]:
        return tuple(value / self.unit for value in place)

    def add_camera(
        self, name: str, place: tuple[float, ...], aim: tuple[float, ...], **properties: Any
    ) -> Any:
        """A camera at a place in metres that looks at another."""
        data = bpy.data.cameras.new(name)
        for key, value in properties.items():
            setattr(data, key, value)
        data.clip_end = 1000.0 / self.unit
        camera = bpy.data.objects.new(name, data)
        self.scene.collection.objects.link(camera)
        look_at(camera, self._at(*place), self._at(*aim))
        bpy.context.view_layer.update()
        return camera

    def deliver(self, folder: Path, *people: Any, **wishes: Any) -> tuple[str, ...]:
        return deliver(self.scene, people or (self.ann,), folder, Wishes(**wishes))

    def truth(self, folder: Path, *people: Any, name: str = "Ann", **wishes: Any) -> Any:
        """The numbers of somebody, once they are delivered."""
        self.deliver(folder, *people, truth=True, **wishes)
        with np.load(folder / "truth" / "take_1" / f"{name}.npz") as known:
            return dict(known)


def numbers_in(file: Path) -> np.ndarray:
    """The pixels of a picture of numbers, the top row first, as Blender reads them."""
    image = bpy.data.images.load(str(file))
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return np.round(pixels.reshape(height, width, 4)[::-1, :, 0] * 65535).astype(int)


def glb(file: Path) -> Any:
    """The JSON in a .glb file."""
    data = file.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length])
