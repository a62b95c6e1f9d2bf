#!/usr/bin/env python3
"""Weights whose numbers are the mean of those of several runs that went on from one another, or
were cooled at several times: what one has learnt and forgotten since counts as well.

    scripts/mean_of_runs.py RUN RUN … --dataset DATASET -o FILE

The file says of what runs it is the mean, and all else of the last one. Needs torch.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import torch

ROOT = Path(__file__).absolute().parents[1]
sys.path.insert(0, str(ROOT))

from dafnet_addon.core.errors import InputError  # noqa: E402 - found only now
from dafnet_addon.training.candidates import provenance, write_networks  # noqa: E402
from dafnet_addon.training.parts import trained_networks  # noqa: E402


def mean_weights(runs: Sequence[Path], dataset: Path, file: Path) -> None:
    """Write the mean of the flows of the folders ``runs``, which have one predictor, into ``file``;
    how far takes differ is measured anew in ``dataset``. Raises InputError where they are not of
    one make.
    """
    made = [trained_networks(run) for run in runs]
    flow, _, _ = made[-1]
    states = [each.state_dict() for each, _, _ in made]
    shapes = [{name: values.shape for name, values in state.items()} for state in states]
    predictors = [each.state_dict() for _, each, _ in made if each is not None]
    if any(each != shapes[-1] for each in shapes) or any(
        not torch.equal(values, predictors[-1][name])
        for each in predictors
        for name, values in each.items()
    ):
        raise InputError("The runs have other sizes or predictors; give runs of one training.")

    flow.load_state_dict(
        {
            name: torch.stack([state[name].double() for state in states]).mean(0).to(last.dtype)
            for name, last in states[-1].items()
        }
    )
    said = [provenance(run, dataset) for run in runs]
    of = [json.loads(each["training"]) for each in said]
    steps = [{part: each[part] for part in each if part in ("upper", "lower")} for each in of]
    training = json.dumps({**of[-1], "mean_of": steps})
    write_networks(made[-1], dataset, file, {**said[-1], "training": training})


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN")
    parser.add_argument("--dataset", type=Path, required=True)
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE")
    options = parser.parse_args()
    try:
        mean_weights(options.runs, options.dataset, options.output)
    except InputError as error:
        sys.exit(f"mean_of_runs: {error}")


if __name__ == "__main__":
    main()
