"""Scene and controls in, a take out: the one code path under the operator, the command line and the
Python API.
"""

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

import numpy as np

from .beginning import PREROLL
from .cleanup import CleanUp, cleaned, reach_targets
from .conditions import Change, Shot, rolled, shot_steps, targets_of, turns_of
from .draws import Asked, Draw
from .errors import InputError
from .kinematics import Bent, Turn, come_over, global_from_local, local_from_global, turned
from .leaning import lean_findings, lean_of, with_lean
from .live import LiveFrame
from .looking import counting, head_turn, with_chest_turned
from .meeting import TRIES, bent, led_to, met, nearest, on_joints, require_same_root
from .metrics import motion_metrics
from .occupancy import distance
from .progress import stepwise, within
from .resampling import covering_frames, frame_times, resample_positions, resample_rotations
from .root import RootPath, to_root, to_world
from .rotations import continuous_signs, matrix_from_quaternion, quaternion_from_matrix
from .sampler import Conditions, Run, Sampler, Samples, Unchanged
from .series import MODEL_FPS
from .skeleton import UPPER, WRISTS, model_order
from .softness import Support, support_under
from .solids import Scene
from .take import Controls, Take
from .touching import touches
from .verdict import STANDS, verdict
from .weights import Weights

__all__ = [
    "RAW",
    "clean_again_steps",
    "cleaned_up",
    "crowd_steps",
    "generate",
    "generate_steps",
    "played_take_steps",
    "takes_steps",
]

RAW = CleanUp()
"""The model's own motion."""
_Drawing = Generator[float, None, list[list[Take]]]
"""Draws the takes of each of some people, and yields progress in [0, 1]."""
_HAIR = 1e-3  # metres, radians, fractions: what comes back from single precision is the same
_LEAD = 30  # frames before a change of mode that tell how straight limbs were twisted
_CONDITIONED = 0.15  # progress when the conditions are known
_FRAMES_AT_ONCE = 12_000  # of all people who are made side by side
_SAMPLED = 0.85  # progress when the poses are made
_DRAWN = 0.95  # progress when all takes are drawn once
_AGAIN = 3  # times that one who stays standing before his seat is drawn anew
_DRAWN_ANEW = (
    "With seed {first} the character stays standing before a seat, so it was drawn with {other}."
)
_LEGS = slice(len(UPPER), None)  # joints in the model's order
_LEGS_UNHEARD = (
    "These weights were not trained with targets for feet and legs; only Reach Targets brings the "
    "feet there, after the motion is made."
)


@dataclass(frozen=True)
class _Kept:
    """What stays of motion that is known: ``poses`` (PREROLL + N, 66), in the frames of the shot's
    path, but those of the ``middle``, a stretch (first, stop) of the shot's frames that is made
    anew between two that stay.
    """

    poses: np.ndarray
    middle: tuple[int, int] | None = None

    def of_takes(self, takes: int) -> np.ndarray:
        """The poses (PREROLL + N, B, 66) as the sampler takes them."""
        poses = np.repeat(self.poses[:, None], takes, axis=1)
        if self.middle is not None:
            poses[PREROLL + self.middle[0] : PREROLL + self.middle[1]] = np.nan
        return poses


def _kept(resume: Take, frame: int, until: int | None, controls: Controls, path: RootPath) -> _Kept:
    """What is kept of the resumed take: its poses before a frame of the controls, and from the
    frame ``until`` on, in the new path's frames.

    The two may have other rates, and the body another size: it keeps its place in the world beside
    the take's root.
    """
    seconds = len(resume) / resume.fps
    for each, doing in ((frame, "go on"), (until, "come back to it")):
        if each is not None and not 0 < each / controls.fps <= seconds * (1.0 + _HAIR):
            raise InputError(
                f"Frame {each} is not inside the take, which lasts {seconds:.2f} s; {doing} from a "
                "frame in it."
            )
    if until is not None and until <= frame:
        raise InputError(
            f"The part that is made anew ends at frame {until}, before its start at {frame}; give "
            "it a frame at least."
        )

    longest = min(len(resume.path), len(path))
    first = min(covering_frames(frame, controls.fps), longest)
    count = first if until is None else longest
    old = RootPath(
        resume.path.position[:count] * (resume.scale / controls.scale), resume.path.yaw[:count]
    )
    new = RootPath(path.position[:count], path.yaw[:count])
    shot = resume.poses[PREROLL : PREROLL + count].reshape(count, 22, 3)
    poses = np.concatenate(
        [resume.poses[:PREROLL], to_root(new, to_world(old, shot)).reshape(count, 66)]
    )
    if until is None:
        return _Kept(poses)
    stop = min(covering_frames(until + 1, controls.fps) - 1, longest)
    require_same_root(old, new, stop)
    return _Kept(poses, (first, stop))


