"""Training: it learns, resumes exactly, stops on NaN with the last good state, and what it exports
is what it trained.
"""

import itertools
import json
import os
import subprocess
import sys
import threading
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from kit.networks import TINY
from kit.places import ROOT

torch = pytest.importorskip("torch", reason="training needs torch")

from dafnet_addon import cli  # noqa: E402
from dafnet_addon.core.errors import InputError, WeightsError  # noqa: E402
from dafnet_addon.core.progress import run_to_end  # noqa: E402
from dafnet_addon.core.root import RootPath  # noqa: E402
from dafnet_addon.core.sampler import Conditions, Sampler  # noqa: E402
from dafnet_addon.core.skeleton import MODEL_ORDER, model_order  # noqa: E402
from dafnet_addon.core.weights import load_weights  # noqa: E402
from dafnet_addon.data.dataset.prepare import POSE_UNIT  # noqa: E402
from dafnet_addon.data.furnish import boxes as boxes_module  # noqa: E402
from dafnet_addon.model.config import ModelConfig  # noqa: E402
from dafnet_addon.model.flow import (  # noqa: E402
    BodyFlow,
    Coupling,
    EnvironmentEncoder,
)
from dafnet_addon.model.predictor import ActionPredictor  # noqa: E402
from dafnet_addon.model.systems import sampler_of, system_named  # noqa: E402
from dafnet_addon.training import batches, precision  # noqa: E402
from dafnet_addon.training import train as training  # noqa: E402
from dafnet_addon.training.batches import (  # noqa: E402
    Pool,
    Statistics,
    chance,
    given_for,
    occupancy_of,
    past_of,
)
from dafnet_addon.training.candidates import provenance  # noqa: E402
from dafnet_addon.training.config import TrainingConfig, read_config  # noqa: E402
from dafnet_addon.training.export import (  # noqa: E402
    adopt_predictor,
    adopted_statistics,
    annotate,
    export,
    tensors_of,
)
from dafnet_addon.training.noise import (  # noqa: E402
    PartNoise,
    gains_of_noise,
    noise_along,
    process_of,
    take_noise,
    within_normal,
    within_room,
)
from dafnet_addon.training.parts import load_run, new_run, trained_networks  # noqa: E402
from dafnet_addon.training.processes import new_processes  # noqa: E402
from dafnet_addon.training.run import Run  # noqa: E402
from dafnet_addon.training.train import train_part  # noqa: E402

pytestmark = pytest.mark.torch


def _config(steps: int) -> TrainingConfig:
    """A budget that no test spends by time: runs are stopped by their number of steps."""
    return TrainingConfig(
        minutes_predictor=1e3, minutes_flow=1e3, batch=4, warmup=5, save_every=steps
    )


class _Enough(Exception):
    pass


def _until(
    part: str, dataset: Path, folder: Path, steps: int, saves: int = 1, model: ModelConfig = TINY
) -> Run:
    """Train a part for ``saves`` times ``steps`` steps; the run as it was saved last."""
    seen: list[float] = []

    def progress(name: str, share: float, loss: float) -> None:
        # Called before each save: the call after the last wanted one stops the run.
        if len(seen) == saves:
            raise _Enough
        seen.append(loss)

    with pytest.raises(_Enough):
        train_part(part, dataset, folder, model, _config(steps), progress=progress)
    return load_run(part, folder)


def test_pasts_hold_ten_poses_and_eleven_velocities():
    poses = torch.arange(14.0)[None, :, None].expand(1, 14, 66)
    velocity = 100 + torch.arange(14.0)[None, :, None].expand(1, 14, 3)
    past = past_of(poses, velocity, 10)
    assert past.shape == (1, 4, 693)
    assert (
        past[0, 0, 0] == 0
        and past[0, 0, 659] == 9
        and past[0, 0, 660] == 100
        and past[0, 0, 692] == 110
    )
    assert past[0, 3, 0] == 3 and past[0, 3, 692] == 113


def test_a_mode_gives_only_what_it_may():
    given = given_for(torch.randn(200, 20, 42))
    assert (given[..., 14:] == 0).all(), "the lower body is never given"
    effectors = [MODEL_ORDER.index(j) for j in (15, 20, 21)]
    counts = {tuple(row) for row in given[:, 0].numpy().astype(int).tolist()}
    assert any(sum(row) == 0 for row in counts) and any(sum(row) in (13, 14) for row in counts)
    alone = [row for row in counts if sum(row) == 1]
    assert {row.index(1) for row in alone} == set(effectors), "one hand alone is a valid request"


def test_feet_and_legs_may_be_given():
    like = torch.randn(4000, 4, 42)
    torch.manual_seed(3)
    without = given_for(like)
    torch.manual_seed(3)
    assert torch.equal(given_for(like, 0.0), without), "off, to the bit"

    given = given_for(like, 1.0)
    rows = {tuple(row) for row in given[:, 0].numpy().astype(int).tolist()}
    legs = {row[14:] for row in rows}
    assert {row for row in legs if sum(row) == 8} == {(1,) * 8}
    # LOWER: hips, knees, ankles, feet
    assert legs - {(1,) * 8} == {
        (0, 0, 0, 0, left, right, left * toes, right * toes)
        for left in (0, 1)
        for right in (0, 1)
        for toes in (0, 1)
    }
    uppers = {sum(row[:14]) for row in rows if sum(row[14:]) == 8}
    assert uppers == {0, 13, 14}, "all of the legs beside an upper body, or alone"
    assert any(sum(row[:14]) == 0 and row[14:] == (0, 0, 0, 0, 1, 0, 1, 0) for row in rows)
    assert any(sum(row[:14]) == 0 and sum(row[14:]) == 0 for row in rows), "nothing at all is FREE"

    few = given_for(like, 0.3)[:, :, 14:].any(-1).any(-1).float().mean()
    assert 0.05 < float(few) < 0.3


def _pool(dataset: Path) -> Pool:
    return Pool(lambda: sorted(dataset.glob("pool-????.npz")), torch.device("cpu"))


