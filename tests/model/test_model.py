"""Every transform of the model: inverse, log-determinant against a numerical Jacobian, likelihood,
sizes of the paper.
"""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

torch = pytest.importorskip(
    "torch", reason="the model's own code needs torch; inside Blender only NumPy runs"
)

from dafnet_addon.model.config import PAPER, SMALL, ModelConfig  # noqa: E402
from dafnet_addon.model.flow import ActNorm, BodyFlow, Coupling, InvertibleLinear, PartFlow  # noqa: E402
from dafnet_addon.model.predictor import GMVAE, gumbel_temperature  # noqa: E402

pytestmark = pytest.mark.torch

TINY = ModelConfig(
    predictor_code=8,
    predictor_width=16,
    width=12,
    code=8,
    shared_encoder=True,
    mask=True,
    steps_upper=2,
    steps_lower=2,
)


_HALVES = slice(0, 3), slice(3, 5)


@pytest.fixture(autouse=True)
def _double():
    torch.manual_seed(0)
    torch.set_default_dtype(torch.float64)
    yield
    torch.set_default_dtype(torch.float32)


def _stirred(module):
    """Weights away from their start, at which couplings are constant."""
    with torch.no_grad():
        for parameter in module.parameters():
            parameter += 0.1 * torch.randn_like(parameter)
    return module


def _log_abs_det(function, x):
    return torch.linalg.slogdet(torch.autograd.functional.jacobian(function, x))[1]


def test_actnorm_whitens_inverts_and_counts_volume():
    norm = ActNorm(5)
    x = 3.0 + 2.0 * torch.randn(40, 7, 5)
    norm.initialise(x)
    y, log_det, _ = norm(x)
    assert y.mean((0, 1)).abs().max() < 1e-9 and (y.std((0, 1)) - 1).abs().max() < 1e-2
    assert (norm.inverse(y).x - x).abs().max() < 1e-10
    assert torch.allclose(log_det[0, 0], _log_abs_det(lambda v: norm(v)[0], x[0, 0]))


def test_actnorm_survives_a_constant_feature():
    norm = ActNorm(2)
    norm.initialise(torch.stack([torch.randn(30, 4), torch.zeros(30, 4)], dim=-1))
    assert norm.log_scale.exp().max() <= 1 / 0.05 + 1e-9


def test_linear_inverts_and_counts_volume():
    linear = _stirred(InvertibleLinear(6))
    x = torch.randn(3, 4, 6)
    y, log_det, _ = linear(x)
    assert (linear.inverse(y).x - x).abs().max() < 1e-10
    assert torch.allclose(log_det[0, 0], _log_abs_det(lambda v: linear(v)[0], x[0, 0]))
    assert torch.allclose(linear.inverse_weight() @ linear.weight(), torch.eye(6))


def test_linear_starts_as_a_rotation():
    weight = InvertibleLinear(9).weight()
    assert torch.allclose(weight @ weight.T, torch.eye(9))


def test_coupling_inverts_and_counts_volume_over_time():
    coupling = _stirred(Coupling(6, 4, 10, 2))
    x, condition = torch.randn(1, 5, 6), torch.randn(1, 5, 4)
    y, log_det, _ = coupling(x, condition)
    assert (coupling.inverse(y, condition)[0] - x).abs().max() < 1e-10
    whole = _log_abs_det(
        lambda v: coupling(v.reshape(1, 5, 6), condition)[0].reshape(-1), x.reshape(-1)
    )
    assert torch.allclose(log_det.sum(), whole)


def test_coupling_goes_on_from_its_state():
    coupling = _stirred(Coupling(6, 4, 10, 2))
    x, condition = torch.randn(2, 8, 6), torch.randn(2, 8, 4)
    whole, _, _ = coupling(x, condition)
    first, _, state = coupling(x[:, :3], condition[:, :3])
    second, _, _ = coupling(x[:, 3:], condition[:, 3:], state)
    assert torch.allclose(torch.cat([first, second], dim=1), whole)