@stepwise
def cleaned_up(
    joints: np.ndarray, shot: Shot, settings: CleanUp, support: Support | None = None
) -> Generator[float, None, np.ndarray]:
    """Joints (N, 22, 3) of a shot, canonical metres, on constant bones, after all that ``settings``
    ask for; ``support``: what carries the body, where that is known already.
    """
    if settings.seat and support is None:
        support = support_under(shot.scene, shot.path)
    floor = shot.path.position[:, 2]
    reach = partial(distance, shot.scene, floor=floor) if shot.scene.solids else None
    yield 0.2
    targets = targets_of(shot.path, shot.request)
    return (
        yield from within(cleaned.steps(joints, targets, settings, floor, support, reach), 0.2, 1.0)
    )


def _told(share: np.ndarray, weights: Weights) -> np.ndarray:
    """How far joints (N, 22) count for these weights: those of the legs not, where training never
    gave any.
    """
    if weights.heeds_legs:
        return share
    told = share.copy()
    told[:, _LEGS] = 0.0
    return told


def _led_over(observation: np.ndarray, share: np.ndarray, free: np.ndarray) -> np.ndarray:
    """An observation (T, 66) whose targets, which count by their ``share`` (T, 22), are led from
    where joints are ``free``.
    """
    way = np.repeat(share, 3, axis=-1)
    return (1.0 - way) * free + way * observation


def _model_joints(poses: np.ndarray, path: RootPath) -> np.ndarray:
    """World joints (N, 22, 3) of the model's poses (PREROLL + N, 66)."""
    return to_world(path, poses[PREROLL:].reshape(-1, 22, 3))


def _as_unchanged(poses: np.ndarray, unchanged: np.ndarray, change: Change, path: RootPath) -> Bent:
    """The motion (M, …) over a change of mode as it would have gone on: M poses ``unchanged`` (M,
    66) after the take's.
    """
    begin, frames = max(0, change.start - _LEAD), change.frames
    after = RootPath(path.position[begin : frames.stop], path.yaw[begin : frames.stop])
    whole = np.concatenate([poses[begin : PREROLL + change.start], unchanged])
    local, pelvis = bent(_model_joints(whole, after))
    return Bent(local[change.start - begin :], pelvis[change.start - begin :])


def _eased(motion: Bent, poses: np.ndarray, unchanged: np.ndarray, shot: Shot) -> Bent:
    """The model's motion, coming over at changes of mode from the poses ``unchanged`` (M, 66) to
    its own (PREROLL + N, 66).
    """
    changes, used = [], 0
    for change in shot.request.changes:
        own = unchanged[used : used + len(change.ease)]
        changes.append((change.start, change.ease, _as_unchanged(poses, own, change, shot.path)))
        used += len(change.ease)
    return come_over(motion, changes)


def _frames(motion: Bent) -> np.ndarray:
    """Global joint frames (T, 22, 3, 3)."""
    return global_from_local(matrix_from_quaternion(motion.local))


def _turned(motion: Bent, turns: Mapping[str, Turn]) -> Bent:
    """The motion with head, hands and feet turned."""
    local = local_from_global(turned(_frames(motion), turns))
    return motion._replace(local=continuous_signs(quaternion_from_matrix(local)))


