"""Shots are made on the workers of a Dask cluster, which share the output's disk.

Dask hands them out, and hands out anew what a worker was making that is gone. Each is still a
process of its own, started by the worker; it ends when the worker does.
"""

import gc
import logging
import secrets
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from ..core.errors import DafnetError, InputError
from ..core.files import save_text
from ..core.manifest import content_hash, current_version
from ..core.text import printable
from ..core.weights import shipped_weights
from .local import TICK, Workers
from .making import Order, Outcome, make

if TYPE_CHECKING:
    from distributed import Client, Future

__all__ = ["cluster_workers"]

_ANSWERS = 10.0
"""Seconds within which a scheduler has to answer, and a worker to be there."""
_GONE = "The Dask scheduler is gone; what is done is kept: start it again, and run again."


@contextmanager
def cluster_workers(address: str, output: Path) -> Iterator[Workers]:
    """As many shots at once as the workers of the scheduler at ``address`` have threads.

    Raises InputError where it does not answer or has no workers, and where a worker has another
    version, other weights, or does not see the ``output``.
    """
    from distributed import Client

    with _quiet():
        client = None
        with suppress(OSError, ValueError, TimeoutError):
            client = Client(address, timeout=_ANSWERS, set_as_default=False)
        if client is None:
            # What is left of it ends here, and not while another one starts: the two would wait for
            # one another.
            gc.collect()
            raise InputError(
                f"No Dask scheduler answers at '{printable(address, 100)}'; start one with 'dask "
                "scheduler', or check the address."
            )

        with client:
            _check(client, address, output)
            yield lambda orders: _outcomes(client, orders)


@contextmanager
def _quiet() -> Iterator[None]:
    """Within the block Dask says nothing on standard error of what is told here in sentences."""
    log = logging.getLogger("distributed")
    before = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        log.setLevel(before)


def _outcomes(client: "Client", orders: Iterable[Order]) -> Iterator[Outcome | None]:
    results: SimpleQueue[tuple[str, Future]] = SimpleQueue()
    futures = {}
    for order in orders:
        key = f"{order.name}-{secrets.token_hex(8)}"
        futures[order.name] = client.submit(make, order, key=key, pure=False)
    for name, future in futures.items():
        future.add_done_callback(lambda done, name=name: results.put((name, done)))

    while futures:
        if client.status != "running":  # by then Dask has given up all that was asked for
            raise InputError(_GONE)
        try:
            name, future = results.get(timeout=TICK)
        except Empty:
            yield None
            continue
        try:
            outcome = _outcome(name, future)
        except (OSError, CancelledError) as lost:  # gone while the outcome was on its way
            raise InputError(_GONE) from lost
        del futures[name]
        yield outcome


def _outcome(name: str, future: "Future") -> Outcome:
    error = future.exception()
    if error is None:
        found: Outcome = future.result()
        return found

    if type(error).__name__ == "KilledWorker":
        return Outcome(
            name,
            "failed",
            "Every worker that made it was killed, as happens where memory runs out; give the "
            "workers more.",
        )
    return Outcome(
        name, "failed", f"Its worker failed ({printable(str(error), 300)}); look into its log."
    )


def _facts(seen: Path) -> dict[str, Any]:
    """What a worker says of itself; ``seen``: a file that it should see."""
    try:
        weights = content_hash(shipped_weights())
    except DafnetError:
        weights = ""
    return {"version": current_version(), "weights": weights, "sees": seen.exists()}


def _check(client: "Client", address: str, output: Path) -> None:
    """Raise InputError where the workers could not make what this process would."""
    until = time.monotonic() + _ANSWERS
    while not client.scheduler_info(n_workers=-1)["workers"]:
        if time.monotonic() > until:
            raise InputError(
                f"The Dask scheduler at '{printable(address, 100)}' has no workers; start some "
                f"with 'dask worker {printable(address, 100)}'."
            )
        time.sleep(0.2)

    seen = output / "logs" / "seen_by_workers.txt"
    save_text(seen, "Every worker of the cluster has to see this file.")
    ours = _facts(seen)
    try:
        found = client.run(_facts, seen, on_error="return")
    finally:
        seen.unlink(missing_ok=True)

    for worker, theirs in found.items():
        where = f"The Dask worker at {printable(worker, 100)}"
        if isinstance(theirs, BaseException) and "dafnet_addon" in repr(theirs):
            raise InputError(
                f"{where} lacks this version of DAFNet ({ours['version']}); install it there."
            )
        if isinstance(theirs, BaseException):
            raise InputError(
                f"{where} cannot be asked ({printable(str(theirs), 300)}); look into its log."
            )
        if theirs["version"] != ours["version"]:
            raise InputError(
                f"{where} has version {printable(theirs['version'], 40)} of DAFNet, this is "
                f"{ours['version']}; install the same on both."
            )
        if theirs["weights"] != ours["weights"]:
            raise InputError(f"{where} has other weights than this; install the same on both.")
        if not theirs["sees"]:
            raise InputError(
                f"{where} does not see '{output}'; give an output on a disk that all workers share."
            )
