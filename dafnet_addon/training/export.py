"""From a training run to the weights file that ships, plain matrices in 8 bits, everything said in
its metadata; and back.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch

from ..core.errors import WeightsError
from ..core.files import whole_file
from ..core.sensor import RADIUS
from ..core.series import MODEL_FPS
from ..core.skeleton import JOINTS, OFFSETS
from ..core.weights import FORMAT, Weights, quantised, read_safetensors, write_safetensors
from ..model.config import VELOCITY_SIZE, ModelConfig
from ..model.flow import BodyFlow, PartFlow
from ..model.predictor import ActionPredictor
from .batches import NOISE, Statistics

__all__ = [
    "tensors_of",
    "adopt_predictor",
    "adopt_part",
    "adopted_statistics",
    "export",
    "annotate",
]


def tensors_of(
    flow: BodyFlow, predictor: ActionPredictor | None, statistics: Statistics
) -> dict[str, np.ndarray]:
    """Every array that the sampler needs, by the names that it knows them by."""
    out: dict[str, np.ndarray] = {
        name: value.astype(np.float32) for name, value in asdict(statistics).items()
    }
    for name in ("ahead_mean", "ahead_std"):
        out[name] = out[name][: flow.config.ahead]
    for name, tensor in predictor.state_dict().items() if predictor is not None else ():
        out[f"predictor.{name}"] = tensor.numpy()

    for part_name, part in flow.parts().items():
        for name, tensor in part.encoders.state_dict().items():
            out[f"{part_name}.encoders.{name}"] = tensor.numpy()
        for k, (norm, linear, coupling) in enumerate(part.steps()):
            prefix = f"{part_name}.{k}"
            out[f"{prefix}.bias"] = norm.bias.detach().numpy()
            out[f"{prefix}.log_scale"] = norm.log_scale.detach().numpy()
            out[f"{prefix}.weight"] = linear.weight().detach().numpy()
            for name, tensor in coupling.state_dict().items():
                out[f"{prefix}.{name}"] = tensor.numpy()

    return out


def _copy_into_wider(weights: Weights, name: str, array: np.ndarray, target: torch.Tensor) -> None:
    """Give ``target`` what ``array`` holds, a matrix or vector of a narrower network of the same
    kind.

    Rows of an LSTM are those of its four gates. Units that are new keep what they begin with, but
    nothing that was there before hears them: so a wider network begins as the very function that
    the narrower one is.
    """
    gates = 4 if ".lstm." in name else 1
    old, new = array.shape, tuple(target.shape)
    if len(old) != len(new) or any(a > b for a, b in zip(old, new, strict=True)) or old[0] % gates:
        raise WeightsError(
            f"The weights '{weights.path}' do not fit this model ('{name}' is {old}, not {new}); "
            "choose others to begin with."
        )

    rows = target.view(gates, new[0] // gates, *new[1:])
    kept = torch.from_numpy(np.array(array)).view(gates, old[0] // gates, *old[1:])
    if len(old) == 2:
        rows[:, : kept.shape[1], old[1] :] = 0.0
        rows[:, : kept.shape[1], : old[1]] = kept
    else:
        rows[:, : kept.shape[1]] = kept


@torch.no_grad()
def adopt_predictor(predictor: ActionPredictor, weights: Weights) -> None:
    """Give a predictor what a weights file of the same or smaller sizes holds. Raises WeightsError
    where they do not fit.
    """
    for name, target in predictor.state_dict().items():
        _copy_into_wider(weights, name, weights.require(f"predictor.{name}"), target)


@torch.no_grad()
def adopt_part(part: PartFlow, name: str, weights: Weights, config: ModelConfig) -> None:
    """Give the flow's part ``name`` what a weights file of the same or smaller sizes holds. Raises
    WeightsError where they do not fit.

    Weights that are told less of the root's way ahead, or not whether it is known, serve a model
    that is: these inputs start at zero.
    """
    for key, target in part.encoders.state_dict().items():
        _copy_into_wider(weights, key, weights.require(f"{name}.encoders.{key}"), target)

    model = weights.config["model"]
    told, masked = int(model.get("ahead", 0)), bool(model.get("ahead_mask", False))
    if told > config.ahead or masked > config.ahead_mask:
        raise WeightsError(
            f"The weights '{weights.path}' are told more of the root's way ahead than this model; "
            "choose others, or a configuration with as much 'ahead'."
        )

    for k, (norm, linear, coupling) in enumerate(part.steps()):
        prefix = f"{name}.{k}"
        for key, target in (("bias", norm.bias), ("log_scale", norm.log_scale)):
            array = weights.require(f"{prefix}.{key}", tuple(target.shape))
            target.copy_(torch.from_numpy(np.array(array)))

        array = weights.require(f"{prefix}.weight", tuple(linear.weight().shape))
        linear.adopt(torch.from_numpy(np.array(array)))

        for key, target in coupling.state_dict().items():
            array = weights.require(f"{prefix}.{key}")
            if key == "lstm.weight_ih_l0":
                end = coupling.passes + config.actions + VELOCITY_SIZE + told
                new = [end] * (config.ahead - told) + [end + masked] * (config.ahead_mask - masked)
                array = np.insert(array, new, 0.0, axis=1)
            _copy_into_wider(weights, f"{prefix}.{key}", array, target)


def adopted_statistics(weights: Weights, found: Statistics) -> Statistics:
    """What a weights file standardises with; what was ``found`` where it has nothing, as older
    files have not for all of the way ahead.
    """
    values = {name: value.copy() for name, value in asdict(found).items()}
    for name, value in values.items():
        own = weights.tensors.get(name, value[:0])
        value[: len(own)] = own
    return Statistics(**values)


def export(
    file: Path,
    flow: BodyFlow,
    predictor: ActionPredictor | None,
    statistics: Statistics,
    words: Mapping[str, str],
    noise: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Write the weights file; ``words`` are its metadata (licence, provenance, metrics), texts or
    JSON texts; ``noise`` (see ``take_noise``) what its takes are drawn from, the paper's N(0, I)
    without it.

    Matrices of a thousand values or more are stored in 8 bits with a scale for each row, which
    changes no figure that was measured; what the flow inverts and what it standardises with stays
    single.
    """
    config: ModelConfig = flow.config
    description = {
        "model": config.as_dict(),
        "fps": round(MODEL_FPS),
        "joints": list(JOINTS),
        "offsets": OFFSETS.tolist(),
        "noise_metres": NOISE,
        "sphere_radius": RADIUS,
    }

    tensors = {}
    for name, array in tensors_of(flow, predictor, statistics).items():
        is_of_flow = name[:5] in ("upper", "lower", "whole")
        inverted = is_of_flow and name.count(".") == 2 and name.endswith(".weight")
        if array.ndim < 2 or array.size < 1000 or inverted:
            tensors[name] = array
        else:
            tensors[name], tensors[f"{name}.scale"] = quantised(array)

    metadata = {"format": FORMAT, "config": json.dumps(description), **words}
    with whole_file(file) as part:
        write_safetensors(part, tensors | dict(noise or {}), metadata)


def annotate(file: Path, words: Mapping[str, str]) -> None:
    """Add to, or replace, words of a weights file's metadata; its tensors stay as they are, to the
    bit.
    """
    tensors, metadata = read_safetensors(file)
    with whole_file(file) as part:
        write_safetensors(part, tensors, {**metadata, **words})