def _looked_at(controls: Controls) -> tuple[np.ndarray, np.ndarray]:
    """What is looked at (T, 3), canonical metres, and how far it counts (T,)."""
    if controls.look_at is None:
        return np.full((len(controls), 3), np.nan), np.zeros(len(controls))
    share = controls.look_at_influence
    given = np.ones(len(controls)) if share is None else np.clip(share, 0.0, 1.0)
    return controls.look_at / controls.scale, counting(controls.look_at, given, controls.fps)


def _finished_steps(
    poses: np.ndarray,
    unchanged: np.ndarray,
    action: np.ndarray,
    shot: Shot,
    controls: Controls,
    clean_up: CleanUp,
    log_likelihood: float,
) -> Generator[float, None, Take]:
    """The take of the model's poses (PREROLL + N, 66), with ``action`` (T, K) at the controls'
    rate; yields progress.

    Changes of mode are eased first, so that feet are planted afterwards; what concerns the
    furniture and the floor is cleaned up at the model's rate; targets are reached at the controls'
    own frames, where they are given.
    """
    started = perf_counter()
    source, target = (
        frame_times(len(shot.path), MODEL_FPS),
        frame_times(len(controls), controls.fps),
    )
    same = len(source) == len(target) and np.allclose(source, target)
    floor = shot.own_path.position[:, 2]
    reach = partial(distance, shot.own_scene, floor=floor) if shot.own_scene.solids else None
    targets = targets_of(shot.own_path, shot.own_request)
    support = support_under(shot.own_scene, shot.own_path)
    judged = partial(motion_metrics, fps=controls.fps, floor=floor, targets=targets, distance=reach)

    def at_own_rate(motion: Bent) -> Bent:
        """A motion at the controls' frames."""
        if same:
            return motion
        return Bent(
            resample_rotations(motion.local, source, target),
            resample_positions(motion.pelvis, source, target),
        )

    joints = _model_joints(poses, shot.path)
    motion = _eased(bent(joints), poses, unchanged, shot)
    yield 0.2
    own = at_own_rate(motion)
    before, lean = on_joints(own), None
    metrics = raw = judged(before)
    yield 0.4
    looked_at, counts = _looked_at(controls)
    leans = np.radians(0.0 if controls.lean is None else np.asarray(controls.lean, float))
    if clean_up.asked or counts.any() or leans.any():
        joints = before
        if clean_up.asked:
            joints = yield from within(
                cleaned_up.steps(
                    on_joints(motion), shot, replace(clean_up, reach=0.0), support if same else None
                ),
                0.4,
                0.6,
            )
            if not same:
                joints = on_joints(at_own_rate(bent(joints)))
        yield 0.6
        before = joints
        if leans.any() or counts.any():
            holds = touches(joints, controls.fps, floor, reach, targets)[:, : len(WRISTS)]
        if leans.any():
            lean = lean_of(joints, leans, support, reach, targets, controls.fps)
            joints = with_lean(joints, lean.done, holds, controls.fps)
        if counts.any():
            frames = _frames(bent(joints, controls.fps))
            joints = with_chest_turned(
                joints, frames, looked_at, counts, holds=holds, fps=controls.fps
            )
        if clean_up.reach > 0.0:
            joints = reach_targets(joints, targets, clean_up.reach, controls.fps)

        own = bent(joints, controls.fps)
        yield 0.8
        metrics = judged(on_joints(own))

    yield 1.0

    turns = turns_of(controls, shot.own_path)
    if counts.any():
        look = head_turn(on_joints(own), _frames(own), looked_at, counts, controls.fps)
        own = _turned(own, {"head": look})
    if turns:
        own = _turned(own, turns)

    joints = on_joints(own)
    found = lean_findings(before, joints, lean, shot.own_scene, controls.fps, floor)
    root = RootPath(shot.own_path.position * controls.scale, shot.own_path.yaw)
    return Take(
        fps=controls.fps,
        joints=joints * controls.scale,
        rotations=own.local,
        root=root.matrices(),
        action=action,
        scale=controls.scale,
        poses=poses,
        path=shot.path,
        unchanged=unchanged,
        touches=touches(joints, controls.fps, floor, reach, targets),
        log_likelihood=log_likelihood,
        raw_metrics=raw,
        metrics=metrics,
        verdict=verdict(
            joints, controls.fps, shot.own_path, shot.own_scene, support, targets, found
        ),
        seconds={"fitting": perf_counter() - started},
        warnings=shot.warnings,
    )


