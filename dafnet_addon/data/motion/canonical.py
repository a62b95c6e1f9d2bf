"""Fits every source's skeleton to the canonical body: constant bone lengths, planted feet kept
where they were.

Sources differ in where spines, hips, collars and ankles lie. Each body is scaled by its leg length;
pelvis, chest, head, collars and feet are then calibrated so that the body's own mean upright
posture has the canonical one's directions.
"""

from dataclasses import dataclass

import numpy as np

from ...core.errors import InputError
from ...core.kinematics import two_bone
from ...core.root import root_from_joints
from ...core.rotations import frame_from, normalised, rotate, rotation_between, transpose
from ...core.skeleton import OFFSETS, PELVIS, TOE_HEIGHT, joint
from ..capture.mocap import Clip

__all__ = ["Calibration", "calibrate", "canonical", "pose_legs", "LEG"]

THIGH, SHIN = (float(np.linalg.norm(OFFSETS[joint(n)])) for n in ("left_knee", "left_ankle"))
LEG = THIGH + SHIN
FOOT = float(np.linalg.norm(OFFSETS[joint("left_foot")]))
_HIP_MIDDLE = OFFSETS[joint("left_hip")] * (0, 1, 1)
_FOOT_PITCH = float(np.arctan2(OFFSETS[joint("left_foot")][2], OFFSETS[joint("left_foot")][1]))
_SIDES = (("left_", 1), ("right_", 2))


@dataclass(frozen=True)
class Calibration:
    """One body's constants: ``scale`` to the canonical leg; rotations that take its mean upright
    directions to ours.
    """

    scale: float
    pelvis: np.ndarray
    chest: np.ndarray
    head: np.ndarray
    collars: dict[str, np.ndarray]
    foot_pitch: float
    ankle_height: float


def _columns(joints: np.ndarray, *names: str) -> list[np.ndarray]:
    return [joints[:, joint(n)] for n in names]


