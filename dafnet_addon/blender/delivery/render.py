"""Pictures of a shot by all its cameras: frames as the scene looks, masks with the numbers of
objects, depth; beside them the people's keypoints as COCO writes them.

Copies of the scene are rendered, with the same objects. Masks and depth are one picture, in which a
material for everything shows its number and its distance: Cycles renders it on the CPU in a tenth
of a second, with one sample and no screen, the same in every version of Blender.
"""

import json
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy
import numpy as np

from ...core.coco import COCO, COCO_BONES
from ...core.errors import InputError
from ...core.files import save_text, whole_file
from ...core.images import save_numbers
from ..character.armature import metres_per_unit
from ..compat import node_tree_of, output_image, output_numbers
from ..scene.playback import frame_kept
from .cameras import OUTSIDE, cameras_of, picture_size
from .people import Played, distinct_names, file_names, playing
from .truth import Truth, looked_at, numbered

__all__ = ["render_steps"]

_HEADLESS = ("CYCLES", "BLENDER_WORKBENCH")
"""Engines that are quick without a graphics card; instead of another one Workbench renders the
frames.
"""
_MILLIMETRES = 1000.0  # in a metre
_FARTHEST = 65535  # of 16 bits
_Box = tuple[int, int, int, int, int]
"""Of somebody in a picture: left, top, width, height, and how many pixels are hers."""


def render_steps(
    context: bpy.types.Context,
    people: Sequence[Played],
    number: int,
    *,
    truth: Truth,
    kinds: Sequence[str],
    every: int,
    folder: Path,
) -> Generator[float, None, tuple[str, ...]]:
    """Render every ``every``-th frame of a take into a folder for each camera: ``kinds`` are some
    of frames, masks and depth. A job that yields its progress; returns sentences for the user.

    Raises InputError where Blender cannot render.
    """
    scene = context.scene
    _, frames = looked_at(people, number, every)
    cameras, _ = cameras_of(scene)
    if not cameras:
        return (f"The scene '{scene.name}' has no camera, so nothing is rendered; add one.",)

    places = [folder / name for name in distinct_names([camera.name for camera in cameras])]
    boxes: dict[tuple[int, int], list[_Box | None]] = {}
    with ExitStack() as undo:
        undo.enter_context(frame_kept(scene))
        undo.callback(_remove_results, {*bpy.data.images})
        undo.enter_context(playing(scene, people, number))
        pictures = undo.enter_context(_pictures(scene)) if "frames" in kinds else None
        measured = set(kinds) & {"masks", "depth"}
        numbers = undo.enter_context(_Numbers(scene, people)) if measured else None
        for k, frame in enumerate(frames):
            for j, camera in enumerate(cameras):
                file = places[j] / f"{frame:04d}.png"
                if pictures:
                    with whole_file(file) as part:
                        _render(pictures, camera, frame, part)
                if numbers:
                    distances, masks = numbers.of(camera, frame)
                    if "masks" in kinds:
                        save_numbers(file.with_name(f"{file.stem}_mask.png"), masks)
                        boxes[j, k] = [_box(masks == n + 1) for n in range(len(people))]
                    if "depth" in kinds:
                        save_numbers(file.with_name(f"{file.stem}_depth.png"), distances)
                yield (k + (j + 1) / len(cameras)) / len(frames)

    for j, place in enumerate(places):
        found = [boxes.get((j, k)) for k in range(len(frames))]
        coco = _coco(truth, file_names(people), j, found, picture_size(scene))
        save_text(place / "keypoints.json", json.dumps(coco))
    return ()


