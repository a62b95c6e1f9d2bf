"""From a training run to the weights file that ships: plain matrices in 8 bits, everything said in its metadata."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ..core.skeleton import JOINTS, OFFSETS
from ..core.weights import FORMAT, quantised, read_safetensors, write_safetensors
from ..model.config import ModelConfig
from ..model.flow import PartFlow, TwoPartFlow
from ..model.predictor import ActionPredictor
from .batches import NOISE, Statistics

__all__ = ["tensors_of", "export", "annotate"]


def tensors_of(flow: TwoPartFlow, predictor: ActionPredictor, statistics: Statistics) -> dict[str, np.ndarray]:
    """Every array that the sampler needs, by the names that it knows them by."""
    out: dict[str, np.ndarray] = {name: value.astype(np.float32) for name, value in asdict(statistics).items()}
    for name, tensor in predictor.state_dict().items():
        out[f"predictor.{name}"] = tensor.numpy()
    for part_name in ("upper", "lower"):
        part: PartFlow = getattr(flow, part_name)
        for name, tensor in part.encoders.state_dict().items():
            out[f"{part_name}.encoders.{name}"] = tensor.numpy()
        for k, (norm, linear, coupling) in enumerate(part.steps()):
            prefix = f"{part_name}.{k}"
            out[f"{prefix}.bias"], out[f"{prefix}.log_scale"] = norm.bias.detach().numpy(), norm.log_scale.detach().numpy()
            out[f"{prefix}.weight"] = linear.weight().detach().numpy()
            for name, tensor in coupling.state_dict().items():
                out[f"{prefix}.{name}"] = tensor.numpy()
    return out


def export(
    file: Path, flow: TwoPartFlow, predictor: ActionPredictor, statistics: Statistics, words: Mapping[str, str]
) -> None:
    """Write the weights file; ``words`` are its metadata (licence, provenance, metrics), texts or JSON texts.

    Matrices of a thousand values or more are stored in 8 bits with a scale for each row, which changes no figure that was
    measured; what the flow inverts and what it standardises with stays single.
    """
    config: ModelConfig = flow.config
    description = {
        "model": config.as_dict(), "fps": 30, "joints": list(JOINTS), "offsets": OFFSETS.tolist(), "noise_metres": NOISE,
    }
    tensors = {}
    for name, array in tensors_of(flow, predictor, statistics).items():
        inverted = name.count(".") == 2 and name.endswith(".weight") and name[:5] in ("upper", "lower")
        if array.ndim < 2 or array.size < 1000 or inverted:
            tensors[name] = array
        else:
            tensors[name], tensors[f"{name}.scale"] = quantised(array)
    write_safetensors(file, tensors, {"format": FORMAT, "config": json.dumps(description), **words})


def annotate(file: Path, words: Mapping[str, str]) -> None:
    """Add to, or replace, words of a weights file's metadata; its tensors stay as they are, to the bit."""
    tensors, metadata = read_safetensors(file)
    part = file.with_suffix(".part")
    write_safetensors(part, tensors, {**metadata, **words})
    part.rename(file)
