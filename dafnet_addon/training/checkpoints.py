"""Checkpoints of a training: tensors and JSON, so that a stranger's run can be resumed and nothing
of it is executed.

A checkpoint is a safetensors file: "network.NAME" and, of each parameter that has been moved, the
optimiser's "optimiser.NAME.KEY"; "generator.DEVICE"; and what else its trainer keeps. The
metadata's "state" is JSON with the numbers, words and settings beside them. Everything is checked
against the network that the settings describe before it is used. A slim one (``slim``) holds the
averaged weights alone, in half precision: a run goes on from it with an optimiser that begins anew.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import torch
from torch import Tensor, nn

from ..core.errors import InputError, WeightsError
from ..core.files import whole_file
from ..core.text import read_json
from ..core.weights import read_safetensors, write_safetensors

__all__ = [
    "BEFORE_COOLING",
    "Checkpoint",
    "checkpoint_file",
    "generators",
    "training_tensors",
    "set_generators",
    "slim",
    "slim_run",
    "typed_settings",
    "write_checkpoint",
]

_FORMAT, _PICKLED = "dafnet-training-1", ".pt"
_AVERAGED = "averaged."
BEFORE_COOLING = "-held"
"""Behind the name of a part: its checkpoint from before its rate fell."""
_ADAM = ("step", "exp_avg", "exp_avg_sq")

Settings = TypeVar("Settings")


def checkpoint_file(folder: Path, part: str) -> Path:
    """Where the checkpoint of a part lies in a run's folder. Raises InputError where only one of an
    earlier version does.
    """
    file, earlier = folder / f"{part}.checkpoint", folder / f"{part}{_PICKLED}"
    if earlier.exists() and not file.exists():
        raise _pickled(earlier)
    return file


def _pickled(file: Path) -> InputError:
    return InputError(
        f"'{file}' was saved by an earlier version as a pickle, which could execute code and is "
        "not read; train in another "
        "folder, beginning with that run's weights (--from)."
    )


def _refused(path: Path, what: str) -> InputError:
    return InputError(
        f"The checkpoint '{path}' cannot be used ({what}); restore a backup or train anew."
    )


def training_tensors(network: nn.Module, optimiser: torch.optim.Optimizer) -> dict[str, Tensor]:
    """The tensors of a network and of its Adam optimiser, by the names that ``Checkpoint.restore``
    knows them by.
    """
    tensors = {f"network.{name}": tensor for name, tensor in network.state_dict().items()}
    for name, parameter in network.named_parameters():
        tensors |= {
            f"optimiser.{name}.{key}": tensor for key, tensor in optimiser.state[parameter].items()
        }
    return tensors


def write_checkpoint(file: Path, tensors: Mapping[str, Tensor], state: Mapping[str, Any]) -> None:
    """Write tensors, and a state that JSON can hold, whole or not at all."""
    plain = {name: tensor.detach().cpu().numpy() for name, tensor in tensors.items()}
    with whole_file(file) as part:
        write_safetensors(part, plain, {"format": _FORMAT, "state": json.dumps(state)})


@dataclass(frozen=True)
class Checkpoint:
    """What a checkpoint holds, as the file ``path`` has it: that it can be read is all that is
    checked yet.
    """

    path: Path
    tensors: dict[str, Tensor]
    state: dict[str, Any]

    @staticmethod
    def read(path: Path) -> "Checkpoint":
        """Raises InputError where the file is missing, damaged, or not a checkpoint."""
        if path.suffix == _PICKLED:
            raise _pickled(path)

        try:
            arrays, words = read_safetensors(path)
        except WeightsError as error:
            raise _refused(path, f"it cannot be read: {str(error).split(';')[0]}") from None

        if words.get("format") != _FORMAT:
            raise InputError(
                f"'{path}' is not a checkpoint of this version; train anew in another folder."
            )

        tensors = {name: torch.from_numpy(np.array(array)) for name, array in arrays.items()}
        try:
            state = read_json(words.get("state", ""))
        except ValueError as error:
            raise _refused(path, f"its state {error}") from None

        if not isinstance(state, dict):
            raise _refused(path, "its state is not an object")

        return Checkpoint(path, tensors, state)

    def refused(self, what: str) -> InputError:
        """The error for something in the file that is not as a trainer writes it."""
        return _refused(self.path, what)

    def settings(self, kind: type[Settings], name: str) -> Settings:
        """The settings kept under ``name``. Raises InputError where one is unknown, missing, or of
        another type.
        """
        try:
            return typed_settings(kind, self.state.get(name))
        except ValueError as error:
            raise self.refused(f"{name}: {error}") from None

    def progress(self) -> tuple[int, float]:
        """Steps and seconds that were trained. Raises InputError where they cannot be that."""
        step, seconds = self.state.get("step"), self.state.get("seconds")
        if type(step) is not int or not 0 <= step < 1 << 53:
            raise self.refused("its number of steps")
        if not isinstance(seconds, float) or not (math.isfinite(seconds) and seconds >= 0.0):
            raise self.refused("its seconds")
        return step, seconds

    def text(self, name: str) -> str:
        """A text of the state. Raises InputError where it is something else."""
        text = self.state.get(name)
        if not isinstance(text, str):
            raise self.refused(name)
        return text

    def tensor(self, name: str, like: Tensor) -> Tensor:
        """A tensor of the same shape and type as ``like``, or half as wide and widened. Raises
        InputError where it is missing or another.
        """
        tensor = self.tensors.get(name)
        kinds = (like.dtype, torch.half) if like.dtype == torch.float else (like.dtype,)
        if tensor is None or tensor.shape != like.shape or tensor.dtype not in kinds:
            raise self.refused(f"'{name}' is missing, or of another shape or type")
        return tensor.to(like.dtype)

    @property
    def is_slim(self) -> bool:
        """Whether it holds the averaged weights alone."""
        return not any(name.startswith(_AVERAGED) for name in self.tensors)

    def fits(self, network: nn.Module) -> None:
        """Raise InputError where the file's network has other tensors than this one, which may be
        on the device 'meta'.
        """
        for name, like in network.state_dict().items():
            self.tensor(f"network.{name}", like)

    def restore(self, network: nn.Module, optimiser: torch.optim.Optimizer | None = None) -> None:
        """Give a network, and its Adam optimiser, what the file holds. Raises InputError where it
        does not fit.
        """
        network.load_state_dict(
            {
                name: self.tensor(f"network.{name}", like)
                for name, like in network.state_dict().items()
            }
        )
        if optimiser is None:
            return

        state = {}
        for k, (name, parameter) in enumerate(network.named_parameters()):
            if f"optimiser.{name}.step" in self.tensors:
                likes = torch.zeros(()), parameter, parameter
                state[k] = {
                    key: self.tensor(f"optimiser.{name}.{key}", like)
                    for key, like in zip(_ADAM, likes, strict=True)
                }

        optimiser.load_state_dict(
            {"state": state, "param_groups": optimiser.state_dict()["param_groups"]}
        )

    def set_generators(self, device: torch.device) -> None:
        """Let the generators go on as they did when the checkpoint was written. Raises InputError
        where they cannot.
        """
        states = {
            name: tensor
            for name in ("cpu", "cuda")
            if (tensor := self.tensors.get(f"generator.{name}")) is not None
        }
        try:
            set_generators(states, device)
        except (KeyError, RuntimeError, TypeError):
            raise self.refused("the state of its generators") from None


def slim(kept: Checkpoint, file: Path) -> None:
    """Write a run's checkpoint so that it travels: what it has learnt, averaged and in half
    precision, without what the optimiser knows: an eighth of its size.
    """
    learnt = {
        f"network.{name.removeprefix(_AVERAGED)}": tensor
        for name, tensor in kept.tensors.items()
        if name.startswith(_AVERAGED)
    }
    tensors = {
        name: tensor.half() if name in learnt else tensor
        for name, tensor in {**kept.tensors, **learnt}.items()
        if name.split(".")[0] in ("network", "generator", "statistics")
    }
    write_checkpoint(file, tensors, kept.state)


def slim_run(folder: Path, out: Path) -> list[Path]:
    """Write what of a run's folder is worth carrying to ``out``: its checkpoints slim, its log and
    the weights that it has given. The files that were written.
    """
    written = []
    for file in sorted(folder.glob("*.checkpoint")):
        # One from before the rate fell is of use where the optimiser is.
        if not file.stem.endswith(BEFORE_COOLING):
            slim(Checkpoint.read(file), out / file.name)
            written.append(out / file.name)

    for file in [*sorted(folder.glob("*.safetensors")), folder / "log.jsonl"]:
        if file.exists():
            with whole_file(out / file.name) as part:
                part.write_bytes(file.read_bytes())
            written.append(out / file.name)

    return written


def generators(device: torch.device) -> dict[str, Tensor]:
    """States of the generators that draw, by device: the CPU's and this one's."""
    states = {"cpu": torch.get_rng_state()}
    if device.type == "cuda":
        states["cuda"] = torch.cuda.get_rng_state(device)
    return states


def set_generators(states: Mapping[str, Tensor], device: torch.device) -> None:
    """Let the generators go on from ``states``, as ``generators`` gives them."""
    torch.set_rng_state(states["cpu"])
    if device.type == "cuda" and "cuda" in states:
        torch.cuda.set_rng_state(states["cuda"], device)


def typed_settings(kind: type[Settings], values: object) -> Settings:
    """A dataclass of numbers, words and switches from what JSON or TOML gives for its fields; the
    others keep their defaults.

    Raises ValueError, which names the field, where one is unknown or of another type, or the
    dataclass refuses it.
    """
    known = {field.name: field.type for field in fields(kind)}  # type: ignore[arg-type]
    if not isinstance(values, dict):
        raise ValueError("they are not given by name")
    if unknown := values.keys() - known.keys():
        raise ValueError(f"unknown setting '{min(unknown)}'")

    found = {}
    for name, value in values.items():
        if known[name] is float and type(value) is int and abs(value) < 1 << 53:
            value = float(value)
        if type(value) is not known[name] or (
            isinstance(value, float) and not math.isfinite(value)
        ):
            raise ValueError(f"'{name}' is not what it should be, {_NAMES[known[name]]}")
        found[name] = value

    return kind(**found)


_NAMES: dict[Any, str] = {
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    str: "a text",
}
