"""Feet that are asked for stand elsewhere than they were captured.

Where a captured foot is, all else in a window nearly says, so that a network which is told of it as
well hardly listens: asked to put a foot 10 cm aside, it moved it by 3. Only where feet stand where
nothing but the asking says is it worth listening.
"""

import torch
from torch import Tensor

from ..core.skeleton import ANKLES, FEET, HIPS, KNEES, LOWER, MODEL_ORDER
from .batches import Statistics

__all__ = ["FARTHEST", "feet_elsewhere"]

FARTHEST = 0.4
"""Metres that a foot is put aside at most: far enough that seated ankles cross, in one of six."""
_RAISED, _HIGHEST = 0.3, 0.12
"""Share of the feet that are raised as well, and by how many metres at most."""
_TRIED = (1.0, -1.0, 0.6, -0.6, 0.3, -0.3, 0.15, -0.15)
"""Shares of the way aside that are tried, until the leg reaches and the feet are apart."""
_STRETCHED = 0.995
"""Share of a leg's length that it is stretched to at most: farther than most captured legs."""
_APART = 0.09
"""Metres between ankles, over the floor; less only where captured ones are closer."""
_TOEWARDS = 0.03
"""Metres that a knee counts as bent towards the toes: what says where a straight leg bends."""

_HIPS, _KNEES, _ANKLES, _TOES = (
    [LOWER.index(j) for j in joints] for joints in (HIPS, KNEES, ANKLES, FEET)
)
_GIVEN = [MODEL_ORDER.index(j) for j in ANKLES]


def feet_elsewhere(
    lower: Tensor, given: Tensor, step: Tensor, share: float, statistics: Statistics
) -> Tensor:
    """Standardised lower bodies (B, T, 24) of which a ``share`` of the feet that are asked for all
    along stand elsewhere: each as far aside in the world, in all frames of its window, so that what
    was planted stays so. Knees bend to where feet are.

    ``given`` (B, T, 22): which joints are asked for; ``step`` (B, T, 3): the root's displacement,
    in metres, and turn to each frame, in the frame before it.
    """
    mean, std = (
        torch.as_tensor(values[-lower.shape[-1] :], dtype=lower.dtype, device=lower.device)
        for values in (statistics.pose_mean, statistics.pose_std)
    )
    legs = (lower * std + mean).unflatten(-1, (-1, 3))
    windows, device = len(lower), lower.device
    turned = step[..., 2].cumsum(1)
    moved = torch.zeros(windows, dtype=torch.bool, device=device)

    for side, joint in enumerate(_GIVEN):
        chosen = given[..., joint].bool().all(1) & (torch.rand(windows, device=device) < share)
        way = _in_root(_drawn_way(windows, device), turned)
        least = _nearest(legs).clamp_max(_APART)
        for tried in _TRIED:
            made, reaches = _leg_moved(legs, side, tried * way)
            taken = chosen & reaches & (_nearest(made) >= least)
            legs = torch.where(taken[:, None, None, None], made, legs)
            chosen, moved = chosen & ~taken, moved | taken

    # What stays where it was does so to the bit.
    return torch.where(moved[:, None, None], (legs.flatten(-2) - mean) / std, lower)


def _nearest(legs: Tensor) -> Tensor:
    """How near the ankles of legs (B, T, 8, 3) come to each other over the floor (B,)."""
    left, right = (legs[:, :, ankle, :2] for ankle in _ANKLES)
    return (left - right).norm(dim=-1).amin(1)


def _drawn_way(windows: int, device: torch.device) -> Tensor:
    """Ways aside (B, 3), all over a disc, and now and then upwards."""
    far = FARTHEST * torch.rand(windows, device=device).sqrt()
    angle = 2.0 * torch.pi * torch.rand(windows, device=device)
    raised = torch.rand(windows, device=device) < _RAISED
    up = _HIGHEST * torch.rand(windows, device=device) * raised
    return torch.stack([far * angle.cos(), far * angle.sin(), up], dim=-1)


def _in_root(way: Tensor, turned: Tensor) -> Tensor:
    """Ways of the world (B, 3) in a root's frames (B, T, 3) that has ``turned`` (B, T) by then."""
    c, s = turned.cos(), turned.sin()
    x, y = way[:, None, 0], way[:, None, 1]
    up = way[:, None, 2].expand_as(turned)
    return torch.stack([c * x + s * y, c * y - s * x, up], dim=-1)


def _leg_moved(legs: Tensor, side: int, way: Tensor) -> tuple[Tensor, Tensor]:
    """Legs (B, T, 8, 3) whose foot of one ``side`` is moved by ``way`` (B, T, 3), which goes up
    alone where it is tried backwards; and where the leg reaches so far in all frames (B,).
    """
    way = torch.cat([way[..., :2], way[..., 2:].abs()], dim=-1)
    hip, knee, ankle, toe = (legs[:, :, each[side]] for each in (_HIPS, _KNEES, _ANKLES, _TOES))
    thigh, shin = (knee - hip).norm(dim=-1), (ankle - knee).norm(dim=-1)
    there = ankle + way
    stretch = (there - hip).norm(dim=-1).clamp_min(1e-6)
    axis = (there - hip) / stretch[..., None]

    reaches = (stretch <= _STRETCHED * (thigh + shin)) & (stretch > 1.1 * (thigh - shin).abs())
    along = (thigh**2 - shin**2 + stretch**2) / (2.0 * stretch)
    out = (thigh**2 - along**2).clamp_min(0.0).sqrt()

    def across(v: Tensor, axis: Tensor) -> Tensor:
        return v - (v * axis).sum(-1, keepdim=True) * axis

    before = torch.nn.functional.normalize(ankle - hip, dim=-1)
    toes = torch.nn.functional.normalize(toe - ankle, dim=-1)
    bent = across(across(knee - hip, before) + _TOEWARDS * toes, axis)
    bent = torch.nn.functional.normalize(bent, dim=-1)

    made = legs.clone()
    made[:, :, _KNEES[side]] = hip + along[..., None] * axis + out[..., None] * bent
    made[:, :, _ANKLES[side]] = there
    made[:, :, _TOES[side]] = toe + way
    return made, reaches.all(1)
