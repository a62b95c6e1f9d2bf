"""What the sensor sees of real pieces, on any device: a bank of shapes as tensors. Equal to
``data.shapes.ShapeBank``.
"""

import numpy as np
import torch
from torch import Tensor

from ..core.sensor import RADIUS, REACH, SPHERES
from ..data.furnish.shapes import DEEPEST, FARTHEST, ShapeBank

__all__ = ["DeviceBank"]

_AT_ONCE = 256
"""Pairs of a root and a shape, of which 2640 points each are computed: what stays in a core's
cache.
"""
_AT_ONCE_ELSEWHERE = 4096
"""Such pairs: enough to keep another device busy."""
_STEP = (FARTHEST - DEEPEST) / 255.0


class DeviceBank:
    """The shapes' distances in one long tensor, and where each shape's begin."""

    def __init__(self, bank: ShapeBank, device: torch.device) -> None:
        self.count, self.device = len(bank), device
        if not self.count:
            return

        values = np.concatenate([shape.values.ravel() for shape in bank.shapes])
        self.values = torch.from_numpy(values).to(device)

        sizes = np.array([shape.values.shape for shape in bank.shapes])
        first = np.concatenate([[0], np.cumsum(sizes.prod(1))[:-1]])
        self.sizes = torch.as_tensor(sizes, device=device)
        self.first = torch.as_tensor(first, device=device)

        ends = [
            (shape.origin, shape.origin + shape.spacing * np.array(shape.values.shape))
            for shape in bank.shapes
        ]
        reach = [np.linalg.norm(np.abs(corner).max(0)[:2]) for corner in ends]

        def single(values: np.ndarray) -> Tensor:
            return torch.as_tensor(np.asarray(values), dtype=torch.float32, device=device)

        self.origins = single(np.stack([shape.origin for shape in bank.shapes]))
        self.spacings = single(np.array([shape.spacing for shape in bank.shapes]))
        self.reaches = single(np.array(reach)) + REACH + RADIUS
        self.spheres = single(SPHERES)

    def occupancy(self, placed: Tensor, root: Tensor) -> Tensor:
        """Occupancy (B, T, 2640) of ``placed`` shapes (B, S, 5), number −1 for none, seen from
        ``root`` (B, T, 3).
        """
        windows, frames, _ = root.shape
        out = torch.zeros(windows * frames, len(SPHERES), device=self.device)
        if not self.count:
            return out.reshape(windows, frames, -1)

        numbers = placed[..., 0].long()
        apart = (placed[:, None, :, 1:3] - root[:, :, None, :2]).norm(dim=-1)
        near = (numbers >= 0)[:, None] & (apart < self.reaches[numbers.clamp_min(0)][:, None])
        at_once = _AT_ONCE if root.device.type == "cpu" else _AT_ONCE_ELSEWHERE
        for some in torch.nonzero(near).split(at_once):
            window, frame, which = some.unbind(1)
            found = self._seen(placed[window, which], root[window, frame])
            # A frame that sees two shapes stands twice among the rows.
            row = (window * frames + frame)[:, None].expand_as(found)
            out.scatter_reduce_(0, row, found, "amax")

        return out.reshape(windows, frames, -1)

    def _seen(self, placed: Tensor, root: Tensor) -> Tensor:
        """Occupancy (N, 2640) of one shape (N, 5) from one root (N, 3) each."""
        number = placed[:, 0].long()

        # The sensor's points in the shape's own frame, then in cells of its grid.
        turn, own = (root[:, 2] - placed[:, 3])[:, None], placed[:, 3]
        away = root[:, :2] - placed[:, 1:3]
        x0 = (own.cos() * away[:, 0] + own.sin() * away[:, 1])[:, None]
        y0 = (own.cos() * away[:, 1] - own.sin() * away[:, 0])[:, None]
        x = x0 + turn.cos() * self.spheres[:, 0] - turn.sin() * self.spheres[:, 1]
        y = y0 + turn.sin() * self.spheres[:, 0] + turn.cos() * self.spheres[:, 1]
        z = self.spheres[:, 2] / placed[:, 4:5]
        at = (torch.stack([x, y, z], -1) - self.origins[number][:, None]) / self.spacings[number][
            :, None, None
        ]

        size = self.sizes[number][:, None]
        within = ((at > 0) & (at < size - 1)).all(-1)
        cell = torch.minimum(at.clamp_min(0).long(), size - 2)
        share = at - cell

        stride_y, stride_x = size[..., 2], size[..., 1] * size[..., 2]
        node = (
            self.first[number][:, None]
            + cell[..., 0] * stride_x
            + cell[..., 1] * stride_y
            + cell[..., 2]
        )

        def along_z(n: Tensor) -> Tensor:
            below = self.values[n].float()
            return below + share[..., 2] * (self.values[n + 1].float() - below)

        def across(n: Tensor) -> Tensor:
            near = along_z(n)
            return near + share[..., 1] * (along_z(n + stride_y) - near)

        node = torch.where(within, node, self.first[number][:, None])
        near = across(node)
        distance = DEEPEST + _STEP * (near + share[..., 0] * (across(node + stride_x) - near))
        return torch.where(within, (1 - distance / RADIUS).clamp(0, 1), 0.0)
