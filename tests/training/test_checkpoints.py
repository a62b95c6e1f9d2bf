"""Checkpoints: what is gone on with is exact and whole, and a stranger's run folder executes
nothing.
"""

import json
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kit.places import ROOT

torch = pytest.importorskip("torch", reason="training needs torch")

from dafnet_addon import cli  # noqa: E402
from dafnet_addon.baselines.samp import SampConfig  # noqa: E402
from dafnet_addon.baselines.train import load_samp, train_samp  # noqa: E402
from dafnet_addon.core.errors import InputError  # noqa: E402
from dafnet_addon.core.weights import write_safetensors  # noqa: E402
from dafnet_addon.model.config import ModelConfig  # noqa: E402
from dafnet_addon.training.batches import Statistics  # noqa: E402
from dafnet_addon.training.checkpoints import Checkpoint, write_checkpoint  # noqa: E402
from dafnet_addon.training.config import TrainingConfig  # noqa: E402
from dafnet_addon.training.parts import load_run, new_run, trained_networks  # noqa: E402
from dafnet_addon.training.run import Run  # noqa: E402
from dafnet_addon.training.train import train_part  # noqa: E402

pytestmark = pytest.mark.torch

TINY = ModelConfig(
    system="moglow",
    predictor_code=8,
    predictor_width=16,
    width=8,
    layers=1,
    code=8,
    steps_whole=1,
    shared_encoder=True,
)
TINY_SAMP = SampConfig(width=16, code=8, experts=2, latent=4, frames=10)
STEPPED = TrainingConfig(steps_flow=4, batch=4, warmup=2, save_every=2, free_run=1.0)
UNIT = Statistics(np.zeros(66), np.ones(66), np.zeros(3), np.ones(3), np.zeros(24), np.ones(24))


class _Stopped(Exception):
    pass


def _one_sentence(error: pytest.ExceptionInfo[InputError]) -> None:
    text = str(error.value)
    assert text.endswith(".") and "\n" not in text and "Traceback" not in text


@pytest.mark.parametrize("lively", [0.0, 0.5])
def test_a_run_that_was_stopped_ends_bit_for_bit_as_one_that_was_not(
    dataset: Path, tmp_path: Path, lively: float
) -> None:
    config = replace(STEPPED, lively=lively)

    def stop(part: str, share: float, loss: float) -> None:
        if share >= 1.0:
            raise _Stopped

    train_part("whole", dataset, tmp_path / "straight", TINY, config)
    with pytest.raises(_Stopped):
        train_part("whole", dataset, tmp_path / "stopped", TINY, config, progress=stop)
    assert load_run("whole", tmp_path / "stopped").step == 2
    train_part("whole", dataset, tmp_path / "stopped", TINY, config)
    one, two = (
        Checkpoint.read(tmp_path / name / "whole.checkpoint") for name in ("straight", "stopped")
    )
    assert one.state["step"] == two.state["step"] == 4
    assert one.tensors.keys() == two.tensors.keys() and any(
        name.startswith("optimiser.") for name in one.tensors
    )
    for name, tensor in one.tensors.items():
        assert torch.equal(tensor, two.tensors[name]), name
    assert ("noise.spread" in one.tensors) == (lively > 0.0)
    lines = [
        json.loads(line)
        for line in (tmp_path / "stopped" / "log.jsonl").read_text(encoding="utf-8").splitlines()
    ]
    assert [line["step"] for line in lines] == [2, 4], (
        "what was stopped before it was saved is not told twice"
    )


def test_a_run_that_was_begun_without_lively_free_runs_goes_on_with_them(
    dataset: Path, tmp_path: Path
) -> None:
    train_part("whole", dataset, tmp_path, TINY, STEPPED)
    longer = replace(STEPPED, steps_flow=6, lively=0.5)
    run = train_part("whole", dataset, tmp_path, TINY, longer)
    assert run.step == 6 and run.noise is not None

    kept = load_run("whole", tmp_path)
    assert torch.equal(kept.noise.taps, run.noise.taps)
    assert load_run("whole", tmp_path, replace(longer, lively=0.0)).noise is None


