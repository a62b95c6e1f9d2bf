"""A report's main figures as bars, beside those of the real motion."""

from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import whole_file

__all__ = ["plot"]

_PANELS = {
    "sits_within_6cm": "sits within 6 cm",
    "stands_when_it_should": "stands when it should",
    "end_effector_error": "EED",
    "foot_sliding_per_frame": "FS, feet a frame",
    "bad_collisions_per_frame": "BCC, joints a frame",
    "jerk": "jerk, m/s³",
}
_COLOURS = {"ground": "#555555", "free": "#4c78a8", "ee": "#f58518", "full": "#54a24b"}


def plot(report: dict[str, Any], file: Path) -> None:
    """Draw the runs on captured clips of unseen bodies into ``file`` (PNG), with 95 % intervals
    over clips.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    rows = {
        name: row
        for name, row in report["rows"].items()
        if name.split("_t")[0] in ("ground", "free", "ee", "full")
        and name.endswith(("_truth", "_t0", "_t1", "_clean"))
    }
    figure, axes = plt.subplots(2, 3, figsize=(12, 7), constrained_layout=True)
    for ax, (key, title) in zip(axes.flat, _PANELS.items(), strict=True):
        shown = {name: row for name, row in rows.items() if row.get(key) is not None}
        values = np.array([row[key] for row in shown.values()])
        low, high = np.array([row["intervals"][key] for row in shown.values()]).T
        errors = np.maximum([values - low, high - values], 0.0)
        colours = [_COLOURS[name.split("_")[0]] for name in shown]
        ax.barh(
            range(len(shown)),
            values,
            xerr=errors,
            color=colours,
            error_kw={"lw": 1.0, "ecolor": "#222222"},
        )
        ax.set_yticks(range(len(shown)), [name.replace("_", " ") for name in shown])
        ax.invert_yaxis()
        ax.set_title(title)
    some = report["rows"]["ground_truth"]
    figure.suptitle(
        f"{some['clips']} captured clips of unseen bodies, {some['seat_episodes']} seat episodes"
    )
    with whole_file(file) as part:
        figure.savefig(part, format="png", dpi=80)
    plt.close(figure)
