"""The sampler against the torch model it was exported from, NumPy against torch, resuming, and
seeds.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dafnet_addon.core.errors import WeightsError
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.sampler import Conditions, Sampler
from dafnet_addon.core.skeleton import OFFSETS, model_order, smpl_order
from dafnet_addon.core.weights import load_weights


def _conditions(frames: int, seed: int = 0) -> Conditions:
    rng = np.random.default_rng(seed)
    smooth = np.cumsum(rng.normal(size=(frames, 3)), axis=0) * (0.001, 0.002, 0.003) + (0, 0.02, 0)
    occupancy = np.repeat((rng.random((1, 2640)) < 0.05).astype(float), frames, axis=0)
    given = np.zeros((frames, 22))
    given[frames // 3 : frames // 2, 12:14] = 1.0
    observation = np.tile(rng.normal(size=66) * 0.1 + np.tile([0.0, 0.2, 1.0], 22), (frames, 1))
    return Conditions(smooth, np.repeat(smooth, 8, axis=1), occupancy, observation, given)


def test_orders_are_inverse():
    poses = np.arange(66.0)
    assert (smpl_order(model_order(poses)) == poses).all() and not (
        model_order(poses) == poses
    ).all()


@pytest.mark.torch
def test_frame_by_frame_equals_the_model_in_float64(tmp_path: Path):
    import torch

    from dafnet_addon.core.weights import FORMAT, Weights
    from dafnet_addon.model.config import ModelConfig
    from dafnet_addon.model.flow import BodyFlow
    from dafnet_addon.model.predictor import ActionPredictor
    from dafnet_addon.training.batches import Statistics, past_of
    from dafnet_addon.training.export import tensors_of

    torch.manual_seed(3)
    config = ModelConfig(
        predictor_code=8,
        predictor_width=16,
        width=12,
        code=8,
        shared_encoder=False,
        mask=True,
        ahead=24,
    )
    flow, predictor = BodyFlow(config), ActionPredictor(config)
    with torch.no_grad():
        for p in [*flow.parameters(), *predictor.parameters()]:
            p += 0.05 * torch.randn_like(p)
    rng = np.random.default_rng(0)
    statistics = Statistics(
        rng.normal(size=66),
        rng.uniform(0.1, 0.3, 66),
        rng.normal(size=3) * 0.01,
        np.full(3, 0.02),
        rng.normal(size=24) * 0.1,
        np.full(24, 0.2),
    )
    flow.double(), predictor.double()
    tensors = tensors_of(flow, predictor, statistics)
    description = {"model": config.as_dict(), "fps": 30, "offsets": OFFSETS.tolist()}
    weights = Weights(tensors, description, {"format": FORMAT}, tmp_path)
    conditions, z = _conditions(30), rng.normal(size=(2, 66))
    made, actions, density, _ = run_to_end(Sampler(weights, dtype="float64").run(conditions, z))

    # The same, by the model's own forward: poses must go back to the noise that they were made
    # from.
    poses = torch.from_numpy(
        (model_order(made).transpose(1, 0, 2) - tensors["pose_mean"]) / tensors["pose_std"]
    )
    velocity = torch.from_numpy(
        (conditions.velocity - tensors["velocity_mean"]) / tensors["velocity_std"]
    )
    velocity = torch.cat([velocity[:1].repeat(10, 1), velocity]).repeat(2, 1, 1)
    past = past_of(torch.cat([torch.zeros(2, 10, 66, dtype=torch.float64), poses], 1), velocity, 10)
    occupancy = torch.from_numpy(conditions.occupancy).repeat(2, 1, 1)
    with torch.no_grad():
        probabilities = predictor(past, occupancy)
        given = torch.from_numpy(conditions.given).repeat(2, 1, 1)
        scaled = (
            (conditions.observation - tensors["pose_mean"])
            / tensors["pose_std"]
            * np.repeat(conditions.given, 3, -1)
        )
        way = torch.from_numpy(
            (conditions.ahead - tensors["ahead_mean"]) / tensors["ahead_std"]
        ).repeat(2, 1, 1)
        base = torch.cat([probabilities, velocity[:, 10:], way], -1)
        observation = torch.from_numpy(scaled).repeat(2, 1, 1)
        noise, flow_log_det, _ = flow(poses, base, occupancy, observation, given)
    assert np.abs(actions - probabilities.transpose(0, 1).numpy()).max() < 1e-9
    assert np.abs(noise.numpy() - z[:, None]).max() < 1e-8
    sampler = Sampler(weights, dtype="float64")
    sampler.start(conditions, takes=2)
    taken = [sampler.encode(t, sampler.standardised(made[t])) for t in range(30)]
    assert max(np.abs(back - z).max() for _, back, _, _ in taken) < 1e-8
    log_det = np.stack([frame.log_det for frame in taken], axis=1)
    assert np.abs(log_det - flow_log_det.numpy()).max() < 1e-8
    gaussian = -0.5 * (z**2).sum(-1) - 33.0 * np.log(2.0 * np.pi)
    assert np.abs(density.T - gaussian[:, None] - log_det).max() < 1e-8, (
        "what it says of itself as it makes it"
    )


@pytest.mark.torch
@pytest.mark.parametrize("system", ["ap-p", "moglow", "lower-first"])
def test_frame_by_frame_the_baselines_equal_their_models(system: str, tmp_path: Path):
    import torch

    from dafnet_addon.core.weights import FORMAT, Weights
    from dafnet_addon.model.config import ModelConfig
    from dafnet_addon.model.flow import BodyFlow
    from dafnet_addon.model.predictor import ActionPredictor
    from dafnet_addon.model.systems import sampler_of
    from dafnet_addon.training.batches import Statistics, past_of
    from dafnet_addon.training.export import tensors_of

    torch.manual_seed(3)
    config = ModelConfig(
        system=system,
        predictor_code=8,
        predictor_width=16,
        width=12,
        code=8,
        mask=True,
        steps_whole=4,
        shared_encoder=system == "moglow",
    )
    flow = BodyFlow(config).double()
    predictor = ActionPredictor(config).double() if config.predicts else None
    with torch.no_grad():
        for p in [*flow.parameters(), *(predictor.parameters() if predictor else ())]:
            p += 0.05 * torch.randn_like(p)
    rng = np.random.default_rng(0)
    statistics = Statistics(
        rng.normal(size=66),
        rng.uniform(0.1, 0.3, 66),
        rng.normal(size=3) * 0.01,
        np.full(3, 0.02),
        np.zeros(24),
        np.ones(24),
    )
    tensors = tensors_of(flow, predictor, statistics)
    description = {"model": config.as_dict(), "fps": 30, "offsets": OFFSETS.tolist()}
    conditions, z = _conditions(30), rng.normal(size=(2, 66))
    weights = Weights(tensors, description, {"format": FORMAT}, tmp_path)
    sampler = sampler_of(weights, dtype="float64")
    made, actions, density, _ = run_to_end(sampler.run(conditions, z))
    assert actions.shape == (30, 2, 0 if system == "moglow" else 10)

    # The same, by the model's own forward: poses must go back to the noise that they were made
    # from.
    poses = torch.from_numpy(
        (model_order(made).transpose(1, 0, 2) - tensors["pose_mean"]) / tensors["pose_std"]
    )
    velocity = torch.from_numpy(
        (conditions.velocity - tensors["velocity_mean"]) / tensors["velocity_std"]
    )
    velocity = torch.cat([velocity[:1].repeat(10, 1), velocity]).repeat(2, 1, 1)
    past = past_of(torch.cat([torch.zeros(2, 10, 66, dtype=torch.float64), poses], 1), velocity, 10)
    occupancy = torch.from_numpy(conditions.occupancy).repeat(2, 1, 1)
    given = torch.from_numpy(conditions.given).repeat(2, 1, 1)
    scaled = (
        (conditions.observation - tensors["pose_mean"])
        / tensors["pose_std"]
        * np.repeat(conditions.given, 3, -1)
    )
    observation = torch.from_numpy(scaled).repeat(2, 1, 1)
    with torch.no_grad():
        told = (
            past
            if predictor is None
            else torch.cat([predictor(past, occupancy), velocity[:, 10:]], -1)
        )
        log_det = torch.zeros(2, 30)
        for name, columns in flow.partition.items():
            condition = flow.condition(name, told, observation, given, poses)
            noise, part_det, _ = flow.parts()[name](poses[..., columns], condition, occupancy)
            assert np.abs(noise.numpy() - z[:, None, columns]).max() < 1e-8
            log_det = log_det + part_det
    sampler.start(conditions, takes=2)
    taken = [sampler.encode(t, sampler.standardised(made[t])) for t in range(30)]
    encoded = np.stack([frame.log_det for frame in taken], axis=1)
    assert np.abs(encoded - log_det.numpy()).max() < 1e-8
    assert np.ptp(density.T - log_det.numpy(), axis=1).max() < 1e-8


@pytest.fixture(scope="module")
def weights():
    return load_weights()


@pytest.mark.torch
def test_numpy_and_torch_agree_over_300_frames(weights):
    z = 0.7 * np.random.default_rng(1).normal(size=(1, 66))
    ours = run_to_end(Sampler(weights).run(_conditions(300), z)).poses
    theirs = run_to_end(Sampler(weights, device="cpu").run(_conditions(300), z)).poses
    assert np.abs(ours - theirs).max() < 1e-4


def test_shipped_weights_invert(weights):
    sampler = Sampler(weights)
    conditions, z = _conditions(100), 0.7 * np.random.default_rng(1).normal(size=(1, 66))
    made = run_to_end(sampler.run(conditions, z)).poses
    again = Sampler(weights)
    again.start(conditions)
    standard = again.standardised(made).astype(np.float32)
    noise = np.concatenate([again.encode(t, standard[t]).noise for t in range(100)])
    assert np.abs(noise - z).max() < 1e-2, "pose to noise gives back the noise"


def test_a_batch_is_its_single_takes(weights):
    z = np.random.default_rng(2).normal(size=(3, 66))
    together = run_to_end(Sampler(weights).run(_conditions(40), z)).poses
    alone = run_to_end(Sampler(weights).run(_conditions(40), z[1:2])).poses
    assert np.abs(together[:, 1] - alone[:, 0]).max() < 1e-4


def test_resuming_goes_on_as_if_never_stopped(weights):
    conditions, z = _conditions(160), 0.5 * np.random.default_rng(4).normal(size=(1, 66))
    whole = run_to_end(Sampler(weights).run(conditions, z)).poses
    resumed = run_to_end(Sampler(weights).run(conditions, z, kept=whole[:90])).poses
    assert np.abs(resumed - whole).max() < 1e-3


def test_lower_noise_leaves_the_upper_body_alone_at_the_first_frame(weights):
    z = np.zeros((2, 66))
    z[1, 42:] = 1.0
    made = run_to_end(Sampler(weights).run(_conditions(1), z)).poses
    upper = model_order(made)[..., :42]
    assert np.abs(upper[0, 0] - upper[0, 1]).max() < 1e-5
    assert np.abs(made[0, 0] - made[0, 1]).max() > 1e-3


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"layers": 0}, "'layers'"),
        ({"steps_upper": -1}, "'steps_upper'"),
        ({"width": float("inf")}, "'width'"),
        ({"code": "many"}, "'code'"),
        ({"history": True}, "'history'"),
        ({"mask": 1}, "'mask'"),
        ({"ahead": 18.0}, "'ahead'"),
        ({"history": 65536}, "'history'"),
        ({"system": ["dafnet"]}, "system"),
        ({"action_temperature": 0}, "temperature"),
        ({"action_temperature": float("nan")}, "temperature"),
    ],
)
def test_a_model_that_cannot_be_is_refused(weights, changed, words):
    odd = replace(
        weights, config={**weights.config, "model": {**weights.config["model"], **changed}}
    )
    with pytest.raises(WeightsError, match=words):
        Sampler(odd)


def test_another_skeleton_or_rate_is_refused(weights):
    for changed in ({"fps": 60}, {"offsets": (OFFSETS * 1.1).tolist()}, {"model": None}):
        with pytest.raises(WeightsError, match="cannot be used"):
            Sampler(replace(weights, config={**weights.config, **changed}))


@pytest.mark.parametrize(
    "name", ["pose_std", "velocity_std", "upper.0.weight", "lower.1.log_scale"]
)
def test_numbers_that_cannot_be_inverted_are_refused(weights, name):
    spoilt = (
        np.full_like(weights.tensors[name], 2000.0)
        if name.endswith("log_scale")
        else weights.tensors[name] * 0.0
    )
    with pytest.raises(WeightsError, match="cannot be used"):
        Sampler(replace(weights, tensors={**weights.tensors, name: spoilt}))


@pytest.mark.parametrize(
    "offsets", ["here", None, [[0.0], [0.0, 1.0]], [[None] * 3] * 22, np.zeros((22, 3)).tolist()]
)
def test_another_skeleton_is_refused_however_it_is_written(weights, offsets):
    with pytest.raises(WeightsError, match="another skeleton or frame rate \\('offsets'\\)"):
        Sampler(replace(weights, config={**weights.config, "offsets": offsets}))


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("upper.0.weight", 0.0, "'upper.0' cannot be inverted"),
        ("lower.1.log_scale", 50.0, "'lower.1' cannot be inverted"),
        ("upper.0.weight", 1e-35, "'upper.0' cannot be inverted"),
        ("pose_std", 0.0, "'pose_std' is not positive"),
        ("velocity_std", -1.0, "'velocity_std' is not positive"),
        ("lower.0.bias", 1e30, "'lower.0.bias' holds 1e\\+30"),
    ],
)
def test_tensors_that_no_training_gives_are_named(weights, name, value, words):
    tensor = weights.tensors[name]
    changed = (
        np.eye(len(tensor), dtype=np.float32) * np.float32(value)
        if tensor.ndim == 2
        else np.full_like(tensor, value)
    )
    with pytest.raises(WeightsError, match=words):
        Sampler(replace(weights, tensors={**weights.tensors, name: changed}))


def test_poses_that_are_no_bodys_are_refused_before_they_are_shown(weights):
    far = replace(weights, tensors={**weights.tensors, "pose_mean": np.full(66, 1e5, np.float32)})
    sampler, shown = Sampler(far), []
    conditions = Conditions(
        np.zeros((3, 3)),
        np.zeros((3, 24)),
        np.zeros((3, 2640)),
        np.zeros((3, 66)),
        np.zeros((3, 22)),
    )
    with pytest.raises(
        WeightsError, match="the poses they give are not numbers, or farther than 100 metres"
    ):
        run_to_end(
            sampler.run(conditions, np.zeros((1, 66)), None, lambda frame, pose: shown.append(pose))
        )
    assert not shown
