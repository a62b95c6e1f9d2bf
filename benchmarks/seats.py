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
        for temperature, take in _takes(seat(height, back), ways[way], weights, noise):
            path, _ = root_from_matrices(take.root)
            error = seat_report(
                take.joints, path, take.fps, [Seat("seat", np.array([0.0, 0.0, height]))]
            )[0]["error"]
            seated.append(
                {
                    "height": round(height, 3),
                    "back": back,
                    "approach": way,
                    "temperature": temperature,
                    "error": None if error is None else round(float(error), 4),
                }
            )

    empty: list[dict[str, Any]] = []
    for done, way in enumerate(ways):
        progress((len(situations) + done) / count)
        rest = ways[way].rests[-1]
        for temperature, take in _takes(Scene(), ways[way], weights, noise):
            path, _ = root_from_matrices(take.root)
            drop = (
                standing_pelvis_height(take.joints, path, take.fps)
                - take.joints[rest.start : rest.stop - 1, PELVIS, 2].min()
            )
            empty.append(
                {"approach": way, "temperature": temperature, "drop": round(float(drop), 4)}
            )

    progress(1.0)

    def share(**chosen: Any) -> float:
        errors = [
            each["error"]
            for each in seated
            if all(each[key] == value for key, value in chosen.items())
        ]
        return float(np.mean([error is not None and abs(error) <= TOLERANCE for error in errors]))

    report = {
        "tolerance": TOLERANCE,
        "sits": share(),
        "sits_at_temperature": {
            f"{t:g}": share(temperature=t) for t in sorted({t for t, _ in noise})
        },
        "sits_by_approach": {way: share(approach=way) for way in ways},
        "sits_by_back": {
            name: share(back=back) for name, back in (("with", True), ("without", False))
        },
        "sits_by_height": {f"{h:.3f}": share(height=round(h, 3)) for h in heights},
        "largest_drop_without_seat": max(each["drop"] for each in empty),
        "takes": seated,
        "takes_without_seat": empty,
    }
    lines = [
        f"{100 * report['sits']:.0f} % of {len(seated)} takes sit within {100 * TOLERANCE:.0f} cm"
    ]
    for key in ("temperature", "approach", "back", "height"):
        table = report["sits_at_temperature" if key == "temperature" else f"sits_by_{key}"]
        lines.append(
            f"  by {key}: "
            + ", ".join(f"{name} {100 * value:.0f} %" for name, value in table.items())
        )

    lines.append(
        f"Without a seat the pelvis drops by {100 * report['largest_drop_without_seat']:.0f} cm "
        "at most"
    )
    return report, "\n".join(lines)
