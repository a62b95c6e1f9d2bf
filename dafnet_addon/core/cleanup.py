"""After the model: motion is smoothed, hands and feet come out of furniture, planted feet stay
where they are, who rests on a seat is carried by it, head and hands reach their targets exactly.

All is done on joint positions of a body with constant bones, 30 frames a second, and leaves them
constant; the take's own poses are untouched, so that the strengths can be changed without sampling
again. Corrections begin and end softly: what is added to a joint is held or faded where nothing
asks for it. What bends all of the motion comes first; feet before the seat, since they may lower
the pelvis; targets last.
"""

from collections.abc import Generator, Mapping
from dataclasses import astuple, dataclass
from types import MappingProxyType

import numpy as np

from .errors import InputError
from .kinematics import on_bones, two_bone
from .progress import stepwise
from .resting import Distance, across_of, on_legs, rested, sitting, until_free
from .root import gaussian
from .rotations import matrix_from_vector
from .series import MODEL_FPS, runs, smoothstep
from .skeleton import (
    ANKLES,
    END_EFFECTORS,
    FEET,
    FEET_ASKED,
    HIPS,
    JOINTS,
    KNEES,
    LIMBS,
    OFFSETS,
    PARENTS,
    PELVIS,
    TARGETS,
    TOE_HEIGHT,
    joint,
)
from .softness import Support

__all__ = [
    "CleanUp",
    "cleaned",
    "cleared",
    "planted",
    "smoothed_out",
    "reach_targets",
    "standing_still",
    "too_high",
    "with_legroom",
]

_THIGH, _SHIN = (float(np.linalg.norm(OFFSETS[joint("left_" + n)])) for n in ("knee", "ankle"))
_ARMS = {f"hand_{side}": list(LIMBS[f"{side}_arm"]) for side in ("left", "right")}
_UPPER_ARM, _FOREARM = (
    float(np.linalg.norm(OFFSETS[joint("left_" + n)])) for n in ("elbow", "wrist")
)

_LOW = 0.035  # metres over a planted toe base
_SLOW = 0.45  # metres a second that a foot slides and is still meant to stand
_PLANTS = 4  # frames of the shortest stand
_MENDS = 3  # frames of the longest gap in one
_SLIPS = 0.12  # metres from its place at which a foot is let go, while the pelvis moves
_CREEPS = 0.30  # metres at which it is let go though the pelvis rests
_RESTS = 0.1  # metres a second of a pelvis that rests
_CLEAR = 0.015  # metres that a toe base clears the floor by while its foot is put elsewhere
_STRIDES = 0.15, 0.45  # metres a second of a foot that begins to be, and that is
_LIFTS = 5  # frames in which it is lifted and let down
_FADE = 1 / 3  # seconds in which what is added dies away
_SMOOTHING = 2.5  # frames; deviation of the Gaussian at full strength
_SKIN = 0.03  # metres between a wrist or ankle and the surface that it must not sink into
_DEEPEST = 0.20  # metres that it is moved, at most
_STEADY = 3.0  # frames; deviation of the Gaussian over what brings a hand or foot out
_NUDGE = 0.01  # metres; for slopes of the distance
_LEGROOM = 0.02  # metres that furniture keeps the bones of shins and feet away
_SWINGS = 0.15  # metres that a foot is put ahead for that, at most
_LEGROOM_ROUNDS = 2  # knees move with the feet
_ON_SHIN = np.array([0.35, 0.55, 0.75, 1.0])  # places on it that are kept clear
_STRAIGHT = 0.999  # of a leg's or arm's length, which is how far they reach

_FARTHEST_HEAD = 0.20  # metres that the trunk is bent by for the head's target, at most
_FARTHEST_LEAN = 0.25  # metres that it is bent by for a hand's
_SOFT = 0.15  # share of that in which it stops
_SUPPLE = {
    joint(n): share
    for n, share in (
        ("spine1", 0.4),
        ("spine2", 0.4),
        ("spine3", 0.4),
        ("neck", 1.0),
        ("left_collar", 0.3),
        ("right_collar", 0.3),
        ("left_shoulder", 1.0),
        ("right_shoulder", 1.0),
        ("left_elbow", 1.0),
        ("right_elbow", 1.0),
    )
}
"""How willingly joints turn for a target."""
_DAMPING = 0.03  # metres
_ROUNDS = 15  # of least squares
_STEP = 0.10  # metres in one round, at most


