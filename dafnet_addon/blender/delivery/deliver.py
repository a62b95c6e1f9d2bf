"""Delivers what is wished for of a shot: one folder for each kind, in it one for each take."""

from collections.abc import Generator, Iterator, Sequence
from pathlib import Path

import bpy

from ...core.progress import stepwise, within
from ...core.wishes import Wishes
from .export import export_steps
from .people import Played, takes_to_play
from .render import render_steps
from .truth import truth_of, write_truth

__all__ = ["deliver"]


@stepwise
def deliver(
    scene: bpy.types.Scene, people: Sequence[Played], folder: Path, wishes: Wishes
) -> Generator[float, None, tuple[str, ...]]:
    """Write what is wished for of all takes into ``folder``: ``truth``, ``frames``, ``export``.

    Nothing of the scene is changed. Returns sentences for the user. ``scene`` is the active one.
    Yields progress. Raises InputError where something cannot be written or read.
    """
    warnings: dict[str, None] = {}
    jobs = [
        job
        for number in takes_to_play(people)
        for job in _jobs(people, number, folder=folder, wishes=wishes)
    ]
    for k, job in enumerate(jobs):
        found = yield from within(job, k / len(jobs), (k + 1) / len(jobs))
        warnings |= dict.fromkeys(found)
    return tuple(warnings)


def _jobs(
    people: Sequence[Played], number: int, *, folder: Path, wishes: Wishes
) -> Iterator[Generator[float, None, tuple[str, ...]]]:
    """What is to be done for a take."""
    take = f"take_{number + 1}"
    if wishes.truth or wishes.render:
        yield _seen(people, number, folder=folder, take=take, wishes=wishes)
    if wishes.export:
        yield export_steps(
            bpy.context,
            people,
            number,
            kinds=wishes.export,
            root_motion=wishes.root_motion,
            folder=folder / "export" / take,
        )


def _seen(
    people: Sequence[Played], number: int, *, folder: Path, take: str, wishes: Wishes
) -> Generator[float, None, tuple[str, ...]]:
    """Ground truth, and pictures of it."""
    known = 0.3 if wishes.render else 1.0
    truth = yield from within(truth_of(bpy.context, people, number, wishes.every), 0.0, known)
    if wishes.truth:
        write_truth(truth, folder / "truth" / take)
    if not wishes.render:
        return truth.warnings

    rendered = yield from within(
        render_steps(
            bpy.context,
            people,
            number,
            truth=truth,
            kinds=wishes.render,
            every=wishes.every,
            folder=folder / "frames" / take,
        ),
        known,
        1.0,
    )
    return truth.warnings + rendered