@dataclass(frozen=True)
class _Wanted:
    """A shot that is to be sampled, and what it is to be sampled from: ``conditions``, ``changes``
    of mode with what counts of them for the weights, ``share`` (PREROLL + N, 22) of the joints that
    are given, and the noise ``z`` (PREROLL + N, B, 66) of its takes.
    """

    shot: Shot
    conditions: Conditions
    changes: tuple[Change, ...]
    share: np.ndarray
    z: np.ndarray

    @property
    def in_part(self) -> bool:
        """Whether any target counts in part."""
        shares = (self.share, *(change.share for change in self.changes))
        return any(((each > 0.0) & (each < 1.0)).any() for each in shares)

    def without(self) -> Conditions:
        """Those without the targets that count in part."""
        return replace(self.conditions, given=(self.share >= 1.0).astype(float))

    def led_from(self, free: np.ndarray) -> "_Wanted":
        """The same with targets that count in part led from the joints of a calm take (PREROLL + N,
        66), in the model's order.
        """
        changes = tuple(
            replace(
                each,
                observation=_led_over(each.observation, each.share, free[PREROLL:][each.frames]),
            )
            for each in self.changes
        )
        observation = _led_over(self.conditions.observation, self.share, free)
        return replace(
            self, conditions=replace(self.conditions, observation=observation), changes=changes
        )

    def run(self) -> Run:
        """As the sampler takes it."""
        unchanged = [
            Unchanged(PREROLL + each.start, each.observation, (each.share > 0.0).astype(float))
            for each in self.changes
        ]
        return Run(self.conditions, self.z, unchanged)


def _wanted(
    scene: Scene, asked: Asked, weights: Weights, sampler: Sampler
) -> Generator[float, None, _Wanted]:
    shot = yield from shot_steps(scene, asked.controls)
    if not weights.heeds_legs and shot.request.share[:, _LEGS].any():
        shot = replace(shot, warnings=(*shot.warnings, _LEGS_UNHEARD))

    frames = len(shot.conditions)
    z = np.concatenate(
        [
            sampler.noise(frames, d.seed, d.lower_seed, d.temperature, d.lower_temperature, d.held)
            for d in asked.draws
        ],
        axis=1,
    )
    share = rolled(_told(shot.request.share, weights)) * shot.conditions.given
    return _Wanted(
        shot=shot,
        conditions=replace(shot.conditions, given=(share > 0.0).astype(float)),
        changes=tuple(
            replace(each, share=_told(each.share, weights)) for each in shot.request.changes
        ),
        share=share,
        z=z,
    )


def takes_steps(
    scene: Scene,
    controls: Controls,
    weights: Weights,
    draws: Sequence[Draw],
    *,
    resume: Take | None = None,
    resume_frame: int = 0,
    resume_until: int | None = None,
    device: str | None = None,
    clean_up: CleanUp = RAW,
    watch: Callable[[int, np.ndarray], None] | None = None,
) -> Generator[float, None, list[Take]]:
    """Generate takes of one shot side by side, one for each of ``draws``; yields progress in [0,
    1].

    ``resume``: a take whose motion before ``resume_frame`` (a frame of the controls) is kept, and
    gone on from; ``resume_until``: a frame from which it is kept as well, so that only the middle
    is made anew, and meets it. ``device``: None runs on NumPy, else on that torch device.
    ``clean_up``: what is done to the joints after the model; nothing by default. ``watch`` is shown
    each frame of the first take as it is made: its index at 30 fps, and the joints (22, 3) in the
    world, metres. Raises InputError for what cannot be used, WeightsError for weights that do not
    fit.
    """

    def kept(shot: Shot) -> _Kept | None:
        if resume is None or resume_frame == 0:
            return None if shot.before is None else _Kept(shot.before)
        return _kept(resume, resume_frame, resume_until, controls, shot.path)

    def shown(path: RootPath, frame: int, pose: np.ndarray) -> None:
        if watch is not None and frame >= PREROLL:
            at = RootPath(path.position[frame - PREROLL, None], path.yaw[frame - PREROLL, None])
            watch(frame - PREROLL, to_world(at, pose.reshape(1, 22, 3))[0] * controls.scale)

    yield 0.0
    people, sampler = [Asked(controls, tuple(draws))], Sampler(weights, device)
    draw = partial(
        _together, scene=scene, weights=weights, sampler=sampler, clean_up=clean_up, kept=kept
    )
    job = draw(
        people,
        tries=TRIES if resume_until is not None else 1,
        shown=shown if watch is not None else None,
    )
    if resume is None or resume_frame == 0:
        job = _seated(job, people, draw)
    return (yield from job)[0]