def test_samp_goes_on_bit_for_bit_too(dataset: Path, tmp_path: Path) -> None:
    def stop(share: float, loss: float) -> None:
        raise _Stopped

    straight, stopped = tmp_path / "a.checkpoint", tmp_path / "b.checkpoint"
    assert train_samp("samp-ob", TINY_SAMP, dataset, straight, STEPPED) == 4
    with pytest.raises(_Stopped):
        train_samp("samp-ob", TINY_SAMP, dataset, stopped, STEPPED, progress=stop)
    assert train_samp("samp-ob", TINY_SAMP, dataset, stopped, STEPPED) == 4
    one, two = Checkpoint.read(straight), Checkpoint.read(stopped)
    assert one.tensors.keys() == two.tensors.keys()
    assert all(torch.equal(tensor, two.tensors[name]) for name, tensor in one.tensors.items())
    assert load_samp(stopped)[0] == "samp-ob"
    for changed, refused in (
        ({"config": asdict(replace(TINY_SAMP, width=17))}, "of another shape"),
        ({"kind": ["samp"]}, "none of SAMP's"),
    ):
        write_checkpoint(tmp_path / "c.checkpoint", one.tensors, {**one.state, **changed})
        with pytest.raises(InputError, match=refused) as error:
            load_samp(tmp_path / "c.checkpoint")
        _one_sentence(error)


