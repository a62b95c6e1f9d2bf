"""Feet that are asked for stand elsewhere: what was planted stays so, and nothing else changes."""

import importlib.util

import numpy as np
import pytest

from dafnet_addon.core.skeleton import ANKLES, FEET, HIPS, KNEES, LOWER, MODEL_ORDER, REST

if not importlib.util.find_spec("torch"):
    pytest.skip("needs torch", allow_module_level=True)

import torch

from dafnet_addon.training.asked_feet import FARTHEST, feet_elsewhere
from dafnet_addon.training.batches import Statistics
from dafnet_addon.training.free_run import sliding_speed

pytestmark = pytest.mark.torch

_WINDOWS, _FRAMES = 300, 12
_UNIT = Statistics(*(f(n) for n in (66, 3, 24) for f in (np.zeros, np.ones)))
_STEP = torch.tensor([0.01, 0.02, 0.1]).expand(_WINDOWS, _FRAMES, 3)
"""A root that walks in an arc: what is planted in the world turns in its frames."""


def _crouched() -> torch.Tensor:
    """Lower bodies (B, T, 24) of one who crouches, so that feet have somewhere to go, on a root
    that walks.
    """
    legs = torch.tensor(REST[list(LOWER)] + [0.0, 0.0, 0.95], dtype=torch.float32)
    hips, knees = ([LOWER.index(j) for j in joints] for joints in (HIPS, KNEES))
    shin, thigh = legs[knees[0], 2] - 0.1, (legs[hips[0]] - legs[knees[0]]).norm()
    legs[knees, 1] += 0.3
    legs[hips, 2] = legs[knees, 2] + (thigh**2 - 0.3**2).sqrt()
    assert shin > 0.2
    return legs.flatten().expand(_WINDOWS, _FRAMES, 24)


def _given(joints: list[int]) -> torch.Tensor:
    given = torch.zeros(_WINDOWS, _FRAMES, 22)
    given[..., [MODEL_ORDER.index(j) for j in joints]] = 1.0
    return given


def _of(bodies: torch.Tensor, joints: list[int]) -> torch.Tensor:
    return bodies.unflatten(-1, (-1, 3))[:, :, [LOWER.index(j) for j in joints]]


def test_feet_that_nobody_asks_for_stay_where_they_were():
    lower = _crouched()
    assert torch.equal(feet_elsewhere(lower, _given([]), _STEP, 1.0, _UNIT), lower)
    assert torch.equal(feet_elsewhere(lower, _given(ANKLES), _STEP, 0.0, _UNIT), lower)

    some = _given(ANKLES)
    some[:, 5:] = 0.0
    assert torch.equal(feet_elsewhere(lower, some, _STEP, 1.0, _UNIT), lower), "asked for, not long"

    left = feet_elsewhere(lower, _given(ANKLES[:1]), _STEP, 1.0, _UNIT)
    rights = [HIPS[1], KNEES[1], ANKLES[1], FEET[1]]
    assert torch.allclose(_of(left, rights), _of(lower, rights), atol=1e-6)


def test_feet_are_put_aside_and_stay_planted_on_legs_as_long():
    torch.manual_seed(0)
    lower = _crouched()
    made = feet_elsewhere(lower, _given(ANKLES), _STEP, 1.0, _UNIT)

    aside = (_of(made, ANKLES) - _of(lower, ANKLES)).norm(dim=-1)[..., 0]
    assert 0.08 < float(aside[:, 0].mean()) < FARTHEST + 0.01
    assert float((aside > 0.01).all(1).float().mean()) > 0.8

    # Captured feet that stand in the root's frames move over the floor as it does; so do these.
    speeds = [sliding_speed(_of(bodies, ANKLES + FEET), _STEP) for bodies in (lower, made)]
    assert torch.allclose(*speeds, atol=1e-4)

    for far, near in ((KNEES, HIPS), (ANKLES, KNEES), (FEET, ANKLES)):
        lengths = [(_of(each, far) - _of(each, near)).norm(dim=-1) for each in (lower, made)]
        assert torch.allclose(*lengths, atol=1e-5)

    assert torch.equal(_of(made, HIPS), _of(lower, HIPS))
    hips, knees, ankles, toes = (_of(made, each) for each in (HIPS, KNEES, ANKLES, FEET))
    axis = torch.nn.functional.normalize(ankles - hips, dim=-1)
    bend = (knees - hips) - ((knees - hips) * axis).sum(-1, keepdim=True) * axis
    assert ((bend * (toes - ankles)).sum(-1) > 0.0).all(), "knees bend to where toes point"
    apart = (_of(made, ANKLES[:1]) - _of(made, ANKLES[1:]))[..., :2].norm(dim=-1)
    assert (apart > 0.08).all(), "no foot stands in the other"


def test_feet_that_no_leg_reaches_stay():
    legs = torch.tensor(REST[list(LOWER)], dtype=torch.float32).flatten()
    stretched = legs.expand(_WINDOWS, _FRAMES, 24)
    made = feet_elsewhere(stretched, _given(ANKLES), _STEP, 1.0, _UNIT)
    lengths = [(_of(each, KNEES) - _of(each, ANKLES)).norm(dim=-1) for each in (stretched, made)]
    assert torch.allclose(*lengths, atol=1e-5)
    assert torch.isfinite(made).all()