@dataclass(frozen=True)
class CleanUp:
    """Strengths from 0 (off) to 1 of what is done after the model: ``feet`` stand still where they
    are planted, head, hands and feet ``reach`` their targets, a body that rests on a ``seat`` is as
    high as that carries it, hands and feet are kept ``clear`` of furniture, and motion is made more
    ``smooth``.
    """

    feet: float = 0.0
    reach: float = 0.0
    seat: float = 0.0
    clear: float = 0.0
    smooth: float = 0.0

    def __post_init__(self) -> None:
        strengths = astuple(self)
        if not all(0.0 <= strength <= 1.0 for strength in strengths):
            raise InputError(
                f"The clean-up's strengths are {', '.join(map(str, strengths))}; give numbers "
                "from 0 to 1."
            )

    @property
    def asked(self) -> bool:
        """Whether anything is to be done."""
        return any(strength > 0.0 for strength in astuple(self))


def _below() -> np.ndarray:
    """(22, 22): whether a joint hangs from another, or is it."""
    out = np.eye(len(JOINTS), dtype=bool)
    for j in range(1, len(JOINTS)):
        out[j] |= out[PARENTS[j]]
    return out


_HANGS = _below()


def _between(offset: np.ndarray, asked: np.ndarray, fps: float = MODEL_FPS) -> np.ndarray:
    """Offsets (T, 3) where they are ``asked`` (T,), led over to the next ones or faded out
    elsewhere.
    """
    longest = max(1, round(_FADE * fps))
    out = np.where(asked[:, None], offset, 0.0)
    for start, end in runs(~asked):
        before = out[start - 1] if start else np.zeros(3)
        after = out[end] if end < len(out) else np.zeros(3)
        t = np.arange(1, end - start + 1, dtype=float)
        rest = end - start + 1
        fade = min(longest, rest)
        out[start:end] = (1 - smoothstep(t / fade))[:, None] * before + smoothstep(
            (t - rest + fade) / fade
        )[:, None] * after

    return out


def standing_still(
    joints: np.ndarray, floor: np.ndarray | float = 0.0, fps: float = MODEL_FPS
) -> list[tuple[int, int, int]]:
    """Stands of both feet: (foot, start, end exclusive), foot 0 is the left one, of joints (T, 22,
    3).

    A foot stands while its toe base is low over the ``floor``, a height or one for each frame, and
    not fast; it is let go, and stands anew, where it has slipped too far for that. What creeps
    under a body that rests stands.
    """

    def speed_of(places: np.ndarray) -> np.ndarray:
        if len(places) < 2:
            return np.zeros(len(places))
        return np.linalg.norm(np.gradient(places, axis=0), axis=-1) * fps

    stands = []
    moves = speed_of(joints[:, PELVIS, :2]) > _RESTS
    for foot, toe in enumerate(FEET):
        place = joints[:, toe]
        speed = speed_of(place)
        on = (place[:, 2] - floor < TOE_HEIGHT + _LOW) & (speed < _SLOW)
        for start, end in runs(~on):
            if start > 0 and end < len(on) and end - start <= _MENDS:
                on[start:end] = (
                    place[start:end, 2] - np.broadcast_to(floor, len(on))[start:end]
                    < TOE_HEIGHT + _LOW
                ).all()

        for start, end in runs(on):
            while end - start >= _PLANTS:
                slipped = np.linalg.norm(place[start:end, :2] - place[start, :2], axis=-1)
                away = slipped > np.where(moves[start:end], _SLIPS, _CREEPS)
                stop = start + int(np.argmax(away)) if away.any() else end
                if stop - start >= _PLANTS:
                    stands.append((foot, int(start), int(stop)))
                start = stop + _PLANTS

    return stands


