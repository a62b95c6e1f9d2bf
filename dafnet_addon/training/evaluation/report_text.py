"""A report as a page of Markdown."""

from collections.abc import Iterator
from typing import Any

from .clips import table
from .criteria import criteria
from .markdown import markdown_table

__all__ = ["report_text"]


def report_text(values: dict[str, Any]) -> str:
    """A report (see ``report``) in Markdown."""
    parts = [
        "## What has to be seen",
        _judged(values),
        "## Clips",
        table(values["rows"]),
    ]
    for name, rows in values["by_activity"].items():
        parts += [f"### {name[0].upper()}{name[1:]}", table(rows)]

    parts += [
        "## Drift: first and last third of a minute",
        table(values["drift"]),
        "## Diversity",
        table(values["diversity"]),
        "## Low, medium and high seats on the same root path",
        *_seats(values["seats"]),
        "## Action predictor and likelihood (nats a frame, poses in metres, 3 mm of noise)",
        *_actions(values["actions"]),
    ]
    return "\n\n".join(parts)


def _judged(values: dict[str, Any]) -> str:
    """The criteria, whether they are met, and by what."""
    rows = [
        (
            each.name,
            f"{each.value:.3g}",
            f"{'≤' if each.at_most else '≥'} {each.must:.3g}",
            f"{each.goal:.3g}",
            each.met,
            each.count,
        )
        for each in criteria(values)
    ]
    return markdown_table(("", "found", "must", "goal", "met", "of"), rows)


def _seats(seats: dict[str, Any]) -> Iterator[str]:
    """A row for each height and temperature, then how often all three are right."""
    head = ("", "seat, m", "pelvis wanted, m", "median, m", "within 5 cm", "takes")
    rows = [
        (
            f"{name}, {heat}",
            f"{each['seat']:.2f}",
            f"{each['wanted']:.2f}",
            f"{each['pelvis_median']:.3f}",
            f"{100 * each['right']:.0f} %",
            str(found["paths_and_seeds"]),
        )
        for heat, found in seats.items()
        for name, each in found.items()
        if isinstance(each, dict)
    ]
    yield markdown_table(head, rows)
    yield ", ".join(
        f"all three right, {heat}: {100 * found['all_three_right']:.0f} %"
        for heat, found in seats.items()
    )


def _actions(actions: dict[str, Any]) -> Iterator[str]:
    """What the predictor says, as a list; then the likelihood by activity."""
    lines = [
        f"- {name.replace('_', ' ')}: {value}"
        for name, value in actions.items()
        if not isinstance(value, dict)
    ]
    lines += [
        f"- likeliest action, {name}: {shares}"
        for name, shares in actions.get("shares", {}).items()
    ]
    yield "\n".join(lines)

    names = list(actions["likelihood"]["all"])
    yield markdown_table(
        ("", *(name.replace("_", " ") for name in names)),
        [
            (label, *(str(row[name]) for name in names))
            for label, row in actions["likelihood"].items()
        ],
    )