class _Hostile:
    """What creates a file when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return Path.touch, (self.mark,)


PICKLES = {
    "pickle": (pickle.dump, pickle.load),
    "torch": (torch.save, partial(torch.load, weights_only=False)),
}


@pytest.mark.parametrize("kind", PICKLES)
@pytest.mark.parametrize("suffix", ["pt", "checkpoint"])
def test_a_strangers_run_folder_executes_nothing(
    dataset: Path, tmp_path: Path, capsys: Any, suffix: str, kind: str
) -> None:
    dump, load = PICKLES[kind]
    run, mark = tmp_path / "run", tmp_path / "executed"
    run.mkdir()
    for part in ("predictor", "upper", "lower", "whole", "samp"):
        with (run / f"{part}.{suffix}").open("wb") as file:
            dump(_Hostile(mark), file)
    for read in (
        lambda: load_run("whole", run),
        lambda: trained_networks(run),
        lambda: load_samp(run / f"samp.{suffix}"),
        lambda: train_part("whole", dataset, run, TINY, STEPPED),
    ):
        with pytest.raises(InputError, match=r"pickle|cannot be read") as error:
            read()
        _one_sentence(error)
    assert cli.main(["evaluate", str(dataset), "--weights", str(run / f"samp.{suffix}")]) != 0
    assert "Traceback" not in capsys.readouterr().err and not mark.exists()
    with (run / f"samp.{suffix}").open("rb") as file:
        load(file)
    assert mark.exists(), "the file really is hostile"


KILLED = """
import os, signal, sys, torch
from pathlib import Path
from dafnet_addon.training import checkpoints
file, moment = Path(sys.argv[1]), sys.argv[2]
checkpoints.write_checkpoint(file, {"network.a": torch.zeros(1000)}, {"step": 1})
def die(*_): os.kill(os.getpid(), signal.SIGKILL)
def half(part, tensors, words): Path(part).write_bytes(b"half of it"); die()
if moment == "written": checkpoints.write_safetensors = half
else: setattr(os, moment, die)
checkpoints.write_checkpoint(file, {"network.a": torch.ones(1000)}, {"step": 2})
"""


@pytest.mark.parametrize("moment", ["written", "fsync", "replace"])
def test_a_killed_writer_leaves_the_checkpoint_before(tmp_path: Path, moment: str) -> None:
    file = tmp_path / "whole.checkpoint"
    done = subprocess.run(
        [sys.executable, "-c", KILLED, file, moment], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    kept = Checkpoint.read(file)
    assert kept.state == {"step": 1} and not kept.tensors["network.a"].any()
    write_checkpoint(file, {"network.a": torch.ones(3)}, {"step": 3})
    assert Checkpoint.read(file).state == {"step": 3} and list(tmp_path.iterdir()) == [file], (
        "nothing is left lying about"
    )


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Checkpoint:
    """The checkpoint of a run after a step."""
    run = new_run("whole", tmp_path_factory.mktemp("run"), TINY, STEPPED, UNIT)
    sum(p.sum() for p in run.network.parameters()).backward()
    run.optimiser.step()
    run.step = 1
    run.save()
    return Checkpoint.read(run.folder / "whole.checkpoint")


def _reads(kept: Checkpoint, folder: Path, tensors: dict[str, Any], state: dict[str, Any]) -> Run:
    """The run of a checkpoint, some of whose tensors and words are others; None takes one away."""
    mixed = {
        name: tensor for name, tensor in {**kept.tensors, **tensors}.items() if tensor is not None
    }
    write_checkpoint(
        folder / "whole.checkpoint",
        mixed,
        {k: v for k, v in {**kept.state, **state}.items() if v is not None},
    )
    return load_run("whole", folder)


MODEL = TINY.as_dict()
MOVED = "couplings.0.out.bias"


@pytest.mark.parametrize(
    ("tensors", "state", "named"),
    [
        ({}, {"model": None}, "model"),
        ({}, {"model": [1]}, "model"),
        ({}, {"model": {**MODEL, "colour": 1}}, "colour"),
        ({}, {"model": {**MODEL, "width": "wide"}}, "width"),
        ({}, {"model": {**MODEL, "width": True}}, "width"),
        ({}, {"model": {**MODEL, "width": 1 << 40}}, "width"),
        ({}, {"model": {**MODEL, "width": 1 << 16}}, "too large"),
        ({}, {"model": {**MODEL, "steps_whole": 10**9}}, "steps_whole"),
        ({}, {"model": {**MODEL, "code": 0}}, "code"),
        ({}, {"model": {**MODEL, "action_temperature": 0.0}}, "action_temperature"),
        ({}, {"model": {**MODEL, "system": "dafnet"}}, "no part 'whole'"),
        ({}, {"model": {**MODEL, "system": "x"}}, "unknown"),
        ({}, {"model": {**MODEL, "width": 9}}, "another shape"),
        ({}, {"config": {"batch": 0}}, "batch"),
        ({}, {"config": {"peak": float("inf")}}, "not finite"),
        ({}, {"config": {"peak": 10**17}}, "peak"),
        ({}, {"config": {"peak": 10**400}}, "too large"),
        ({}, {"config": {"calm": -0.1}}, "calm"),
        ({}, {"step": -1}, "steps"),
        ({}, {"step": True}, "steps"),
        ({}, {"step": 1.5}, "steps"),
        ({}, {"step": None}, "steps"),
        ({}, {"seconds": float("nan")}, "not finite"),
        ({}, {"seconds": -1.0}, "seconds"),
        ({}, {"seconds": "1"}, "seconds"),
        ({}, {"adopted": 3}, "adopted"),
        ({f"network.{MOVED}": None}, {}, MOVED),
        ({f"network.{MOVED}": torch.zeros(2)}, {}, MOVED),
        ({f"network.{MOVED}": torch.zeros(66, dtype=torch.double)}, {}, MOVED),
        ({f"optimiser.{MOVED}.exp_avg": torch.zeros(2)}, {}, "exp_avg"),
        ({f"optimiser.{MOVED}.exp_avg_sq": None}, {}, "exp_avg_sq"),
        ({"generator.cpu": None}, {}, "generators"),
        ({"generator.cpu": torch.zeros(3, dtype=torch.uint8)}, {}, "generators"),
        ({"generator.cpu": torch.zeros(5056)}, {}, "generators"),
        ({"statistics.pose_std": torch.zeros(66, dtype=torch.double)}, {}, "pose_std"),
        (
            {"statistics.ahead_mean": torch.full((24,), torch.nan, dtype=torch.double)},
            {},
            "ahead_mean",
        ),
        ({"statistics.velocity_mean": torch.zeros(4, dtype=torch.double)}, {}, "velocity_mean"),
    ],
)
def test_what_no_trainer_writes_is_refused_by_name(
    kept: Checkpoint, tmp_path: Path, tensors: dict[str, Any], state: dict[str, Any], named: str
) -> None:
    assert _reads(kept, tmp_path, {}, {}).step == 1
    with pytest.raises(InputError, match=named) as error:
        _reads(kept, tmp_path, tensors, state)
    _one_sentence(error)


def test_damaged_files_are_refused_or_read(kept: Checkpoint, tmp_path: Path) -> None:
    rng, whole, file = (
        np.random.default_rng(0),
        kept.path.read_bytes(),
        tmp_path / "whole.checkpoint",
    )
    header = 8 + int.from_bytes(whole[:8], "little")
    refused = 0
    for k in range(60):
        data = bytearray(whole)
        if k % 3 == 0:
            del data[int(rng.integers(len(data))) :]
        for place in rng.integers(header, size=0 if k % 3 == 0 else k % 3 * 2):
            data[place] = int(rng.integers(256))
        file.write_bytes(data)
        try:
            load_run("whole", tmp_path)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)
    assert refused > 30


def test_json_as_deep_as_the_stack_is_refused(kept: Checkpoint, tmp_path: Path) -> None:
    arrays = {name: tensor.numpy() for name, tensor in kept.tensors.items()}
    for text in ("[" * 100_000, "{", "7", "", "[]"):
        write_safetensors(
            tmp_path / "whole.checkpoint", arrays, {"format": "dafnet-training-1", "state": text}
        )
        with pytest.raises(InputError, match="its state is") as error:
            load_run("whole", tmp_path)
        _one_sentence(error)
