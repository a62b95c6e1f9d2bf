"""What is told of a batch at its end: ``report.json``, and ``report.html``, one file that needs no
other.
"""

import json
from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Any

from ..core.files import save_text
from ..core.manifest import Manifest, current_version, read_manifest
from ..core.text import duration, printable
from .making import Outcome
from .running import Batch

__all__ = ["counted", "report", "save_report"]

_COLUMNS = {
    "bad_collisions_per_frame": ("collisions a frame", 1.0, "{:.2f}"),
    "penetration_max": ("deepest, cm", 100.0, "{:.1f}"),
    "foot_sliding_per_frame": ("sliding feet a frame", 1.0, "{:.2f}"),
    "end_effector_error": ("misses targets by, cm", 100.0, "{:.1f}"),
    "jerk": ("jerk", 1.0, "{:.0f}"),
}
"""Metrics that the table shows: title, factor, format; the worse the larger. Shots that are equally
bad by one are told apart by the next.
"""
_MAX_PICTURES = 500
"""That the page shows, of the worst: it stays under 10 MB."""
_WORST = ("failed", "busy", "missing")
"""States that stand before those that are there."""


def report(batch: Batch, outcomes: Sequence[Outcome], seconds: float) -> dict[str, Any]:
    """What became of every shot, worst first, in plain data. ``seconds``: that it all took."""
    shots = sorted((_row(batch, outcome) for outcome in outcomes), key=_how_bad)
    return {
        "version": current_version(),
        "output": str(batch.output),
        "seconds": round(seconds, 3),
        "counts": dict(Counter(outcome.state for outcome in outcomes)),
        "shots": shots,
    }


def _row(batch: Batch, outcome: Outcome) -> dict[str, Any]:
    folder = batch.folder(outcome.name)
    manifest = read_manifest(folder) if outcome.state in ("made", "unchanged") else None
    row: dict[str, Any] = {
        "name": outcome.name,
        "state": outcome.state,
        "sentence": outcome.sentence,
        "log": str(outcome.log or ""),
        "folder": str(folder) if manifest else "",
        "process_seconds": round(outcome.seconds, 3),
    }
    if manifest:
        row |= {
            "seed": manifest.seed,
            "takes": manifest.takes,
            "people": len(manifest.people),
            "seconds": dict(manifest.seconds),
            "metrics": dict(manifest.metrics),
            "warnings": list(manifest.warnings),
            "faults": list(_faults(manifest)),
            "content": dict(manifest.content),
        }
    return row


def _faults(manifest: Manifest) -> Iterator[str]:
    """What an eye would find wrong with the takes, as their verdicts say it; nothing of what is not
    a verdict.
    """
    for person in manifest.people:
        takes = person.get("verdict")
        for k, findings in enumerate(takes if isinstance(takes, list) else (), 1):
            for each in findings if isinstance(findings, list) else ():
                if isinstance(each, dict) and each.get("good") is False:
                    name = printable(person.get("name", ""), 100)
                    yield f"{name}, take {k}: {printable(each.get('text', ''), 500)}"


def _how_bad(row: dict[str, Any]) -> tuple[Any, ...]:
    """Sorts the worst to the front."""
    state = _WORST.index(row["state"]) if row["state"] in _WORST else len(_WORST)
    metrics = row.get("metrics", {})
    values = (-float(metrics.get(name) or 0.0) for name in _COLUMNS)
    faults, warnings = (len(row.get(name, ())) for name in ("faults", "warnings"))
    return state, -faults, -warnings, *values, row["name"]


def save_report(
    batch: Batch, told: dict[str, Any], thumbnail: Callable[[Path], bytes] | None = None
) -> Path:
    """Write ``report.json`` and ``report.html`` into the batch's folder; the path of the latter.

    ``thumbnail`` makes a small JPEG of a rendered frame. Raises InputError where the disk refuses.
    """
    save_text(batch.output / "report.json", json.dumps(told, indent=2))
    page = batch.output / "report.html"
    save_text(page, _page(batch, told, thumbnail))
    return page


