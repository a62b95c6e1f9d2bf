"""Datasets and runs that are carried to another machine and back: small, near enough, gone on
with.
"""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kit.places import ROOT

torch = pytest.importorskip("torch", reason="training needs torch")

from dafnet_addon import cli  # noqa: E402
from dafnet_addon.core.errors import InputError  # noqa: E402
from dafnet_addon.core.weights import load_weights  # noqa: E402
from dafnet_addon.data.dataset.packed import is_packed, pack, unpack  # noqa: E402
from dafnet_addon.data.dataset.prepare import load_pool  # noqa: E402
from dafnet_addon.model.config import ModelConfig  # noqa: E402
from dafnet_addon.training.checkpoints import Checkpoint, slim_run  # noqa: E402
from dafnet_addon.training.config import TrainingConfig, read_config  # noqa: E402
from dafnet_addon.training.parts import load_run  # noqa: E402
from dafnet_addon.training.train import train_part  # noqa: E402

pytestmark = pytest.mark.torch

TINY = ModelConfig(system="moglow", width=8, layers=1, code=8, steps_whole=1, shared_encoder=True)
STEPPED = TrainingConfig(steps_flow=4, batch=4, warmup=2, save_every=2)
SMALL = (
    "width=8",
    "code=8",
    "predictor_code=8",
    "predictor_width=16",
    "steps_upper=1",
    "steps_lower=1",
    "save_every=10",
)


def _described(dataset: Path, copies: int = 1) -> Path:
    """The dataset with what it says of itself, and its shard several times."""
    (dataset / "dataset.json").write_text('{"train": ["Jörg"]}', encoding="utf-8")
    for k in range(1, copies):
        (dataset / f"pool-{k:04d}.npz").write_bytes((dataset / "pool-0000.npz").read_bytes())
    return dataset


def test_a_packed_dataset_is_whole_again_to_what_its_fields_are_rounded_to(dataset, tmp_path):
    assert pack(_described(dataset, 2), tmp_path / "packed") == 24
    assert is_packed(tmp_path / "packed") and not is_packed(dataset)
    assert unpack(tmp_path / "packed", tmp_path / "whole") == 24
    off = {"poses": 2.5, "velocity": 5.1e-6, "ahead": 5.1e-4, "root": 5.1e-5}
    for name in ("pool-0000.npz", "pool-0001.npz", "held.npz"):
        before, after = (load_pool([folder / name]) for folder in (dataset, tmp_path / "whole"))
        assert before.keys() == after.keys()
        for field, values in before.items():
            assert values.dtype == after[field].dtype and values.shape == after[field].shape
            if field == "kinds":
                assert (values == after[field]).all()
            else:
                apart = np.abs(values.astype(float) - after[field]).max()
                assert apart <= off.get(field, 0.0), field
    described = json.loads((tmp_path / "whole" / "dataset.json").read_text(encoding="utf-8"))
    assert described["train"] == ["Jörg"] and described["windows"] == 24


def test_so_many_windows_are_packed_as_there_is_room_for(dataset, tmp_path):
    pack(_described(dataset, 3), tmp_path / "all")
    whole = sum(file.stat().st_size for file in (tmp_path / "all").iterdir())
    one = (tmp_path / "all" / "packed-0000.npz").stat().st_size
    room = (whole - 1.2 * one) / 2**20
    packed = pack(dataset, tmp_path / "some", room)
    assert 12 < packed < 24
    assert sum(file.stat().st_size for file in (tmp_path / "some").iterdir()) <= room * 2**20
    assert unpack(tmp_path / "some", tmp_path / "whole") == packed
    with pytest.raises(InputError, match="allow more"):
        pack(dataset, tmp_path / "none", 1e-3)
    with pytest.raises(InputError, match="is not a dataset"):
        pack(tmp_path / "all", tmp_path / "none")