def planted(
    joints: np.ndarray,
    floor: np.ndarray | float = 0.0,
    strength: float = 1.0,
    targets: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> np.ndarray:
    """Joints (T, 22, 3) with every standing foot held at one place, and those that are put
    elsewhere off the floor meanwhile; legs and, where they do not reach, the pelvis follow.

    Metres, world, 30 frames a second; ``floor``: its height, one or one for each frame. A foot that
    has a target (``reach_targets``) is left to it.
    """
    heights = np.broadcast_to(np.asarray(floor, float), len(joints))
    stands = standing_still(joints, floor)
    moved = np.zeros((len(joints), 2, 3))
    held = np.zeros((len(joints), 2), dtype=bool)
    for foot, start, end in stands:
        toe = joints[start:end, FEET[foot]]
        # Where it is slowest it is nearest to where it should stand.
        speed = np.linalg.norm(np.gradient(toe[:, :2], axis=0), axis=-1)
        place = np.average(toe, axis=0, weights=1.0 / (speed + 1e-3) ** 2)
        place[2] = np.median(heights[start:end]) + TOE_HEIGHT
        moved[start:end, foot] = strength * (place - toe)
        held[start:end, foot] = True

    for foot, name in enumerate(FEET_ASKED):
        asked = _asked(targets, name, len(joints))
        held[asked, foot] = False
        moved[:, foot] = _between(moved[:, foot], held[:, foot])
        toe = joints[:, FEET[foot]] + moved[:, foot] - heights[:, None] * (0.0, 0.0, 1.0)
        moved[:, foot, 2] += strength * _lifted(toe, held[:, foot]) * ~asked

    ankles = joints[:, ANKLES] + moved
    down = _lowered(joints[:, HIPS], ankles, held)
    return on_legs(joints, -down, ankles, joints[:, KNEES] + moved / 2)


def _lifted(toe: np.ndarray, held: np.ndarray) -> np.ndarray:
    """How much higher (T,) a toe base over its floor (T, 3) has to be not to scrape it on the way
    from one place where it is ``held`` (T,) to the next.
    """
    if not held.any():
        return np.zeros(len(toe))

    speed = np.linalg.norm(np.gradient(toe[:, :2], axis=0), axis=-1) * MODEL_FPS
    slow, fast = _STRIDES
    strides = smoothstep((speed - slow) / (fast - slow))
    stands, frames = np.flatnonzero(held), np.arange(len(toe))
    after = np.searchsorted(stands, frames).clip(max=len(stands) - 1)
    away = np.abs(stands[[after, (after - 1).clip(min=0)]] - frames).min(axis=0)
    short = np.clip(TOE_HEIGHT + _CLEAR - toe[:, 2], 0.0, 2.0 * _CLEAR)
    return np.asarray(short * strides * smoothstep(away / _LIFTS))


def _asked(targets: Mapping[str, np.ndarray], name: str, frames: int) -> np.ndarray:
    """Where (T,) something has a target."""
    target = targets.get(name)
    return np.zeros(frames, bool) if target is None else np.isfinite(target).all(-1)


def _lowered(hips: np.ndarray, ankles: np.ndarray, held: np.ndarray) -> np.ndarray:
    """How far down (T,) the pelvis has to go for standing legs (T, 2) to reach their ankles (T, 2,
    3), smooth in time.
    """
    return _covering(too_high(hips, ankles, held))


def too_high(
    hips: np.ndarray, ankles: np.ndarray, held: np.ndarray, straight: float = _STRAIGHT
) -> np.ndarray:
    """How much (T,) the pelvis is too high for legs (T, 2) that are ``held`` to reach from hips to
    ankles (T, 2, 3), stretched to no more than this share of their length.
    """
    reach = straight * (_THIGH + _SHIN)
    across = np.linalg.norm((hips - ankles)[..., :2], axis=-1)
    highest = np.sqrt(np.maximum(reach**2 - across**2, 0.0))
    above = np.where(held & (across < reach), hips[..., 2] - ankles[..., 2] - highest, 0.0)
    return np.asarray(above.max(1).clip(0.0, 0.15))


def _covering(need: np.ndarray) -> np.ndarray:
    """A smooth curve (T,) nowhere under the ``need``: its running maximum, averaged over no more
    than it looks ahead.
    """
    if not need.any():
        return need
    ahead = np.lib.stride_tricks.sliding_window_view(np.pad(need, 5, mode="edge"), 11).max(1)
    kernel = np.hanning(13)[1:-1]
    wide = np.pad(ahead, 5, mode="edge")
    return np.convolve(wide, kernel / kernel.sum(), mode="valid")


def smoothed_out(joints: np.ndarray, strength: float = 1.0) -> np.ndarray:
    """Joints (T, 22, 3) as a Gaussian over time leaves them, on constant bones again."""
    return on_bones(gaussian(joints, _SMOOTHING * strength))


def _out_of(points: np.ndarray, distance: Distance) -> np.ndarray:
    """How (T, N, 3) points (T, N, 3) have to move to be as far from furniture as skin keeps them,
    steady in time.
    """
    depth = np.clip(_SKIN - distance(points), 0.0, _DEEPEST)
    if not depth.any():
        return np.zeros_like(points)
    steps = _NUDGE * np.eye(3)
    slope = np.stack([distance(points + step) - distance(points - step) for step in steps], axis=-1)
    away = slope / np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-6)
    return gaussian(depth[..., None] * away, _STEADY)


