"""A list of shots is made: those that are not there yet, or would be others now."""

import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from ..core.errors import InputError
from ..core.files import remove_abandoned, require_replaceable, save_text
from ..core.manifest import content_hash, current_version, read_manifest
from ..core.stopping import Stop
from ..core.text import nearest_known, printable
from ..core.weights import shipped_weights
from .lists import ListedShot
from .local import Workers
from .making import SAYS, Order, Outcome

__all__ = ["MARKER", "Batch", "chosen", "look", "make_batch"]

MARKER = "batch.json"
"""A folder that has it is a batch of ours."""

_LAST_WORDS = 4096  # bytes of a log that are looked through for why it failed


@dataclass(frozen=True)
class Batch:
    """Where a list of shots is made: each in a folder of its name in ``output``, its log in
    ``logs``. ``weights``: a file, None for those that ship. ``program``: see ``Order``.
    """

    shots: tuple[ListedShot, ...]
    output: Path
    weights: Path | None = None
    program: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        # wherever shots are made
        object.__setattr__(self, "output", Path(os.path.abspath(self.output)))

    def folder(self, name: str) -> Path:
        """That of a shot."""
        return self.output / name

    def log(self, name: str) -> Path:
        """What the process said that made a shot, or could not."""
        return self.output / "logs" / f"{name}.log"

    def order(self, shot: ListedShot) -> Order:
        """What it takes to make a shot, wherever that is."""
        return Order(
            name=shot.name,
            words=shot.words,
            folder=self.folder(shot.name),
            log=self.log(shot.name),
            weights=self.weights,
            program=self.program,
        )


def chosen(shots: Sequence[ListedShot], only: Iterable[str]) -> tuple[ListedShot, ...]:
    """Those shots that are named: by name, by pattern (``hall_*``), by number (``3``, the first is
    1) or from one number to another (``1:100``), in the order of the list.

    Raises InputError for what names none.
    """
    wanted: set[str] = set()
    for word in only:
        numbers = re.fullmatch(r"(\d{1,9})(?::(\d{1,9}))?", word)
        if numbers:
            first, last = int(numbers[1]), int(numbers[2] or numbers[1])
            found = [shot.name for shot in shots[max(first - 1, 0) : last]]
        else:
            found = [shot.name for shot in shots if fnmatchcase(shot.name, word)]
        if not found:
            known = nearest_known(word, [shot.name for shot in shots])
            raise InputError(f"No shot of the list is called '{printable(word, 40)}'; {known}")
        wanted |= {*found}
    return tuple(shot for shot in shots if shot.name in wanted)


def look(batch: Batch) -> Iterator[Outcome]:
    """What is there of each shot, without making any: "unchanged", "failed" with what its log says
    last, or "missing" with what has changed since, if it was ever made.
    """
    weights = content_hash(batch.weights or shipped_weights())
    for shot in batch.shots:
        if shot.refusal:
            yield Outcome(shot.name, "failed", shot.refusal)
            continue
        manifest = read_manifest(batch.folder(shot.name))
        changed = manifest and manifest.what_changed(shot.words_hash, weights)
        if manifest and not changed:
            yield Outcome(shot.name, "unchanged", seconds=manifest.all_seconds)
        elif said := _last_sentence(batch.log(shot.name)):
            yield Outcome(shot.name, "failed", said, log=batch.log(shot.name))
        else:
            yield Outcome(shot.name, "missing", changed or "")


def _last_sentence(log: Path) -> str:
    """Why a shot failed, as its log says it."""
    try:
        with log.open("rb") as file:
            file.seek(max(0, log.stat().st_size - _LAST_WORDS))
            lines = file.read().decode("utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    said = [line.strip().removeprefix(SAYS) for line in lines if line.strip().startswith(SAYS)]
    return printable(said[-1], 1000) if said else ""


def make_batch(
    batch: Batch,
    workers: AbstractContextManager[Workers],
    *,
    progress: Callable[[float], None] = lambda share: None,
    tell: Callable[[Outcome], None] = lambda outcome: None,
) -> list[Outcome]:
    """Make what is not there yet, or has changed; what became of every shot, in the list's order.

    ``tell`` is called with every outcome as soon as it is known, ``progress`` with the share of
    what is to be made that is done. Stopped at any time, by Ctrl-C or killed, it goes on where it
    was. Raises InputError, before anything is made, where the output is not ours or cannot be
    written.
    """
    require_replaceable(batch.output, MARKER)
    found: dict[str, Outcome] = {}
    orders = []
    for shot, outcome in zip(batch.shots, look(batch), strict=True):
        if shot.refusal or outcome.state == "unchanged":
            found[shot.name] = outcome
            tell(outcome)
        else:
            orders.append(batch.order(shot))

    save_text(batch.output / MARKER, f'{{"version": "{current_version()}"}}')
    if orders:
        with Stop() as stop, workers as outcomes:
            progress(0.0)
            done = 0
            for outcome_or_tick in outcomes(orders):
                stop.now()
                if outcome_or_tick is not None:
                    done += 1
                    found[outcome_or_tick.name] = outcome_or_tick
                    tell(outcome_or_tick)
                progress(done / len(orders))

    remove_abandoned(batch.output)
    return [found[shot.name] for shot in batch.shots]