def test_a_file_that_was_damaged_on_the_way_is_said(dataset, tmp_path):
    pack(_described(dataset), tmp_path / "packed")
    file = tmp_path / "packed" / "packed-0000.npz"
    data = file.read_bytes()
    for damaged in (data[: len(data) // 2], data[:200] + bytes(200) + data[400:], b""):
        file.write_bytes(damaged)
        with pytest.raises(InputError, match="get it again") as error:
            unpack(tmp_path / "packed", tmp_path / "whole")
        assert "\n" not in str(error.value)


def test_a_slim_run_is_an_eighth_and_is_gone_on_with(dataset, tmp_path):
    run = train_part("whole", dataset, tmp_path / "run", TINY, STEPPED)
    (file, log) = slim_run(tmp_path / "run", tmp_path / "slim")
    assert log.read_bytes() == (tmp_path / "run" / "log.jsonl").read_bytes()
    kept = Checkpoint.read(file)
    assert kept.is_slim and not any(name.startswith("optimiser.") for name in kept.tensors)
    numbers = sum(p.numel() for p in run.network.parameters())
    assert (
        file.stat().st_size
        < 2 * numbers + 40_000
        < 0.2 * (tmp_path / "run" / "whole.checkpoint").stat().st_size
    )
    again = load_run("whole", tmp_path / "slim")
    for name, parameter in again.network.named_parameters():
        assert torch.allclose(parameter, run.averaged[name], rtol=1e-3, atol=1e-6)
        assert torch.equal(parameter, again.averaged[name])
    longer = train_part("whole", dataset, tmp_path / "slim", TINY, replace(STEPPED, steps_flow=8))
    assert longer.step == 8 and not Checkpoint.read(file).is_slim


def test_settings_on_the_command_line_replace_the_files(tmp_path):
    file = ROOT / "configs" / "main.toml"
    model, training = read_config(file, ["width=17", "batch=3", "mixed=false"])
    plain_model, plain = read_config(file)
    assert model == replace(plain_model, width=17)
    assert training == replace(plain, batch=3, mixed=False)
    for wrong in ("widht=3", "width=wide", "width", "batch=0", "a.b=1", "batch=1\nbatch=2"):
        with pytest.raises(InputError, match="cannot be used"):
            read_config(file, [wrong])


def test_what_is_carried_to_itself_or_is_nothing_is_refused(dataset, tmp_path, capsys):
    for arguments in (
        [str(dataset), "-o", str(dataset)],
        [str(tmp_path), "-o", str(tmp_path / "a")],
    ):
        assert cli.main(["carry", *arguments]) == 1
        said = capsys.readouterr().err
        assert said.startswith("dafnet: ") and said.count("\n") == 1


ABSENT = ("bpy", "matplotlib", "PIL", "rtree", "safetensors", "scipy", "tensorboard", "trimesh")
HIDDEN = f"""
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {ABSENT}:
            raise ModuleNotFoundError(f"No module named '{{name}}'", name=name)
sys.meta_path.insert(0, Hidden())
"""


def _on_gpu(
    *arguments: object, python: str = sys.executable, without: Path = ROOT
) -> subprocess.CompletedProcess[str]:
    settings = [word for setting in SMALL for word in ("--set", setting)]
    return subprocess.run(
        [ROOT / "scripts" / "train_on_gpu.sh", *map(str, arguments), "--batch", "4", *settings],
        env={**os.environ, "PYTHON": python, "PYTHONPATH": str(without), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
    )


def test_one_command_trains_on_a_machine_without_a_network_and_goes_on_on_another(
    dataset, tmp_path
):
    """Twenty steps, as on a GPU, on this processor; then four more from what was carried back."""
    pack(_described(dataset), tmp_path / "packed")
    out, again = tmp_path / "out", tmp_path / "again"
    # Nothing but torch and NumPy is there.
    (tmp_path / "sitecustomize.py").write_text(HIDDEN, encoding="utf-8")
    common = (tmp_path / "packed", "--device", "cpu", "--minutes", "0.05")
    done = _on_gpu(*common, "-o", out, "--set", "steps_flow=20", without=tmp_path)
    assert done.returncode == 0, done.stderr
    names = {"predictor.checkpoint", "upper.checkpoint", "lower.checkpoint"}
    assert {f.name for f in out.iterdir()} == names | {"log.jsonl", "dafnet.safetensors"}
    assert all(f.stat().st_size <= 16 << 20 for f in out.iterdir())
    assert all(Checkpoint.read(out / name).is_slim for name in names)
    data = json.loads(load_weights(out / "dafnet.safetensors").metadata["data"])
    assert data == {"train": ["Jörg"], "windows": 12}
    for part in ("upper", "lower"):
        assert load_run(part, out).step == 20 and load_run(part, out).config.batch == 4
    done = _on_gpu(
        *common, "-o", again, "--set", "steps_flow=24", "--resume", out, without=tmp_path
    )
    assert done.returncode == 0, done.stderr
    lines = [
        json.loads(line) for line in (again / "log.jsonl").read_text(encoding="utf-8").splitlines()
    ]
    steps = [line["step"] for line in lines if line["part"] == "upper"]
    assert steps == [10, 20, 24], "it went on from where it was, and tells of all"


def test_what_the_machine_lacks_is_said_in_one_sentence(tmp_path):
    done = _on_gpu(tmp_path, "-o", tmp_path / "out", python="/bin/false")
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert "torch" in done.stderr and not (tmp_path / "out").exists()
    assert _on_gpu(tmp_path).returncode == 2