@contextmanager
def _copy(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """A block with a copy of the scene that holds the same objects, and renders whole pictures."""
    copy = scene.copy()
    try:
        render = copy.render
        render.use_border = render.use_multiview = render.use_sequencer = False
        render.use_stamp = render.use_file_extension = False
        yield copy
    finally:
        bpy.data.scenes.remove(copy)


def _remove_results(before: set[bpy.types.Image]) -> None:
    """Remove the images that Blender has made by rendering."""
    for image in {*bpy.data.images} - before:
        bpy.data.images.remove(image)


@contextmanager
def _pictures(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """A copy that renders as the scene does, or by Workbench where that needs a screen."""
    with _copy(scene) as copy:
        if copy.render.engine not in _HEADLESS:
            copy.render.engine = "BLENDER_WORKBENCH"
        if copy.render.engine == "CYCLES":
            copy.cycles.device = "CPU"
        output_image(copy)
        yield copy


def _render(copy: bpy.types.Scene, camera: bpy.types.Object, frame: int, file: Path) -> None:
    copy.camera = camera
    copy.frame_set(frame)
    copy.render.filepath = str(file)
    try:
        # As the scene's name alone it would be rendered in the active scene's frame.
        with bpy.context.temp_override(scene=copy, view_layer=copy.view_layers[0]):
            bpy.ops.render.render(write_still=True)
    except RuntimeError as error:
        raise InputError(
            f"Blender cannot render: {str(error).strip()}; see to it there."
        ) from error


class _Numbers:
    """A block in which pictures have for pixels the number of the object that is seen there, and
    how far off it is.
    """

    def __init__(self, scene: bpy.types.Scene, people: Sequence[Played]) -> None:
        self._scene = scene
        self._objects = numbered(scene, people)
        self._undo = ExitStack()

    def __enter__(self) -> "_Numbers":
        with ExitStack() as undo:
            self._copy = undo.enter_context(_copy(self._scene))
            self._folder = Path(undo.enter_context(TemporaryDirectory()))
            material = _showing_numbers()
            undo.callback(bpy.data.materials.remove, material)
            for each, number in self._numbers():
                undo.callback(setattr, each, "pass_index", each.pass_index)
                each.pass_index = number
            _measuring(self._copy, material)
            self._undo = undo.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._undo.close()

    def _numbers(self) -> Iterator[tuple[bpy.types.Object, int]]:
        listed = {each for _, objects in self._objects.values() for each in objects}
        yield from ((each, 0) for each in self._scene.objects if each not in listed)
        for number, (_, objects) in self._objects.items():
            yield from ((each, number) for each in objects)

    def of(self, camera: bpy.types.Object, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Millimetres ahead of the camera, 0 where there is nothing within 65 m, and the numbers of
        objects, 0 where there is none; (height, width), the top row first.
        """
        file = self._folder / "numbers.exr"
        _render(self._copy, camera, frame, file)
        image = bpy.data.images.load(str(file))
        try:
            image.colorspace_settings.name = "Non-Color"
            width, height = image.size
            pixels = np.empty(width * height * 4, np.float32)
            image.pixels.foreach_get(pixels)
        finally:
            bpy.data.images.remove(image)

        pixels = pixels.reshape(height, width, 4)[::-1]
        there = pixels[..., 3] > 0.0
        away = np.round(pixels[..., 0] * metres_per_unit(self._scene) * _MILLIMETRES)
        return (
            np.where(there & (away <= _FARTHEST), away, 0).astype(np.uint16),
            np.where(there, np.round(pixels[..., 1]), 0).astype(np.uint16),
        )


def _showing_numbers() -> bpy.types.Material:
    """A material that shines with its distance ahead of the camera, Blender units, as red, and with
    its object's number as green.
    """
    material = bpy.data.materials.new("DAFNet numbers")
    tree = node_tree_of(material)
    tree.nodes.clear()
    colour = tree.nodes.new("ShaderNodeCombineColor").inputs
    light = tree.nodes.new("ShaderNodeEmission")
    distance = tree.nodes.new("ShaderNodeCameraData").outputs["View Z Depth"]
    number = tree.nodes.new("ShaderNodeObjectInfo").outputs["Object Index"]
    surface = tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]
    tree.links.new(distance, colour["Red"])
    tree.links.new(number, colour["Green"])
    tree.links.new(colour["Red"].node.outputs[0], light.inputs["Color"])
    tree.links.new(light.outputs[0], surface)
    return material


def _measuring(copy: bpy.types.Scene, material: bpy.types.Material) -> None:
    """Let a copy of a scene render this material alone, one ray through the middle of each
    pixel.
    """
    render, cycles = copy.render, copy.cycles
    render.engine, cycles.device = "CYCLES", "CPU"
    render.film_transparent, render.use_compositing = True, False
    render.use_motion_blur = render.use_freestyle = False
    cycles.samples, cycles.max_bounces = 1, 0
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01
    copy.cycles.film_exposure = 1.0
    output_numbers(copy)
    for layer in copy.view_layers:
        layer.material_override = material
        layer.samples = 0


def _box(mask: np.ndarray) -> _Box | None:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return None
    left, top = int(columns[0]), int(rows[0])
    size = int(columns[-1]) + 1 - left, int(rows[-1]) + 1 - top
    return (left, top, *size, int(mask.sum()))


def _coco(
    truth: Truth,
    names: Sequence[str],
    camera: int,
    boxes: Sequence[list[_Box | None] | None],
    size: tuple[int, int],
) -> dict[str, Any]:
    """What a camera's ``keypoints.json`` says: images, and who is in them. ``boxes``: of each
    image, of each person; None where no masks were made, in which keypoints bound her.
    """
    frames = truth.scene["camera_frames"]
    annotations: list[dict[str, Any]] = []
    for k in range(len(frames)):
        for n, name in enumerate(names):
            known = truth.people[name]
            pixels, seen = known["coco_2d"][camera, k], known["coco_seen"][camera, k]
            there, own = boxes[k], seen > OUTSIDE
            box = there[n] if there is not None else _around(pixels[own], size)
            if not own.any() or box is None:
                continue
            *sides, area = box
            points = np.where(own[:, None], np.nan_to_num(pixels), 0.0).round(2)
            annotations.append(
                {
                    "id": len(annotations) + 1,
                    "image_id": k + 1,
                    "category_id": 1,
                    "track_id": n + 1,
                    "person": name,
                    "iscrowd": 0,
                    "bbox": sides,
                    "area": area,
                    "num_keypoints": int(own.sum()),
                    "keypoints": np.column_stack([points, seen]).ravel().tolist(),
                }
            )

    return {
        "images": [
            {
                "id": k + 1,
                "file_name": f"{frame:04d}.png",
                "width": size[0],
                "height": size[1],
                "frame": frame,
            }
            for k, frame in enumerate(frames)
        ],
        "annotations": annotations,
        "categories": [
            {
                "id": 1,
                "name": "person",
                "supercategory": "person",
                "keypoints": list(COCO),
                "skeleton": [[a + 1, b + 1] for a, b in COCO_BONES],
            }
        ],
    }


def _around(points: np.ndarray, size: tuple[int, int]) -> _Box | None:
    """The box around keypoints (N, 2) in a picture."""
    if not len(points):
        return None
    low, high = np.floor(points.min(axis=0)), np.ceil(points.max(axis=0)) + 1
    width, height = (np.minimum(high, size) - low).astype(int)
    return int(low[0]), int(low[1]), int(width), int(height), int(width * height)
