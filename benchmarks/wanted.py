"""What is wanted of weights, beside what they do, on bodies and makers that trained nothing.

    dafnet bench wanted FOLDER --furniture LIBRARY -o OUT [--weights WEIGHTS]

``FOLDER`` holds the motion files, ``LIBRARY`` the real pieces (docs/data.md). One table says, of
each thing that is wanted, what is found, with the 95 % of a bootstrap over clips where it is a mean
over them; what is missed comes first. Three more say it body by body, maker by maker, and by kind
of piece. Of the reports that it is of ``OUT`` may hold some already (``evaluate --furniture``,
``bench sitting``, ``bench life``), of the same weights; those that it lacks are made there, so that
the same command goes on where it was stopped. All of it takes half an hour of one core.
"""

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import life, sitting
from dafnet_addon import Controls, generate, load_weights
from dafnet_addon.core.draws import Draw
from dafnet_addon.core.files import save_text
from dafnet_addon.core.generate import takes_steps
from dafnet_addon.core.liveliness import BANDS, lean
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import forward_of
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import HEAD, NECK, PELVIS
from dafnet_addon.core.weights import Weights
from dafnet_addon.data.held_out.captured import HeldClip, held_out
from dafnet_addon.data.held_out.real import real_test
from dafnet_addon.data.held_out.walks import real_walks
from dafnet_addon.training.evaluation.clips import (
    captured_clips,
    grouped,
    measure_clips,
    rows_by_run,
)
from dafnet_addon.training.evaluation.markdown import markdown_table
from dafnet_addon.training.evaluation.real_report import real_report

__all__ = ["Wanted", "main", "postures", "wanted", "wanted_text"]

_PIECES = 4  # clips of a kind from which on it is judged by itself
_LEVEL = 25.0  # degrees between the trunk of who lies and the floor
_SEEDS = range(1, 9)  # of one sit
_APART = 0.10, 10.0  # metres between heads, degrees between trunks: another posture
_SETTLES = 15  # frames at the beginning of a rest that are left out
_SITS = 5  # of so many of the director's walks to seats one is drawn with all seeds


@dataclass(frozen=True)
class Wanted:
    """Something that is wanted, from ``least`` to ``most``, and what was ``found``, of what; with
    the 95 % ``interval`` where there is one.
    """

    name: str
    found: float
    of: str
    least: float = -np.inf
    most: float = np.inf
    interval: tuple[float, float] | None = None

    @property
    def met(self) -> bool:
        """Whether it is what is wanted."""
        return bool(self.least <= self.found <= self.most)

    def cells(self) -> tuple[str, ...]:
        """As a row of the table."""
        between = "–" if self.interval is None else "{:.3g} to {:.3g}".format(*self.interval)
        low, high = f"{self.least:g}", f"{self.most:g}"
        asked = f"{low} to {high}"
        if self.most == np.inf:
            asked = f"≥ {low}"
        elif self.least == -np.inf:
            asked = f"≤ {high}"
        return self.name, f"{self.found:.3g}", between, asked, "yes" if self.met else "no", self.of


def _of_row(
    name: str, row: dict[str, Any], figure: str, factor: float = 1.0, **bounds: float
) -> Wanted:
    """A figure of a report's row, times a ``factor``."""
    low, high = (factor * value for value in row["intervals"][figure])
    found = factor * row[figure]
    return Wanted(name, found, f"{row['clips']} clips", interval=(low, high), **bounds)


def _of_seats(real: dict[str, Any]) -> Iterator[Wanted]:
    seats, lying = real["all seats"], real["lying"]
    for run, word, within, least in (
        ("free_t0", "FREE, raw", 8, 92.0),
        ("free_t0", "FREE, raw", 4, 75.0),
        ("free_t0_clean", "FREE, clean", 8, 96.0),
        ("free_t0_clean", "FREE, clean", 4, 90.0),
    ):
        name = f"{word}: seated episodes within {within} cm, %"
        yield _of_row(name, seats[run], f"sits_within_{within}cm", 100.0, least=least)

    median = 100.0 * seats["free_t0_clean"]["seat_error_median"]
    of = f"{seats['free_t0_clean']['seat_episodes']} episodes"
    yield Wanted("FREE, clean: median height error, cm", median, of, most=1.5)
    for kind, rows in real["by kind"].items():
        row = rows["free_t0"]
        if row["clips"] >= _PIECES:
            name = f"FREE, raw: on {kind} within 8 cm, %"
            yield _of_row(name, row, "sits_within_8cm", 100.0, least=90.0)

    name = "FREE, raw: lying within 8 cm, %"
    yield _of_row(name, lying["free_t0"], "sits_within_8cm", 100.0, least=75.0)