def test_statistics_standardise_and_keep_their_floor(dataset):
    pool = _pool(dataset)
    next(iter(pool.shards.values()))["poses"][..., 0] = 1000
    statistics = pool.statistics()
    assert statistics.pose_std.min() >= 0.01
    batch = pool.batch(torch.arange(12), statistics, TINY)
    assert torch.cat([batch.upper, batch.lower], -1).mean((0, 1)).abs().max() < 0.5


def test_pools_take_in_new_shards(dataset):
    pool = _pool(dataset)
    (dataset / "pool-0001.npz").write_bytes((dataset / "pool-0000.npz").read_bytes())
    pool.refresh()
    assert len(pool) == 24
    unit = Statistics(np.zeros(66), np.ones(66), np.zeros(3), np.ones(3), np.zeros(24), np.ones(24))
    batch = pool.batch(torch.tensor([3, 15, 23]), unit, TINY)
    assert (batch.root[0] == batch.root[1]).all() and not (batch.root[0] == batch.root[2]).all()


def test_the_sensor_in_torch_is_the_one_in_numpy():
    rng = np.random.default_rng(0)
    rows = rng.uniform(
        (-1, -1, 0.1, 0.05, 0.05, 0.05, -3), (1, 1, 1.2, 0.6, 0.6, 0.6, 3), (3, 6, 7)
    )
    rows[:, -1] = boxes_module.ABSENT
    root = np.concatenate(
        [rng.uniform(-0.5, 0.5, (3, 20, 2)), rng.uniform(-3, 3, (3, 20, 1))], axis=-1
    )
    made = occupancy_of(torch.from_numpy(rows), torch.from_numpy(root)).numpy()
    for boxes, places, seen in zip(rows, root, made, strict=True):
        path = RootPath(np.c_[places[:, :2], np.zeros(20)], places[:, 2])
        assert np.abs(seen - boxes_module.occupancy(boxes, path)).max() < 1e-6 and seen.max() > 0.5


def _loss_at(run: Run, dataset: Path) -> float:
    return run.held_out_loss(_pool(dataset), windows=12)


@pytest.mark.parametrize("part", ["predictor", "upper"])
def test_it_learns(part, dataset, tmp_path):
    folder = tmp_path / "run"
    if part == "upper":
        _until("predictor", dataset, folder, steps=2)
    fresh = new_run(part, tmp_path / "fresh", TINY, _config(10), _pool(dataset).statistics())
    before = _loss_at(fresh, dataset)
    assert _loss_at(_until(part, dataset, folder, steps=40), dataset) < before - 5.0


def test_resuming_is_exact(dataset, tmp_path, monkeypatch):
    # The Gumbel temperature follows the clock: let every step take a second.
    monkeypatch.setattr(training, "clock_of", lambda device: itertools.count().__next__)
    one, two = tmp_path / "one", tmp_path / "two"
    straight = _until("predictor", dataset, one, steps=3, saves=2)
    _until("predictor", dataset, two, steps=3)
    resumed = _until("predictor", dataset, two, steps=3)
    assert straight.step == resumed.step == 6
    for a, b in zip(straight.network.parameters(), resumed.network.parameters(), strict=True):
        assert torch.equal(a, b)
    assert all(
        torch.equal(value, resumed.averaged[name]) for name, value in straight.averaged.items()
    )


def test_a_rate_holds_then_falls_and_a_larger_budget_goes_on_from_before_it_fell(dataset, tmp_path):
    model, folder = replace(TINY, system="moglow", steps_whole=1), tmp_path / "run"
    config = replace(_config(1), steps_flow=10, cool_down=0.4, peak=1e-3, final=0.0, warmup=1)
    rates = [config.rate(step, step / 10) for step in range(11)]
    assert rates[:7] == [1e-3] * 7 and rates[10] == 0.0 and abs(rates[8] - 0.5e-3) < 1e-9
    cooled = train_part("whole", dataset, folder, model, config)
    assert cooled.step == 10
    log = folder / "log.jsonl"
    longer = train_part("whole", dataset, folder, model, replace(config, steps_flow=20))
    steps = [json.loads(line)["step"] for line in log.read_text(encoding="utf-8").splitlines()]
    assert longer.step == 20 and steps == [*range(1, 11), *range(8, 21)], (
        "from the last step at the full rate"
    )
    once = train_part("whole", dataset, tmp_path / "once", model, replace(config, steps_flow=20))
    for a, b in zip(longer.network.parameters(), once.network.parameters(), strict=True):
        assert torch.equal(a, b), "as if the budget had been known from the beginning"
    for name, value in longer.averaged.items():
        assert torch.equal(value, once.averaged[name])


def test_the_papers_rate_rises_to_its_peak_and_falls_as_one_over_the_root_of_the_steps():
    _, config = read_config(ROOT / "configs" / "paper.toml")
    rates = {step: config.rate(step - 1, 0.99) for step in (1, 100, 500, 1000, 4000, 10**6)}
    # init · √W · min(step · W^-1.5, step^-0.5) with W = 1000 and init = 1e-3, never below 1e-4
    expected = {1: 1e-4, 100: 1e-4, 500: 5e-4, 1000: 1e-3, 4000: 5e-4, 10**6: 1e-4}
    assert all(abs(rates[step] - rate) < 1e-12 for step, rate in expected.items())
    assert not config.cool_down and config.batch == 50


def test_what_is_exported_is_the_average(dataset, tmp_path):
    model = replace(TINY, system="moglow", steps_whole=1)
    config = replace(_config(1), steps_flow=6, average=0.9)
    run = train_part("whole", dataset, tmp_path, model, config)
    flow, _, _ = trained_networks(tmp_path)
    apart = 0.0
    for name, parameter in flow.parts()["whole"].named_parameters():
        assert torch.equal(parameter, run.averaged[name])
        apart += float(
            (parameter.detach() - dict(run.network.named_parameters())[name].detach()).abs().max()
        )
    assert apart > 0.0
    with run.with_average() as network:
        assert all(torch.equal(p, run.averaged[name]) for name, p in network.named_parameters())
    assert not all(torch.equal(p, run.averaged[name]) for name, p in run.network.named_parameters())