@pytest.mark.parametrize("shared", [True, False])
def test_part_flow_inverts_to_1e8_and_matches_a_numerical_jacobian(shared):
    flow = _stirred(PartFlow(6, 3, ModelConfig(width=10, code=8, shared_encoder=shared)))
    x, condition = torch.randn(1, 4, 6), torch.randn(1, 4, 10 + 3 + 66)
    occupancy = torch.rand(1, 4, 2640)
    with torch.no_grad():
        z, log_det, _ = flow(x, condition, occupancy)
        assert (flow.inverse(z, condition, occupancy)[0] - x).abs().max() < 1e-8
        flat, step = x.reshape(-1), 1e-6
        columns = []
        for i in range(len(flat)):
            e = torch.zeros_like(flat)
            e[i] = step
            ahead, back = (
                flow((flat + s * e).reshape(1, 4, 6), condition, occupancy)[0].reshape(-1)
                for s in (1, -1)
            )
            columns.append((ahead - back) / (2 * step))
        assert abs(float(log_det.sum() - torch.linalg.slogdet(torch.stack(columns, 1))[1])) < 1e-5
        constant = 0.5 * math.log(2 * math.pi)
        expected = log_det - 0.5 * z.square().sum(-1) - 6 * constant
        assert torch.allclose(flow.log_likelihood(x, condition, occupancy), expected)


def _inputs(frames=5, batch=2):
    given = (torch.rand(batch, frames, 22) < 0.2).double()
    upper, lower = torch.randn(batch, frames, 42), torch.randn(batch, frames, 24)
    observation = torch.cat([upper, torch.zeros_like(lower)], -1) * given.repeat_interleave(3, -1)
    base = torch.cat(
        [torch.softmax(torch.randn(batch, frames, 10), -1), torch.randn(batch, frames, 3)], -1
    )
    return torch.cat([upper, lower], -1), base, torch.rand(batch, frames, 2640), observation, given


def _body_flow(system: str) -> BodyFlow:
    return _stirred(BodyFlow(replace(TINY, system=system, steps_whole=2)))


@pytest.mark.parametrize("system", ["dafnet", "lower-first", "ap-p"])
def test_a_flow_of_the_body_inverts_and_goes_on_from_its_state(system: str):
    flow = _body_flow(system)
    pose, *known = _inputs()
    noise, log_det, _ = flow(pose, *known)
    assert (flow.inverse(noise, *known).x - pose).abs().max() < 1e-8

    first, second = ([each[:, frames] for each in (pose, *known)] for frames in _HALVES)
    begun = flow(*first)
    ended = flow(*second, begun.state)
    assert torch.allclose(torch.cat([begun.y, ended.y], dim=1), noise)
    assert torch.allclose(torch.cat([begun.log_det, ended.log_det], dim=1), log_det)
    back = flow.inverse(begun.y, *first[1:])
    assert torch.allclose(flow.inverse(ended.y, *second[1:], back.state).x, second[0])


def test_every_transform_keeps_the_same_contract():
    x, condition, occupancy = torch.randn(2, 5, 6), torch.randn(2, 5, 79), torch.rand(2, 5, 2640)
    config = ModelConfig(width=10, code=8)
    transforms = (
        (ActNorm(6), (condition,)),
        (InvertibleLinear(6), (condition,)),
        (Coupling(6, 79, 10, 2), (condition,)),
        (PartFlow(6, 2, config), (condition, occupancy)),
    )
    for transform, known in transforms:
        whole = transform(x, *known, None)
        begun = transform(x[:, :2], *(each[:, :2] for each in known), None)
        ended = transform(x[:, 2:], *(each[:, 2:] for each in known), begun.state)
        assert torch.allclose(torch.cat([begun.y, ended.y], dim=1), whole.y)
        assert whole.log_det.shape == x.shape[:-1]
        assert torch.allclose(transform.inverse(whole.y, *known, None).x, x)


