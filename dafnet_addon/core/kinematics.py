"""From bones to joints and back: forward kinematics, two-bone limbs, and rotations fitted to generated positions.

A joint's frame places its children: ``child = joint + frame @ OFFSETS[child] * scale``. The identity in every global
frame is the rest pose, a T-pose that looks along +y.
"""

import numpy as np

from .root import RootPath, to_root, to_world
from .rotations import (
    frame_from,
    matrix_from_quaternion,
    normalised,
    quaternion_from_matrix,
    rotate,
    rotation_between,
    slerp,
    transpose,
)
from .skeleton import OFFSETS, PARENTS, UPPER, joint

__all__ = ["forward_kinematics", "global_from_local", "local_from_global", "two_bone", "fit", "on_bones", "blend_switches"]

# Limbs in one order: left and right arm, left and right leg. The rest pose is straight along _AXIS, and the middle
# joint leaves that line along _BEND: elbows go backward, knees forward.
_PARENT, _FIRST, _MIDDLE, _END = [13, 14, 0, 0], [16, 17, 1, 2], [18, 19, 4, 5], [20, 21, 7, 8]
_AXIS = np.array([[-1.0, 0, 0], [1, 0, 0], [0, 0, -1], [0, 0, -1]])
_BEND = np.array([[0.0, -1, 0], [0, -1, 0], [0, 1, 0], [0, 1, 0]])

_ABOVE = list(UPPER[1:])
_SETTLES = 4  # frames
_CLEAR_BEND = 0.25  # a limb bent by this (radians) shows its plane about as clearly as its neighbours in time tell it
_CARRY, _PULL = 4.0, 0.05  # weights of the neighbouring frames and of the parent's reference, against 1 at a clear bend

_HAND_REST = {  # columns: x, the fingers' direction, the back of the hand; as they lie in the rest pose
    "left_wrist": np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]),
    "right_wrist": np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
}