def _raw_frames(j: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    lhip, rhip, spine1, spine2 = _columns(j, "left_hip", "right_hip", "spine1", "spine2")
    pelvis = frame_from(rhip - lhip, (spine1 + spine2) / 2 - (lhip + rhip) / 2, "xz")
    lcol, rcol, lsh, rsh, neck = _columns(
        j, "left_collar", "right_collar", "left_shoulder", "right_shoulder", "neck"
    )
    across = normalised(rcol - lcol) + normalised(rsh - lsh)
    return pelvis, frame_from(neck - spine2, across, "zx")


def _mean_rotation(m: np.ndarray) -> np.ndarray:
    u, _, vt = np.linalg.svd(m.mean(0))
    return u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt


def _leg_lengths(j: np.ndarray) -> np.ndarray:
    """(T, 2) thigh plus shin of both legs, in the clip's own metres."""
    hip, knee, ankle = (j[:, [joint(s + n) for s, _ in _SIDES]] for n in ("hip", "knee", "ankle"))
    return np.linalg.norm(hip - knee, axis=-1) + np.linalg.norm(knee - ankle, axis=-1)


def _toe_floor(j: np.ndarray) -> float:
    return float(
        np.percentile(np.minimum(j[:, joint("left_foot"), 2], j[:, joint("right_foot"), 2]), 8)
    )


def calibrate(clips: list[Clip]) -> Calibration:
    """Constants of one body from its clips, read off the frames in which it stands upright on both
    feet or walks.

    Legs are measured there too: where joints come from markers, a bent leg measures up to 15 %
    shorter than a straight one. Raises InputError where the body never stands upright.
    """
    pelvis, chest, head, pitch, ankles, legs = [], [], [], [], [], []
    collars: dict[str, list[np.ndarray]] = {"left_": [], "right_": []}
    tallest = max(float(np.percentile(c.joints[:, PELVIS, 2], 98)) for c in clips)
    for clip in clips:
        j = clip.joints
        trunk = normalised(j[:, joint("neck")] - j[:, 0])
        upright = (j[:, 0, 2] - _toe_floor(j) > 0.9 * min(tallest, 1.1)) & (trunk[:, 2] > 0.92)
        if upright.sum() < 5:
            continue

        yaw = root_from_joints(j).rotation
        raw_pelvis, raw_chest = _raw_frames(j)
        step = max(1, int(upright.sum()) // 400)
        pick = np.flatnonzero(upright)[::step]
        to_root = transpose(yaw[pick])
        legs.append(_leg_lengths(j[pick]))
        pelvis.append(to_root @ raw_pelvis[pick])
        chest.append(to_root @ raw_chest[pick])
        head.append(rotate(to_root, normalised(j[:, joint("head")] - j[:, joint("neck")])[pick]))
        for side, _ in _SIDES:
            collars[side].append(
                rotate(
                    to_root,
                    normalised(j[:, joint(side + "shoulder")] - j[:, joint(side + "collar")])[pick],
                )
            )
            toe, ankle = j[:, joint(side + "foot")], j[:, joint(side + "ankle")]
            low = toe[:, 2] - _toe_floor(j) < 0.015
            still = (
                np.linalg.norm(np.gradient(ankle, axis=0), axis=-1) < 0.004 if len(j) > 2 else low
            )
            planted = low & still & upright
            d = (toe - ankle)[planted]
            pitch.append(np.arctan2(d[:, 2], np.linalg.norm(d[:, :2], axis=-1)))
            ankles.append((ankle[:, 2] - _toe_floor(j))[planted])

    if not legs:
        raise InputError(
            f"The body '{clips[0].source}/{clips[0].subject}' never stands upright in its motion "
            "files; "
            "add a clip in which it stands or walks, so that its skeleton can be fitted."
        )

    scale = LEG / float(np.median(np.concatenate(legs)))
    chest_mean = _mean_rotation(np.concatenate(chest))
    pitches = np.concatenate(pitch)
    heights = np.concatenate(ankles) * scale
    return Calibration(
        scale=scale,
        pelvis=_mean_rotation(np.concatenate(pelvis)).T,
        chest=chest_mean.T,
        head=rotation_between(np.concatenate(head).mean(0), OFFSETS[joint("head")]),
        collars={
            side: rotation_between(np.concatenate(v).mean(0), OFFSETS[joint(side + "shoulder")])
            for side, v in collars.items()
        },
        foot_pitch=float(np.median(pitches)) if len(pitches) > 10 else _FOOT_PITCH,
        ankle_height=float(np.median(heights)) if len(heights) > 10 else 0.06,
    )


def pose_legs(joints: np.ndarray) -> np.ndarray:
    """Legs solved again from hips to ankles as they stand in ``joints`` (T, 22, 3): exact thigh and
    shin, same bend.
    """
    out = joints.copy()
    for side, _ in _SIDES:
        hip, knee, ankle, foot = (joint(side + n) for n in ("hip", "knee", "ankle", "foot"))
        mid, end = two_bone(out[:, hip], joints[:, ankle], joints[:, knee], THIGH, SHIN)
        out[:, knee], out[:, ankle] = mid, end
        out[:, foot] = joints[:, foot] + (end - joints[:, ankle])
    return out


def canonical(clip: Clip, c: Calibration) -> np.ndarray:
    """The clip on the canonical body: joints (T, 22, 3), world, metres, a planted toe base at 0.02
    m.
    """
    j = clip.joints * c.scale
    j = j - [0.0, 0.0, _toe_floor(j) - TOE_HEIGHT]
    raw_pelvis, raw_chest = _raw_frames(j)
    pelvis, chest = raw_pelvis @ c.pelvis, raw_chest @ c.chest
    out = np.zeros_like(j)
    # Legs keep their length between sources, so the ankle's own height is all that lifts or lowers
    # the body.
    lift = np.array([0.0, 0.0, -OFFSETS[joint("left_foot")][2] - c.ankle_height])
    middle = (j[:, joint("left_hip")] + j[:, joint("right_hip")]) / 2 + lift
    out[:, 0] = middle - rotate(pelvis, _HIP_MIDDLE)

    # The spine's inner joints are interpolated: sources place them differently, pelvis and chest
    # they agree on.
    lower_spine = _blended(pelvis, chest, 1 / 3)
    upper_spine = _blended(pelvis, chest, 2 / 3)
    chain = (
        ("spine1", 0, pelvis),
        ("spine2", joint("spine1"), lower_spine),
        ("spine3", joint("spine2"), upper_spine),
    )
    for name, parent, frame in chain:
        out[:, joint(name)] = out[:, parent] + rotate(frame, OFFSETS[joint(name)])
    for name in ("neck", "left_collar", "right_collar"):
        out[:, joint(name)] = out[:, joint("spine3")] + rotate(chest, OFFSETS[joint(name)])

    def along(name: str, parent: str, direction: np.ndarray) -> None:
        out[:, joint(name)] = out[:, joint(parent)] + direction * np.linalg.norm(
            OFFSETS[joint(name)]
        )

    def calibrated(direction: np.ndarray, correction: np.ndarray) -> np.ndarray:
        return rotate(chest, rotate(correction, rotate(transpose(chest), direction)))

    along("head", "neck", calibrated(normalised(j[:, joint("head")] - j[:, joint("neck")]), c.head))
    for side, _ in _SIDES:
        shoulder, elbow, wrist, collar = _columns(
            j, *(side + n for n in ("shoulder", "elbow", "wrist", "collar"))
        )
        along(
            side + "shoulder",
            side + "collar",
            calibrated(normalised(shoulder - collar), c.collars[side]),
        )
        along(side + "elbow", side + "shoulder", normalised(elbow - shoulder))
        along(side + "wrist", side + "elbow", normalised(wrist - elbow))

        hip, knee, ankle, foot = (joint(side + n) for n in ("hip", "knee", "ankle", "foot"))
        out[:, hip] = out[:, 0] + rotate(pelvis, OFFSETS[hip])
        pointing = normalised(j[:, foot] - j[:, ankle])
        level = np.linalg.norm(pointing[:, :2], axis=-1)
        pitch = np.arctan2(pointing[:, 2], level) + (_FOOT_PITCH - c.foot_pitch)
        flat = normalised(pointing * (1, 1, 0), fallback=np.array([0.0, 1.0, 0.0]))
        pointing = (
            flat * np.cos(pitch)[:, None] + np.array([0.0, 0.0, 1.0]) * np.sin(pitch)[:, None]
        )
        out[:, foot] = j[:, foot]
        out[:, ankle] = out[:, foot] - pointing * FOOT
        # The source's knee tells the bend's direction; the offset carries it from its hip and ankle
        # to ours.
        bend = j[:, knee] - (j[:, hip] + j[:, ankle]) / 2
        out[:, knee] = (out[:, hip] + out[:, ankle]) / 2 + bend + pelvis[..., :, 1] * 0.02

    return pose_legs(out)


def _blended(a: np.ndarray, b: np.ndarray, t: float) -> np.ndarray:
    """Rotation between ``a`` and ``b`` (…, 3, 3): z and x axes blended by ``t`` and made
    orthogonal.
    """
    m = (1 - t) * a + t * b
    return frame_from(m[..., :, 2], m[..., :, 0], "zx")