def test_the_upper_body_does_not_hang_on_the_lower_noise():
    flow = _body_flow("dafnet")
    _, *known = _inputs()
    z_upper = torch.randn(2, 5, 42)
    one, two = (
        flow.inverse(torch.cat([z_upper, torch.randn(2, 5, 24)], -1), *known).x for _ in range(2)
    )
    assert torch.allclose(one[..., :42], two[..., :42]) and not torch.allclose(
        one[..., 42:], two[..., 42:]
    )


def test_with_the_lower_body_first_it_is_the_other_way_round():
    flow = _body_flow("lower-first")
    pose, *known = _inputs()
    base, _, observation, given = known
    z_lower = torch.randn(2, 5, 24)
    one, two = (
        flow.inverse(torch.cat([torch.randn(2, 5, 42), z_lower], -1), *known).x for _ in range(2)
    )
    assert torch.allclose(one[..., 42:], two[..., 42:]) and not torch.allclose(
        one[..., :42], two[..., :42]
    )
    told = flow.condition("upper", base, observation, given, pose)[..., base.shape[-1] :]
    assert (told[..., :42] == observation[..., :42]).all() and (
        told[..., 42:66] == pose[..., 42:]
    ).all()
    assert (told[..., 66:80] == given[..., :14]).all() and (told[..., 80:] == 1).all()


def test_data_dependent_start_whitens_the_noise():
    flow = PartFlow(24, 2, TINY)
    x = 5.0 + torch.randn(30, 60, 24) @ torch.randn(24, 24)
    with torch.no_grad():
        z, _, _ = flow(
            x,
            torch.zeros(30, 60, TINY.condition_size - TINY.code),
            torch.zeros(30, 60, 2640),
            initialise=True,
        )
    # A coupling starts with the scale sigmoid(2) = 0.88; half of the features pass it unscaled at
    # every step.
    assert abs(float(z.mean())) < 0.05 and abs(float(z.std()) - 1) < 0.2


def test_sizes_of_the_paper():
    with torch.device("meta"):
        flow, gmvae = BodyFlow(PAPER), GMVAE(PAPER)
    count = lambda module: sum(p.numel() for p in module.parameters())  # noqa: E731
    assert PAPER.scene_size == 693 and PAPER.condition_size == 591
    assert (
        35.5e6 < count(flow) < 37e6
        and 2.2e6 < count(gmvae.predictor) < 2.3e6
        and 5.1e6 < count(gmvae) < 5.3e6
    )
    assert SMALL.condition_size == 10 + 3 + SMALL.code + 66 + 22


@torch.no_grad()
def test_gmvae_losses_have_known_values():
    model = GMVAE(TINY)
    past, occupancy = torch.randn(4000, TINY.scene_size), torch.zeros(4000, 2640)
    for name, parameter in model.named_parameters():
        if name.startswith("predictor.layers.4"):
            torch.nn.init.zeros_(parameter)
    losses = model.losses(past, past, occupancy, 1.0)
    assert abs(float(losses.category)) < 1e-9, "even probabilities have the entropy log K"
    assert losses.kl > 0 and losses.reconstruction > 0.9 * TINY.scene_size
    for head in (model.mean, model.spread, model.prior_mean, model.prior_spread):
        head.weight.zero_()
        head.bias.zero_()
    assert abs(float(model.losses(past, past, occupancy, 1.0).kl)) < 1e-9, (
        "equal Gaussians have no divergence"
    )


def test_annealing_goes_from_one_to_a_half():
    values = [gumbel_temperature(t) for t in np.linspace(0, 1, 11)]
    assert values[0] == 1.0 and values[-1] == 0.5 and all(a > b for a, b in pairwise(values))


def test_predictor_gives_probabilities():
    predictor = GMVAE(TINY).predictor
    actions = predictor(torch.randn(3, 5, TINY.scene_size), torch.rand(3, 5, 2640))
    assert (
        actions.shape == (3, 5, 10)
        and torch.allclose(actions.sum(-1), torch.ones(3, 5))
        and (actions > 0).all()
    )
