"""From bones to joints and back: forward kinematics, two-bone limbs, and rotations fitted to
generated positions.

A joint's frame places its children: ``child = joint + frame @ OFFSETS[child] * scale``. The
identity in every global frame is the rest pose, a T-pose that looks along +y.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .rotations import (
    continuous_signs,
    frame_from,
    matrix_from_quaternion,
    normalised,
    quaternion_from_matrix,
    rotate,
    rotation_between,
    slerp,
    transpose,
)
from .series import MODEL_FPS
from .skeleton import (
    COLLARS,
    FEET_ASKED,
    LIMB_AXES,
    LIMB_BENDS,
    LIMBS,
    OFFSETS,
    PARENTS,
    PELVIS,
    TARGETS,
    joint,
)

__all__ = [
    "Bent",
    "Turn",
    "bent",
    "come_over",
    "fit",
    "forward_kinematics",
    "global_from_local",
    "local_from_global",
    "on_bones",
    "on_joints",
    "turned",
    "two_bone",
    "with_wrists_at",
]

# Tables of the limbs, in the order of LIMBS.
_PARENT = [*COLLARS, PELVIS, PELVIS]
_FIRST, _MIDDLE, _END = (list(joints) for joints in zip(*LIMBS.values(), strict=True))
_AXIS = np.array([LIMB_AXES[limb] for limb in LIMBS])
_BEND = np.array([LIMB_BENDS[limb] for limb in LIMBS])

# a limb bent by this (radians) shows its plane about as clearly as its neighbours in time tell it
_CLEAR_BEND = 0.25
_CARRY = 4.0  # weight of the neighbouring frames, against 1 at a clear bend
_PULL = 0.05  # weight of the parent's reference

# columns: x, where the face looks or fingers or toes point, crown or back of hand or foot; as they
# lie in the rest pose
_AXES_REST = {
    "head": np.eye(3),
    "hand_left": np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]),
    "hand_right": np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
    "foot_left": np.eye(3),
    "foot_right": np.eye(3),
}


class Turn(NamedTuple):
    """How a head, hand or foot has to be turned: world ``axes`` (T, 3, 3), y where the face looks
    or fingers or toes point, z the crown or the back of the hand or foot; ``share`` (T,): how far
    they count; where that is 0 they may be NaN.
    """

    axes: np.ndarray
    share: np.ndarray


def forward_kinematics(rotations: np.ndarray, pelvis: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """Joints (T, 22, 3) of global joint frames (T, 22, 3, 3) and pelvis positions (T, 3); world,
    metres.
    """
    joints = np.empty((*rotations.shape[:-2], 3))
    joints[..., PELVIS, :] = pelvis
    for j in range(1, len(PARENTS)):
        joints[..., j, :] = joints[..., PARENTS[j], :] + rotations[..., PARENTS[j], :, :] @ (
            scale * OFFSETS[j]
        )
    return joints


def global_from_local(local: np.ndarray) -> np.ndarray:
    """Global joint frames (T, 22, 3, 3) of frames in their parents' frames; the pelvis' is in the
    world in both.
    """
    frames = np.empty_like(local)
    frames[..., 0, :, :] = local[..., 0, :, :]
    for j in range(1, len(PARENTS)):
        frames[..., j, :, :] = frames[..., PARENTS[j], :, :] @ local[..., j, :, :]
    return frames


def local_from_global(frames: np.ndarray) -> np.ndarray:
    """Joint frames in their parents' frames (T, 22, 3, 3), of global ones; the pelvis' stays in the
    world.
    """
    local = frames.copy()
    local[..., 1:, :, :] = transpose(frames[..., list(PARENTS[1:]), :, :]) @ frames[..., 1:, :, :]
    return local


def two_bone(
    root: np.ndarray,
    target: np.ndarray,
    pole: np.ndarray,
    length1: np.ndarray | float,
    length2: np.ndarray | float,
    fallback: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Middle and end joint (…, 3) of limbs from ``root`` to ``target``, bent towards the point
    ``pole``.

    The end lies on the target wherever the bone lengths reach it, else as near as they allow. Where
    the pole lies on the line from root to target, the limb bends along the direction ``fallback``
    (…, 3) if given, else as in the last frame (first axis) in which the pole was clear, else
    anywhere.
    """
    root, target, pole = np.broadcast_arrays(root, target, pole)
    length1, length2 = np.asarray(length1, float)[..., None], np.asarray(length2, float)[..., None]
    reach = length1 + length2
    distance = np.linalg.norm(target - root, axis=-1, keepdims=True)
    distance = np.clip(distance, np.abs(length1 - length2) + 1e-12 * reach, (1.0 - 1e-12) * reach)
    along = normalised(target - root, np.array([0.0, 0.0, -1.0]))
    bend = _across(pole - root, along)
    clear = np.linalg.norm(bend, axis=-1, keepdims=True) > 1e-6 * reach
    if not clear.all():
        bend = np.where(
            clear, bend, _across(_last_clear(bend, clear) if fallback is None else fallback, along)
        )
        least = np.argmin(np.abs(along), axis=-1)
        bend = np.where(
            np.linalg.norm(bend, axis=-1, keepdims=True) > 1e-8,
            bend,
            _across(np.eye(3)[least], along),
        )

    bend = normalised(bend)
    cosine = np.clip(
        (length1**2 + distance**2 - length2**2) / (2.0 * length1 * distance), -1.0, 1.0
    )
    middle = root + length1 * (cosine * along + np.sqrt(1.0 - cosine**2) * bend)
    return middle, root + distance * along


