"""A character that is led as time runs: what leads it is read at each tick, the network is stepped
up to now, and the pose is written onto the armature.

Whoever calls ``tick`` says what time it is: the operator's timer, or a test. A session holds on to
objects of the file, so it ends before the file is undone, closed or saved (``listening``).
"""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ... import load_weights
from ...core.checks import MAX_FRAMES
from ...core.errors import InputError
from ...core.following import Way
from ...core.live import Lead, LiveBody, LiveFrame
from ...core.root import RootPath, root_from_matrices
from ...core.rotations import yaw_matrix
from ...core.sampler import Sampler
from ...core.series import MODEL_FPS
from ...core.skeleton import JOINTS, TARGETS
from ...core.weights import Weights
from ..character.armature import metres_per_unit
from ..character.settings import HELD, Settings, settings_of
from ..directing.root_keys import require_keyable
from ..pipeline.baker import channels_of, ready_to_pose, require_bakeable
from ..pipeline.job import clean_up_of
from ..pipeline.rollback import place_restorer, state_restorer
from ..preferences import weights_path
from ..scene.furniture import array
from ..scene.lookup import find_object, object_named
from .around import LiveFurniture

__all__ = ["Clip", "LiveSession", "Over"]

_MOST_STEPS = 15
"""Frames that one tick makes at most: half a second; what is later than that is lost."""
_BUSY = 0.5
"""Share of the time that may be spent on steps; the rest is for Blender, and for who drags."""
_MOVED = 1e-3
"""Metres by which something has to be dragged to count as dragged."""
_TIMED = 60
"""Steps whose duration is told."""


class Over(Exception):
    """The session cannot go on; the sentence says why."""


@dataclass(frozen=True)
class Clip:
    """What was recorded: the frames that were ``played``, and those ``before`` them."""

    before: tuple[LiveFrame, ...]
    played: list[LiveFrame] = field(default_factory=list)