def crowd_steps(
    scene: Scene,
    people: Sequence[Asked],
    weights: Weights,
    *,
    device: str | None = None,
    clean_up: CleanUp = RAW,
) -> Generator[float, None, list[list[Take]]]:
    """The takes of each of some people in one scene, who go through the network side by side;
    yields progress in [0, 1].

    Each is as ``takes_steps`` makes him alone, but for rounding, whatever lengths and sizes the
    others have. Raises as ``takes_steps`` does.
    """
    draw = partial(
        _together,
        scene=scene,
        weights=weights,
        sampler=Sampler(weights, device),
        clean_up=clean_up,
    )
    found: list[list[Take]] = []
    while len(found) < len(people):
        group = people[len(found) : len(found) + _at_once(people[len(found) :])]
        done = len(found) / len(people), (len(found) + len(group)) / len(people)
        found += yield from within(_seated(draw(group), group, draw), *done)
    return found


def _at_once(people: Sequence[Asked]) -> int:
    """How many of the first people are made side by side, so that memory suffices."""
    frames = [covering_frames(len(each.controls), each.controls.fps) + PREROLL for each in people]
    longest = np.maximum.accumulate(frames)
    return max(1, int((longest * np.arange(1, len(frames) + 1) <= _FRAMES_AT_ONCE).sum()))


def _together(
    people: Sequence[Asked],
    scene: Scene,
    weights: Weights,
    sampler: Sampler,
    *,
    clean_up: CleanUp,
    kept: Callable[[Shot], _Kept | None] = lambda shot: None,
    tries: int = 1,
    shown: Callable[[RootPath, int, np.ndarray], None] | None = None,
) -> Generator[float, None, list[list[Take]]]:
    """The takes of people who go through the network side by side. ``kept``, ``tries``, ``shown``:
    of one who is alone: what stays of a motion, how often a part in its middle is tried, and what
    is shown each frame.
    """
    started, count = perf_counter(), len(people)
    wanted: list[_Wanted] = []
    for k, asked in enumerate(people):
        job = _wanted(scene, asked.tried(tries), weights, sampler)
        low, high = _CONDITIONED * k / count, _CONDITIONED * (k + 1) / count
        wanted.append((yield from within(job, low, high)))
    conditioned, sampling = perf_counter(), _CONDITIONED

    if partly := [k for k, each in enumerate(wanted) if each.in_part]:
        # Where a target counts in part, the calm take tells where the joint would be without it.
        sampling = (_CONDITIONED + _SAMPLED) / 2
        runs = [Run(wanted[k].without(), np.zeros((1, 66))) for k in partly]
        calm = yield from within(sampler.run_several(runs), _CONDITIONED, sampling)
        for k, each in zip(partly, calm, strict=True):
            wanted[k] = wanted[k].led_from(model_order(each.poses[:, 0]))

    path, stays = wanted[0].shot.path, kept(wanted[0].shot)
    if stays is not None and stays.middle is not None:
        leading = led_to(sampler, wanted[0].conditions, stays.poses, stays.middle[1], wanted[0].z)
        before, sampling = sampling, (sampling + _SAMPLED) / 2
        wanted[0] = replace(wanted[0], z=(yield from within(leading, before, sampling)))
    watch = None if shown is None else partial(shown, path)
    runs = [each.run() for each in wanted]
    poses = None if stays is None else stays.of_takes(runs[0].z.shape[1])
    made = yield from within(sampler.run_several(runs, poses, watch), sampling, _SAMPLED)
    if stays is not None and stays.middle is not None:
        made = [_meeting(made[0], stays.poses, path, stays.middle, len(people[0].draws))]
    now = perf_counter()
    seconds = {
        "conditions": (conditioned - started) / count,
        "sampling": (now - conditioned) / count,
    }

    found: list[list[Take]] = []
    for k, samples in enumerate(made):
        low, one = _SAMPLED + (1.0 - _SAMPLED) * k / count, (1.0 - _SAMPLED) / count
        finishing = _finished(people[k], wanted[k].shot, samples, clean_up, seconds)
        found.append((yield from within(finishing, low, low + one)))
    return found


