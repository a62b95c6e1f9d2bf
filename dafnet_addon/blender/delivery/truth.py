"""Ground truth: what is known of the people of a shot, as numbers; docs/truth.md lists the names.

For each take a folder with ``scene.json``, and for each person an NPZ file and a JSON file of the
same numbers.
"""

import json
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...core.coco import COCO, ESTIMATED, face_points, in_coco_order
from ...core.contacts import CONTACTS, contacts
from ...core.files import save_text, whole_file
from ...core.grid import BAND
from ...core.metrics import body_points
from ...core.nearby import REACH_OF_A_BODY, solids_near
from ...core.occupancy import distance
from ...core.retargeting import Motion
from ...core.skeleton import HEAD, JOINTS, STATURE
from ...core.solids import Box, Mesh, Scene
from ...core.take import Take
from ...director.task_lists import plain_tasks
from ..character.armature import metres_per_unit
from ..populating.surroundings import standing_objects
from ..scene.dependencies import Dependencies
from ..scene.furniture import Furniture, meshes_in, rendered
from .cameras import DEPTHS, Sights, View, cameras_of, view_of
from .people import Body, Played, distinct_names, file_names, playing

__all__ = ["Truth", "looked_at", "numbered", "truth_of", "write_truth"]

_DIGITS = 5  # behind the point, in JSON


@dataclass(frozen=True)
class Truth:
    """One take of everybody: ``people``, their numbers by name; ``scene``: what they share;
    ``warnings``: sentences for the user.
    """

    people: dict[str, dict[str, np.ndarray]]
    scene: dict[str, Any]
    warnings: tuple[str, ...] = ()


def looked_at(people: Sequence[Played], number: int, every: int) -> tuple[range, range]:
    """The frames in which anybody of a take is there, and those in which cameras look."""
    spans = [person.frames(number) for person in people]
    frames = range(min(span.start for span in spans), max(span.stop for span in spans))
    return frames, frames[::every]


def numbered(
    scene: bpy.types.Scene, people: Sequence[Played]
) -> dict[int, tuple[str, list[bpy.types.Object]]]:
    """The numbers of objects in masks, from 1 on, with their names: people first, each with all
    that is hers, then what else renders show.
    """
    found: dict[int, tuple[str, list[bpy.types.Object]]] = {}
    taken: set[bpy.types.Object] = set()
    for person in people:
        found[len(found) + 1] = person.name, list(person.meshes())
        taken |= person.meshes()
    for each in sorted(scene.objects, key=lambda o: o.name):
        if each not in taken and (each.type in _SURFACES or each.is_instancer):
            found[len(found) + 1] = each.name, [each]
    return found


_SURFACES = ("MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD", "VOLUME")