class LiveSession:
    """Leads one character. Nothing is changed until ``begin``; ``restore`` puts everything back.

    ``clips``: what was recorded; ``way``: one that was drawn for the root; ``milliseconds``: that a
    step takes, in the median of the last ``durations``, seconds; ``lost``: frames that were never
    made, since they came too late; ``busy``: see ``tick``. Raises InputError where the character
    cannot be led.
    """

    def __init__(
        self,
        context: bpy.types.Context,
        armature: bpy.types.Object,
        weights: Weights | None = None,
    ) -> None:
        """Without ``weights`` those of the preferences, else the shipped ones, are loaded."""
        self.scene, self.armature = context.scene, armature
        self._settings = settings_of(armature, self.scene)
        self._named = {"armature": armature, "scene": self.scene} | {
            name: getattr(armature.dafnet, name) for name in ("root", "furniture", *TARGETS)
        }
        self.unit = metres_per_unit(self.scene)
        self.scale = require_bakeable(armature, self.unit)
        if self.settings.root is None:
            raise InputError(
                f"The character '{armature.name}' has no root; choose its root object in the "
                "DAFNet panel."
            )
        if armature.dafnet.mode == "FULL":
            raise InputError(
                "Live follows the root and the targets, not another body; set the mode to FREE or "
                "EE."
            )

        self.root = find_object(self.settings, self.settings.root, "root")
        self.targets = {
            role: find_object(self.settings, name, f"target of '{role.replace('_', ' ')}'")
            for role in TARGETS
            if (name := getattr(self.settings, role))
            # Only EE misses a target that is gone.
            and (armature.dafnet.mode == "EE" or object_named(self.scene, name))
        }
        self._at_first = {role: self._place(target) for role, target in self.targets.items()}
        self._last = lead = self._lead()
        self.furniture = LiveFurniture(
            context, self.settings, unit=self.unit, scale=self.scale, floor=float(lead.position[2])
        )
        self.body = LiveBody(
            Sampler(weights or load_weights(weights_path(context))),
            self.furniture.surroundings,
            lead,
            scale=self.scale,
            clean_up=clean_up_of(self.settings),
            seed=self.settings.seed,
            held=self.settings.noise == HELD,
            seats=self.furniture.seats(lead.position, lead.position, patience=np.inf) or (),
        )

        self.clips: list[Clip] = []
        self.recording = False
        self.way = Way()
        self.milliseconds, self.lost = 0.0, 0
        self.busy = _BUSY
        self.durations: deque[float] = deque(maxlen=_TIMED)
        self._started, self._made = 0.0, -1
        self._undo: list[Callable[[], None]] = []

    @property
    def settings(self) -> Settings:
        """The character's settings when the session was made, with what they name as it is called
        now; what is gone keeps the name that it had.
        """
        names: dict[str, Any] = {}
        for field_name, held in self._named.items():
            with suppress(ReferenceError):
                names[field_name] = held.name_full if held else None
        self._settings = replace(self._settings, **names)
        return self._settings

    def begin(self) -> None:
        """Take hold of the armature: from now on it shows the body."""
        frame, subframe = self.scene.frame_current, self.scene.frame_subframe
        put_back = state_restorer(self.armature)
        self._undo = [
            lambda: put_back(self.armature),
            *(place_restorer(each) for each in (self.root, *self.targets.values())),
            lambda: self.scene.frame_set(frame, subframe=subframe),
        ]
        tools = self.scene.tool_settings
        if tools.use_keyframe_insert_auto:  # what is dragged now is not meant to be keyed
            self._undo.append(lambda: setattr(tools, "use_keyframe_insert_auto", True))
            tools.use_keyframe_insert_auto = False
        data = self.armature.animation_data
        if data is not None:
            mixes = data.use_nla
            self._undo.insert(1, lambda: setattr(self.armature.animation_data, "use_nla", mixes))
            if data.action:  # nobody else may use it meanwhile
                data.action.use_fake_user = True
            data.action, data.use_nla = None, False
        ready_to_pose(self.armature)
        self._show(self.body.frame)

    def restore(self) -> None:
        """Put the armature, the root, the targets and the frame back as they were; what is gone
        stays gone. The first other error is raised once all the rest is back.
        """
        failed: Exception | None = None
        while self._undo:
            try:
                self._undo.pop(0)()
            except ReferenceError:
                continue
            except Exception as error:
                failed = failed or error
        if failed is not None:
            raise failed

    def tick(self, context: bpy.types.Context, now: float) -> int:
        """Make the frames that are due at ``now``, seconds, and show the last one; how many it
        made. Raises Over where the session cannot go on, InputError where a setting is wrong.

        If a tick is late, all frames that were due are made and only the last is seen: time is not
        slowed down. What is later than half a second, or would keep Blender ``busy`` for more than
        that share of the time, is lost: then the body is slower than it should be.
        """
        if self._made < 0:
            self._started, self._made = now, 0
        due = int((now - self._started) * MODEL_FPS) - self._made
        if due <= 0:
            return 0

        self._require_all(context)
        self._made += due
        until = perf_counter() + self.busy * due / MODEL_FPS
        late = max(0, due - _MOST_STEPS)
        due -= late

        try:
            if self.furniture.read_again(context, self.settings, self.floor, now):
                self.body.surroundings = self.furniture.surroundings
        except InputError as error:
            raise Over(f"Live ended. {error}") from error

        if self.way:
            self._lead_along_the_way(due)
        lead, temperature = self._lead(), float(self.armature.dafnet.temperature)
        seats = self.furniture.seats(lead.position, self.body.frame.position)
        self.body.seats = self.body.seats if seats is None else seats
        for k in range(due):
            if (started := perf_counter()) > until and k:
                late += due - k
                due = k
                break
            frame = self.body.step(_between(self._last, lead, (k + 1) / due), temperature)
            self.durations.append(perf_counter() - started)
            if self.recording:
                self._keep(frame)

        self._last, self.lost = lead, self.lost + late
        self.milliseconds = 1e3 * float(np.median(self.durations))
        self._show(self.body.frame)
        return due

    # Recording, and a way to go.

    def record(self) -> None:
        """Keep what is played from now on. ``InputError``: the root cannot take the keys of it."""
        require_keyable(self.root, "root")
        self.clips.append(Clip(tuple(self.body.memory)))
        self.recording = True

    def stop_recording(self) -> None:
        """What was played since ``record`` is a clip, unless it is less than two frames."""
        self.recording = False
        if self.clips and len(self.clips[-1].played) < 2:
            self.clips.pop()

    def _keep(self, frame: LiveFrame) -> None:
        self.clips[-1].played.append(frame)
        if len(self.clips[-1].played) >= MAX_FRAMES:
            self.stop_recording()

    def _lead_along_the_way(self, frames: int) -> None:
        """Bring the root along what was drawn; who drags it himself ends that."""
        here, _ = self._root_now()
        if np.linalg.norm(here - self._last.position) > _MOVED:
            self.way.clear()
            return

        body = self.body.frame.position[:2]
        place, yaw = self.way.lead(here[:2], body, frames, self.scale)
        if yaw is not None:
            matrix = array(self.root.matrix_world)
            size = np.linalg.norm(matrix[:3, :3], axis=0)
            matrix[:2, 3] = place / self.unit
            matrix[:3, :3] = yaw_matrix(np.array(yaw)) * size
            self.root.matrix_world = Matrix(matrix.tolist())

    def way_left(self) -> np.ndarray:
        """The way (N, 3) from the root on that is still to be gone, metres; (0, 3) without one."""
        ahead = self.way.left()
        if not len(ahead):
            return np.zeros((0, 3))
        places = np.concatenate([self._last.position[None, :2], ahead])
        return np.column_stack([places, np.full(len(places), self.floor)])

    @property
    def there(self) -> bool:
        """Whether the character and its root are still in the scene."""
        try:
            return all(
                self.scene.objects.get(each.name) == each for each in (self.armature, self.root)
            )
        except ReferenceError:
            return False

    @property
    def floor(self) -> float:
        """Height of the root, metres."""
        return float(self._last.position[2])

    # Reading.

    def _require_all(self, context: bpy.types.Context) -> None:
        """Raises Over where something that the session needs is gone, or is used otherwise."""
        if context.scene != self.scene:
            raise Over("Live ended, since another scene became the active one.")
        try:
            shown = context.view_layer.objects
            for each in (self.armature, self.root):
                if each.name not in shown:
                    raise Over(f"Live ended, since '{each.name}' is no longer in the scene.")
            for role in [r for r, target in self.targets.items() if target.name not in shown]:
                del self.targets[role]
        except ReferenceError:
            raise Over("Live ended, since something that leads it was deleted.") from None
        if lost := [name for name in JOINTS if name not in self.armature.pose.bones]:
            raise Over(f"Live ended, since the bone '{lost[0]}' was renamed or removed.")
        if context.mode not in {"OBJECT", "POSE"}:
            raise Over("Live ended, since it works in object and pose mode only.")
        if bpy.app.is_job_running("RENDER"):
            raise Over("Live ended, since a render began.")

    def _root_now(self) -> tuple[np.ndarray, float]:
        """Place (3,) and yaw of the root as it is dragged, metres."""
        matrix = array(self.root.matrix_world)
        if not np.isfinite(matrix).all():
            raise Over(f"Live ended, since the root '{self.root.name}' is nowhere.")
        path, _ = root_from_matrices(matrix[None])
        return self.unit * path.position[0], float(path.yaw[0])

    def _place(self, target: bpy.types.Object) -> np.ndarray:
        return self.unit * np.array(target.matrix_world.translation)

    def _lead(self) -> Lead:
        """What leads the body now: targets count in EE, and once they have been dragged."""
        position, yaw = self._root_now()
        own, counting = self.armature.dafnet, {}
        for role, target in self.targets.items():
            place = self._place(target)
            dragged = np.linalg.norm(place - self._at_first[role]) > _MOVED
            if (dragged or own.mode == "EE") and getattr(own, f"{role}_influence") > 0.0:
                counting[role] = place
        return Lead(position, yaw, counting)

    # Writing.

    def _show(self, frame: LiveFrame) -> None:
        """Pose the armature."""
        root = RootPath(frame.position[None], np.array([frame.yaw])).matrices()
        posed = channels_of(
            self.armature, frame.joints[None], frame.rotations[None], root, self.unit
        )
        self.armature.location = posed.places[0]
        self.armature.rotation_euler = posed.angles[0]
        bones = self.armature.pose.bones
        bones["pelvis"].location = posed.pelvis[0]
        for name, turn in zip(JOINTS, posed.turns[0].tolist(), strict=True):
            bones[name].rotation_quaternion = turn


def _between(last: Lead, now: Lead, share: float) -> Lead:
    """What leads at some ``share`` of the time between two ticks."""
    turn = (now.yaw - last.yaw + np.pi) % (2.0 * np.pi) - np.pi
    targets = {
        role: (1.0 - share) * last.targets.get(role, place) + share * place
        for role, place in now.targets.items()
    }
    return Lead(
        (1.0 - share) * last.position + share * now.position, last.yaw + share * turn, targets
    )