def _seated(
    job: _Drawing, people: Sequence[Asked], draw: Callable[[Sequence[Asked]], _Drawing]
) -> _Drawing:
    """The takes of people that a ``job`` makes, those drawn anew, with other seeds, that stay
    standing before a seat on which their root rests: with some noise one does. Those that stand
    however they are drawn are as they were. ``draw`` makes the takes of some people.
    """
    found = yield from within(job, 0.0, _DRAWN)
    missed = [
        (k, b)
        for k, takes in enumerate(found)
        for b, take in enumerate(takes)
        if people[k].draws[b].temperature > 0.0 and _stands(take)
    ]
    for again in range(1, _AGAIN + 1):
        standing = sorted({person for person, _ in missed})
        for i, k in enumerate(standing):
            which = [b for person, b in missed if person == k]
            others = tuple(people[k].draws[b].other(again) for b in which)
            asked = replace(people[k], draws=others)
            low, high = (
                _DRAWN + (1.0 - _DRAWN) * (again - 1 + j / len(standing)) / _AGAIN
                for j in (i, i + 1)
            )
            made = yield from within(draw([asked]), low, high)
            for b, other, take in zip(which, others, made[0], strict=True):
                if not _stands(take):
                    told = _DRAWN_ANEW.format(first=people[k].draws[b].seed, other=other.seed)
                    found[k][b] = replace(take, warnings=(*take.warnings, told))
                    missed.remove((k, b))

    yield 1.0
    return found


def _stands(take: Take) -> bool:
    return any(each.word == STANDS for each in take.verdict)


def _meeting(
    made: Samples, kept: np.ndarray, path: RootPath, middle: tuple[int, int], takes: int
) -> Samples:
    """Of the tries for each of the takes the one that comes nearest to what is ``kept`` (PREROLL +
    N, 66) after the middle, led to it.
    """
    count = made.poses.shape[1] // takes
    tried = made.poses.reshape(len(made.poses), takes, count, 66)
    chosen = np.arange(takes) * count + nearest(tried, kept, path, middle)
    made = Samples(*(each[:, chosen] for each in made))
    poses = [met(made.poses[:, k], kept, path, middle) for k in range(takes)]
    return made._replace(poses=np.stack(poses, axis=1))


def _finished(
    asked: Asked, shot: Shot, made: Samples, clean_up: CleanUp, seconds: dict[str, float]
) -> Generator[float, None, list[Take]]:
    """The takes of one person; ``seconds``: that were spent on him before."""
    controls, count = asked.controls, len(asked.draws)
    source, target = (
        frame_times(len(shot.path), MODEL_FPS),
        frame_times(len(controls), controls.fps),
    )
    takes = []
    for b in range(count):
        action = resample_positions(made.actions[PREROLL:, b], source, target)
        density = float(made.log_likelihood[PREROLL:, b].mean())
        job = _finished_steps(
            made.poses[:, b], made.unchanged[:, b], action, shot, controls, clean_up, density
        )
        take = yield from within(job, b / count, (b + 1) / count)
        takes.append(replace(take, seconds=seconds | take.seconds))

    return takes


