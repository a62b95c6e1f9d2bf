"""A character that plays a take, and a rig beside it."""

from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.takes import add_take
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.baker import bake
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig import baker, detection, maps
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig.sizing import size_as_rig
from bl_ext.user_default.dafnet.dafnet_addon.core.generate import generate
from bl_ext.user_default.dafnet.dafnet_addon.core.paths import Route, Stop, route
from bl_ext.user_default.dafnet.dafnet_addon.core.solids import Box, Scene
from bl_ext.user_default.dafnet.dafnet_addon.core.take import Controls, Take
from bl_ext.user_default.dafnet.dafnet_addon.core.weights import load_weights

from kit import humanoids
from kit.stage import Stage, bone_heads

__all__ = ["MEASURED", "RigStage", "made_takes"]

# What is measured, by bone: wrists, ankles, head, and the hip joints, whose middle is the pelvis'
# place. Written out here so that a wrong map cannot hide.


def sided(pattern: str, *words: str) -> list[str]:
    return [pattern.format(word) for word in words]


MEASURED: dict[str, dict[str, list[str]]] = {
    "mixamo": {
        "wrists": sided("mixamorig:{}Hand", "Left", "Right"),
        "ankles": sided("mixamorig:{}Foot", "Left", "Right"),
        "head": ["mixamorig:Head"],
        "pelvis": sided("mixamorig:{}UpLeg", "Left", "Right"),
    },
    "rigify": {
        "wrists": sided("DEF-hand.{}", "L", "R"),
        "ankles": sided("DEF-foot.{}", "L", "R"),
        "head": ["DEF-spine.006"],
        "pelvis": sided("DEF-thigh.{}", "L", "R"),
    },
    "rigify_metarig": {
        "wrists": sided("hand.{}", "L", "R"),
        "ankles": sided("foot.{}", "L", "R"),
        "head": ["spine.006"],
        "pelvis": sided("thigh.{}", "L", "R"),
    },
    "smpl_x": {
        "wrists": sided("{}_wrist", "left", "right"),
        "ankles": sided("{}_ankle", "left", "right"),
        "head": ["head"],
        "pelvis": sided("{}_hip", "left", "right"),
    },
    "unreal": {
        "wrists": sided("hand_{}", "l", "r"),
        "ankles": sided("foot_{}", "l", "r"),
        "head": ["head"],
        "pelvis": sided("thigh_{}", "l", "r"),
    },
    "vrm": {
        "wrists": sided("{}Hand", "left", "right"),
        "ankles": sided("{}Foot", "left", "right"),
        "head": ["head"],
        "pelvis": sided("{}UpperLeg", "left", "right"),
    },
    "odd": {
        "wrists": sided("Hand {}", "li", "re"),
        "ankles": sided("Fuss {}", "li", "re"),
        "head": ["Kopf"],
        "pelvis": sided("Schenkel {}", "li", "re"),
    },
}
_AT = {"wrists": (20, 21), "ankles": (7, 8), "head": (15,), "pelvis": (1, 2)}


def made_takes(size: float = 1.0) -> dict[str, Take]:
    """A walk, a sitting down on a box and a writing on a board, by the weights that ship, of a body
    of this ``size``.
    """
    weights = load_weights()

    def box(center: tuple[float, ...], half_size: tuple[float, ...]) -> Scene:
        return Scene((Box(np.array(center), np.array(half_size), np.eye(3)),))

    def made(scene: Scene, root: Route, **given: Any) -> Take:
        controls = Controls(fps=30, root=root.path.matrices(), scale=size, **given)
        return generate(scene, controls, weights, seed=0)

    walk = route(Stop((0, 0), 0.0, 0.2), (0.5, 0.9), Stop((1.2, 1.4), -1.2, 0.2))
    sit = route(Stop((0, 1.4), np.pi, 0.1), Stop((0, 0.2), 0.0, 0.8, seated=True))
    write = route(Stop((0, -0.7), 0.0, 0.1), Stop((0, 0), 0.0, 1.2))
    t = np.arange(len(write.path)) / 30
    hand = np.stack([0.2 + 0.15 * np.sin(2 * t), 0 * t + 0.45, 1.35 + 0.08 * np.cos(3 * t)], axis=1)
    hand *= size
    return {
        "walk": made(Scene(()), walk),
        "sit": made(box((0, 0.1, 0.22), (0.25, 0.25, 0.22)), sit),
        "write": made(box((0, 0.5, 1.4), (0.6, 0.02, 0.4)), write, mode="EE", hand_right=hand),
    }


class RigStage(Stage):
    """A scene in which Ann can play one of ``takes``, and rigs are built and baked onto."""

    def __init__(self, takes: dict[str, Take], unit: float = 1.0) -> None:
        super().__init__(fps=30, unit=unit, furnished=False)
        self.takes = takes
        self.take: Any = None

    def play(self, kind: str) -> None:
        """Let her play a take."""
        self.take = self.takes[kind]
        action = bake(self.take, self.ann, 1, kind)
        controls = Controls(self.take.fps, self.take.root, scale=self.take.scale)
        add_take(self.ann, action, self.take, controls, 1)

    def size_as(self, rig: Any) -> None:
        """Make her as large as the rig, and her takes anew."""
        size_as_rig(bpy.context, self.ann, rig, detection.detect_map(rig))
        self.takes = made_takes(self.ann.scale[0])

    def build(self, kind: str, **body: Any) -> Any:
        """A rig of this convention."""
        try:
            return humanoids.BUILDERS[kind](bpy, **body)
        except RuntimeError as error:
            pytest.skip(f"Rigify does not run here: {error}")

    def map(self, kind: str, rig: Any) -> Any:
        """Its bones: detected, but for the odd one."""
        if kind == "odd":
            return maps.RigMap("Odd", joints=humanoids.ODD, root="Wurzel")
        return detection.detect_map(rig)

    def bake(self, kind: str, rig: Any, **options: Any) -> Any:
        """Bake what she plays onto the rig."""
        return baker.bake_onto_rig(bpy.context, self.ann, rig, self.map(kind, rig), **options)

    def heads(self, rig: Any, names: list[str], frame: int) -> np.ndarray:
        return bone_heads(rig, frame, names)

    def bones(self, rig: Any, names: list[str], step: int = 9) -> np.ndarray:
        """Heads (T, N, 3) of the rig's bones in every ``step``-th frame of the take."""
        frames = range(1, len(self.take) + 1, step)
        return np.array([bone_heads(rig, frame, names) for frame in frames])

    def errors(
        self, kind: str, rig: Any, source: np.ndarray | None = None, step: int = 9
    ) -> dict[str, np.ndarray]:
        """Distances in every ``step``-th frame between the rig's bones and the source's joints; of
        wrists only where hands hold on to something, and none where they never do.
        """
        held = self.take.touches[::step, :2] > 0.99
        source = (self.take.joints if source is None else source)[::step]
        found = {}
        for part, names in MEASURED[kind].items():
            off = self.bones(rig, names, step) - source[:, _AT[part]]
            found[part] = np.linalg.norm(
                off.mean(axis=1, keepdims=True) if part == "pelvis" else off, axis=-1
            )

        found["wrists"] = found["wrists"][held]
        return {part: distances for part, distances in found.items() if distances.size}
