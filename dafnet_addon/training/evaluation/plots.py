"""A report's main figures as bars, beside those of the real motion; a run's validation as
curves.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...core.files import whole_file
from ...core.liveliness import BANDS

__all__ = ["draw_curves", "draw_bars"]

_PANELS = {
    "sits_within_6cm": "sits within 6 cm",
    "stands_when_it_should": "stands when it should",
    "end_effector_error": "EED",
    "foot_sliding_per_frame": "FS, feet a frame",
    "bad_collisions_per_frame": "BCC, joints a frame",
    "jerk": "jerk, m/s³",
}
_COLOURS = {"ground": "#555555", "free": "#4c78a8", "ee": "#f58518", "full": "#54a24b"}

_PANELS_OF_A_RUN = {
    "sits within 4 cm": ("sits_within_4cm", ("free_t0", "ee_t0")),
    "sits within 8 cm": ("sits_within_8cm", ("free_t0", "ee_t0")),
    "EED, EE": ("end_effector_error", ("ee_t0",)),
    "skate, cm a frame": ("skate_cm", ("free_t0", "ee_t0", "ground_truth")),
    "life: wrists, m/s": ("speed_wrists", ("free_t0", "free_t1", "ground_truth")),
    **{
        f"life, {band}, m/s": (f"speed_{band}", ("free_t0", "free_t1", "ground_truth"))
        for band in BANDS
    },
    "descent, s": ("descent_seconds", ("free_t0", "ee_t0", "ground_truth")),
}
"""By title, the figure that is drawn, and of which runs."""
_KINDS = {
    "free_t0": ("FREE", "#4c78a8"),
    "free_t1": ("FREE, temperature 1", "#72b7b2"),
    "ee_t0": ("EE", "#f58518"),
    "ground_truth": ("captured", "#555555"),
}
"""By run, its label and colour."""


def draw_bars(report: dict[str, Any], file: Path) -> None:
    """Draw the runs on captured clips of unseen bodies into ``file`` (PNG), with 95 % intervals
    over clips.
    """
    plt = _pyplot()
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
        whiskers = {"lw": 1.0, "ecolor": "#222222"}
        ax.barh(range(len(shown)), values, xerr=errors, color=colours, error_kw=whiskers)
        ax.set_yticks(range(len(shown)), [name.replace("_", " ") for name in shown])
        ax.invert_yaxis()
        ax.set_title(title)

    some = report["rows"]["ground_truth"]
    figure.suptitle(
        f"{some['clips']} captured clips of unseen bodies, {some['seat_episodes']} seat episodes"
    )
    _save(figure, file)


def draw_curves(rows: Sequence[Mapping[str, Any]], file: Path) -> None:
    """Draw a run's validation (rows of ``validation``) over its hours into ``file`` (PNG), with
    95 % intervals over clips; level lines are what was captured and other weights' figures.
    """
    plt = _pyplot()
    own = sorted((each for each in rows if "hours" in each), key=lambda each: each["hours"])
    others = [each for each in rows if "hours" not in each]
    hours = [each["hours"] for each in own]
    figure, axes = plt.subplots(4, 3, figsize=(15, 15), constrained_layout=True)
    for ax, (title, (name, shown)) in zip(axes.flat, _PANELS_OF_A_RUN.items(), strict=False):
        for which in shown:
            label, colour = _KINDS[which]
            if which == "ground_truth":
                value, _, _ = _figure_and_interval(rows[0], which, name)
                ax.axhline(value, ls="--", color=colour, label=label)
                continue
            values, low, high = (
                np.array([_figure_and_interval(each, which, name) for each in own]).reshape(-1, 3).T
            )
            ax.plot(hours, values, marker="o", ms=3, color=colour, label=label)
            ax.fill_between(hours, low, high, color=colour, alpha=0.15, lw=0)
            for each in others:
                value, _, _ = _figure_and_interval(each, which, name)
                ax.axhline(value, ls=":", color=colour, label=f"{label}, {each['weights']}")
        ax.set_title(title)

    makers, loss, best = axes.flat[len(_PANELS_OF_A_RUN) :]
    for maker in sorted({name for each in own for name in each["makers"]}):
        shares = [each["makers"][maker]["free_t0"]["sits_within_8cm"] for each in own]
        makers.plot(hours, shares, marker="o", ms=3, label=maker)

    makers.set_title("FREE, within 8 cm, by maker")
    for part in sorted({name for each in own for name in each["held_out"]}):
        loss.plot(hours, [each["held_out"][part] for each in own], marker="o", ms=3, label=part)

    loss.set_title("held-out loss, nats a frame")
    best.plot(hours, [each["score"] for each in own], marker="o", ms=3, label="the run")
    for each in others:
        best.axhline(each["score"], ls=":", color="#222222", label=each["weights"])

    best.set_title("score, cm (the least is kept)")
    for ax in axes.flat:
        ax.set_xlabel("hours of one core a part")
        ax.set_xlim(left=0.0)
        if ax.get_legend_handles_labels()[1]:
            ax.legend(fontsize=7)

    figure.suptitle(f"{rows[0]['clips']} captured clips of bodies and makers that choose weights")
    _save(figure, file)


def _figure_and_interval(
    found: Mapping[str, Any], which: str, name: str
) -> tuple[float, float, float]:
    """A figure of a row and its interval; NaN where nothing showed it, as a descent to a seat."""
    figures = found["figures"][which]
    low, high = figures["intervals"].get(name, (np.nan, np.nan))
    return figures.get(name, np.nan), low, high


def _pyplot() -> Any:
    """Matplotlib, which draws into files alone."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot


def _save(figure: Any, file: Path) -> None:
    with whole_file(file) as part:
        figure.savefig(part, format="png", dpi=80)

    _pyplot().close(figure)
