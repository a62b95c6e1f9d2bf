"""Training: it learns, resumes exactly, stops on NaN with the last good state, and what it exports is what it trained."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")

from dafnet_addon.core.errors import InputError  # noqa: E402
from dafnet_addon.core.skeleton import MODEL_ORDER  # noqa: E402
from dafnet_addon.core.weights import load_weights  # noqa: E402
from dafnet_addon.model.config import ModelConfig  # noqa: E402
from dafnet_addon.training.batches import Statistics, batch_of, observation_for, past_of  # noqa: E402
from dafnet_addon.training.export import annotate, export, tensors_of  # noqa: E402
from dafnet_addon.training.train import Run, TrainingConfig, read_config, train_part, trained  # noqa: E402

TINY = ModelConfig(
    predictor_code=8, predictor_width=16, width=16, code=8, shared_encoder=True, mask=True, steps_upper=1, steps_lower=1
)


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    """A small set of swaying bodies, each window at a height of its own that the sensor shows."""
    rng, windows = np.random.default_rng(0), 12
    sway = np.sin(np.linspace(0, 6, 80))[None, :, None] * rng.uniform(0.05, 0.2, (windows, 1, 66))
    poses = (rng.normal(size=66) + sway).astype(np.float32)
    pool = {
        "poses": poses, "velocity": rng.normal(scale=0.01, size=(windows, 80, 3)).astype(np.float32),
        "occupancy": (rng.random((windows, 70, 2640)) < 0.03).astype(np.uint8) * 255, "kinds": np.array(["walk"] * windows),
    }
    folder = tmp_path / "dataset"
    folder.mkdir()
    np.savez(folder / "pool-000.npz", **pool)
    np.savez(folder / "held.npz", **{name: value[:4] for name, value in pool.items()})
    return folder


def _config(steps: int) -> TrainingConfig:
    """A budget that no test spends by time: runs are stopped by their number of steps."""
    return TrainingConfig(minutes_predictor=1e3, minutes_flow=1e3, batch=4, warmup=5, save_every=steps)


class _Enough(Exception):
    pass


def _until(part: str, dataset: Path, folder: Path, steps: int, saves: int = 1) -> Run:
    """Train a part for ``saves`` times ``steps`` steps; the run as it was saved last."""
    seen: list[float] = []

    def progress(name: str, share: float, loss: float) -> None:
        # Called before each save: the call after the last wanted one stops the run.
        if len(seen) == saves:
            raise _Enough
        seen.append(loss)

    with pytest.raises(_Enough):
        train_part(part, dataset, folder, TINY, _config(steps), progress=progress)
    return Run.load(part, folder)


def test_pasts_hold_ten_poses_and_eleven_velocities():
    poses = torch.arange(14.0)[None, :, None].expand(1, 14, 66)
    velocity = 100 + torch.arange(14.0)[None, :, None].expand(1, 14, 3)
    past = past_of(poses, velocity, 10)
    assert past.shape == (1, 4, 693)
    assert past[0, 0, 0] == 0 and past[0, 0, 659] == 9 and past[0, 0, 660] == 100 and past[0, 0, 692] == 110
    assert past[0, 3, 0] == 3 and past[0, 3, 692] == 113


def test_observations_show_only_what_a_mode_gives():
    upper = torch.randn(200, 20, 42)
    observation, given = observation_for(np.random.default_rng(0), upper)
    mask = given.repeat_interleave(3, -1)
    assert (observation[mask == 0] == 0).all()
    shown = mask[..., :42] == 1
    assert (observation[..., :42][shown] == upper[shown]).all()
    assert (given[..., 14:] == 0).all(), "the lower body is never given"
    effectors = [MODEL_ORDER.index(j) for j in (15, 20, 21)]
    counts = {tuple(row) for row in given[:, 0].numpy().astype(int).tolist()}
    assert any(sum(row) == 0 for row in counts) and any(sum(row) in (13, 14) for row in counts)
    alone = [row for row in counts if sum(row) == 1]
    assert {row.index(1) for row in alone} == set(effectors), "one hand alone is a valid request"


def test_statistics_standardise_and_keep_their_floor(dataset):
    with np.load(dataset / "pool-000.npz") as z:
        poses, velocity = z["poses"], z["velocity"]
    poses = poses.copy()
    poses[..., 0] = 1.0
    statistics = Statistics.of(poses, velocity)
    assert statistics.pose_std.min() >= 0.01 and np.abs(statistics.poses(poses).mean((0, 1))).max() < 1e-4


def _loss_at(run: Run, dataset: Path) -> float:
    with np.load(dataset / "pool-000.npz") as z:
        return run.held_loss({name: z[name] for name in z.files}, windows=12)


@pytest.mark.parametrize("part", ["predictor", "upper"])
def test_it_learns(part, dataset, tmp_path):
    folder = tmp_path / "run"
    if part == "upper":
        _until("predictor", dataset, folder, steps=2)
    with np.load(dataset / "pool-000.npz") as z:
        fresh = Run(part, tmp_path / "fresh", TINY, _config(10), Statistics.of(z["poses"], z["velocity"]))
    before = _loss_at(fresh, dataset)
    assert _loss_at(_until(part, dataset, folder, steps=40), dataset) < before - 5.0


def test_resuming_is_exact(dataset, tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    straight = _until("predictor", dataset, one, steps=3, saves=2)
    _until("predictor", dataset, two, steps=3)
    resumed = _until("predictor", dataset, two, steps=3)
    assert straight.step == resumed.step == 6
    for a, b in zip(straight.network.parameters(), resumed.network.parameters(), strict=True):
        # The learning rate follows the clock, so equality holds to what two clocks differ by.
        assert torch.allclose(a, b, atol=1e-5)


def test_a_loss_that_is_no_number_stops_with_the_last_good_state(dataset, tmp_path):
    folder = tmp_path / "run"
    _until("predictor", dataset, folder, steps=2)
    before = (folder / "predictor.pt").read_bytes()
    with np.load(dataset / "pool-000.npz") as z:
        pool = {name: z[name] for name in z.files}
    pool["velocity"] = pool["velocity"] * np.nan
    np.savez(dataset / "pool-000.npz", **pool)
    with pytest.raises(InputError, match="no number"):
        train_part("predictor", dataset, folder, TINY, _config(2))
    assert (folder / "predictor.pt").read_bytes() == before


def test_what_is_exported_is_what_was_trained(dataset, tmp_path):
    folder = tmp_path / "run"
    for part in ("predictor", "upper", "lower"):
        _until(part, dataset, folder, steps=2)
    flow, predictor, statistics = trained(folder)
    export(tmp_path / "w.safetensors", flow, predictor, statistics, {"licence": "none"})
    weights = load_weights(tmp_path / "w.safetensors")
    for name, array in tensors_of(flow, predictor, statistics).items():
        error = np.abs(weights.tensors[name] - array).max()
        assert error <= 1e-3 * max(np.abs(array).max(), 1.0), name
    annotate(tmp_path / "w.safetensors", {"held_out": json.dumps({"a": 1})})
    again = load_weights(tmp_path / "w.safetensors")
    assert again.metadata["licence"] == "none" and json.loads(again.metadata["held_out"]) == {"a": 1}
    assert all((again.tensors[name] == weights.tensors[name]).all() for name in weights.tensors)


def test_configurations_are_read_and_bad_ones_refused(tmp_path):
    root = Path(__file__).resolve().parents[1] / "configs"
    for file in sorted(root.glob("*.toml")):
        model, config = read_config(file)
        assert model.actions == 10 and config.batch > 0
    bad = tmp_path / "bad.toml"
    for text, words in (("preset = 'huge'", "unknown"), ("[model]\nwidht = 3", "unknown setting"), ("= 3", "cannot be read")):
        bad.write_text(text)
        with pytest.raises(InputError, match=words):
            read_config(bad)
    with pytest.raises(InputError, match="holds no windows"):
        train_part("predictor", tmp_path, tmp_path / "run", TINY, _config(1))


def test_batches_are_noisy_by_three_millimetres(dataset):
    with np.load(dataset / "pool-000.npz") as z:
        pool = {name: z[name] for name in z.files}
    statistics = replace(Statistics.of(pool["poses"], pool["velocity"]), pose_std=np.ones(66), pose_mean=np.zeros(66))
    rows = np.arange(12)
    batch = batch_of(pool, rows, statistics, 10)
    clean = statistics.poses(pool["poses"][rows])[:, 10:, :42]
    assert abs(float((batch.upper - torch.from_numpy(clean)).std()) - 0.003) < 3e-4