def test_a_loss_that_is_no_number_stops_with_the_last_good_state(dataset, tmp_path):
    folder = tmp_path / "run"
    _until("predictor", dataset, folder, steps=2)
    before = (folder / "predictor.checkpoint").read_bytes()
    with np.load(dataset / "pool-0000.npz") as z:
        pool = {name: z[name] for name in z.files}
    pool["velocity"] = pool["velocity"] * np.nan
    np.savez(dataset / "pool-0000.npz", **pool)
    with pytest.raises(InputError, match="not a number"):
        train_part("predictor", dataset, folder, TINY, _config(2))
    assert (folder / "predictor.checkpoint").read_bytes() == before


def test_a_run_may_be_told_of_legs_from_some_step_on_and_its_weights_say_so(dataset, tmp_path):
    folder = tmp_path / "run"
    for part in ("predictor", "upper", "lower"):
        _until(part, dataset, folder, steps=2)
    (dataset / "dataset.json").write_text("{}", encoding="utf-8")
    assert "legs" not in provenance(folder, dataset)["told"].split()

    more = replace(_config(2), steps_flow=6, legs_given=1.0, free_run=1.0)
    for part in ("upper", "lower"):
        assert train_part(part, dataset, folder, TINY, more).step == 6

    words = provenance(folder, dataset)
    flow, predictor, statistics = trained_networks(folder)
    export(tmp_path / "w.safetensors", flow, predictor, statistics, words)
    assert load_weights(tmp_path / "w.safetensors").heeds_legs


def test_what_is_exported_is_what_was_trained(dataset, tmp_path):
    folder = tmp_path / "run"
    for part in ("predictor", "upper", "lower"):
        _until(part, dataset, folder, steps=2)
    flow, predictor, statistics = trained_networks(folder)
    export(tmp_path / "w.safetensors", flow, predictor, statistics, {"licence": "none"})
    weights = load_weights(tmp_path / "w.safetensors")
    for name, array in tensors_of(flow, predictor, statistics).items():
        rows = (
            np.abs(array).max(axis=tuple(range(1, array.ndim)), keepdims=True)
            if array.ndim
            else array
        )
        assert (np.abs(weights.tensors[name] - array) <= rows / 253).all(), name
    annotate(tmp_path / "w.safetensors", {"held_out": json.dumps({"a": 1})})
    again = load_weights(tmp_path / "w.safetensors")
    assert again.metadata["licence"] == "none" and json.loads(again.metadata["held_out"]) == {
        "a": 1
    }
    assert all((again.tensors[name] == weights.tensors[name]).all() for name in weights.tensors)


def _exported(dataset: Path, folder: Path, model: ModelConfig) -> Path:
    """Weights of a hardly trained model, in a file."""
    for part in ("predictor", "upper", "lower"):
        _until(part, dataset, folder, steps=2, model=model)
    flow, predictor, statistics = trained_networks(folder)
    export(folder / "w.safetensors", flow, predictor, statistics, {"licence": "none"})
    return folder / "w.safetensors"


def test_a_run_begins_with_what_weights_have_learnt(dataset, tmp_path):
    weights = load_weights(_exported(dataset, tmp_path / "one", TINY))
    for part in ("predictor", "upper", "lower"):
        before = load_run(part, tmp_path / "one")
        predictor = load_run("predictor", tmp_path / "one").network.predictor
        after = new_run(part, tmp_path / "two", TINY, _config(2), before.statistics)
        if part == "predictor":
            # Weights hold the predictor alone, not the rest of its GMVAE.
            after.network.load_state_dict(before.network.state_dict())
        else:
            before.use_predictor(predictor)
            after.use_predictor(predictor)
        fresh = _loss_at(after, dataset)
        after.adopt(weights)
        # What was stored in 8 bits is off by a little.
        assert (
            abs(_loss_at(after, dataset) - _loss_at(before, dataset))
            < 0.02 * abs(_loss_at(before, dataset) - fresh) + 0.5
        )


FORESEEING = replace(TINY, ahead=24)
SHORT_SIGHTED = replace(TINY, ahead=18, ahead_mask=True)
LIVE = replace(FORESEEING, ahead_mask=True)


@pytest.mark.parametrize(
    ("before", "after"),
    [(TINY, FORESEEING), (TINY, LIVE), (FORESEEING, LIVE), (SHORT_SIGHTED, LIVE)],
)
def test_weights_that_were_told_less_of_the_way_ahead_begin_a_model_that_is_told(
    before: ModelConfig, after: ModelConfig, dataset: Path, tmp_path: Path
):
    weights = load_weights(_exported(dataset, tmp_path / "one", before))
    found = _pool(dataset).statistics()
    statistics = adopted_statistics(weights, found)
    assert (statistics.pose_mean == weights.tensors["pose_mean"]).all()
    for part in ("upper", "lower"):
        short, long = (
            new_run(part, tmp_path / "two", model, _config(2), statistics)
            for model in (before, after)
        )
        for run in (short, long):
            adopt_predictor(run.predictor, weights)
            run.adopt(weights)
        assert abs(_loss_at(short, dataset) - _loss_at(long, dataset)) < 1e-2
    with pytest.raises(WeightsError, match="choose others"):
        new_run("upper", tmp_path / "two", replace(before, width=8), _config(2), found).adopt(
            weights
        )


def test_the_way_ahead_is_hidden_from_a_share_of_the_windows(dataset, tmp_path):
    statistics = _pool(dataset).statistics()
    root = _pool(dataset).batch(torch.arange(4), statistics, LIVE).root.repeat(100, 1, 1)
    assert root.shape[-1] == 28 and (root[..., -1] == 1.0).all()
    run = new_run("upper", tmp_path, LIVE, replace(_config(2), ahead_hidden=0.25), statistics)
    told = run.root_inputs(root)
    hidden = (told[..., 3:] == 0.0).all(-1)
    assert (hidden == hidden[:, :1]).all(), "all along a window or nowhere in it"
    assert 0.15 < float(hidden.float().mean()) < 0.35
    assert (told[~hidden] == root[~hidden]).all() and (told[..., :3] == root[..., :3]).all()


