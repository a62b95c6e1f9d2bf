"""Composed motions: captured pieces joined and combined into what nobody recorded in one go, and
what training needs often.

Walking up to a seat and sitting down, getting up and walking off, working while seated, writing on
a desk or a board, lying down on a bed. All is made of captured motion on the canonical body; what
is added are joins, upper bodies of others and paths of hands.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...core.kinematics import two_bone
from ...core.root import root_from_joints, to_root
from ...core.rotations import normalised, rotate, yaw_matrix
from ...core.series import runs
from ...core.skeleton import PELVIS, SEAT_TO_PELVIS, joint
from ..motion.interactions import miming
from ..motion.motion import Motion, mirrored
from ..motion.retarget import at_top_height
from .hand_paths import AT_DESKS, drawing, lettering, min_jerk_path, wandering
from .joins import (
    FEET,
    LENGTHS,
    ease,
    fit_to_bones,
    frames_of,
    join,
    lead_hand,
    lean_and_turn,
    lend_upper_body,
    presence,
)
from .pieces import (
    BEFORE,
    DIRECTIONS,
    STAYS,
    TOELESS,
    WORKS,
    Composed,
    Piece,
    WalkIndex,
    composition,
    features_of,
    find_walks,
    index_walks,
    sit_downs,
    upper_bodies,
)
from .postures import POSTURES, posture_of, sitting_in

__all__ = ["LEANS", "at_board", "at_top", "composed", "let_down", "seated_work"]

_BUSY = {
    "standing_gesture",
    "social_gesture",
    "greeting",
    "documents",
    "work_standing",
    "reach-hand-task",
    "standing_idle",
}
_AT_DESKS = {"desk_mime"}  # standing: what is above the hips is lent to one who sits
_AT_COUNTERS = {"kitchen_mime"}
_COUNTERS = (0.72, 1.05)  # metres over the floor
_OVER_SEATS = (0.24, 0.33)  # metres from a seat up to a desk
_WRIST_OVER = 0.045  # metres, of one whose hand works on a top
_HIGHEST_BED = 0.62
# metres over a bed: of a body, against the bare floor; and of a wrist whose hand lies on it
_CARRIES, _WRIST_LIES = 0.02, 0.09
_TURNING = 66  # frames of getting onto a bed
_WAITS = 90  # frames
_SITS = 12  # sit-downs of one body that are composed with
_IDLES = 45  # pieces of standing that are used, of many that are alike
_BOARD = np.array([0.0, 0.6])  # from the root that stands before it; or a counter
LEANS = (-0.3, -0.15, 0.0, 0.0, 0.15, 0.3)  # radians; back is positive
_AT_DESK_LEANS = (-0.2, -0.1, 0.0, 0.0, 0.06)


def _to_and_from_seats(
    motions: list[Motion], sits: list[Piece], to: WalkIndex, away: WalkIndex
) -> Iterator[Composed]:
    """Walks that end in a sit-down ("approach"), and stand-ups that go on as a walk ("leave"), all
    around the seat.
    """
    for sit in sits:
        each = 1 if sit.borrowed else 2
        path = root_from_joints(sit.joints)
        seat = rotate(path.rotation[0].T, sit.joints[-1, PELVIS] - path.position[0])[:2]
        down, up = sit.joints, sit.joints[::-1]
        for walk in find_walks(to, features_of(down)[0], seat, each):
            whole = join(walk, down)
            focus = np.arange(60, max(BEFORE + len(down) - STAYS, 90) + 20, 5)
            yield from composition("approach", sit.name, sit.subject, "sit-stand", whole, focus)
        for walk in find_walks(away, features_of(up)[-1], seat, each):
            whole = join(up, walk)
            focus = np.arange(max(0, len(up) - 60), len(whole) - 40, 5)
            yield from composition("leave", sit.name, sit.subject, "sit-stand", whole, focus)


def _waiting(sits: list[Piece]) -> Iterator[Composed]:
    """Standing still before a seat for a while, then sitting down ("wait"), and the same
    reversed.
    """
    for sit in sits:
        stands = np.repeat(sit.joints[:1], _WAITS, axis=0)
        whole = np.concatenate([stands, sit.joints])
        focus = np.arange(0, _WAITS, 5)
        yield from composition("wait", sit.name, sit.subject, "sit-stand", whole, focus)
        yield from composition(
            "wait",
            sit.name + " reversed",
            sit.subject,
            "sit-stand",
            whole[::-1],
            len(whole) - 1 - focus[::-1],
        )


def at_top(
    rng: np.random.Generator,
    joints: np.ndarray,
    start: int,
    end: int,
    height: float,
    farther: float = 0.0,
) -> np.ndarray:
    """The motion with hands that work on a top at ``height`` in frames ``start`` to ``end``,
    wherever its root is then.
    """
    path = root_from_joints(joints)
    origin, turn = path.position[(start + end) // 2], path.rotation[(start + end) // 2]
    out = joints
    for side, sign, course in zip(
        ("left_", "right_"), (-1.0, 1.0), AT_DESKS[rng.integers(len(AT_DESKS))], strict=True
    ):
        if course is not None:
            local = course(rng, len(joints), sign) + np.array([0.0, farther, height])
            first = start + int(rng.integers(0, 12))
            out = lead_hand(
                out,
                side,
                origin + rotate(turn, local),
                presence(len(joints), first, end - int(rng.integers(0, 12))),
            )

    return out


def _leaning(
    rng: np.random.Generator, frames: int, rest: int, leans: Sequence[float]
) -> tuple[np.ndarray, np.ndarray]:
    """How a body leans back and turns on its seat (T,), radians, once it rests; it goes from one of
    ``leans`` to another.
    """
    stops = np.concatenate([[0.0, 0.0], rng.choice(leans, 5) * rng.uniform(0.6, 1.0, 5)])
    lean = min_jerk_path(stops, [rest, *rng.integers(30, 60, 5)])
    lean = np.pad(lean, (0, frames), mode="edge")[:frames]
    begun = 1 - ease((np.arange(frames) - rest) / 40)
    wander = wandering(rng, frames, 2, 30) * (0.02, 0.10) * begun[:, None]
    return lean + wander[:, 0], wander[:, 1]


def seated_work(
    rng: np.random.Generator, sit: np.ndarray, upper: np.ndarray, leans: Sequence[float]
) -> tuple[np.ndarray, int]:
    """A motion (T, 22, 3) that ends seated, gone on for ``WORKS`` frames under another's upper
    body; and where it rests.

    That is 20 frames before the end of ``sit``: from there on ``upper`` (T, 22, 3) is lent and the
    trunk leans, from one of ``leans`` (radians, back is positive) to another.
    """
    body = np.concatenate([sit, np.repeat(sit[-1:], WORKS, axis=0)])
    rest, frames = len(sit) - 20, len(body)
    upper = np.pad(upper, ((rest, frames), (0, 0), (0, 0)), mode="edge")[:frames]
    body = lend_upper_body(body, upper, presence(frames, rest, 2 * frames, 30))
    return lean_and_turn(body, *_leaning(rng, frames, rest, leans)), rest


def at_board(rng: np.random.Generator, joints: np.ndarray, start: int, end: int) -> np.ndarray:
    """The motion with a right hand that writes or draws on a board in frames ``start`` to ``end``,
    before its root there.
    """
    path, middle = root_from_joints(joints), (start + end) // 2
    course = (lettering, lettering, drawing)[rng.integers(3)](rng, len(joints))
    wrist = path.position[middle] + rotate(path.rotation[middle], course)
    return lead_hand(joints, "right_", wrist, presence(len(joints), start, end))


def let_down(joints: np.ndarray, start: int, end: int, top: float) -> np.ndarray:
    """The motion (T, 22, 3) whose hands mimed work in the air in frames ``start`` to ``end``, with
    that work on a top at this height; what they lift, they lift as before. Unchanged where they
    did no such work.
    """
    part = joints[start:end]
    mimed = miming(part, root_from_joints(part))
    if mimed is None:
        return joints

    use = replace(mimed, start=start, end=end)
    return at_top_height(joints, use, top + _WRIST_OVER - float(use.points[:, 2].min()))


def _while_seated(motions: list[Motion], sits: list[Piece]) -> Iterator[Composed]:
    """Seated legs under upper bodies that gesture, greet and reach ("work"), or whose hands work at
    a desk ("desk"): led there, or let down from where somebody mimed it standing.
    """
    rng = np.random.default_rng(12)
    seated = upper_bodies(motions, {"seated_chair", "seated_table"})
    mimed = upper_bodies(motions, _AT_DESKS)
    busy = upper_bodies(motions, _BUSY) + seated + mimed
    for sit in sits * 3:
        for kind, uppers, leans in (
            ("work", busy, LEANS),
            ("desk", seated, _AT_DESK_LEANS),
            ("desk", mimed, _AT_DESK_LEANS),
        ):
            if not uppers:
                continue

            upper = uppers[rng.integers(len(uppers))]
            upper = upper if rng.random() < 0.5 else mirrored(upper)
            body, rest = seated_work(rng, sit.joints, upper, leans)
            frames = len(body)
            if kind == "desk":
                seat = body[rest + 20, PELVIS, 2] - SEAT_TO_PELVIS
                top = float(seat + rng.uniform(*_OVER_SEATS))
                body = (
                    let_down(body, rest + 20, frames, top)
                    if uppers is mimed
                    else at_top(rng, body, rest + 5, frames + 60, top)
                )

            yield from composition(
                kind, sit.name, sit.subject, "seated", body, np.arange(rest, frames - 20, 5)
            )


def _in_postures(motions: list[Motion], sits: list[Piece]) -> Iterator[Composed]:
    """Who has sat down takes a posture and stays in it, or goes on to another; hands and head are
    as of somebody who sits.
    """
    rng = np.random.default_rng(15)
    seated = upper_bodies(motions, {"seated_chair", "seated_table"})
    names, about = list(POSTURES), list(POSTURES.values())
    share = np.array([row[0] for row in about])
    for sit in sits * 2 if seated else ():
        upper = seated[rng.integers(len(seated))]
        body, rest = seated_work(rng, sit.joints, upper, (0.0,))
        count = int(rng.integers(1, 3))
        drawn = [names[k] for k in rng.choice(len(names), count, p=share / share.sum())]
        postures = [posture_of(rng, name) for name in drawn]
        whole = sitting_in(rng, body, rest + 20, postures)
        name = f"{', then '.join(drawn)}, {sit.name}"
        yield from composition(
            "posture", name, sit.subject, "seated", whole, np.arange(rest + 20, len(whole) - 20, 5)
        )


def _while_standing(motions: list[Motion], to: WalkIndex, away: WalkIndex) -> Iterator[Composed]:
    """A walk up to a board ("write") or a counter ("counter"), work there on captured standing, and
    a walk away; at some counters the work is what somebody mimed in a kitchen.
    """
    rng = np.random.default_rng(13)
    mimed = upper_bodies(motions, _AT_COUNTERS)
    behind = range(DIRECTIONS // 4, 3 * DIRECTIONS // 4 + 1)
    idles = upper_bodies([m for m in motions if m.source != TOELESS], {"standing_idle", "standing"})
    for idle in idles[:: max(1, len(idles) // _IDLES)]:
        for stands in (idle, mirrored(idle)):
            features = features_of(stands)
            for kind in ("write", "counter"):
                come, go = (
                    list(find_walks(p, f, _BOARD, 1, behind))
                    for p, f in ((to, features[0]), (away, features[-1]))
                )
                if not come or not go:
                    continue
                whole = join(join(come[rng.integers(len(come))], stands), go[rng.integers(len(go))])
                start, end = BEFORE + 8, BEFORE + WORKS - 4
                if kind == "counter" and mimed and rng.random() < 0.5:
                    whole = _in_a_kitchen(rng, whole, start, end, mimed)
                elif kind == "counter":
                    whole = at_top(rng, whole, start, end, rng.uniform(*_COUNTERS))
                else:
                    whole = at_board(rng, whole, start, end)
                if rng.random() < 0.5:
                    whole = mirrored(whole)
                yield from composition(
                    kind,
                    "standing",
                    "composed",
                    "standing",
                    whole,
                    np.arange(start - 30, end + 30, 5),
                )


def _in_a_kitchen(
    rng: np.random.Generator, joints: np.ndarray, start: int, end: int, mimed: list[np.ndarray]
) -> np.ndarray:
    """The motion whose upper body does in frames ``start`` to ``end`` what somebody mimed, with the
    hands on a counter.
    """
    upper = mimed[rng.integers(len(mimed))]
    upper = upper if rng.random() < 0.5 else mirrored(upper)
    after = len(joints) - BEFORE - len(upper)
    upper = np.pad(upper, ((BEFORE, max(0, after)), (0, 0), (0, 0)), mode="edge")[: len(joints)]
    body = lend_upper_body(joints, upper, presence(len(joints), start, end, 30))
    return let_down(body, start + 30, end - 30, float(rng.uniform(*_COUNTERS)))


def _lying_down(motions: list[Motion]) -> list[np.ndarray]:
    """Captured pieces that begin sitting on the floor, lie back and stay; also made by reversing
    sitting up from lying.
    """
    found = []
    for m in (m for m in motions if m.category == "lying"):
        for joints in (m.joints, m.joints[::-1]):
            trunk = normalised(joints[:, joint("neck")] - joints[:, PELVIS])[:, 2]
            low, face = joints[:, PELVIS, 2] < 0.2, frames_of(joints)[1][:, 2, 1]
            sits = np.flatnonzero(low & (trunk > 0.85))
            for start, _ in runs(low & (np.abs(trunk) < 0.35) & (face > 0.5), 30):
                before = sits[(sits < start) & (sits > start - 60)]
                if len(before):
                    found.append(joints[before[-1] : start + 75])

    return found


def _lifted(joints: np.ndarray, height: float) -> np.ndarray:
    """A body on the floor, on a bed of that height instead; hands that sank into the floor lie on
    it.
    """
    out = joints + np.array([0.0, 0.0, height + _CARRIES])
    for side in ("left_", "right_"):
        wrist = out[:, joint(side + "wrist")].copy()
        over = wrist[:, 2] - height - _WRIST_LIES
        wrist[:, 2] = height + _WRIST_LIES + 0.5 * (over + np.sqrt(over**2 + 0.03**2))
        shoulder, elbow, hand = (joint(side + n) for n in ("shoulder", "elbow", "wrist"))
        out[:, elbow], out[:, hand] = two_bone(
            out[:, shoulder], wrist, out[:, elbow], LENGTHS[elbow], LENGTHS[hand]
        )

    return out


def _onto_the_bed(seated: np.ndarray, lying: np.ndarray, turn: float, inward: float) -> np.ndarray:
    """From one seated pose (22, 3) on a bed's edge to one that sits on the bed along it: the legs
    rise, the body turns.
    """
    t = np.linspace(0.0, 1.0, _TURNING)
    rise, turned, place = (1 - ease(x)[:, None, None] for x in (t / 0.6, (t - 0.15) / 0.85, t))
    poses = []
    for pose in (seated, lying):
        path = root_from_joints(np.repeat(pose[None], 2, axis=0))
        poses.append(to_root(path, np.repeat(pose[None], 2, axis=0))[0])

    a, b = poses
    local = a + (b - a) * place
    feet = [j for pair in FEET for j in pair]
    local[:, feet, 2] = (a + (b - a) * rise)[:, feet, 2] + 0.05 * np.sin(np.pi * rise[:, :, 0])
    yaw = root_from_joints(np.repeat(seated[None], 2, axis=0)).yaw[0]
    origin = (
        seated[0] * (1, 1, 0)
        + rotate(yaw_matrix(np.array(yaw)), np.array([0.0, -inward, 0.0])) * turned[:, 0]
    )
    return fit_to_bones(
        rotate(yaw_matrix(yaw + turn * turned[:, 0, 0])[:, None], local) + origin[:, None]
    )


def _lying(motions: list[Motion], sits: list[Piece]) -> Iterator[Composed]:
    """Sitting down on a bed's edge, turning onto it and lying back ("lie"), and the same
    reversed.
    """
    rng = np.random.default_rng(14)
    pieces = _lying_down(motions)
    for sit in (s for s in sits if pieces and not s.borrowed):
        top = sit.joints[-1, PELVIS, 2] - SEAT_TO_PELVIS
        if top > _HIGHEST_BED:
            continue

        piece = pieces[rng.integers(len(pieces))]
        lies = _lifted(piece if rng.random() < 0.5 else mirrored(piece), top)
        turn, inward = rng.choice([-1.0, 1.0]) * rng.uniform(1.3, 1.7), rng.uniform(0.1, 0.25)
        turning = _onto_the_bed(sit.joints[-1], lies[0], turn, inward)
        whole = join(np.concatenate([sit.joints, turning[1:]]), lies)
        start, frames = len(sit.joints) - 20, len(whole)
        yield from composition(
            "lie", sit.name, sit.subject, "lying", whole, np.arange(start, frames, 5)
        )
        yield from composition(
            "lie",
            sit.name + " reversed",
            sit.subject,
            "lying",
            whole[::-1],
            np.arange(0, frames - start, 5),
        )


def _some_of_each_body(sits: list[Piece]) -> list[Piece]:
    """At most ``_SITS`` sit-downs of one body, spread over all that it has: who sat down a hundred
    times sat much alike.
    """
    bodies: dict[str, list[Piece]] = {}
    for sit in sits:
        bodies.setdefault(sit.subject, []).append(sit)
    return [
        own[k]
        for own in bodies.values()
        for k in np.unique(np.linspace(0, len(own) - 1, _SITS).round().astype(int))
    ]


def composed(motions: list[Motion]) -> list[Composed]:
    """All composed motions of captured ones on the canonical body; the same for the same
    motions.
    """
    to, away = index_walks(motions, arriving=True), index_walks(motions, arriving=False)
    # Windows are seen in a mirror as often as not, whatever they are composed of.
    sits = [sit for sit in sit_downs(motions) if not sit.in_mirror]
    # Many of those with borrowed arms, and all of them begin in front of the seat.
    sits = (
        _some_of_each_body([s for s in sits if not s.borrowed])
        + [s for s in sits if s.borrowed][::9]
    )
    return [
        *_to_and_from_seats(motions, sits, to, away),
        *_waiting(sits),
        *_while_seated(motions, sits),
        *_in_postures(motions, sits),
        *_while_standing(motions, to, away),
        *_lying(motions, sits),
    ]
