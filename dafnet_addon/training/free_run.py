"""What motion that the flow makes by itself is held to, beside the likelihood.

The likelihood is learnt along captured poses; sampling walks along the model's own, made from
noise: none, one vector for all frames, or such as comes and goes (``noise``). These losses are of
the poses that it makes after some captured frames (the memory knows the phase of the gait from
them): at z = 0 they should be the captured ones; with any noise targets are met, the pelvis is as
high as floor or seat asks, bones keep their length and planted feet stay (the paper's section 7
asks for a foot-velocity loss). Metres and seconds.
"""

import torch
from torch import Tensor

from ..core.series import MODEL_FPS
from ..core.skeleton import LOWER, LOWER_SIZE, OFFSETS, PARENTS, TOE_HEIGHT, UPPER, UPPER_SIZE
from .batches import Statistics

__all__ = ["free_run_loss", "lower_loss", "sliding_speed", "upper_loss"]

# nats for each metre
_POSE = 100.0
_GIVEN = 200.0
_HEIGHT = 150.0
_BONE = 100.0
# nats for each metre a second
_SPEED = 3.0
_SLIDE = 40.0

_PLANTED = 0.15
"""Metres a second, under which a captured foot is planted."""
_LOW = 0.03
"""Metres over where a planted toe base is, under which it may be planted."""
_FADE = 0.025
"""Metres over which a foot that rises is held to the floor half as much."""
_FARTHEST = 20.0
"""Deviations: the inverse of a flow that has not learnt may be anywhere; such poses teach
nothing.
"""


def _bones(
    joints: tuple[int, ...], known: tuple[int, ...]
) -> tuple[list[int], list[int], list[float]]:
    """Rows (in ``known`` + ``joints``) of the bones' far and near ends, and their lengths."""
    order = list(known) + list(joints)
    pairs = [(order.index(j), order.index(PARENTS[j])) for j in joints if PARENTS[j] in order]
    lengths = [float((OFFSETS[order[far]] ** 2).sum() ** 0.5) for far, _ in pairs]
    return [far for far, _ in pairs], [near for _, near in pairs], lengths


_UPPER_BONES, _LOWER_BONES = _bones(UPPER, ()), _bones(LOWER, (0,))
_FEET = [LOWER.index(j) for j in (7, 8, 10, 11)]
_TOES = [LOWER.index(j) for j in (10, 11, 10, 11)]


def _bone_error(joints: Tensor, bones: tuple[list[int], list[int], list[float]]) -> Tensor:
    far, near, lengths = bones
    made = (joints[..., far, :] - joints[..., near, :]).norm(dim=-1)
    return (made - torch.tensor(lengths, device=made.device)).abs().mean()


def _tracking_error(made: Tensor, true: Tensor, calm: Tensor) -> Tensor:
    """How far calm motion (B, T, J, 3) is from the captured one, in place and in speed."""
    share = calm.float().mean().clamp_min(1e-6)
    place = (made - true).norm(dim=-1).mean((1, 2))
    speed = MODEL_FPS * (made.diff(dim=1) - true.diff(dim=1)).norm(dim=-1).mean((1, 2))
    return ((_POSE * place + _SPEED * speed) * calm).mean() / share


