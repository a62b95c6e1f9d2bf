"""How weights do among real furniture: body by body, maker by maker and kind by kind, beside the
captured motion itself; and where nobody was captured, but the director sends them to sit down.
"""

from collections.abc import Callable, Sequence
from typing import Any

from ...core.weights import Weights
from ...data.held_out.captured import HeldClip
from ...data.held_out.walks import Walks
from .clips import MeasuredClip, grouped, measure_clips, rows_by_run, table
from .markdown import markdown_table

__all__ = ["real_page", "real_report", "real_text"]

_RUNS = ("ground_truth", "free_t0", "free_t0_clean", "free_t1", "ee_t0", "ee_t0_clean")
_COLUMNS = (
    "clips",
    "seat_episodes",
    "sits_within_2cm",
    "sits_within_4cm",
    "sits_within_8cm",
    "seat_error_median",
    "end_effector_error",
    "foot_sliding_per_frame",
    "skate_cm",
    "bad_collisions_per_frame",
    "penetrates",
    "penetration_deepest",
    "jerk",
    "speed_wrists",
    "speed_head",
    "speed_chest",
    "speed_slow",
    "speed_middle",
    "speed_quick",
    "sway",
    "descent_seconds",
    "lean_degrees",
)
_SENT_RUNS = ("free_t0", "free_t0_clean", "free_t1")
_SENT = "sent by the director"
_SENT_COLUMNS = (
    "clips",
    "refused",
    "sits_within_2cm",
    "sits_within_4cm",
    "sits_within_8cm",
    "seat_error_median",
    "foot_sliding_per_frame",
    "skate_cm",
    "penetrates",
    "penetration_deepest",
    "descent_seconds",
    "lean_degrees",
    "sway",
)
_GROUPS: dict[str, Callable[[HeldClip], str]] = {
    "kind": lambda clip: clip.kind,
    "maker": lambda clip: clip.maker,
    "body": lambda clip: clip.body,
}


def real_report(
    weights: Weights,
    clips: Sequence[HeldClip],
    progress: Callable[[float], None] = lambda share: None,
    seeds: int = 3,
    walks: Walks | None = None,
) -> dict[str, Any]:
    """Rows (``clips.pooled_row``) over all clips of ``real_test``, and over those of each kind of
    piece, maker and body; where ``walks`` are given, over all that the director sent to seats, and
    by kind of piece, with the share that was refused.
    """
    part = len(clips) / max(1, len(clips) + (len(walks.clips) if walks else 0))
    found = measure_clips(
        weights, clips, lambda done: progress(part * done), seeds=seeds, modes=("FREE", "EE")
    )

    seated = [each for each in found if each.clip.room != "bed"]
    lying = [each for each in found if each.clip.room == "bed"]
    report: dict[str, Any] = {
        "all seats": rows_by_run(seated, _RUNS),
        "lying": rows_by_run(lying, _RUNS),
    }
    for group, of in _GROUPS.items():
        report[f"by {group}"] = {
            name: rows_by_run(own, _RUNS) for name, own in grouped(seated, of).items()
        }

    if walks is None:
        return report

    sent = measure_clips(
        weights,
        walks.clips,
        lambda done: progress(part + (1.0 - part) * done),
        seeds=seeds,
        modes=("FREE",),
    )
    refused = sum(walks.refused.values()) / max(1, sum(walks.sent.values()))
    report[_SENT] = _directed_rows(sent, refused)

    of_kinds = report[f"by kind, {_SENT}"] = {}
    for kind, times in sorted(walks.sent.items()):
        own = [each for each in sent if each.clip.kind == kind]
        of_kinds[kind] = _directed_rows(own, walks.refused.get(kind, 0) / times)

    return report


def _directed_rows(found: Sequence[MeasuredClip], refused: float) -> dict[str, dict[str, Any]]:
    """Rows of clips in which the director sent somebody to a seat, with the share ``refused``."""
    return {run: row | {"refused": refused} for run, row in rows_by_run(found, _SENT_RUNS).items()}


