"""The action predictor, learnt without labels inside a Gaussian-mixture VAE (paper, section 4.2,
Table 3).
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from .config import SENSOR_SIZE, ModelConfig

__all__ = ["ActionPredictor", "GMVAE", "Losses", "gumbel_temperature"]


def _mlp(*sizes: int) -> nn.Sequential:
    layers: list[nn.Module] = []
    for a, b in pairwise(sizes[:-1]):
        layers += [nn.Linear(a, b), nn.ReLU()]
    return nn.Sequential(*layers, nn.Linear(sizes[-2], sizes[-1]))


class ActionPredictor(nn.Module):
    """q_α: scene feature to K logits. ``past`` (…, 693) standardised, ``occupancy`` (…, 2640).

    ``mixed``: the environment's layer computes in bfloat16. The others do not: their logits are
    large, and rounded so they would be other actions.
    """

    mixed = False

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.temperature = config.action_temperature
        self.environment = nn.Linear(SENSOR_SIZE, config.predictor_code)
        width = config.predictor_width
        self.layers = _mlp(config.scene_size + config.predictor_code, width, width, config.actions)

    def encode(self, occupancy: Tensor) -> Tensor:
        with torch.autocast(occupancy.device.type, torch.bfloat16, enabled=self.mixed):
            return self.environment(occupancy)

    def logits(self, past: Tensor, code: Tensor) -> Tensor:
        return self.layers(torch.cat([past, code.to(past.dtype)], dim=-1))

    def forward(self, past: Tensor, occupancy: Tensor) -> Tensor:
        """Action probabilities π (…, K), as the flow is given them."""
        return torch.softmax(self.logits(past, self.encode(occupancy)) / self.temperature, dim=-1)


@dataclass(frozen=True)
class Losses:
    """Equation 5, each summed over features and averaged over the batch."""

    reconstruction: Tensor
    kl: Tensor
    category: Tensor

    @property
    def total(self) -> Tensor:
        return self.reconstruction + self.kl + self.category


class GMVAE(nn.Module):
    """Trains the predictor: q_α(π|s), the encoder q_s(z|s, π), the decoders p_β(z|π) and
    p_θ(s|z).
    """

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.predictor = ActionPredictor(config)
        width, k = config.predictor_width, config.actions
        self.encoder = nn.Sequential(
            *_mlp(config.scene_size + config.predictor_code + k, width, width), nn.ReLU()
        )
        self.mean, self.spread = nn.Linear(width, config.latent), nn.Linear(width, config.latent)
        self.prior_mean, self.prior_spread = (
            nn.Linear(k, config.latent),
            nn.Linear(k, config.latent),
        )
        self.decoder = _mlp(config.latent, width, width, config.scene_size + SENSOR_SIZE)

    def losses(self, past: Tensor, seen: Tensor, occupancy: Tensor, temperature: float) -> Losses:
        """Losses of a batch: ``seen`` (B, 693) is what the predictor is shown of ``past``, which is
        reconstructed.
        """
        code = self.predictor.encode(occupancy)
        logits = self.predictor.logits(seen, code)
        actions = F.gumbel_softmax(logits, tau=temperature, dim=-1)
        hidden = self.encoder(torch.cat([seen, code, actions], dim=-1))
        mean, variance = self.mean(hidden), F.softplus(self.spread(hidden)) + 1e-5
        prior_mean, prior_variance = (
            self.prior_mean(actions),
            F.softplus(self.prior_spread(actions)) + 1e-5,
        )
        z = mean + variance.sqrt() * torch.randn_like(mean)
        target = torch.cat([past, occupancy], dim=-1)
        reconstruction = (self.decoder(z) - target).square().sum(-1).mean()
        ratio = variance / prior_variance
        kl = (
            0.5
            * (ratio + (mean - prior_mean).square() / prior_variance - 1.0 - ratio.log())
            .sum(-1)
            .mean()
        )
        # log K minus the entropy of the probabilities, as the authors code it: no action may
        # swallow the rest.
        probabilities = F.log_softmax(logits, dim=-1)
        category = math.log(logits.shape[-1]) + (probabilities.exp() * probabilities).sum(-1).mean()
        return Losses(reconstruction, kl, category)


def gumbel_temperature(progress: float) -> float:
    """Annealing of the Gumbel-softmax: 1.0 at the first step, 0.5 at the last, falling
    exponentially.
    """
    return 0.5**progress
