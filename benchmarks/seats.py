"""Does a character sit where there is a seat, and only there? Ten heights, three approaches, with
and without a back.

Run as ``dafnet bench seats``. Nothing here is part of the demo: other paths, other furniture, boxes
only.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dafnet_addon import Box, Controls, Scene, Take, generate, load_weights
from dafnet_addon.core.metrics import Seat, seat_report, standing_pelvis_height
from dafnet_addon.core.paths import Route, Stop, facing, route
from dafnet_addon.core.root import root_from_matrices
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import PELVIS
from dafnet_addon.core.weights import Weights

Noise = Sequence[tuple[float, int]]

HEIGHTS: list[float] = np.linspace(0.35, 0.65, 10).tolist()
NOISE: Noise = [(0.0, 0)] + [(1.0, seed) for seed in range(1, 6)]
"""Temperature and seed of every take of a situation."""
TOLERANCE = 0.08
"""Metres by which a pelvis may be off and still sits."""
_SEAT = Stop((0.0, 0.0), 0.0, 3.0, seated=True, name="seat")


def approaches() -> dict[str, Route]:
    """Three ways to a seat that looks along +y: from its front, turning round; from its side;
    around it from behind.
    """
    return {
        "front": route(Stop((-1.6, 3.2), facing((0.5, -1.0)), 0.5), _SEAT),
        "side": route(Stop((3.2, 0.8), facing((-1.0, 0.0)), 0.5), _SEAT),
        "behind": route(Stop((-0.3, -3.2), 0.0, 0.5), (-0.95, -0.6), (-0.85, 0.45), _SEAT),
    }


def seat(height: float, back: bool) -> Scene:
    """A seat of boxes, its top at ``height``: a slab on four legs, and a back where asked for."""

    def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Box:
        a, b = np.array(low), np.array(high)
        return Box(center=(a + b) / 2, half_size=(b - a) / 2)

    solids = [box((-0.22, -0.21, height - 0.05), (0.22, 0.23, height))]
    for x in (-0.22, 0.18):
        for y in (-0.21, 0.19):
            solids.append(box((x, y, 0.0), (x + 0.04, y + 0.04, height - 0.05)))

    if back:
        solids.append(box((-0.22, -0.25, height - 0.05), (0.22, -0.21, height + 0.42)))

    return Scene(tuple(solids))


def _takes(
    scene: Scene, walked: Route, weights: Weights, noise: Noise
) -> Iterator[tuple[float, Take]]:
    controls = Controls(fps=MODEL_FPS, root=walked.path.matrices())
    for temperature, seed in noise:
        yield temperature, generate(scene, controls, weights, seed=seed, temperature=temperature)


def measure(
    file: Path | None,
    progress: Callable[[float], None],
    heights: Sequence[float] = HEIGHTS,
    noise: Noise = NOISE,
) -> tuple[dict[str, Any], str]:
    """Run the benchmark with the weights in ``file`` (None: those that ship); the report and its
    summary in words.
    """
    weights = load_weights(file)
    ways = approaches()
    situations = [
        (height, back, way) for height in heights for back in (False, True) for way in ways
    ]
    count = len(situations) + len(ways)

    seated: list[dict[str, Any]] = []
    for done, (height, back, way) in enumerate(situations):
        progress(done / count)
        named = {"height": round(height, 3), "back": back, "approach": way}
        for temperature, take in _takes(seat(height, back), ways[way], weights, noise):
            seated.append({**named, "temperature": temperature, "error": _error(take, height)})

    empty: list[dict[str, Any]] = []
    for done, (way, walked) in enumerate(ways.items(), len(situations)):
        progress(done / count)
        for temperature, take in _takes(Scene(), walked, weights, noise):
            drop = _drop(take, walked)
            empty.append({"approach": way, "temperature": temperature, "drop": drop})

    progress(1.0)
    report = _report(seated, empty)
    return report, _summary(report)


def _error(take: Take, height: float) -> float | None:
    """Metres by which a take's pelvis is over the right height; None where it never rests."""
    path, _ = root_from_matrices(take.root)
    there = Seat("seat", np.array([0.0, 0.0, height]))
    error = seat_report(take.joints, path, take.fps, [there])[0]["error"]
    return None if error is None else round(float(error), 4)


def _drop(take: Take, walked: Route) -> float:
    """Metres by which a take's pelvis comes down where the root rests and there is no seat."""
    path, _ = root_from_matrices(take.root)
    rest = walked.rests[-1]
    lowest = take.joints[rest.start : rest.stop - 1, PELVIS, 2].min()
    return round(float(standing_pelvis_height(take.joints, path, take.fps) - lowest), 4)


def _report(seated: list[dict[str, Any]], empty: list[dict[str, Any]]) -> dict[str, Any]:
    """Shares of the takes that sit, in all and by what differs between them."""

    def share(**chosen: Any) -> float:
        errors = [
            each["error"]
            for each in seated
            if all(each[name] == value for name, value in chosen.items())
        ]
        return float(np.mean([error is not None and abs(error) <= TOLERANCE for error in errors]))

    def values(name: str) -> list[Any]:
        return list(dict.fromkeys(each[name] for each in seated))

    return {
        "tolerance": TOLERANCE,
        "sits": share(),
        "sits_at_temperature": {
            f"{heat:g}": share(temperature=heat) for heat in sorted(values("temperature"))
        },
        "sits_by_approach": {way: share(approach=way) for way in values("approach")},
        "sits_by_back": {
            name: share(back=back) for name, back in (("with", True), ("without", False))
        },
        "sits_by_height": {f"{height:.3f}": share(height=height) for height in values("height")},
        "largest_drop_without_seat": max(each["drop"] for each in empty),
        "takes": seated,
        "takes_without_seat": empty,
    }


def _summary(report: dict[str, Any]) -> str:
    lines = [
        f"{100 * report['sits']:.0f} % of {len(report['takes'])} takes sit within "
        f"{100 * TOLERANCE:.0f} cm"
    ]
    for name in ("temperature", "approach", "back", "height"):
        shares = report["sits_at_temperature" if name == "temperature" else f"sits_by_{name}"]
        cells = ", ".join(f"{label} {100 * value:.0f} %" for label, value in shares.items())
        lines.append(f"  by {name}: {cells}")

    drop = 100 * report["largest_drop_without_seat"]
    lines.append(f"Without a seat the pelvis drops by {drop:.0f} cm at most")
    return "\n".join(lines)
