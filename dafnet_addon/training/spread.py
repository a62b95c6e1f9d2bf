"""How real takes differ from one another in the flow's noise: what a take's one noise vector is
drawn from.

The flow's noise is standard normal frame by frame, but a take holds one vector for all its frames.
Along captured motion most of the noise comes and goes within a second; what lasts is about half as
large. A vector of unit deviation that lasts is a body that nobody moves like, so takes draw theirs
from the spread of the noise's mean over a captured window: temperature 1 is then how far real takes
differ. The paper's draw from N(0, I) is temperature 1 of weights that hold no spread.
"""

import numpy as np
import torch

from ..core.skeleton import POSE_SIZE
from ..model.flow import BodyFlow
from ..model.predictor import ActionPredictor
from .batches import Batch, Pool, Statistics

__all__ = ["noise_along", "take_spread"]

_SETTLED = 20  # frames in which the memory fills
_AT_ONCE = 50


@torch.no_grad()
def noise_along(
    flow: BodyFlow, predictor: ActionPredictor | None, batch: Batch
) -> dict[str, torch.Tensor]:
    """Noise of each part (B, T, …) along captured windows in FREE mode, each beside the captured
    parts before it.
    """
    observation = torch.zeros(*batch.upper.shape[:2], POSE_SIZE, device=batch.upper.device)
    given = observation[..., :22]
    told = batch.past
    if predictor is not None:
        told = torch.cat([predictor(batch.past, batch.occupancy), batch.root], dim=-1)
    pose = torch.cat([batch.upper, batch.lower], dim=-1)
    conditions = {
        name: flow.condition(name, told, observation, given, pose) for name in flow.partition
    }
    return {
        name: part(pose[..., flow.partition[name]], conditions[name], batch.occupancy)[0]
        for name, part in flow.parts().items()
    }


def take_spread(
    flow: BodyFlow,
    predictor: ActionPredictor | None,
    pool: Pool,
    statistics: Statistics,
    windows: int = 2000,
) -> dict[str, np.ndarray]:
    """By part, the lower triangular matrix L (n, n) of which a take's noise is L e with e from N(0,
    I), of as many windows.
    """
    rows = torch.randperm(len(pool), generator=torch.Generator().manual_seed(0))[:windows]
    means: dict[str, list[torch.Tensor]] = {}
    for some in rows.split(_AT_ONCE):
        batch = pool.batch(some, statistics, flow.config)
        for part, noise in noise_along(flow, predictor, batch).items():
            means.setdefault(part, []).append(noise[:, _SETTLED:].mean(1))
    out = {}
    for part, found in means.items():
        mean = torch.cat(found).double()
        # A few windows do not span the space: what they leave out is given a hair's breadth.
        moment = mean.T @ mean / len(mean) + 1e-6 * torch.eye(
            mean.shape[1], dtype=mean.dtype, device=mean.device
        )
        out[part] = torch.linalg.cholesky(moment).float().cpu().numpy()
    return out