def _of_targets(real: dict[str, Any]) -> Iterator[Wanted]:
    soft = real["by kind"].get("sofa", {})
    for word, rows, most in (
        ("seats", real["all seats"], 0.015),
        ("sofas", soft, 0.018),
        ("lying", real["lying"], 0.03),
    ):
        if rows:
            name = f"EE, raw: EED, {word}"
            yield _of_row(name, rows["ee_t0"], "end_effector_error", most=most)
    name = "EE, raw: seated episodes within 8 cm, %"
    yield _of_row(name, real["all seats"]["ee_t0"], "sits_within_8cm", 100.0, least=98.0)


def _of_life(real: dict[str, Any], lively: dict[str, Any]) -> Iterator[Wanted]:
    rows = real["all seats"]
    clips = f"{rows['ground_truth']['clips']} clips"
    figure = "bad_collisions_per_frame"
    leans = rows["free_t0"][figure] / rows["ground_truth"][figure]
    yield Wanted("FREE: joints in backs and arms, over real", leans, clips, 0.5, 1.2)

    moves = rows["free_t1"]["speed_wrists"] / rows["ground_truth"]["speed_wrists"]
    yield Wanted("temperature 1: speed of seated wrists, over real", moves, clips, 0.7, 1.3)
    for state, runs in lively["life"].items():
        for band in BANDS:
            name = f"temperature 1: {state}, {band} band, over real"
            yield Wanted(name, runs["temperature 1"][band], "captured clips", 0.5, 1.5)

    sways = [each["sway"] for each in lively["walks"] if each["temperature"] == 1.0]
    name = "temperature 1: sway on a straight way, cm"
    yield Wanted(name, float(np.nanmean(sways)), f"{len(sways)} walks", 3.0, 6.0)
    for asked in life.ASKED:
        took = [
            each["took"]
            for each in lively["descents"]
            if each["temperature"] == 1.0 and each["asked"] == asked
        ]
        name = f"temperature 1: descent over the {asked:g} s asked"
        yield Wanted(name, float(np.nanmean(took)) / asked, f"{len(took)} takes", 0.8, 1.2)

    for run, word in (("asked", "where captured"), ("asked aside", "10 cm aside")):
        off = [each[run] for each in lively["feet"]]
        name = f"EE, raw: feet from where they are asked for, {word}, cm"
        yield Wanted(name, float(np.mean(off)), f"{len(off)} clips", most=3.0)


def _of_feet(walking: dict[str, dict[str, Any]]) -> Iterator[Wanted]:
    for body, rows in walking.items():
        real = rows["ground_truth"]["foot_sliding_per_frame"]
        for run, word, most in (("free_t0", "raw", 1.4), ("free_t0_clean", "clean", 1.0)):
            slides = rows[run]["foot_sliding_per_frame"] / real
            name = f"FREE, {word}: sliding as he walks, over real, {body}"
            yield Wanted(name, slides, f"{rows[run]['clips']} clips", most=most)


def wanted(found: dict[str, Any]) -> list[Wanted]:
    """All that is wanted, of the reports that ``main`` makes, by their names; what is missed
    first.
    """
    own, real = found["wanted"], found["real-tell"]
    trunks, sits = np.array(own["trunks of who lies"]), own["postures"]
    level = 100.0 * float((np.abs(trunks) <= _LEVEL).mean())
    sent = found["sitting"]["all"]
    rows = [
        *_of_seats(real),
        Wanted(
            f"FREE, raw: trunk of who lies within {_LEVEL:g} degrees of level, %",
            level,
            f"{len(trunks)} clips",
            least=75.0,
        ),
        *_of_targets(real),
        Wanted("Sit on, by default: right in all, %", sent["right"], f"{sent['sent']} sent", 97.0),
        *_of_life(real, found["life"]),
        *_of_feet(own["walking"]),
        Wanted(
            f"postures of {len(_SEEDS)} seeds of one sit, in the median sit",
            float(np.median(sits)),
            f"{len(sits)} sits",
            least=3.0,
        ),
    ]
    return sorted(rows, key=lambda each: each.met)


def _trunk(joints: np.ndarray) -> np.ndarray:
    """Degrees (T,) by which trunks of joints (T, 22, 3) rise over level."""
    way = joints[:, NECK] - joints[:, PELVIS]
    return np.degrees(np.arcsin(way[:, 2] / np.linalg.norm(way, axis=-1)))


def _trunks_lying(clips: Sequence[HeldClip], weights: Weights) -> list[float]:
    found = []
    for clip in clips:
        controls = Controls(fps=MODEL_FPS, root=clip.path.matrices())
        joints = generate(clip.scene, controls, weights).joints
        for rest in clip.rests:
            found.append(float(np.median(_trunk(joints[rest.start : rest.end]))))
    return found