def cleared(
    joints: np.ndarray, distance: Distance, targets: dict[str, np.ndarray], strength: float = 1.0
) -> np.ndarray:
    """Joints (T, 22, 3) whose wrists and ankles are out of the furniture, arms and legs following.

    Hands are moved any way that is out, feet level; what has a target (``reaching``) is left to it.
    Sitting thighs and a back that leans on something are not touched.
    """
    wrists = [chain[2] for chain in _ARMS.values()]
    out_of = strength * _out_of(joints[:, [*wrists, *ANKLES]], distance)
    if not out_of.any():
        return joints

    for k, name in enumerate((*_ARMS, *FEET_ASKED)):
        out_of[_asked(targets, name, len(joints)), k] = 0.0

    out_of[:, 2:, 2] = 0.0
    out = on_legs(
        joints,
        np.zeros(len(joints)),
        joints[:, ANKLES] + out_of[:, 2:],
        joints[:, KNEES] + out_of[:, 2:] / 2,
    )
    for k, (shoulder, elbow, wrist) in enumerate(_ARMS.values()):
        goal, pole = joints[:, wrist] + out_of[:, k], joints[:, elbow] + out_of[:, k] / 2
        out[:, elbow], out[:, wrist] = two_bone(
            joints[:, shoulder], goal, pole, _UPPER_ARM, _FOREARM
        )

    return out


def _limited(vectors: np.ndarray, limit: float) -> np.ndarray:
    return vectors * np.minimum(
        1.0, limit / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
    )


