"""How takes are drawn: people go through the network side by side, and who stays standing before a
seat is drawn anew.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter

import numpy as np

from .beginning import PREROLL
from .cleanup import CleanUp
from .conditions import Shot
from .draws import Draw
from .finishing import finished_steps
from .kept_motion import Kept, kept_before
from .meeting import led_to, met, nearest
from .progress import within
from .resampling import frame_times, resample_positions
from .root import RootPath
from .sampler import Run, Sampler, Samples
from .series import MODEL_FPS
from .skeleton import model_order
from .solids import Scene
from .take import Asked, Take
from .verdict import STANDS
from .wanted import Wanted, wanted_steps
from .weights import Weights

__all__ = ["Drawing", "together"]

Drawing = Generator[float, None, list[list[Take]]]
"""Draws the takes of each of some people, and yields progress in [0, 1]."""
_CONDITIONED = 0.15  # progress when the conditions are known
_LED = 0.5  # progress when a calm take has told where joints would be without targets
_SAMPLED = 0.8  # of the progress of takes that are drawn, when the poses are made
_DRAWN = 0.95  # progress when all takes are drawn once
_AGAIN = 3  # times that one who stays standing before his seat is drawn anew
_DRAWN_ANEW = (
    "With seed {first} the character stays standing before a seat, so it was drawn with {other}."
)


def together(
    people: Sequence[Asked],
    scene: Scene,
    weights: Weights,
    sampler: Sampler,
    *,
    clean_up: CleanUp,
    kept: Callable[[Shot], Kept | None] = kept_before,
    tries: int = 1,
    anew: bool = True,
    shown: Callable[[RootPath, int, np.ndarray], None] | None = None,
) -> Drawing:
    """The takes of people who go through the network side by side. ``kept``, ``tries``, ``shown``:
    of one who is alone: what stays of a motion, how often a part in its middle is tried, and what
    is shown each frame. Who begins with motion that is known has to be alone.

    ``anew``: those that stay standing before a seat on which their root rests, as with some noise
    one does, are drawn anew, with other seeds. Those that stand however they are drawn are as they
    were.
    """
    started, count = perf_counter(), len(people)
    anew = anew and any(draw.temperature > 0.0 for asked in people for draw in asked.draws)
    once = _DRAWN if anew else 1.0
    asked = [each.tried(tries) for each in people]
    job = _all_wanted(asked, scene, weights, sampler)
    wanted = yield from within(job, 0.0, once * _CONDITIONED)
    sampling = _CONDITIONED
    if any(each.in_part for each in wanted):
        sampling = _LED
        job = _led_from_calm(wanted, sampler)
        wanted = yield from within(job, once * _CONDITIONED, once * sampling)

    draw = partial(
        _drawn,
        sampler=sampler,
        clean_up=clean_up,
        stays=kept(wanted[0].shot),
        conditions=(perf_counter() - started) / count,
    )
    found = yield from within(draw(people, wanted, shown=shown), once * sampling, once)
    if anew:

        def redrawn(k: int, draws: tuple[Draw, ...]) -> Drawing:
            return draw([replace(people[k], draws=draws)], [wanted[k].drawn(draws, sampler)])

        found = yield from within(_seated(found, people, redrawn), once, 1.0)
    return found


def _all_wanted(
    people: Sequence[Asked], scene: Scene, weights: Weights, sampler: Sampler
) -> Generator[float, None, list[Wanted]]:
    found: list[Wanted] = []
    for k, asked in enumerate(people):
        job = wanted_steps(scene, asked, weights, sampler)
        found.append((yield from within(job, k / len(people), (k + 1) / len(people))))
    return found


def _led_from_calm(
    wanted: Sequence[Wanted], sampler: Sampler
) -> Generator[float, None, list[Wanted]]:
    """The same where, for targets that count in part, the calm take tells where the joint would be
    without them.
    """
    found = list(wanted)
    partly = [k for k, each in enumerate(wanted) if each.in_part]
    runs = [Run(wanted[k].without(), np.zeros((1, 66))) for k in partly]
    calm = yield from sampler.run_several(runs)
    for k, each in zip(partly, calm, strict=True):
        found[k] = wanted[k].led_from(model_order(each.poses[:, 0]))
    return found


def _drawn(
    people: Sequence[Asked],
    wanted: Sequence[Wanted],
    sampler: Sampler,
    clean_up: CleanUp,
    stays: Kept | None,
    conditions: float,
    shown: Callable[[RootPath, int, np.ndarray], None] | None = None,
) -> Drawing:
    """The takes of people of whom is known what is ``wanted``, in so many seconds each
    (``conditions``).
    """
    started, count, sampling = perf_counter(), len(people), 0.0
    path, runs = wanted[0].shot.path, [each.run() for each in wanted]
    if stays is not None and stays.middle is not None:
        sampling = _SAMPLED / 2
        leading = led_to(sampler, runs[0].conditions, stays.poses, stays.middle[1], runs[0].z)
        runs = [runs[0]._replace(z=(yield from within(leading, 0.0, sampling)))]
    watch = None if shown is None else partial(shown, path)
    poses = None if stays is None else stays.of_takes(runs[0].z.shape[1])
    made = yield from within(sampler.run_several(runs, poses, watch), sampling, _SAMPLED)
    if stays is not None and stays.middle is not None:
        made = [_meeting(made[0], stays.poses, path, stays.middle, len(people[0].draws))]
    seconds = {"conditions": conditions, "sampling": (perf_counter() - started) / count}

    found: list[list[Take]] = []
    for k, samples in enumerate(made):
        low, one = _SAMPLED + (1.0 - _SAMPLED) * k / count, (1.0 - _SAMPLED) / count
        finishing = _finished(people[k], wanted[k].shot, samples, clean_up, seconds)
        found.append((yield from within(finishing, low, low + one)))
    return found


def _seated(
    found: list[list[Take]],
    people: Sequence[Asked],
    redrawn: Callable[[int, tuple[Draw, ...]], Drawing],
) -> Drawing:
    """The takes of people, those ``redrawn`` of one of them that stay standing, until they sit."""
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
            low, high = ((again - 1 + j / len(standing)) / _AGAIN for j in (i, i + 1))
            made = yield from within(redrawn(k, others), low, high)
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
        job = finished_steps(
            made.poses[:, b],
            made.unchanged[:, b],
            action,
            shot,
            controls,
            clean_up,
            density,
            asked.draws[b],
        )
        take = yield from within(job, b / count, (b + 1) / count)
        takes.append(replace(take, seconds=seconds | take.seconds))

    return takes