@dataclass
class _Looks:
    """What a camera has seen in the frames in which it looked: of people, by their numbers, pixels
    (27, 2) and whether seen (27,) of the joints and then of the face.
    """

    camera: bpy.types.Object
    views: list[View] = field(default_factory=list)
    pixels: list[dict[int, np.ndarray]] = field(default_factory=list)
    seen: list[dict[int, np.ndarray]] = field(default_factory=list)

    def add(
        self,
        view: View,
        sights: Sights,
        depsgraph: bpy.types.Depsgraph,
        there: dict[int, tuple[np.ndarray, np.ndarray]],
    ) -> None:
        """Look at those who are ``there`` by their numbers: points and depths, Blender units."""
        found = {
            k: sights.look(depsgraph, view, points, k, depths)
            for k, (points, depths) in there.items()
        }
        self.views.append(view)
        self.pixels.append({k: pixels for k, (pixels, _) in found.items()})
        self.seen.append({k: seen for k, (_, seen) in found.items()})

    def of(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (K, 27, 2) and whether seen (K, 27) of the person ``k``."""
        nowhere, unseen = np.full((len(DEPTHS), 2), np.nan), np.zeros(len(DEPTHS), np.uint8)
        pixels = [each.get(k, nowhere) for each in self.pixels]
        seen = [each.get(k, unseen) for each in self.seen]
        return np.array(pixels).reshape(-1, *nowhere.shape), np.array(seen, np.uint8)


def truth_of(
    context: bpy.types.Context, people: Sequence[Played], number: int, every: int
) -> Generator[float, None, Truth]:
    """Play a take of everybody and note what is known; cameras look in every ``every``-th frame.

    A job that yields its progress; the scene shows afterwards what it showed.
    """
    scene, unit = context.scene, metres_per_unit(context.scene)
    frames, looks_in = looked_at(people, number, every)
    cameras, warnings = cameras_of(scene)
    looks = [_Looks(camera) for camera in cameras]
    bodies = [Body(person.armature) for person in people]
    furniture = _Furnished(scene, people)
    owners = {each: k for k, person in enumerate(people) for each in person.meshes()}

    with playing(scene, people, number):
        sights = Sights(scene, owners, set(scene.objects) - rendered(scene.collection))
        for k, frame in enumerate(frames):
            scene.frame_set(frame)
            depsgraph = context.evaluated_depsgraph_get()
            furniture.add(depsgraph)
            for person, body in zip(people, bodies, strict=True):
                if frame in person.frames(number):
                    body.add(depsgraph)
            if frame in looks_in:
                there = {
                    k: _points(person.takes[number], bodies[k], unit)
                    for k, person in enumerate(people)
                    if frame in person.frames(number)
                }
                for look in looks:
                    look.add(view_of(look.camera, scene, depsgraph), sights, depsgraph, there)
            yield 0.9 * k / len(frames)

    found = {}
    for k, (person, name) in enumerate(zip(people, file_names(people), strict=True)):
        span = person.frames(number)
        solids = furniture.solids(k, slice(span.start - frames.start, span.stop - frames.start))
        motion = bodies[k].motion()
        found[name] = {
            **_known(person, number, motion=motion, unit=unit, fps=_fps(scene), solids=solids),
            **_seen(looks, k, looks_in),
        }
        yield 0.9 + 0.1 * k / len(people)

    shared = _shared(scene, people, number, frames=frames, looks_in=looks_in, looks=looks)
    return Truth(found, shared, warnings)


def _fps(scene: bpy.types.Scene) -> float:
    return float(scene.render.fps / scene.render.fps_base)


def _points(take: Take, body: Body, unit: float) -> tuple[np.ndarray, np.ndarray]:
    """A body's joints and face (27, 3) in the frame that was noted last, and how much of the body
    may lie before each (27,); Blender units.
    """
    size, motion = take.scale / unit, body.motion(slice(-1, None))
    face = face_points(motion.joints, motion.frames[:, HEAD], size)
    return np.concatenate([motion.joints[0], face[0]]), size * DEPTHS


class _Furnished:
    """The furniture of all people, read frame by frame; those who share a collection share what is
    read. For who has no collection it is all that stands in the scene in the first frame.
    """

    def __init__(self, scene: bpy.types.Scene, people: Sequence[Played]) -> None:
        self._scene, self._unit = scene, metres_per_unit(scene)
        self._collections = [person.armature.dafnet.furniture for person in people]
        self._read: dict[bpy.types.Collection, Furniture] = {}
        self._solids: dict[bpy.types.Collection | None, tuple[Mesh, ...]] = {}
        self._begun = False
        bodies = {each for person in people for each in person.meshes()}
        dependencies = Dependencies(scene)
        for person, collection in zip(people, self._collections, strict=True):
            if collection is not None and collection not in self._read:
                self._read[collection] = Furniture(
                    scene,
                    collection=collection,
                    armature=person.armature,
                    own=bodies,
                    dependencies=dependencies,
                )

    def add(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Note the frame that the scene shows now."""
        for furniture in self._read.values():
            if self._begun:
                furniture.add(depsgraph, set())
            else:
                furniture.begin(depsgraph)
        if not self._begun and None in self._collections:
            members = standing_objects(self._scene)
            self._solids[None] = tuple(meshes_in(depsgraph, members, self._unit))
        self._begun = True

    def solids(self, k: int, frames: slice) -> list[Mesh]:
        """The furniture of the person ``k`` in these frames of all; world, metres."""
        collection = self._collections[k]
        if collection not in self._solids:
            self._solids[collection] = self._read[collection].solids(self._unit)
        return [
            replace(solid, matrix=solid.matrix[frames]) if solid.matrix.ndim == 3 else solid
            for solid in self._solids[collection]
        ]


def _known(
    person: Played,
    number: int,
    *,
    motion: Motion,
    unit: float,
    fps: float,
    solids: Sequence[Box | Mesh],
) -> dict[str, np.ndarray]:
    """What is known of a person in the world, by name."""
    take, frames = person.takes[number], np.array(person.frames(number))
    joints, heads = motion.joints * unit, motion.frames[:, HEAD]
    depths, nearest = _measured(joints, take, solids)
    return {
        "frames": frames,
        "seconds": frames / fps,
        "joint_names": np.array(JOINTS),
        "joints": joints,
        "rotations": take.rotations,
        "coco_names": np.array(COCO),
        "coco": in_coco_order(joints, face_points(joints, heads, take.scale)),
        "coco_estimated": np.isin(np.arange(len(COCO)), ESTIMATED),
        "root": take.root,
        "contact_names": np.array(CONTACTS),
        "contacts": contacts(joints, fps, take.root[:, 2, 3], nearest, take.scale),
        "actions": take.action,
        "piece_names": np.array([*depths], str),
        "penetration": np.reshape([*depths.values()], (len(depths), len(frames))).T,
        **_tasks(person, frames, fps),
    }


def _measured(
    joints: np.ndarray, take: Take, solids: Sequence[Box | Mesh]
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """How deep (T,) the bones are in each piece that comes near, centimetres, and how far (T, 22)
    the joints are from any, metres, infinite where none is near; joints (T, 22, 3) and solids in
    the world, metres.
    """
    floor = take.root[:, 2, 3]
    near = solids_near(Scene(tuple(solids)), take.root[:, :3, 3], REACH_OF_A_BODY, take.scale)
    pieces: dict[str, list[Box | Mesh]] = {}
    for solid in near.solids:
        pieces.setdefault(solid.name, []).append(solid)

    inside = body_points(joints)
    points, count = np.concatenate([joints, inside], axis=1), len(JOINTS)
    depths, nearest = {}, np.full((len(joints), count), np.inf)
    for name in sorted(pieces):
        found = distance(Scene(tuple(pieces[name])), points, floor)
        depths[name] = 100.0 * np.maximum(-found[:, count:].min(axis=1), 0.0)
        near_it = found[:, :count] < BAND
        nearest[near_it] = np.minimum(nearest, found[:, :count])[near_it]
    return depths, nearest


def _tasks(person: Played, frames: np.ndarray, fps: float) -> dict[str, np.ndarray]:
    """The tasks of a plan, and which of them is on in each frame."""
    timeline = person.plan.timeline if person.plan else ()
    rate = fps / person.plan.fps if person.plan else 1.0
    times = [
        [frames[0] + round(rate * at) for at in (each.start, each.there, each.stop)]
        for each in timeline
    ]
    task = np.full(len(frames), -1)
    for k, (start, _, stop) in enumerate(times):
        task[(frames >= start) & (frames < stop)] = k
    words = [
        json.dumps(each, ensure_ascii=False) for each in plain_tasks([e.task for e in timeline])
    ]
    return {
        "tasks": np.array(words, str),
        "task_frames": np.array(times, int).reshape(-1, 3),
        "task_furniture": np.array([each.furniture for each in timeline], str),
        "task_seats": np.array([each.seat for each in timeline], str),
        "task": task,
    }


def _seen(looks: Sequence[_Looks], k: int, frames: range) -> dict[str, np.ndarray]:
    """What all cameras have seen of the person ``k``."""
    count = len(JOINTS)
    found = [look.of(k) for look in looks]
    shape = (len(looks), len(frames), len(DEPTHS))
    pixels = np.reshape([pixels for pixels, _ in found], (*shape, 2)).astype(float)
    seen = np.reshape([seen for _, seen in found], shape).astype(np.uint8)

    def coco(values: np.ndarray) -> np.ndarray:
        flat = values.reshape(-1, *values.shape[2:])
        ordered = in_coco_order(flat[:, :count], flat[:, count:])
        return ordered.reshape(*values.shape[:2], *ordered.shape[1:])

    return {
        "camera_names": np.array([look.camera.name for look in looks], str),
        "camera_frames": np.array(frames),
        "joints_2d": pixels[:, :, :count],
        "joints_seen": seen[:, :, :count],
        "coco_2d": coco(pixels),
        "coco_seen": coco(seen),
    }


def _shared(
    scene: bpy.types.Scene,
    people: Sequence[Played],
    number: int,
    *,
    frames: range,
    looks_in: range,
    looks: Sequence[_Looks],
) -> dict[str, Any]:
    """What ``scene.json`` says."""
    unit = metres_per_unit(scene)
    objects = numbered(scene, people)
    return {
        "fps": _fps(scene),
        "frames": [frames.start, frames.stop],
        "camera_frames": [*looks_in],
        "people": [
            {
                "name": person.name,
                "file": name,
                "take": person.actions[number].name,
                "frames": [person.frames(number).start, person.frames(number).stop],
                "height": round(STATURE * person.takes[number].scale, _DIGITS),
            }
            for person, name in zip(people, file_names(people), strict=True)
        ],
        "objects": {str(k): name for k, (name, _) in objects.items()},
        "cameras": [
            _camera(look, unit, name)
            for look, name in zip(
                looks, distinct_names([look.camera.name for look in looks]), strict=True
            )
        ],
    }


def _camera(look: _Looks, unit: float, folder: str) -> dict[str, Any]:
    metres = np.array([1.0, 1.0, 1.0, unit])
    places = [view.to_camera * metres for view in look.views]
    for place in places:
        place[3, 3] = 1.0
    return {
        "name": look.camera.name,
        "folder": folder,
        "width": look.views[0].size[0],
        "height": look.views[0].size[1],
        "intrinsics": _plain(np.array([view.intrinsics() for view in look.views])),
        "world_to_camera": _plain(np.array(places)),
    }


def _plain(values: np.ndarray) -> Any:
    """Numbers and words as JSON holds them; what is not a number is null."""
    if values.dtype.kind != "f":
        return values.tolist()
    plain = np.round(values.astype(float), _DIGITS).astype(object)
    plain[~np.isfinite(values)] = None
    return plain.tolist()


def write_truth(truth: Truth, folder: Path) -> None:
    """Write a take's files. ``InputError`` where the disk refuses."""
    for name, known in truth.people.items():
        with whole_file(folder / f"{name}.npz") as part, part.open("wb") as file:
            np.savez_compressed(file, **known)
        plain = {key: _plain(values) for key, values in known.items()}
        plain["tasks"] = [json.loads(words) for words in plain["tasks"]]
        save_text(folder / f"{name}.json", json.dumps(plain, ensure_ascii=False))
    save_text(folder / "scene.json", json.dumps(truth.scene, indent=1, ensure_ascii=False))