def with_legroom(
    joints: np.ndarray,
    support: Support,
    distance: Distance,
    strength: float = 1.0,
    floor: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Joints (T, 22, 3) of which nobody who sits has shins or feet in the furniture: feet stand as
    far ahead as that asks for, from the step before they sit on; feet that hang swing ahead.
    """
    sits, out = sitting(joints, support), joints
    skin = np.where(sits, _LEGROOM, -1.0)
    for _ in range(_LEGROOM_ROUNDS if sits.any() else 0):
        forward = np.cross((0.0, 0.0, 1.0), across_of(out))
        knees, ankles = out[:, KNEES, None], out[:, ANKLES, None]
        points = knees + _ON_SHIN[:, None] * (ankles - knees)
        points = np.concatenate([points, out[:, FEET, None]], axis=2)
        ahead = until_free(points.reshape(len(out), -1, 3), forward, distance, skin)
        need = (ahead.reshape(len(out), 2, -1) / np.append(_ON_SHIN, 1.0)).max(axis=-1)
        if not need.any():
            break

        need = strength * np.minimum(need, _SWINGS)
        moved = gaussian(need, _STEADY)[..., None] * forward[:, None]
        held = need > 0.0
        low = out[:, FEET, 2] - np.reshape(floor, (-1, 1)) < TOE_HEIGHT + _LOW
        for foot in range(2):
            for start, stop in runs(low[:, foot]):
                own = need[start:stop, foot]
                way = (own[:, None] * forward[start:stop]).sum(axis=0)
                moved[start:stop, foot] = own.max() * way / max(float(np.linalg.norm(way)), 1e-9)
                held[start:stop, foot] = True
            moved[:, foot] = _between(moved[:, foot], held[:, foot])
        ankles = out[:, ANKLES] + moved
        down = _lowered(out[:, HIPS], ankles, low)
        out = on_legs(out, -down, ankles, out[:, KNEES] + moved / 2)
    return out


def _softly_limited(vectors: np.ndarray, limit: float) -> np.ndarray:
    """Vectors whose lengths near ``limit`` as they grow, without a kink."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    bend = _SOFT * limit
    over = np.maximum(length - (limit - bend), 0.0)
    return vectors * (
        np.where(over > 0.0, limit - bend * np.exp(-over / bend), length) / np.maximum(length, 1e-9)
    )


def _wished(
    joints: np.ndarray,
    targets: dict[str, np.ndarray],
    strength: float,
    fps: float,
) -> dict[str, np.ndarray]:
    """Where each effector with targets should be in all frames (T, 3): on them, and softly led to
    and from them.
    """
    out = {}
    for name, target in targets.items():
        asked = np.isfinite(target).all(-1)
        if asked.any():
            place = joints[:, TARGETS[name]]
            offset = np.where(asked[:, None], target - place, 0.0)
            out[name] = place + strength * _between(offset, asked, fps)
    return out


def reach_targets(
    joints: np.ndarray,
    targets: dict[str, np.ndarray],
    strength: float = 1.0,
    fps: float = MODEL_FPS,
) -> np.ndarray:
    """Joints (T, 22, 3) whose head, wrists and ankles are at their ``targets``: (T, 3) by the names
    of ``TARGETS``, NaN if free.

    Legs first: they bend to their targets, knees forward, and the pelvis comes down where they are
    too short. Then damped least squares over spine, neck, collars and arms: a straight arm is
    shortened by the trunk rather than by a sudden elbow. A target that is out of reach is
    approached as near as arms and a modest lean allow.
    """
    feet = {name: target for name, target in targets.items() if name in FEET_ASKED}
    joints = _feet_led(joints, _wished(joints, feet, strength, fps), feet)
    upper = {name: target for name, target in targets.items() if name not in FEET_ASKED}
    wished = _wished(joints, upper, strength, fps)
    if not wished:
        return joints

    out, goals = joints.copy(), {}
    for name, goal in wished.items():
        if name == "head":
            base, limit = joints[:, END_EFFECTORS[name]], _FARTHEST_HEAD
        else:
            base, limit = joints[:, _ARMS[name][0]], _UPPER_ARM + _FOREARM + _FARTHEST_LEAN
        goals[END_EFFECTORS[name]] = base + _softly_limited(goal - base, limit)

    damping = np.full(len(joints), _DAMPING)
    for _ in range(_ROUNDS):
        wants = [(j, goal - out[:, j]) for j, goal in goals.items()]
        if max(float(np.abs(want).max()) for _, want in wants) < 1e-4:
            break

        bent = _bent(out, wants, damping)
        # Levenberg and Marquardt: of a target that is out of reach a bold step may lead farther
        # away, to and fro.
        missed, misses = (
            sum(((goal - x[:, j]) ** 2).sum(-1) for j, goal in goals.items()) for x in (out, bent)
        )
        better = misses < missed
        out[better] = bent[better]
        damping = np.where(better, np.maximum(damping / 2.0, _DAMPING), damping * 4.0)

    for name, (shoulder, elbow, wrist) in _ARMS.items():
        if name in wished:
            out[:, elbow], out[:, wrist] = two_bone(
                out[:, shoulder], goals[wrist], out[:, elbow], _UPPER_ARM, _FOREARM
            )

    return out


def _feet_led(
    joints: np.ndarray, wished: Mapping[str, np.ndarray], targets: Mapping[str, np.ndarray]
) -> np.ndarray:
    """Joints whose ankles are where they are ``wished`` (T, 3), by the names of ``FEET_ASKED``;
    toes go with them.
    """
    if not wished:
        return joints

    ankles, held = joints[:, ANKLES].copy(), np.zeros((len(joints), 2), dtype=bool)
    for foot, name in enumerate(FEET_ASKED):
        if name in wished:
            ankles[:, foot], held[:, foot] = wished[name], _asked(targets, name, len(joints))

    moved = ankles - joints[:, ANKLES]
    forward = np.cross((0.0, 0.0, 1.0), across_of(joints))[:, None]
    knees = joints[:, KNEES] + moved / 2
    knees += forward * np.linalg.norm(moved, axis=-1, keepdims=True)
    down = _lowered(joints[:, HIPS], ankles, held)
    return on_legs(joints, -down, ankles, knees)


def _bent(
    joints: np.ndarray, wants: list[tuple[int, np.ndarray]], damping: np.ndarray
) -> np.ndarray:
    """Joints with the trunk turned so that they move as wanted: (joint, displacement (T, 3)); one
    step of least squares with ``damping`` (T,), metres.
    """
    moves = np.concatenate([_limited(want, _STEP) for _, want in wants], axis=1)
    turning = [at for at in _SUPPLE if any(_HANGS[j, at] and j != at for j, _ in wants)]
    columns = []
    for at in turning:
        rows = []
        for j, _ in wants:
            lever = (
                joints[:, j] - joints[:, at]
                if _HANGS[j, at] and j != at
                else np.zeros((len(joints), 3))
            )
            skew = np.zeros((len(joints), 3, 3))
            skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = lever[:, 2], -lever[:, 1], lever[:, 0]
            rows.append(_SUPPLE[at] * (skew - np.swapaxes(skew, 1, 2)))
        columns.append(np.concatenate(rows, axis=1))

    jacobian = np.concatenate(columns, axis=2)
    square = jacobian @ np.swapaxes(jacobian, 1, 2) + (damping**2)[:, None, None] * np.eye(
        moves.shape[1]
    )
    turns = np.einsum("tmn,tm->tn", jacobian, np.linalg.solve(square, moves[..., None])[..., 0])
    joints = joints.copy()
    for k, at in enumerate(turning):
        turn = matrix_from_vector(_SUPPLE[at] * turns[:, 3 * k : 3 * k + 3])
        moving = [j for j in range(len(JOINTS)) if _HANGS[j, at] and j != at]
        arms = joints[:, moving] - joints[:, at, None]
        joints[:, moving] = joints[:, at, None] + np.einsum("tij,tbj->tbi", turn, arms)

    return joints


@stepwise
def cleaned(
    joints: np.ndarray,
    targets: dict[str, np.ndarray],
    settings: CleanUp,
    floor: np.ndarray | float = 0.0,
    support: Support | None = None,
    distance: Distance | None = None,
) -> Generator[float, None, np.ndarray]:
    """Joints (T, 22, 3) after all that ``settings`` ask for; canonical metres, world, 30 frames a
    second, constant bones.

    ``floor``: its height, one or one for each frame; ``support``: what is under the root;
    ``distance``: to the furniture, if there is any. Yields progress.
    """
    if settings.smooth > 0.0:
        joints = smoothed_out(joints, settings.smooth)
        yield 0.2
    if settings.clear > 0.0 and distance is not None:
        joints = cleared(joints, distance, targets, settings.clear)
        yield 0.4
    if settings.feet > 0.0:
        joints = planted(joints, floor, settings.feet, targets)
        yield 0.6
    if settings.seat > 0.0 and support is not None:
        joints = rested(joints, support, settings.seat, distance)
        if distance is not None:
            joints = with_legroom(joints, support, distance, settings.seat, floor)
        yield 0.8
    if settings.reach > 0.0:
        joints = reach_targets(joints, targets, settings.reach)

    return joints