def clean_again_steps(
    scene: Scene, controls: Controls, take: Take, clean_up: CleanUp
) -> Generator[float, None, Take]:
    """The take with another clean-up, without sampling again; ``scene`` and ``controls`` as it was
    generated with.
    """
    shot = yield from within(shot_steps(scene, controls), 0.0, 0.5)
    if (
        len(controls) != len(take)
        or len(shot.path) != len(take.path)
        or not np.isclose(controls.fps, take.fps, rtol=1e-5)
    ):
        raise InputError("The take has other frames than the controls; generate it again.")

    close = partial(np.allclose, rtol=1e-5, atol=_HAIR)
    same_path = close(shot.path.position, take.path.position) and close(
        shot.path.yaw, take.path.yaw
    )
    if not same_path or not np.isclose(controls.scale, take.scale, rtol=_HAIR):
        raise InputError(
            "The take was made for another root or size than the controls'; generate it again."
        )
    if len(take.unchanged) != sum(len(change.ease) for change in shot.request.changes):
        raise InputError(
            "The take was made for other modes or targets than the controls'; generate it again."
        )

    return (
        yield from within(
            _finished_steps(
                take.poses,
                take.unchanged,
                take.action,
                shot,
                controls,
                clean_up,
                take.log_likelihood,
            ),
            0.5,
            1.0,
        )
    )


def played_take_steps(
    scene: Scene,
    controls: Controls,
    before: Sequence[LiveFrame],
    played: Sequence[LiveFrame],
    clean_up: CleanUp,
) -> Generator[float, None, Take]:
    """The take of what was played live (``live.LiveBody``), 30 frames a second, with the clean-up
    that needs a look ahead; nothing is sampled.

    ``controls``: what it was led by, of one mode (``live.controls_of``); ``before``: the frames
    before the first that was ``played``, at least ``PREROLL`` of them. Raises InputError for what
    cannot be used.
    """
    shot = yield from within(shot_steps(scene, controls), 0.0, 0.5)
    count = len(shot.path)
    if len(before) < PREROLL or len(played) < count or shot.request.changes:
        raise InputError("What was played has other frames than its controls; record it again.")

    kept, scale = played[:count], controls.scale
    own = RootPath(
        np.array([each.position for each in kept]) / scale, np.array([each.yaw for each in kept])
    )
    world = to_world(own, np.array([each.pose for each in kept]).reshape(count, 22, 3))
    poses = np.concatenate(
        [
            np.array([each.pose for each in before[-PREROLL:]]),
            to_root(shot.path, world).reshape(count, 66),
        ]
    )
    source, target = frame_times(count, MODEL_FPS), frame_times(len(controls), controls.fps)
    action = resample_positions(np.array([each.action for each in kept]), source, target)
    density = float(np.mean([each.log_likelihood for each in kept]))
    job = _finished_steps(poses, np.zeros((0, 66)), action, shot, controls, clean_up, density)
    return (yield from within(job, 0.5, 1.0))


@stepwise
def generate(
    scene: Scene,
    controls: Controls,
    weights: Weights,
    *,
    seed: int = 0,
    lower_seed: int | None = None,
    temperature: float = 0.0,
    held: bool = False,
    resume: Take | None = None,
    resume_frame: int = 0,
    resume_until: int | None = None,
    device: str | None = None,
    clean_up: CleanUp = RAW,
) -> Generator[float, None, Take]:
    """Generate one take; yields progress in [0, 1] and returns the ``Take``.

    ``temperature`` scales the take's noise; 0 is the pose at z = 0, 1 the spread of captured takes.
    ``lower_seed``: another seed for the legs. ``held``: see ``Draw``. The rest is as in
    ``takes_steps``.
    """
    takes = yield from takes_steps(
        scene,
        controls,
        weights,
        [Draw(seed, lower_seed, temperature, held=held)],
        resume=resume,
        resume_frame=resume_frame,
        resume_until=resume_until,
        device=device,
        clean_up=clean_up,
    )
    return takes[0]


generate_steps = generate.steps