def _page(batch: Batch, told: dict[str, Any], thumbnail: Callable[[Path], bytes] | None) -> str:
    pictures: dict[str, str] = {}
    if thumbnail:
        for row in told["shots"]:
            frame = _frame(Path(row["folder"])) if row["folder"] else None
            if frame and len(pictures) < _MAX_PICTURES:
                pictures[row["name"]] = b64encode(thumbnail(frame)).decode("ascii")

    columns = {
        name: column
        for name, column in _COLUMNS.items()
        if any(row.get("metrics", {}).get(name) is not None for row in told["shots"])
    }
    titles = ["shot", "state", "people", "takes", "seed", "seconds"]
    titles += [title for title, _, _ in columns.values()] + ["remarks"]
    head = "".join(f"<th>{escape(title)}</th>" for title in (["", *titles] if pictures else titles))
    rows = "\n".join(_line(batch, row, columns, pictures) for row in told["shots"])
    return _PAGE.format(
        title=escape(printable(batch.output.name)),
        summary=escape(
            f"{counted(told['counts'])}, in {duration(told['seconds'])}; the worst first"
        ),
        head=head,
        rows=rows,
        version=escape(told["version"]),
    )


def _frame(folder: Path) -> Path | None:
    """A rendered frame in the middle of a shot; masks and depths have words behind the number."""
    found = sorted(each for each in (folder / "frames").rglob("*.png") if each.stem.isdigit())
    return found[len(found) // 2] if found else None


def _line(
    batch: Batch,
    row: dict[str, Any],
    columns: dict[str, tuple[str, float, str]],
    pictures: dict[str, str],
) -> str:
    """A row of the table."""
    metrics = row.get("metrics", {})
    seconds = row["process_seconds"]
    values = [str(row.get(key, "")) for key in ("people", "takes", "seed")]
    values.append(f"{seconds:.1f}" if seconds else "")
    for name, (_, factor, form) in columns.items():
        value = metrics.get(name)
        values.append("" if value is None else form.format(factor * value))

    told = [*row.get("faults", []), *row.get("warnings", [])]
    remarks = [row["sentence"]] if row["sentence"] else told
    said = "<br>".join(escape(printable(each, 500)) for each in remarks)
    if row["log"] and row["state"] == "failed":
        said += f' <a href="logs/{escape(row["name"])}.log">log</a>'

    name = escape(row["name"])
    if row["folder"]:
        name = f'<a href="{name}/">{name}</a>'
    cells = [f"<td>{name}</td>", f'<td class="{row["state"]}">{row["state"]}</td>']
    cells += [f'<td class="number">{escape(value)}</td>' for value in values]
    if pictures:
        picture = pictures.get(row["name"])
        source = f'<img src="data:image/jpeg;base64,{picture}" alt="">' if picture else ""
        cells.insert(0, f"<td>{source}</td>")
    return f"<tr>{''.join(cells)}<td>{said}</td></tr>"


def counted(counts: dict[str, int]) -> str:
    """How many shots are in which state, as words.

    >>> counted({"made": 2, "failed": 1})
    '3 shots: 2 made, 1 failed'
    """
    total = sum(counts.values())
    states = ", ".join(f"{count} {state}" for state, count in counts.items())
    return f"{total} shot{'s' if total != 1 else ''}: {states}"


_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>{title}</title>
<style>
body {{ font: 15px/1.4 system-ui, sans-serif; margin: 2em; color: #222; background: #fff; }}
table {{ border-collapse: collapse; }}
th, td {{ padding: 0.3em 0.7em; text-align: left; vertical-align: top; }}
th {{ border-bottom: 2px solid #888; cursor: pointer; white-space: nowrap; }}
td {{ border-bottom: 1px solid #ddd; }}
td.number {{ text-align: right; font-variant-numeric: tabular-nums; }}
td.failed {{ color: #b00020; font-weight: bold; }}
td.busy, td.missing {{ color: #8a5a00; }}
td.made {{ color: #1b6e2c; }}
td.unchanged {{ color: #666; }}
img {{ display: block; max-width: 240px; }}
</style>
</head>
<body>
<h1>{title}</h1>
<p>{summary}. A click on a title sorts by it.</p>
<table>
<thead><tr>{head}</tr></thead>
<tbody>
{rows}
</tbody>
</table>
<p>DAFNet for Blender {version}</p>
<script>
document.querySelectorAll("th").forEach((title, column) => title.addEventListener("click", () => {{
  const body = document.querySelector("tbody");
  const value = row => row.cells[column].textContent;
  const up = title.dataset.up = title.dataset.up === "1" ? "" : "1";
  const order = new Intl.Collator("en", {{ numeric: true }});
  [...body.rows]
    .sort((a, b) => (up ? 1 : -1) * order.compare(value(a), value(b)))
    .forEach(row => body.append(row));
}}));
</script>
</body>
</html>"""
