"""Scene and controls in, a take out: the one code path under the operator, the command line and the
Python API.
"""

from collections.abc import Callable, Generator, Sequence
from functools import partial

import numpy as np

from .beginning import PREROLL
from .cleanup import CleanUp
from .conditions import Shot, shot_steps
from .drawing import together
from .draws import Draw
from .errors import InputError
from .finishing import finished_steps
from .kept_motion import Kept, kept_before, kept_of
from .live import LiveFrame
from .meeting import TRIES
from .progress import stepwise, within
from .resampling import covering_frames, frame_times, resample_positions
from .root import RootPath, to_root, to_world
from .sampler import Sampler
from .series import MODEL_FPS
from .solids import Scene
from .take import Asked, Controls, Take
from .weights import Weights

__all__ = [
    "RAW",
    "clean_again_steps",
    "crowd_steps",
    "generate",
    "generate_steps",
    "played_take_steps",
    "takes_steps",
]

RAW = CleanUp()
"""The model's own motion."""
_HAIR = 1e-3  # metres, radians, fractions: what comes back from single precision is the same
_FRAMES_AT_ONCE = 12_000  # of all people who are made side by side


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

    def kept(shot: Shot) -> Kept | None:
        if resume is None or resume_frame == 0:
            return kept_before(shot)
        return kept_of(resume, resume_frame, resume_until, controls, shot.path)

    def shown(path: RootPath, frame: int, pose: np.ndarray) -> None:
        if watch is not None and frame >= PREROLL:
            at = RootPath(path.position[frame - PREROLL, None], path.yaw[frame - PREROLL, None])
            watch(frame - PREROLL, to_world(at, pose.reshape(1, 22, 3))[0] * controls.scale)

    yield 0.0
    job = together(
        [Asked(controls, tuple(draws))],
        scene,
        weights,
        Sampler(weights, device),
        clean_up=clean_up,
        kept=kept,
        tries=TRIES if resume_until is not None else 1,
        anew=resume is None or resume_frame == 0,
        shown=shown if watch is not None else None,
    )
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
    others have; who begins with motion that is known is made alone. Raises as ``takes_steps`` does.
    """
    sampler = Sampler(weights, device)
    found: list[list[Take]] = []
    while len(found) < len(people):
        group = people[len(found) : len(found) + _at_once(people[len(found) :])]
        done = len(found) / len(people), (len(found) + len(group)) / len(people)
        job = together(group, scene, weights, sampler, clean_up=clean_up)
        found += yield from within(job, *done)
    return found


def _at_once(people: Sequence[Asked]) -> int:
    """How many of the first people are made side by side: so many as memory suffices for, of whom
    none begins with motion that is known, or one who does.
    """
    begins = [each.controls.before is not None for each in people]
    people = people[: max(1, begins.index(True))] if any(begins) else people
    frames = [covering_frames(len(each.controls), each.controls.fps) + PREROLL for each in people]
    longest = np.maximum.accumulate(frames)
    return max(1, int((longest * np.arange(1, len(frames) + 1) <= _FRAMES_AT_ONCE).sum()))


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
            finished_steps(
                take.poses,
                take.unchanged,
                take.action,
                shot,
                controls,
                clean_up,
                take.log_likelihood,
                take.draw,
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
    draw: Draw,
) -> Generator[float, None, Take]:
    """The take of what was played live (``live.LiveBody``), 30 frames a second, with the clean-up
    that needs a look ahead; nothing is sampled.

    ``controls``: what it was led by, of one mode (``live.controls_of``); ``before``: the frames
    before the first that was ``played``, at least ``PREROLL`` of them; ``draw``: what it was drawn
    with. Raises InputError for what
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
    job = finished_steps(poses, np.zeros((0, 66)), action, shot, controls, clean_up, density, draw)
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