def free_run_loss(
    *,
    part: str,
    made: Tensor,
    true: Tensor,
    calm: Tensor,
    given: Tensor,
    pelvis: Tensor,
    step: Tensor,
    statistics: Statistics,
) -> Tensor:
    """Loss of the frames that a part of the flow has made by itself, ``made`` (B, T, …), beside
    the captured ones, ``true``.

    ``calm`` (B,): whether z = 0; ``given`` (B, T, 22): which joints the observation gives;
    ``pelvis`` (B, T, 3): the captured one; all standardised as poses are. ``step`` (B, T, 3): see
    ``sliding_speed``.
    """
    mean, std = (
        torch.as_tensor(values, dtype=made.dtype, device=made.device)
        for values in (statistics.pose_mean, statistics.pose_std)
    )
    upper, lower = slice(0, UPPER_SIZE), slice(UPPER_SIZE, UPPER_SIZE + LOWER_SIZE)

    def metres(values: Tensor, columns: slice) -> Tensor:
        within = values.clamp(-_FARTHEST, _FARTHEST)
        return (within * std[columns] + mean[columns]).unflatten(-1, (-1, 3))

    loss = made.new_zeros(())
    if part != "lower":
        bodies, captured = (metres(each[..., upper], upper) for each in (made, true))
        loss = loss + upper_loss(bodies, captured, calm, given[..., : len(UPPER)])

    if part != "upper":
        legs, captured = (metres(each[..., -LOWER_SIZE:], lower) for each in (made, true))
        hips = metres(pelvis, slice(0, 3))[..., 0, :]
        loss = loss + lower_loss(legs, captured, calm, hips, step, given[..., len(UPPER) :])

    return loss


def _missed(made: Tensor, true: Tensor, given: Tensor) -> Tensor:
    """How far made joints (B, T, J, 3) are from the captured ones where these are ``given``
    (B, T, J).
    """
    return ((made - true).norm(dim=-1) * given).sum() / given.sum().clamp_min(1.0)


def upper_loss(made: Tensor, true: Tensor, calm: Tensor, given: Tensor) -> Tensor:
    """Loss of made upper bodies (B, T, 14, 3) beside the captured; ``calm`` (B,) where z = 0;
    ``given`` (B, T, 14).
    """
    # In this order: gradients are summed backwards through it, and runs resume to the last bit.
    missed = _missed(made, true, given)
    height = (made[..., 0, 2] - true[..., 0, 2]).abs().mean()
    return (
        _tracking_error(made, true, calm)
        + _GIVEN * missed
        + _HEIGHT * height
        + _BONE * _bone_error(made, _UPPER_BONES)
    )


def sliding_speed(feet: Tensor, step: Tensor) -> Tensor:
    """Horizontal speed over the floor (B, T − 1, J), metres a second, of points (B, T, J, 3) in the
    root's frames.

    ``step`` (B, T, 3): the root's displacement and turn to each frame, in the frame before it.
    """
    before = feet[:, :-1, :, :2] - step[:, 1:, None, :2]
    c, s = step[:, 1:, None, 2].cos(), step[:, 1:, None, 2].sin()
    moved = torch.stack(
        [c * before[..., 0] + s * before[..., 1], c * before[..., 1] - s * before[..., 0]], dim=-1
    )
    # A square root of nothing has no gradient.
    return MODEL_FPS * ((feet[:, 1:, :, :2] - moved).square().sum(-1) + 1e-8).sqrt()


def lower_loss(
    made: Tensor,
    true: Tensor,
    calm: Tensor,
    pelvis: Tensor,
    step: Tensor,
    given: Tensor,
) -> Tensor:
    """Loss of made lower bodies (B, T, 8, 3) under the captured ``pelvis`` (B, T, 3); ``given``
    (B, T, 8); the rest as above.

    Calm feet stay where the captured ones do; others where they themselves are low.
    """
    bones = _bone_error(torch.cat([pelvis[:, :, None], made], dim=2), _LOWER_BONES)
    still = sliding_speed(true[:, :, _FEET], step) < _PLANTED
    planted = still & (true[:, 1:, _TOES, 2] < TOE_HEIGHT + _LOW)
    height = (made[:, 1:, _TOES, 2].detach() - TOE_HEIGHT).clamp_min(0.0)
    low = (2.0 - 2.0 ** (height / _FADE)).clamp_min(0.0)

    weight = torch.where(calm[:, None, None], planted.float(), low)
    slid = (sliding_speed(made[:, :, _FEET], step) * weight).sum() / weight.sum().clamp_min(1.0)
    missed = _GIVEN * _missed(made, true, given)
    return _tracking_error(made, true, calm) + _BONE * bones + _SLIDE * slid + missed