def with_wrists_at(joints: np.ndarray, wrists: np.ndarray, elbows: np.ndarray) -> np.ndarray:
    """Joints (T, 22, 3) of the canonical body whose arms reach ``wrists`` (T, 2, 3), bent towards
    ``elbows`` (T, 2, 3).
    """
    out = joints.copy()
    for k, side in enumerate(("left", "right")):
        shoulder, elbow, wrist = LIMBS[f"{side}_arm"]
        upper, lower = (float(np.linalg.norm(OFFSETS[j])) for j in (elbow, wrist))
        out[:, elbow], out[:, wrist] = two_bone(
            out[:, shoulder], wrists[:, k], elbows[:, k], upper, lower
        )
    return out


def _across(v: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """The part of vectors that is perpendicular to the unit vectors ``axis``."""
    return v - (v * axis).sum(-1, keepdims=True) * axis


def _last_clear(values: np.ndarray, clear: np.ndarray) -> np.ndarray:
    """Values (T, …, 3) held from the last frame that is clear (before the first clear one: from
    that one).
    """
    if values.ndim < 2:
        return values
    frames = np.arange(len(values)).reshape((-1,) + (1,) * (values.ndim - 1))
    last = np.maximum.accumulate(np.where(clear, frames, -1), axis=0)
    last = np.where(last < 0, np.argmax(clear, axis=0), last)
    return np.take_along_axis(values, np.broadcast_to(last, values.shape), axis=0)


def fit(
    joints: np.ndarray, scale: float = 1.0, fps: float = MODEL_FPS
) -> tuple[np.ndarray, np.ndarray]:
    """Pelvis (T, 3) and global joint frames (T, 22, 3, 3) of the body whose bones fit world joints
    (T, 22, 3) best.

    Bone lengths are those of the canonical body times ``scale``. The pelvis is exact, and so are
    ankles and wrists wherever the limbs reach them. Pelvis from hips and spine1, chest from collars
    and neck, limbs twisted by the planes of elbows and knees; a limb too straight to show its plane
    takes it from its neighbours in time and from its parent. Elbows and knees are hinges. Frames
    follow one another without a pop as long as the joints do; ``fps``: how many of them there are a
    second. Head and hands follow their parents (else: ``turned``), toes the foot.
    """
    joints = np.asarray(joints, float)
    position = joints.copy()
    frame = np.empty((*joints.shape, 3))

    def place(child: int) -> None:
        parent = PARENTS[child]
        position[:, child] = position[:, parent] + frame[:, parent] @ (scale * OFFSETS[child])

    def aim(at: int, child: int, base: np.ndarray) -> None:
        """Frame of joint ``at``, nearest to ``base``, whose bone points at the child's generated
        position.
        """
        frame[:, at] = (
            rotation_between(base @ OFFSETS[child], joints[:, child] - position[:, at]) @ base
        )
        place(child)

    frame[:, 0] = _aligned(joints, 0, [1, 2, 3])
    chest = _aligned(joints, 9, [12, 13, 14])
    for child in (1, 2, 3):
        place(child)

    aim(3, 6, _between(frame[:, 0], chest, 1 / 3))
    aim(6, 9, _between(frame[:, 0], chest, 2 / 3))
    frame[:, 9] = chest
    for child in (12, 13, 14):
        place(child)

    # the chest's, rounded as when the head is turned: figures hold to the last bit
    aim(12, 15, _between(chest, chest, 1 / 2))
    frame[:, 15] = frame[:, 12]
    aim(13, 16, chest)
    aim(14, 17, chest)

    frame[:, _FIRST], frame[:, _MIDDLE], position[:, _END] = _limbs(
        frame[:, _PARENT], position[:, _FIRST], joints[:, _MIDDLE], joints[:, _END], scale, fps
    )
    for wrist in (20, 21):
        frame[:, wrist] = frame[:, PARENTS[wrist]]
    for ankle, toe in ((7, 10), (8, 11)):
        aim(ankle, toe, frame[:, PARENTS[ankle]])
        frame[:, toe] = frame[:, ankle]

    return position[:, 0], frame


def on_bones(joints: np.ndarray) -> np.ndarray:
    """World joints (T, 22, 3) of the canonical body whose bones ``fit`` these best."""
    pelvis, frames = fit(joints)
    return forward_kinematics(frames, pelvis)


def _aligned(joints: np.ndarray, center: int, children: list[int]) -> np.ndarray:
    """Rotation (T, 3, 3) that carries the children's rest offsets nearest to where they lie (Kabsch
    1976).
    """
    u, _, vt = np.linalg.svd(
        np.swapaxes(joints[:, children] - joints[:, center, None], 1, 2) @ OFFSETS[children]
    )
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return u @ vt


def _between(a: np.ndarray, b: np.ndarray, t: float | np.ndarray) -> np.ndarray:
    """Rotation matrices on the shortest way from ``a`` to ``b``."""
    return matrix_from_quaternion(
        slerp(quaternion_from_matrix(a), quaternion_from_matrix(b), np.asarray(t))
    )


def turned(frames: np.ndarray, turns: Mapping[str, Turn]) -> np.ndarray:
    """Global joint frames (T, 22, 3, 3) with head, hands and feet turned as ``turns`` ask, by the
    names of ``TARGETS``.

    The neck takes its half of the head's twist. No joint moves but a turned foot's toes.
    """
    out = frames.copy()
    for name, (axes, share) in turns.items():
        at, given = TARGETS[name], (share > 0.0)[:, None, None]
        axes = np.where(given, axes, np.eye(3))
        asked = frame_from(axes[..., 1], axes[..., 2], "yz") @ _AXES_REST[name].T
        if name == "head":
            neck, chest = PARENTS[at], frames[:, joint("spine3")]
            half = _between(chest, asked, share / 2.0)
            bone = rotation_between(half @ OFFSETS[at], frames[:, neck] @ OFFSETS[at])
            out[:, neck] = np.where(given, bone @ half, frames[:, neck])

        # Hands, and the head, go on as their parents where they are free; a foot as it was made.
        free = out[:, at] if name in FEET_ASKED else out[:, PARENTS[at]]
        part = np.where(given, _between(free, asked, share), free)
        out[:, at] = np.where((share >= 1.0)[:, None, None], asked, part)
        if name in FEET_ASKED:
            out[:, PARENTS.index(at)] = out[:, at]

    return out


def _limbs(
    parent: np.ndarray,
    first: np.ndarray,
    middle: np.ndarray,
    end: np.ndarray,
    scale: float,
    fps: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frames of the first and of the middle joint (T, 4, 3, 3) of the limbs, and their reached ends
    (T, 4, 3).
    """
    length1 = scale * np.linalg.norm(OFFSETS[_MIDDLE], axis=-1)
    length2 = scale * np.linalg.norm(OFFSETS[_END], axis=-1)
    along = normalised(end - first, rotate(parent, _AXIS))
    reference = rotate(rotation_between(rotate(parent, _AXIS), along) @ parent, _BEND)
    bend = _bend_direction(
        _across(middle - first, along) / np.minimum(length1, length2)[:, None],
        along,
        reference,
        fps,
    )
    middle, end = two_bone(first, end, first + bend, length1, length2)
    hinge = np.cross(bend, along)
    rest = transpose(frame_from(_AXIS, np.cross(_BEND, _AXIS), "xy"))
    return (
        frame_from(middle - first, hinge, "xy") @ rest,
        frame_from(end - middle, hinge, "xy") @ rest,
        end,
    )


def _bend_direction(
    offset: np.ndarray, along: np.ndarray, reference: np.ndarray, fps: float
) -> np.ndarray:
    """Unit directions (T, L, 3) in which the middle joints leave their limbs' lines, steady in
    time.

    ``offset`` (T, L, 3): the middle joint off the line, over the bone length. Its direction, as a
    point on the unit circle around ``along``, is smoothed by least squares: every frame holds to
    its own with a weight that grows steeply with the bend and fades where it opposes the reference
    (a knee or elbow bent the wrong way by noise), to its neighbours, and faintly to ``reference``.
    """
    size = np.linalg.norm(offset, axis=-1)
    seen = (offset * reference).sum(-1) + 1j * (offset * np.cross(along, reference)).sum(-1)
    seen = seen / np.maximum(size, 1e-9)
    weight = (2.0 * size / _CLEAR_BEND) ** 4 * (1.0 + seen.real) / 2.0
    turn = _smoothed_circle(seen, weight, _CARRY * (fps / MODEL_FPS) ** 2)[..., None]
    return normalised(turn.real * reference + turn.imag * np.cross(along, reference), reference)


def _smoothed_circle(seen: np.ndarray, weight: np.ndarray, carry: float) -> np.ndarray:
    """Solve for z (T, L): weight |z - seen|^2 + carry |z - neighbours|^2 + pull |z - 1|^2 least
    (Thomas algorithm).
    """
    n = len(seen)
    neighbours = np.full((n, 1), 2.0)
    neighbours[0] -= 1.0
    neighbours[-1] -= 1.0
    diagonal = weight + _PULL + carry * neighbours
    z = weight * seen + _PULL
    for t in range(1, n):
        ratio = carry / diagonal[t - 1]
        diagonal[t] -= ratio * carry
        z[t] += ratio * z[t - 1]

    z[-1] /= diagonal[-1]
    for t in range(n - 2, -1, -1):
        z[t] = (z[t] + carry * z[t + 1]) / diagonal[t]

    return z


class Bent(NamedTuple):
    """A body's motion: ``local`` quaternions (T, 22, 4), the pelvis' in the world, and the pelvis'
    positions (T, 3), world.
    """

    local: np.ndarray
    pelvis: np.ndarray


def bent(joints: np.ndarray, fps: float = MODEL_FPS) -> Bent:
    """The motion of the body whose bones fit joints (T, 22, 3) best."""
    pelvis, frames = fit(joints, fps=fps)
    return Bent(continuous_signs(quaternion_from_matrix(local_from_global(frames))), pelvis)


def on_joints(motion: Bent) -> np.ndarray:
    """The joints (T, 22, 3) of a motion."""
    frames = global_from_local(matrix_from_quaternion(motion.local))
    return forward_kinematics(frames, motion.pelvis)


def come_over(motion: Bent, changes: Sequence[tuple[int, np.ndarray, Bent]]) -> Bent:
    """A motion that comes over where something changes, from what would have been to what is.

    ``changes``, in order: the first frame; how far the ``motion`` counts at it and those after it
    (M,); how the body would move in these frames (M, …) if nothing had changed there. Bones turn
    from one to the other by slerp, so nothing is added where both agree: a planted foot stands, a
    stride goes on. What would have been after an earlier change comes over by that first.
    """
    local, pelvis = motion.local.copy(), motion.pelvis.copy()
    before: tuple[int, np.ndarray, Bent] | None = None
    for start, ease, other in changes:
        frames = slice(start, start + len(ease))
        if before is not None and (rest := before[0] + len(before[1]) - start) > 0:
            tail = Bent(before[2].local[-rest:], before[2].pelvis[-rest:])
            led = _mixed(tail, Bent(other.local[:rest], other.pelvis[:rest]), before[1][-rest:])
            other = Bent(*(np.concatenate([a, b[rest:]]) for a, b in zip(led, other, strict=True)))

        local[frames], pelvis[frames] = _mixed(
            other, Bent(motion.local[frames], motion.pelvis[frames]), ease
        )
        before = start, ease, other

    return Bent(local, pelvis)


def _mixed(first: Bent, second: Bent, share: np.ndarray) -> Bent:
    """From the first motion to the second, by ``share`` (T,)."""
    way = share[:, None]
    return Bent(
        slerp(first.local, second.local, way), (1.0 - way) * first.pelvis + way * second.pelvis
    )