def test_a_root_that_is_led_live_has_no_way_ahead(dataset, tmp_path):
    """Models that learnt without it make poses; those that were always told say what they need."""
    conditions = Conditions(
        np.zeros((5, 3)),
        np.full((5, 24), np.nan),
        np.zeros((5, 2640)),
        np.zeros((5, 66)),
        np.zeros((5, 22)),
    )
    z = np.zeros((1, 66))
    live = load_weights(_exported(dataset, tmp_path / "live", LIVE))
    made = [run_to_end(Sampler(live, device).run(conditions, z)).poses for device in (None, "cpu")]
    assert np.isfinite(made[0]).all() and np.abs(made[0] - made[1]).max() < 1e-4
    known = replace(conditions, ahead=np.zeros((5, 24)))
    assert np.abs(run_to_end(Sampler(live).run(known, z)).poses - made[0]).max() > 1e-6
    with pytest.raises(InputError, match="whole path"):
        told = load_weights(_exported(dataset, tmp_path / "told", FORESEEING))
        run_to_end(Sampler(told).run(conditions, z))


def test_a_wider_network_begins_as_the_narrower_one(dataset, tmp_path):
    weights = load_weights(_exported(dataset, tmp_path / "one", TINY))
    wide = replace(
        TINY,
        width=TINY.width + 5,
        code=TINY.code + 3,
        predictor_code=TINY.predictor_code + 2,
        predictor_width=TINY.predictor_width + 7,
    )
    statistics = adopted_statistics(weights, _pool(dataset).statistics())
    for part in ("upper", "lower"):
        losses = []
        for model in (TINY, wide):
            run = new_run(part, tmp_path / "two", model, _config(2), statistics)
            adopt_predictor(run.predictor, weights)
            run.adopt(weights)
            losses.append(_loss_at(run, dataset))
        assert abs(losses[0] - losses[1]) < 1e-3 * abs(losses[0]) + 1e-2
        run.loss(_pool(dataset).batch(torch.arange(4), statistics, wide)).backward()
        heard = run.network.couplings[0].out.weight.grad[:, TINY.width :]
        assert heard.abs().max() > 0.0, "the new units learn to be heard"


def test_mixed_precision_is_nearly_the_same(dataset, tmp_path):
    weights = load_weights(_exported(dataset, tmp_path / "one", TINY))
    statistics = adopted_statistics(weights, _pool(dataset).statistics())
    losses = []
    for mixed in (False, True):
        run = new_run(
            "upper",
            tmp_path / "two",
            TINY,
            replace(_config(2), mixed=mixed, free_run=1.0),
            statistics,
        )
        adopt_predictor(run.predictor, weights)
        run.adopt(weights)
        losses.append(_loss_at(run, dataset))
    assert abs(losses[0] - losses[1]) < 0.02 * abs(losses[0]) + 0.2


@pytest.mark.parametrize("there", [False, True])
def test_mixed_precision_is_asked_for_only_where_it_is_there(
    dataset, tmp_path, monkeypatch, capsys, there
):
    monkeypatch.setattr(precision, "is_available", lambda device: there)
    run = new_run(
        "upper", tmp_path, TINY, replace(_config(2), mixed=True), _pool(dataset).statistics()
    )
    switches = [
        module.mixed
        for module in run.flow.modules()
        if isinstance(module, Coupling | EnvironmentEncoder)
    ]
    assert switches and set(switches) == {there} and run.config.mixed is there, (
        "what is said of the run is what was done"
    )
    precision.warn_if_missing(True)
    assert capsys.readouterr().err.count("\n") == (0 if there else 1)
    precision.warn_if_missing(False)
    assert capsys.readouterr().err == ""


def test_a_step_is_what_its_parts_say_one_after_another(dataset):
    """Conditions joined once and time first, against the plain sum over flow steps in double."""
    torch.manual_seed(0)
    run = new_run("upper", dataset, TINY, _config(1), _pool(dataset).statistics())
    flow = run.flow.upper.double()
    with torch.no_grad():
        for parameter in flow.parameters():
            parameter += 0.05 * torch.randn_like(parameter)
        x, occupancy = torch.randn(3, 9, 42).double(), torch.rand(3, 9, 2640).double()
        condition = torch.randn(3, 9, TINY.condition_size - TINY.code).double()
        expected, total = x, 0.0
        for norm, linear, coupling in flow.steps():
            expected = (expected + norm.bias) * norm.log_scale.exp() @ linear.weight().T
            lstm = torch.nn.LSTM(
                coupling.lstm.input_size, TINY.width, TINY.layers, batch_first=True
            )
            lstm.double().load_state_dict(coupling.lstm.state_dict())
            passed, changed = expected[..., :21], expected[..., 21:]
            told = torch.cat([passed, condition, flow.encoders[0](occupancy)], dim=-1)
            shift, raw = coupling.out(lstm(told)[0]).chunk(2, dim=-1)
            scale = torch.sigmoid(raw + 2.0) + 1e-6
            expected = torch.cat([passed, (changed + shift) * scale], dim=-1)
            total = total + norm.log_scale.sum() + linear.log_s.sum() + scale.log().sum(-1)
        made, log_det, _ = flow(x, condition, occupancy)
    assert (made - expected).abs().max() < 1e-12 and (log_det - total).abs().max() < 1e-12


def test_a_frozen_predictor_that_reads_the_sensor_in_bfloat16_says_the_same(dataset):
    weights = load_weights()
    model = ModelConfig(**weights.config["model"])
    predictor = ActionPredictor(model)
    adopt_predictor(predictor, weights)
    statistics = adopted_statistics(weights, _pool(dataset).statistics())
    batch = _pool(dataset).batch(torch.arange(12), statistics, model)
    with torch.no_grad():
        exact = predictor(batch.past, batch.occupancy)
        code = predictor.encode(batch.occupancy)
        predictor.mixed = True
        near = predictor(batch.past, batch.occupancy.bfloat16())
        near_code = predictor.encode(batch.occupancy.bfloat16())
    assert near.dtype == exact.dtype and (near - exact).abs().max() < 0.02
    assert 0.0 < (near_code - code).abs().max() < 0.05 * code.abs().max()


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
def test_chance_hits_its_share_of_values_each_for_itself(share):
    torch.manual_seed(0)
    hit = chance((7, 300, 11), share, torch.device("cpu")).double()
    spread = 4.0 * (share * (1.0 - share) / hit.numel()) ** 0.5
    assert hit.shape == (7, 300, 11) and abs(hit.mean() - share) <= spread
    neighbours = (hit[..., 1:] - share) * (hit[..., :-1] - share)
    assert abs(neighbours.mean()) <= 4.0 * share * (1.0 - share) / neighbours.numel() ** 0.5