def real_text(report: dict[str, Any]) -> str:
    """The report as Markdown."""
    parts = []
    for title, rows in report.items():
        columns = _SENT_COLUMNS if _SENT in title else _COLUMNS
        if title.startswith("by "):
            for name, own in rows.items():
                parts.append(f"### {title[3:].capitalize()}: {name}\n\n{table(own, columns)}")
        elif rows:
            parts.append(f"## {title.capitalize()}\n\n{table(rows, columns)}")

    return "\n\n".join(parts)


def real_page(report: dict[str, Any], title: str) -> str:
    """The main figures as one Markdown table of captured motion and one of directed walks, a row
    for each kind, maker and body, under ``title``: what docs/evaluation-real.md holds.
    """
    groups = {
        "all seats": report["all seats"],
        **{name: rows for group in _GROUPS for name, rows in report[f"by {group}"].items()},
        "lying": report["lying"],
    }
    parts = [f"## {title}", _page_table(_CAPTURED_CELLS, groups)]
    if report.get(_SENT):
        sent = {"all": report[_SENT], **report[f"by kind, {_SENT}"]}
        parts += [f"### {title}: {_SENT}", _page_table(_SENT_CELLS, sent)]

    return "\n\n".join(parts) + "\n"


def _page_table(
    cells: dict[str, Callable[[dict[str, Any]], str]], groups: dict[str, dict[str, Any]]
) -> str:
    labels = [name if number else f"**{name}**" for number, name in enumerate(groups)]
    return markdown_table(
        ("", *cells),
        [
            (label, *(cell(rows) for cell in cells.values()))
            for label, rows in zip(labels, groups.values(), strict=True)
            if rows
        ],
    )


def _shares_within(run: str) -> Callable[[dict[str, Any]], str]:
    """Shares within 2, 4 and 8 cm, with the interval of the last."""

    def cell(rows: dict[str, Any]) -> str:
        row = rows[run]
        shares = " / ".join(f"{100 * row[f'sits_within_{cm}cm']:.0f}" for cm in (2, 4, 8))
        low, high = row["intervals"]["sits_within_8cm"]
        return f"{shares} ({100 * low:.0f} to {100 * high:.0f})"

    return cell


def _figure_cell(
    name: str, run: str, shown: str, times: float = 1.0
) -> Callable[[dict[str, Any]], str]:
    """One figure of a run, with the captured motion's in brackets where there is one."""

    def cell(rows: dict[str, Any]) -> str:
        values = [rows[r].get(name) for r in (run, "ground_truth") if r in rows]
        words = ["–" if value is None else format(times * value, shown) for value in values]
        return words[0] if len(words) == 1 else f"{words[0]} ({words[1]})"

    return cell


def _clips(rows: dict[str, Any]) -> str:
    return str(rows["free_t0"]["clips"])


_LATER: dict[str, Callable[[dict[str, Any]], str]] = {
    "flesh in furniture, % of frames": _figure_cell("penetrates", "free_t0", ".0f", 100.0),
    "how deep, mm": _figure_cell("penetration_deepest", "free_t0", ".1f", 1000.0),
    "skate, cm/s": _figure_cell("skate_cm", "free_t0", ".1f", 30.0),
    "way down, s": _figure_cell("descent_seconds", "free_t0", ".2f"),
    "lean, degrees": _figure_cell("lean_degrees", "free_t0", "z.0f"),
}
_CAPTURED_CELLS: dict[str, Callable[[dict[str, Any]], str]] = {
    "clips": _clips,
    "FREE within 2 / 4 / 8 cm, %": _shares_within("free_t0"),
    "FREE, clean": _shares_within("free_t0_clean"),
    "EE": _shares_within("ee_t0"),
    "EED in EE": lambda rows: f"{rows['ee_t0']['end_effector_error']:.4f}",
    **_LATER,
    "wrists, m/s": _figure_cell("speed_wrists", "free_t0", ".2f"),
}
_SENT_CELLS: dict[str, Callable[[dict[str, Any]], str]] = {
    "sent, not refused": _clips,
    "refused, %": _figure_cell("refused", "free_t0", ".0f", 100.0),
    "FREE within 2 / 4 / 8 cm, %": _shares_within("free_t0"),
    "FREE, clean": _shares_within("free_t0_clean"),
    **_LATER,
}