def postures(heads: np.ndarray, trunks: np.ndarray) -> int:
    """Of how many postures some takes are whose heads (N, 3) and trunks' leans (N,), in degrees,
    are these: the most of them of which each two are apart.
    """
    count, (far, turned) = len(heads), _APART
    apart = np.linalg.norm(heads[:, None] - heads[None], axis=-1) >= far
    apart |= np.abs(trunks[:, None] - trunks[None]) >= turned
    for size in range(count, 1, -1):
        if any(
            all(apart[a, b] for a, b in combinations(some, 2))
            for some in combinations(range(count), size)
        ):
            return size
    return min(count, 1)


def _postures(clips: Sequence[HeldClip], weights: Weights) -> list[int]:
    found = []
    draws = [Draw(seed, temperature=1.0) for seed in _SEEDS]
    for clip in clips:
        controls = Controls(fps=MODEL_FPS, root=clip.path.matrices())
        takes = run_to_end(takes_steps(clip.scene, controls, weights, draws))
        rest, forward = clip.rests[-1], forward_of(clip.path.yaw)
        seated = slice(rest.start + _SETTLES, rest.end)
        heads = [np.median(take.joints[seated, HEAD], axis=0) for take in takes]
        trunks = [np.degrees(np.median(lean(take.joints, forward)[seated])) for take in takes]
        found.append(postures(np.array(heads), np.array(trunks)))
    return found


def _walking(clips: Sequence[HeldClip], weights: Weights) -> dict[str, dict[str, Any]]:
    walks = [clip for clip in captured_clips(clips) if clip.activity == "walk"]
    runs = ("ground_truth", "free_t0", "free_t0_clean")
    measured = measure_clips(weights, walks, seeds=1, modes=("FREE",))
    return {
        body: rows_by_run(own, runs) for body, own in grouped(measured, lambda c: c.body).items()
    }


def wanted_text(found: dict[str, Any]) -> str:
    """The tables of the reports that ``main`` makes, by their names, in Markdown."""
    rows = wanted(found)
    missed = sum(not each.met for each in rows)
    head = ("", "found", "95 %", "wanted", "met", "of")
    parts = [
        "## What is wanted, and what is found",
        f"{missed} of {len(rows)} are missed.",
        markdown_table(head, [each.cells() for each in rows]),
    ]
    for group in ("body", "maker", "kind"):
        own = [
            (
                name,
                f"{runs['free_t0']['clips']}",
                *(
                    f"{100 * runs[run][f'sits_within_{cm}cm']:.0f}"
                    for run in ("free_t0", "free_t0_clean", "ee_t0")
                    for cm in (4, 8)
                ),
                f"{runs['ee_t0']['end_effector_error']:.4f}",
            )
            for name, runs in found["real-tell"][f"by {group}"].items()
        ]
        columns = [f"{run}, within {cm} cm, %" for run in ("FREE", "clean", "EE") for cm in (4, 8)]
        parts += [f"### By {group}", markdown_table((group, "clips", *columns, "EED in EE"), own)]
    return "\n\n".join(parts) + "\n"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "dafnet bench wanted",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--furniture", type=Path, required=True, metavar="LIBRARY")
    parser.add_argument("--weights", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    return parser


def main(arguments: Sequence[str]) -> str:
    """Run what the arguments ask for; the tables as text."""
    options = _parser().parse_args(arguments)
    file, folder, library = options.weights, options.folder, options.furniture
    weights = load_weights(file)
    told, walks = real_test(folder, library, "tell"), real_walks(library, "tell")

    def own() -> dict[str, Any]:
        return {
            "trunks of who lies": _trunks_lying([c for c in told if c.room == "bed"], weights),
            "walking": _walking(held_out(folder), weights),
            "postures": _postures(walks.clips[::_SITS], weights),
        }

    parts: dict[str, Callable[[], Any]] = {
        "real-tell": lambda: real_report(weights, told, walks=walks),
        "sitting": lambda: sitting.measure(file, _silent, library)[0],
        "life": lambda: life.measure(file, _silent, folder)[0],
        "wanted": own,
    }
    found = {}
    for name, measure in parts.items():
        record = options.output / f"{name}.json"
        if not record.exists():
            save_text(record, json.dumps(measure(), indent=2))
        found[name] = json.loads(record.read_text(encoding="utf-8"))

    text = wanted_text(found)
    save_text(options.output / "wanted.md", text)
    return text


def _silent(share: float) -> None:
    """Progress that nobody looks at."""