@pytest.mark.parametrize("part", ["predictor", "upper"])
def test_values_are_hidden_from_the_sensor_in_a_share_of_the_windows(part, dataset, tmp_path):
    config = replace(_config(1), dropout_windows=0.5, environment_dropout=0.5, mixed=True)
    run = new_run(part, tmp_path, TINY, config, _pool(dataset).statistics())
    seen = torch.randint(1, 256, (400, 3, 2640), dtype=torch.uint8)
    shown = run.dropped_out(seen).float()
    kept = (shown > 0).float().mean((1, 2))
    assert (shown[kept == 1] - seen[kept == 1].float() / 255).abs().max() < 2e-3
    assert abs((kept == 1).float().mean() - 0.5) < 0.1 and abs(kept[kept < 1].mean() - 0.5) < 0.005
    assert ((shown == 0) | ((shown - seen.float() / 255).abs() < 2e-3)).all(), "none is rescaled"


def test_the_optimiser_is_adam(dataset, tmp_path):
    run = new_run("upper", tmp_path, TINY, _config(1), _pool(dataset).statistics())
    other = new_run("upper", tmp_path, TINY, _config(1), run.statistics)
    plain = torch.optim.Adam(other.network.parameters(), lr=run.config.peak)
    batch = _pool(dataset).batch(torch.arange(12), run.statistics, TINY)
    for _ in range(10):
        for each, optimiser in ((run, run.optimiser), (other, plain)):
            torch.manual_seed(2)
            optimiser.zero_grad()
            each.loss(batch).backward()
            optimiser.step()
    for a, b in zip(run.network.parameters(), other.network.parameters(), strict=True):
        assert (a - b).abs().max() < 1e-4, "as plain Adam does, but for rounding"


def test_the_probe_leaves_the_generators_alone():
    before = torch.get_rng_state()
    precision.is_available.__wrapped__("cpu")
    assert torch.equal(torch.get_rng_state(), before)


def test_what_a_cpu_reads_of_the_sensor_is_what_other_devices_make(dataset):
    pool = _pool(dataset)
    rows = pool._rows(torch.arange(12))
    made = occupancy_of(rows["boxes"], rows["root"])
    assert made.max() > 0.5 and (rows["seen"].float() / 255 - made).abs().max() < 0.5 / 255 + 1e-6
    assert (dataset / "pool-0000.occupancy.npy").exists() and len(_pool(dataset)) == 12


@pytest.mark.parametrize("has_room", [False, True])
def test_other_devices_make_it_once_where_there_is_room_and_else_at_every_step(
    dataset, monkeypatch, has_room
):
    (dataset / "pool-0001.npz").write_bytes((dataset / "pool-0000.npz").read_bytes())
    rows = torch.tensor([3, 15, 23, 0])
    read = _pool(dataset)._rows(rows)["seen"]
    pool = Pool(list, torch.device("cpu"))
    pool.files = lambda: sorted(dataset.glob("pool-????.npz"))
    monkeypatch.setattr(batches, "on_disk", lambda device: False)
    # room for the first shard alone: the windows of a batch are then of both kinds
    monkeypatch.setattr(pool, "_has_room", lambda: has_room and not pool.sensed)
    pool.refresh()
    assert len(pool.sensed) == has_room and "seen" not in pool.shards[dataset / "pool-0000.npz"]
    assert torch.equal(pool._rows(rows)["seen"], read)


def test_windows_stay_on_disk_and_what_is_read_of_them_is_what_was_written(dataset):
    pool = _pool(dataset)
    with np.load(dataset / "pool-0000.npz") as written:
        (shard,) = pool.shards.values()
        for name in written.files:
            assert isinstance(shard[name], np.memmap) and (shard[name] == written[name]).all()


def test_statistics_are_mean_and_deviation_of_all_shards_at_once(dataset):
    with np.load(dataset / "pool-0000.npz") as shard:
        one = {name: shard[name] for name in ("poses", "velocity", "ahead")}
    two = {name: values[::2] + np.ones((), values.dtype) for name, values in one.items()}
    found = Statistics.of([one, two])
    poses, velocity = (
        np.concatenate([one[name], two[name]]).astype(float) for name in ("poses", "velocity")
    )
    poses = model_order(poses.reshape(-1, 66) * POSE_UNIT)
    assert np.allclose(found.pose_mean, poses.mean(0), atol=1e-12)
    assert np.allclose(found.pose_std, np.maximum(poses.std(0), 0.01), atol=1e-9)
    assert np.allclose(found.velocity_std, velocity.std((0, 1)), atol=1e-9)


def test_configurations_are_read_and_bad_ones_refused(tmp_path):
    root = ROOT / "configs"
    for file in sorted(root.glob("*.toml")):
        model, config = read_config(file)
        assert model.actions == 10 and config.batch > 0
    bad = tmp_path / "bad.toml"
    for text, words in (
        ("= 3", "cannot be read"),
        ("preset = 'huge'", "unknown"),
        ("preset = [1]", "unknown"),
        ("[model]\nwidht = 3", "unknown setting"),
        ("model = 3", "unknown setting 'model'"),
        ("[modle]\nwidth = 3", "unknown setting 'modle'"),
        ("training = 3", "by name"),
        ("[model]\nwidth = 'wide'", "'width'"),
        ("[model]\nwidth = 0", "'width' must be"),
        ("[training]\nbatch = 0", "'batch' must be"),
        ("[training]\nmixed = 1", "'mixed'"),
        ("[training]\npeak = nan", "'peak'"),
    ):
        bad.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=words):
            read_config(bad)
    with pytest.raises(InputError, match="holds no windows"):
        train_part("predictor", tmp_path, tmp_path / "run", TINY, _config(1))
    with pytest.raises(InputError, match="'lower' is unknown"):
        BodyFlow(replace(TINY, system="lower"))