def forward_kinematics(rotations: np.ndarray, pelvis: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """Joints (T, 22, 3) of global joint frames (T, 22, 3, 3) and pelvis positions (T, 3); world, metres."""
    joints = np.empty((*rotations.shape[:-2], 3))
    joints[..., 0, :] = pelvis
    for j in range(1, len(PARENTS)):
        joints[..., j, :] = joints[..., PARENTS[j], :] + rotations[..., PARENTS[j], :, :] @ (scale * OFFSETS[j])
    return joints


def global_from_local(local: np.ndarray) -> np.ndarray:
    """Global joint frames (T, 22, 3, 3) of frames in their parents' frames; the pelvis' is in the world in both."""
    frames = np.empty_like(local)
    frames[..., 0, :, :] = local[..., 0, :, :]
    for j in range(1, len(PARENTS)):
        frames[..., j, :, :] = frames[..., PARENTS[j], :, :] @ local[..., j, :, :]
    return frames


def local_from_global(frames: np.ndarray) -> np.ndarray:
    """Joint frames in their parents' frames (T, 22, 3, 3), of global ones; the pelvis' stays in the world."""
    local = frames.copy()
    local[..., 1:, :, :] = transpose(frames[..., list(PARENTS[1:]), :, :]) @ frames[..., 1:, :, :]
    return local


def two_bone(
    root: np.ndarray, target: np.ndarray, pole: np.ndarray, length1: np.ndarray | float, length2: np.ndarray | float,
    fallback: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Middle and end joint (…, 3) of limbs from ``root`` to ``target``, bent towards the point ``pole``.

    The end lies on the target wherever the bone lengths reach it, else as near as they allow. Where the pole lies on
    the line from root to target, the limb bends along the direction ``fallback`` (…, 3) if given, else as in the last
    frame (first axis) in which the pole was clear, else anywhere.
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
        bend = np.where(clear, bend, _across(_last_clear(bend, clear) if fallback is None else fallback, along))
        least = np.argmin(np.abs(along), axis=-1)
        bend = np.where(np.linalg.norm(bend, axis=-1, keepdims=True) > 1e-8, bend, _across(np.eye(3)[least], along))
    bend = normalised(bend)
    cosine = np.clip((length1**2 + distance**2 - length2**2) / (2.0 * length1 * distance), -1.0, 1.0)
    middle = root + length1 * (cosine * along + np.sqrt(1.0 - cosine**2) * bend)
    return middle, root + distance * along


def _across(v: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """The part of vectors that is perpendicular to the unit vectors ``axis``."""
    return v - (v * axis).sum(-1, keepdims=True) * axis


def _last_clear(values: np.ndarray, clear: np.ndarray) -> np.ndarray:
    """Values (T, …, 3) held from the last frame that is clear (before the first clear one: from that one)."""
    if values.ndim < 2:
        return values
    frames = np.arange(len(values)).reshape((-1,) + (1,) * (values.ndim - 1))
    last = np.maximum.accumulate(np.where(clear, frames, -1), axis=0)
    last = np.where(last < 0, np.argmax(clear, axis=0), last)
    return np.take_along_axis(values, np.broadcast_to(last, values.shape), axis=0)


def fit(
    joints: np.ndarray, scale: float = 1.0, head_rotation: np.ndarray | None = None,
    hand_left_rotation: np.ndarray | None = None, hand_right_rotation: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Pelvis (T, 3) and global joint frames (T, 22, 3, 3) of the body whose bones fit world joints (T, 22, 3) best.

    Bone lengths are those of the canonical body times ``scale``. The pelvis is exact, and so are ankles and wrists
    wherever the limbs reach them. Pelvis from hips and spine1, chest from collars and neck, limbs twisted by the planes
    of elbows and knees; a limb too straight to show its plane takes it from its neighbours in time and from its parent.
    Elbows and knees are hinges. Frames follow one another without a pop as long as the joints do.

    ``head_rotation`` (T, 3, 3): world axes, y where the face looks, z the crown. ``hand_…_rotation`` (T, 3, 3): y where
    the fingers point, z the back of the hand. Head and hands follow their parents where the argument is missing or NaN;
    toes always follow the foot.
    """
    joints = np.asarray(joints, float)
    position = joints.copy()
    frame = np.empty((*joints.shape, 3))

    def place(child: int) -> None:
        parent = PARENTS[child]
        position[:, child] = position[:, parent] + frame[:, parent] @ (scale * OFFSETS[child])

    def aim(at: int, child: int, base: np.ndarray) -> None:
        """Frame of joint ``at``, nearest to ``base``, whose bone points at the child's generated position."""
        frame[:, at] = rotation_between(base @ OFFSETS[child], joints[:, child] - position[:, at]) @ base
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
    head = chest if head_rotation is None else _where_given(head_rotation, np.eye(3), chest)
    aim(12, 15, _between(chest, head, 1 / 2))  # the neck takes its half of the head's twist
    frame[:, 15] = frame[:, 12] if head_rotation is None else _where_given(head_rotation, np.eye(3), frame[:, 12])
    aim(13, 16, chest)
    aim(14, 17, chest)

    frame[:, _FIRST], frame[:, _MIDDLE], position[:, _END] = _limbs(
        frame[:, _PARENT], position[:, _FIRST], joints[:, _MIDDLE], joints[:, _END], scale)
    for name, given in (("left_wrist", hand_left_rotation), ("right_wrist", hand_right_rotation)):
        wrist = joint(name)
        forearm = frame[:, PARENTS[wrist]]
        frame[:, wrist] = forearm if given is None else _where_given(given, _HAND_REST[name], forearm)
    for ankle, toe in ((7, 10), (8, 11)):
        aim(ankle, toe, frame[:, PARENTS[ankle]])
        frame[:, toe] = frame[:, ankle]
    return position[:, 0], frame


def on_bones(joints: np.ndarray) -> np.ndarray:
    """World joints (T, 22, 3) of the canonical body whose bones ``fit`` these best."""
    pelvis, frames = fit(joints)
    return forward_kinematics(frames, pelvis)


def _aligned(joints: np.ndarray, center: int, children: list[int]) -> np.ndarray:
    """Rotation (T, 3, 3) that carries the children's rest offsets nearest to where they lie (Kabsch 1976)."""
    u, _, vt = np.linalg.svd(np.swapaxes(joints[:, children] - joints[:, center, None], 1, 2) @ OFFSETS[children])
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return u @ vt


def _between(a: np.ndarray, b: np.ndarray, t: float) -> np.ndarray:
    """Rotation matrices on the shortest way from ``a`` to ``b``."""
    return matrix_from_quaternion(slerp(quaternion_from_matrix(a), quaternion_from_matrix(b), np.asarray(t)))


def _where_given(axes: np.ndarray, rest: np.ndarray, fallback: np.ndarray) -> np.ndarray:
    """Global frames of a joint whose asked axes lie as ``rest`` in the rest pose; ``fallback`` where NaN."""
    free = ~np.isfinite(axes).all(axis=(1, 2))[:, None, None]
    asked = np.where(free, np.eye(3), axes)
    return np.where(free, fallback, frame_from(asked[..., 1], asked[..., 2], "yz") @ rest.T)


def _limbs(
    parent: np.ndarray, first: np.ndarray, middle: np.ndarray, end: np.ndarray, scale: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frames of the first and of the middle joint (T, 4, 3, 3) of the limbs, and their reached ends (T, 4, 3)."""
    length1 = scale * np.linalg.norm(OFFSETS[_MIDDLE], axis=-1)
    length2 = scale * np.linalg.norm(OFFSETS[_END], axis=-1)
    along = normalised(end - first, rotate(parent, _AXIS))
    reference = rotate(rotation_between(rotate(parent, _AXIS), along) @ parent, _BEND)
    bend = _bend_direction(_across(middle - first, along) / np.minimum(length1, length2)[:, None], along, reference)
    middle, end = two_bone(first, end, first + bend, length1, length2)
    hinge = np.cross(bend, along)
    rest = transpose(frame_from(_AXIS, np.cross(_BEND, _AXIS), "xy"))
    return frame_from(middle - first, hinge, "xy") @ rest, frame_from(end - middle, hinge, "xy") @ rest, end


def _bend_direction(offset: np.ndarray, along: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Unit directions (T, L, 3) in which the middle joints leave their limbs' lines, steady in time.

    ``offset`` (T, L, 3): the middle joint off the line, over the bone length. Its direction, as a point on the unit
    circle around ``along``, is smoothed by least squares: every frame holds to its own with a weight that grows steeply
    with the bend and fades where it opposes the reference (a knee or elbow bent the wrong way by noise), to its
    neighbours, and faintly to ``reference``.
    """
    size = np.linalg.norm(offset, axis=-1)
    seen = (offset * reference).sum(-1) + 1j * (offset * np.cross(along, reference)).sum(-1)
    seen = seen / np.maximum(size, 1e-9)
    weight = (2.0 * size / _CLEAR_BEND) ** 4 * (1.0 + seen.real) / 2.0
    turn = _smoothed_circle(seen, weight)[..., None]
    return normalised(turn.real * reference + turn.imag * np.cross(along, reference), reference)


def _smoothed_circle(seen: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Solve for z (T, L): weight |z - seen|^2 + carry |z - neighbours|^2 + pull |z - 1|^2 least (Thomas algorithm)."""
    n = len(seen)
    neighbours = np.full((n, 1), 2.0)
    neighbours[0] -= 1.0
    neighbours[-1] -= 1.0
    diagonal = weight + _PULL + _CARRY * neighbours
    z = weight * seen + _PULL
    for t in range(1, n):
        ratio = _CARRY / diagonal[t - 1]
        diagonal[t] -= ratio * _CARRY
        z[t] += ratio * z[t - 1]
    z[-1] /= diagonal[-1]
    for t in range(n - 2, -1, -1):
        z[t] = (z[t] + _CARRY * z[t + 1]) / diagonal[t]
    return z


def blend_switches(
    rotations: np.ndarray, pelvis: np.ndarray, path: RootPath, switches: np.ndarray | list[int], length: int = 10,
) -> tuple[np.ndarray, np.ndarray]:
    """Ease the jump where the mode changes: local quaternions (T, 22, 4) and pelvis (T, 3), both again.

    At a switch frame s the pose before it (s - 1) and the new one differ by one rotation a bone; the new motion starts
    with that difference added to it, which then fades by slerp over ``length`` frames with smoothstep((k + 1) / (length
    + 1)) at frame s + k. So the body keeps moving through the switch, where blending from a frozen pose would halt its
    stride. The pelvis' rotation and offset are eased in the frames of the root ``path``, which itself stays as it is.

    The model takes some frames to follow new targets: in them the upper body already has the pose that it comes to, so that
    all of the difference is eased.
    """
    local = matrix_from_quaternion(rotations)
    local[:, 0] = transpose(path.rotation) @ local[:, 0]
    offset = to_root(path, pelvis)
    for s in sorted({int(s) for s in switches if 0 < s < len(local)}):
        settled = min(s + _SETTLES, len(local) - 1)
        local[s:settled, _ABOVE] = local[settled, _ABOVE]
        stop = min(s + length, len(local))
        x = (np.arange(stop - s) + 1.0) / (length + 1.0)
        ease = x * x * (3.0 - 2.0 * x)
        difference = quaternion_from_matrix(local[s - 1] @ transpose(local[s]))
        identity = np.array([1.0, 0.0, 0.0, 0.0])
        rest = matrix_from_quaternion(slerp(difference, identity, ease[:, None]))
        shift = offset[s - 1] - offset[s]
        local[s:stop] = rest @ local[s:stop]
        offset[s:stop] += (1.0 - ease)[:, None] * shift
    local[:, 0] = path.rotation @ local[:, 0]
    blended = quaternion_from_matrix(local)
    blended = np.where((blended * rotations).sum(-1, keepdims=True) < 0, -blended, blended)
    return blended, to_world(path, offset)
