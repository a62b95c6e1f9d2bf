"""What each thing gives by which people live: weights trained alike but for one of them, in equal
time.

    dafnet bench life-ablation DATASET FOLDER -o RUNS --from WEIGHTS --furniture LIBRARY --minutes 6

``DATASET`` was made by ``dafnet prepare`` of the motion files in ``FOLDER`` and the ``LIBRARY``. Of
as many windows and the same seed others are made: without the people of the newest files, with
root paths that sway as captured ones do, and with ways to seats as quick as they were captured. All
are trained on from ``WEIGHTS``; on the whole one also without lively free runs, and without feet
and legs that are asked for. Measured on the bodies and makers that choose, raw, and on straight
walks and descents that nobody was captured on (``benchmarks/life.py``). Writes
``life-ablation.json`` and ``.md``; what is finished is kept.
"""

import argparse
import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import life
from benchmarks.ablation import described_with_pieces, train_on
from dafnet_addon.core.files import save_text
from dafnet_addon.core.liveliness import BANDS
from dafnet_addon.core.threads import cores
from dafnet_addon.core.weights import Weights, load_weights
from dafnet_addon.data.dataset.prepare import prepare
from dafnet_addon.data.dataset.windows import AS_PEOPLE_DO, Augmentation
from dafnet_addon.data.held_out.captured import HeldClip
from dafnet_addon.data.held_out.real import real_test
from dafnet_addon.training import precision
from dafnet_addon.training.evaluation.clips import measure_clips, rows_by_run
from dafnet_addon.training.evaluation.markdown import markdown_table

__all__ = ["NEWEST", "VARIANTS", "Variant", "main"]

NEWEST = ("cmu_fbx", "mhad", "quaternius_ual")
"""The newest sources: most sit-downs, boards, and work at desks and in kitchens."""


@dataclass(frozen=True)
class Variant:
    """How a variant differs: in the ``leave_out`` of sources and the ``augmentation`` of its
    dataset, or in its ``training``.
    """

    leave_out: tuple[str, ...] = ()
    augmentation: Augmentation = AS_PEOPLE_DO
    training: dict[str, Any] = field(default_factory=dict)

    @property
    def made_alike(self) -> bool:
        """Whether it trains on the whole dataset."""
        return not self.leave_out and self.augmentation == AS_PEOPLE_DO


_WHOLE: dict[str, Any] = {"lively": 0.25, "legs_given": 0.3}
VARIANTS = {
    "all of it": Variant(),
    "without the newest people": Variant(leave_out=NEWEST),
    "paths that sway": Variant(augmentation=Augmentation(paths_by_hand=False)),
    "ways to seats as captured": Variant(augmentation=Augmentation(retimed=False)),
    "without lively free runs": Variant(training={"lively": 0.0}),
    "without feet asked for": Variant(training={"legs_given": 0.0}),
}
BEGUN = "the weights begun with"
_SEEDS = 2


def _dataset_of(variant: Variant, dataset: Path, folder: Path, library: Path, out: Path) -> Path:
    """Make (or go on making) the dataset of a variant: its folder. Raises InputError where the
    whole one has no real pieces.
    """
    described = described_with_pieces(dataset)
    if variant.made_alike:
        return dataset

    made = out / "dataset"
    prepare(
        folder,
        made,
        windows=described["windows"],
        processes=cores(),
        seed=described["seed"],
        furniture=library,
        augmentation=variant.augmentation,
        leave_out=variant.leave_out,
    )
    return made


def _measured(weights: Weights, file: Path, clips: Sequence[HeldClip]) -> dict[str, Any]:
    measured = measure_clips(weights, clips, seeds=_SEEDS, modes=("FREE", "EE"), clean=False)
    report, _ = life.measure(file, lambda share: None, noise=[(0.0, 0), (1.0, 1), (1.0, 2)])
    feet = list(life.feet(weights, clips, lambda share: None))
    return {
        **rows_by_run(measured, ("ground_truth", "free_t0", "free_t1", "ee_t0")),
        **report,
        "feet": {
            run: round(float(np.mean([each[run] for each in feet])), 2)
            for run in ("asked", "asked aside", "not asked")
        },
    }


def _table(results: dict[str, dict[str, Any]]) -> str:
    """The results in Markdown, beside the captured motion."""
    truth = next(iter(results.values()))["ground_truth"]
    head = (
        "",
        "FREE, within 4 / 8 cm",
        "EED in EE",
        "life at temperature 1, slow / middle / quick, of real",
        "sway, cm; with the foot",
        *(f"descent of {asked:g} s" for asked in life.ASKED),
        "feet asked for / 10 cm aside / not, cm off",
        "skate, cm a frame",
    )
    rows = []
    for name, found in results.items():
        free, lively, ee = found["free_t0"], found["free_t1"], found["ee_t0"]
        walks = [each for each in found["walks"] if each["temperature"] == 1.0]
        descents = [
            np.nanmean([each["took"] for each in found["descents"] if each["asked"] == asked])
            for asked in life.ASKED
        ]
        shares = (
            f"{lively[f'speed_{b}'] / truth[f'speed_{b}']:.2f}" if f"speed_{b}" in truth else "–"
            for b in BANDS
        )
        rows.append(
            (
                name,
                f"{100 * free['sits_within_4cm']:.0f} / {100 * free['sits_within_8cm']:.0f} %",
                f"{ee['end_effector_error']:.4f}",
                " / ".join(shares),
                f"{np.nanmean([each['sway'] for each in walks]):.1f}; "
                f"{np.median([each['led'] for each in walks]):.2f}",
                *(f"{took:.2f}" for took in descents),
                " / ".join(f"{off:.1f}" for off in found["feet"].values()),
                f"{free['skate_cm']:.2f}",
            )
        )
    return markdown_table(head, rows)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "dafnet bench life-ablation",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("dataset", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--from", dest="begin_with", type=Path, required=True, metavar="WEIGHTS")
    parser.add_argument("--furniture", type=Path, required=True, metavar="LIBRARY")
    parser.add_argument("--minutes", type=float, default=6.0, help="a part of each")
    return parser


def main(arguments: Sequence[str]) -> str:
    """Run what the arguments ask for; the table as text."""
    options = _parser().parse_args(arguments)
    begin_with = load_weights(options.begin_with)
    precision.warn_if_missing(True)
    clips = [
        clip
        for clip in real_test(options.folder, options.furniture, "choose")
        if clip.room != "bed"
    ]
    record = options.output / "life-ablation.json"
    results: dict[str, dict[str, Any]] = (
        json.loads(record.read_text(encoding="utf-8")) if record.exists() else {}
    )

    def keep(name: str, found: dict[str, Any]) -> None:
        results[name] = found
        save_text(record, json.dumps(results, indent=1))
        save_text(record.with_suffix(".md"), _table(results) + "\n")

    if BEGUN not in results:
        keep(BEGUN, _measured(begin_with, options.begin_with, clips))

    for name, variant in VARIANTS.items():
        if name in results:
            continue
        out = options.output / name.replace(" ", "_")
        dataset = _dataset_of(variant, options.dataset, options.folder, options.furniture, out)
        file = train_on(dataset, out, options.minutes, begin_with, **{**_WHOLE, **variant.training})
        keep(name, _measured(load_weights(file), file, clips))
        if not variant.made_alike:
            shutil.rmtree(dataset)

    return _table(results)