def test_what_a_run_cannot_be_trained_with_is_said(dataset, tmp_path, capsys):
    _until("predictor", dataset, tmp_path / "run", steps=1)
    with pytest.raises(InputError, match="width 16, not 17; code 8, not 9"):
        train_part(
            "predictor", dataset, tmp_path / "run", replace(TINY, width=17, code=9), _config(1)
        )
    config = ROOT / "configs" / "small.toml"
    command = ["train", str(config), str(dataset), "-o", str(tmp_path / "two")]
    for device in ("cuda:77", "gpu"):
        assert cli.main([*command, "--device", device]) == 1
        said = capsys.readouterr().err
        assert f"'{device}' cannot be used" in said and said.strip().count("\n") == 0, said
    assert not (tmp_path / "two").exists()


def test_a_process_that_was_ended_from_outside_is_told(dataset, tmp_path, monkeypatch):
    ended = partial(new_processes, start=partial(os._exit, 9))
    monkeypatch.setattr(training, "new_processes", ended)
    with pytest.raises(InputError, match="give the same command again"):
        training.train(dataset, tmp_path, replace(TINY, system="moglow"), _config(1))


def test_batches_are_noisy_by_three_millimetres(dataset):
    pool, rows = _pool(dataset), torch.arange(12)
    unit = Statistics(np.zeros(66), np.ones(66), np.zeros(3), np.ones(3), np.zeros(24), np.ones(24))
    one, two = (pool.batch(rows, unit, TINY) for _ in range(2))
    assert abs(float((one.upper - two.upper).std()) - 0.003 * 2**0.5) < 3e-4


def test_free_running_loss_is_zero_for_the_captured_motion_and_knows_sliding():
    from dafnet_addon.core.skeleton import LOWER, REST, UPPER
    from dafnet_addon.training.free_run import lower_loss, sliding_speed, upper_loss

    rest = torch.from_numpy(REST).float()
    upper, lower = rest[list(UPPER)].repeat(3, 8, 1, 1), rest[list(LOWER)].repeat(3, 8, 1, 1)
    calm, given, step = (
        torch.tensor([True, False, True]),
        torch.zeros(3, 8, 14),
        torch.zeros(3, 8, 3),
    )
    assert float(upper_loss(upper, upper, calm, given)) < 1e-3
    free = torch.zeros(3, 8, 8)
    still = float(lower_loss(lower, lower, calm, upper[:, :, 0], step, free))
    assert still < 0.2  # where nothing moves, speeds are the square root's floor
    # The root goes 1 cm to the right each frame and turns; feet that stay in its frame slide over
    # the floor.
    step[..., 0] = 0.01
    assert torch.allclose(sliding_speed(lower, step), torch.tensor(0.3), atol=1e-3)
    assert float(lower_loss(lower, lower, ~calm, upper[:, :, 0], step, free)) > still + 1.0
    asked = free.clone()
    asked[..., 4:] = 1.0
    away = lower + torch.tensor([0.0, 0.05, 0.0])
    told, not_told = (
        float(lower_loss(away, lower, ~calm, upper[:, :, 0], 0.0 * step, each))
        for each in (asked, free)
    )
    assert told - not_told == pytest.approx(10.0, rel=0.01), "200 for each metre that feet are off"
    turning = torch.zeros(1, 2, 3)
    turning[..., 2] = 0.1
    fixed = torch.tensor([[0.0, 1.0, 0.0], [0.1, 0.995, 0.0]])[None, :, None]
    assert float(sliding_speed(fixed, turning)) < 0.02, (
        "a point that stays in the world while the root turns to the left"
    )


@pytest.mark.parametrize("part", ["lower", "upper"])
def test_the_lower_body_first_runs_freely_too(part: str, dataset: Path, tmp_path: Path):
    pool, model = _pool(dataset), replace(TINY, system="lower-first")
    run = new_run(
        part, tmp_path, model, replace(_config(1), free_run=1.0, mixed=True), pool.statistics()
    )
    loss = run.loss(pool.batch(torch.arange(4), run.statistics, model))
    loss.backward()
    assert loss.isfinite() and all(p.grad.isfinite().all() for p in run.network.parameters())


def test_running_on_is_the_likelihood_and_the_inverse(dataset):
    torch.manual_seed(0)
    run = new_run("upper", dataset, TINY, _config(1), _pool(dataset).statistics())
    flow = run.flow.upper
    with torch.no_grad():
        for parameter in flow.parameters():
            parameter += 0.05 * torch.randn_like(parameter)
        x, z, occupancy = torch.randn(2, 12, 42), torch.randn(2, 7, 42), torch.rand(2, 12, 2640)
        condition = torch.randn(2, 12, TINY.condition_size - TINY.code)
        density, made = flow.free_run(x, condition, occupancy, z, 5)
        assert torch.allclose(density, flow.log_likelihood(x, condition, occupancy), atol=1e-3)
        again, _, _ = flow(torch.cat([x[:, :5], made], 1), condition, occupancy)
    assert (again[:, 5:] - z).abs().max() < 1e-3


@pytest.mark.parametrize("part", ["upper", "lower"])
def test_free_runs_see_the_noise_that_takes_are_drawn_from(
    part: str, dataset: Path, tmp_path: Path
):
    pool = _pool(dataset)
    config = replace(_config(1), free_run=1.0, calm=0.3, lively=0.6)
    run = new_run(part, tmp_path, TINY, config, pool.statistics())
    run.prepare(pool)
    torch.manual_seed(0)
    size = run.flow.partition[part].stop - run.flow.partition[part].start
    z, calm = run._free_run_noise(torch.zeros(4000, 30, size))
    lively = (z != z[:, :1]).any(-1).any(-1)
    assert abs(calm.float().mean() - 0.3) < 0.03 and (z[calm] == 0.0).all()
    assert abs(lively.float().mean() - 0.6) < 0.03 and not (lively & calm).any()

    # What is drawn varies, lasts, and follows upon itself as takes' noise does.
    found = take_noise(run.flow, run.predictor, pool, run.statistics, parts=[part])
    lasting, passing, taps = (found[f"{part}.{name}"] for name in ("spread", "passing", "taps"))
    drawn = z[lively].double().numpy()
    for apart in (0, 1, 5):
        pairs = (drawn[:, : 30 - apart] * drawn[:, apart:]).mean((0, 1))
        held = (lasting.astype(float) ** 2).sum(1)
        follows = (taps[:, : 49 - apart] * taps[:, apart:]).sum(1) * (passing**2).sum(1)
        assert np.abs(pairs - (held + follows)).max() < 0.1 * (held + (passing**2).sum(1)).max()


def test_calm_and_lively_windows_are_no_more_than_all():
    with pytest.raises(ValueError, match="together"):
        TrainingConfig(calm=0.6, lively=0.5)


def _tiny_train(
    python: list[str], dataset: Path, folder: Path, changed: dict[str, str | None]
) -> str:
    """What ``dafnet train`` of a small model says, run as ``python`` in an environment with some
    variables set or unset.
    """
    (dataset / "dataset.json").write_text('{"train": ["Jörg"]}', encoding="utf-8")
    config = dataset / "tiny.toml"
    config.write_text(
        'preset = "small"\n[model]\npredictor_code = 8\npredictor_width = 16\nwidth = 16\ncode = '
        "8\nsteps_upper = 1\n"
        "steps_lower = 1\n[training]\nminutes_predictor = 0.02\nminutes_flow = 0.02\nbatch = "
        "4\nmixed = true\n",
        encoding="utf-8",
    )
    environment = {
        name: value for name, value in {**os.environ, **changed}.items() if value is not None
    }
    done = subprocess.run(
        [sys.executable, *python, "-m", "dafnet_addon", "train", config, dataset, "-o", folder],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    weights = load_weights(folder / "dafnet.safetensors")
    assert weights.config["model"]["width"] == 16 and "Jörg" in weights.metadata["data"]
    return done.stderr


def test_it_trains_without_avx_512_in_a_bare_environment(dataset, tmp_path):
    """A processor without a bfloat16 LSTM, no home, no UTF-8, one thread: as in a container or a
    batch job.
    """
    bare = {
        "ONEDNN_MAX_CPU_ISA": "AVX2",
        "OMP_NUM_THREADS": "1",
        "LC_ALL": "C",
        "PYTHONUTF8": "0",
        "PYTHONCOERCECLOCALE": "0",
        "HOME": None,
        "TZ": "Asia/Kathmandu",
    }
    said = _tiny_train([], dataset, tmp_path / "run", bare)
    assert said.count("single precision") == 1


def test_a_training_that_is_killed_leaves_no_process_behind(dataset: Path, tmp_path: Path):
    (dataset / "dataset.json").write_text('{"train": []}', encoding="utf-8")
    config = dataset / "tiny.toml"
    config.write_text(
        'preset = "small"\n[training]\nminutes_predictor = 0.01\nminutes_flow = 30.0\nbatch = 4\n',
        encoding="utf-8",
    )
    asked = [sys.executable, "-m", "dafnet_addon", "train", config, dataset, "-o", tmp_path / "run"]
    began = subprocess.Popen(asked, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    latest = time.monotonic() + 240.0
    while not all((tmp_path / "run" / f"{p}.checkpoint").exists() for p in ("upper", "lower")):
        assert began.poll() is None and time.monotonic() < latest
        time.sleep(0.2)

    began.kill()
    # Its processes hold this pipe, too: it ends when the last of them does.
    assert began.stdout is not None
    ended = threading.Thread(target=began.stdout.read, daemon=True)
    ended.start()
    ended.join(60.0)
    assert not ended.is_alive()


def test_two_processes_train_one_model(dataset, tmp_path):
    # By number: a bare machine may not know the name localhost.
    here = ["--rdzv-backend", "c10d", "--rdzv-endpoint", "127.0.0.1:0", "--local-addr", "127.0.0.1"]
    together = ["-m", "torch.distributed.run", *here, "--nproc-per-node", "2"]
    _tiny_train(together, dataset, tmp_path / "run", {"OMP_NUM_THREADS": "1"})
    lines = [
        json.loads(line)
        for line in (tmp_path / "run" / "log.jsonl").read_text(encoding="utf-8").splitlines()
    ]
    assert len(lines) == len({(line["part"], line["step"]) for line in lines}), (
        "one process keeps the run"
    )
    assert {line["part"] for line in lines} == {"predictor", "upper", "lower"}


@pytest.mark.parametrize("system", ["ap-p", "moglow", "lower-first"])
def test_baselines_learn_and_their_weights_run(system: str, dataset: Path, tmp_path: Path):
    model = replace(TINY, system=system, steps_whole=2)
    folder = tmp_path / "run"
    if model.predicts:
        _until("predictor", dataset, folder, steps=2, model=model)
    for part in system_named(model.system).partition:
        fresh = new_run(part, tmp_path / "fresh", model, _config(10), _pool(dataset).statistics())
        before = _loss_at(fresh, dataset)
        assert (
            _loss_at(_until(part, dataset, folder, steps=40, model=model), dataset) < before - 5.0
        )
    flow, predictor, statistics = trained_networks(folder)
    assert (predictor is None) == (system == "moglow")
    noise = take_noise(flow, predictor, _pool(dataset), statistics)
    export(tmp_path / "w.safetensors", flow, predictor, statistics, {}, noise)
    weights = load_weights(tmp_path / "w.safetensors")
    sampler = sampler_of(weights)
    nothing = {"velocity": 3, "ahead": 24, "occupancy": 2640, "observation": 66, "given": 22}
    conditions = Conditions(**{name: np.zeros((20, size)) for name, size in nothing.items()})
    made = run_to_end(sampler.run(conditions, sampler.noise(20, 1))).poses
    assert made.shape == (20, 1, 66) and np.isfinite(made).all()
    with pytest.raises(WeightsError, match=f"'{system}'.*dafnet evaluate"):
        Sampler(weights)


def test_a_budget_in_steps_is_spent_by_steps(dataset: Path, tmp_path: Path):
    model = replace(TINY, system="moglow", steps_whole=1)
    run = train_part("whole", dataset, tmp_path, model, replace(_config(50), steps_flow=7))
    assert run.step == 7 and load_run("whole", tmp_path).step == 7


def test_takes_are_drawn_from_the_noise_along_captured_motion(dataset: Path, tmp_path: Path):
    run = new_run("upper", tmp_path, TINY, _config(1), _pool(dataset).statistics())
    pool, predictor = _pool(dataset), run.predictor
    tensors = take_noise(run.flow, predictor, pool, run.statistics)
    batch = pool.batch(torch.arange(12), run.statistics, TINY, noise=0.0)
    for part, noise in noise_along(run.flow, predictor, batch).items():
        found = within_normal(process_of(noise[:, 20:].numpy().astype(float)))
        for name in ("spread", "passing"):
            assert np.abs(tensors[f"{part}.{name}"] - found[name]).max() < 1e-4
            assert (np.triu(found[name], 1) == 0).all()
        power = (tensors[f"{part}.taps"] ** 2).sum(axis=1)
        varies = (found["spread"] ** 2).sum(1) + power * (found["passing"] ** 2).sum(1)
        assert 0.0 < varies.max() < 1.0 + 1e-3, "within N(0, I)"


def test_drawn_noise_follows_upon_itself_as_what_it_was_found_in():
    """A body's own way, a drift within a second, and a tremble, each of its own size."""
    rng = np.random.default_rng(0)
    windows, frames = 3000, 50
    drift = [rng.standard_normal((windows, 2))]
    for _ in range(frames - 1):
        drift.append(0.9 * drift[-1] + np.sqrt(1.0 - 0.9**2) * rng.standard_normal((windows, 2)))

    own = np.array([0.6, 0.2]) * rng.standard_normal((windows, 1, 2))
    tremble = np.array([0.2, 0.4]) * rng.standard_normal((windows, frames, 2))
    noise = own + np.array([0.8, 1.0]) * np.stack(drift, axis=1) + tremble

    torch.manual_seed(0)
    found = {name: torch.from_numpy(t).float() for name, t in process_of(noise).items()}
    drawn = PartNoise(**found).draw(windows, frames).numpy()
    for apart in (0, 1, 3, 10, 20, 40):
        alike, wanted = (
            (values[:, : frames - apart] * values[:, apart:]).mean((0, 1))
            for values in (drawn, noise)
        )
        assert np.abs(alike - wanted).max() < 0.1, apart


def test_no_dimension_is_drawn_wider_than_the_flow_s_own_noise():
    rng = np.random.default_rng(0)
    small, large = 0.5 * rng.standard_normal((400, 50, 1)), 3.0 * rng.standard_normal((400, 50, 1))
    found = process_of(np.concatenate([small, large + small], axis=2))
    bounded = within_normal(found)
    torch.manual_seed(0)
    noise = PartNoise(**{name: torch.from_numpy(t).float() for name, t in bounded.items()})
    narrow, wide = noise.draw(500, 50).numpy().std((0, 1))
    assert narrow == pytest.approx(0.5, rel=0.05) and wide == pytest.approx(1.0, rel=0.05)
    assert np.corrcoef(noise.draw(500, 50).numpy().reshape(-1, 2).T)[0, 1] == pytest.approx(
        np.corrcoef(np.concatenate([small, large + small], axis=2).reshape(-1, 2).T)[0, 1], abs=0.05
    ), "what goes together still does"
    raised = within_room({**bounded, "taps": 2.0 * bounded["taps"]})
    assert np.allclose(
        np.linalg.norm(raised, axis=1) / np.linalg.norm(found["taps"], axis=1), (2.0, 1.0), atol=0.1
    )


def test_noise_is_damped_or_raised_until_poses_move_as_captured_ones(dataset: Path, tmp_path: Path):
    run, pool = (
        new_run("upper", tmp_path, TINY, _config(1), _pool(dataset).statistics()),
        _pool(dataset),
    )
    flow, predictor = run.flow, run.predictor
    batch = pool.batch(torch.arange(len(pool)), run.statistics, TINY, noise=0.0)
    tensors = take_noise(flow, predictor, pool, run.statistics)

    def gains(times: float) -> dict[str, np.ndarray]:
        noise = {
            part: PartNoise(
                torch.from_numpy(tensors[f"{part}.spread"]),
                times * torch.from_numpy(tensors[f"{part}.passing"]),
                torch.from_numpy(tensors[f"{part}.taps"]),
            )
            for part in ("upper", "lower")
        }
        return gains_of_noise(flow, predictor, [batch], run.statistics, noise)

    # A flow that has learnt nothing is linear: three times the noise is three times the motion.
    once, threefold = gains(1.0), gains(3.0)
    for part in ("upper", "lower"):
        assert ((once[part] >= 0.0) & (once[part] <= 2.0**0.5)).all()
        assert np.allclose(threefold[part][4:], once[part][4:] / 3.0, rtol=0.2)


def test_what_weights_do_not_say_of_noise_is_the_paper_s(dataset: Path, tmp_path: Path):
    file = tmp_path / "w.safetensors"
    for part in ("predictor", "upper", "lower"):
        _until(part, dataset, tmp_path / "run", steps=2)
    flow, predictor, statistics = trained_networks(tmp_path / "run")
    tripled = {"lower.spread": 3.0 * np.eye(24, dtype=np.float32)}
    export(file, flow, predictor, statistics, {}, tripled)
    sampler = Sampler(load_weights(file))
    upper, lower = (np.random.default_rng([5, k]).standard_normal(n) for k, n in ((0, 42), (1, 24)))
    drawn = sampler.noise(9, 5)[:, 0]
    assert (drawn == drawn[0]).all(), "held"
    assert np.allclose(drawn[0, :42], upper) and np.allclose(drawn[0, 42:], 3.0 * lower)
    assert (sampler.noise(9, 5, temperature=0.0) == 0).all()
