"""From a weights file to the parts of a network, checked: sizes, normalisation, the action
predictor and the flow steps of each part of the body.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .backend import Array, Backend
from .checks import shaped
from .errors import InputError, WeightsError
from .noise import TAPS, TakeNoise
from .root import AHEAD
from .sensor import SPHERES
from .series import MODEL_FPS
from .skeleton import JOINTS, OFFSETS, POSE_SIZE, UPPER_THEN_LOWER, Partition
from .text import printable
from .weights import Weights

__all__ = [
    "DAFNET",
    "MAX_ACTIONS",
    "CouplingNet",
    "FlowStep",
    "LSTMLayer",
    "Linear",
    "Network",
    "Normalisation",
    "Part",
    "Predictor",
    "Sizes",
    "System",
    "load_network",
    "unusable",
]

MAX_ACTIONS = 256
"""That a predictor may tell apart; the paper's has 10."""

# The largest model that is run: several times the paper's in each direction.
_MAX_SIZES = {
    "actions": MAX_ACTIONS,
    "history": 120,
    "predictor_code": 4096,
    "predictor_width": 4096,
    "width": 4096,
    "layers": 8,
    "code": 4096,
}
_MAX_STEPS = 32  # of a part's flow
_MAX_WEIGHT = 1e6  # of the numbers in a tensor; trained ones are under a hundred
_MAX_INVERSE = 1e30  # of the numbers in an inverse, so that single precision holds them
_MAX_CONDITION = 1e8  # condition number of a matrix that is to be inverted
_MAX_LOG_SCALE = 30.0
_MIN_DEVIATION = 1e-6  # of what is standardised

_VELOCITY_SIZE = 3
_AHEAD_SIZE = 3 * len(AHEAD)


class System(NamedTuple):
    """A kind of model, as a configuration names it: how it parts the body, and whether an action
    predictor stands between the past and the flow, or the flow is given the past itself.
    """

    name: str
    partition: Partition
    predicts: bool


DAFNET = System("dafnet", UPPER_THEN_LOWER, predicts=True)


@dataclass(frozen=True)
class Sizes:
    """Sizes and switches of one model, as in ``model.config.ModelConfig``; ``steps`` by part."""

    actions: int
    history: int
    predictor_code: int
    predictor_width: int
    width: int
    layers: int
    code: int
    ahead: int
    ahead_mask: bool
    mask: bool
    shared_encoder: bool
    action_temperature: float
    steps: dict[str, int]


@dataclass(frozen=True)
class Normalisation:
    """Mean and deviation of poses (66,) in the model's order, of velocities (3,) and of the way
    ahead (24,), or (0,) of a model without.
    """

    pose_mean: np.ndarray
    pose_std: np.ndarray
    velocity_mean: np.ndarray
    velocity_std: np.ndarray
    ahead_mean: np.ndarray
    ahead_std: np.ndarray


class Linear(NamedTuple):
    """A dense layer: x @ ``matrix`` (inputs, outputs) + ``bias`` (outputs,)."""

    matrix: Array
    bias: Array

    def __call__(self, x: Array) -> Array:
        return x @ self.matrix + self.bias


@dataclass(frozen=True)
class Predictor:
    """The action predictor (paper, section 4.2), its first layer split into what looks at the
    ``past`` poses and what looks at the ``scene``: velocities, and the environment's code.
    """

    environment: Linear
    past: Array
    scene: Linear
    second: Linear
    out: Linear
    temperature: float


class LSTMLayer(NamedTuple):
    """``matrix`` (inputs + width, 4 · width) of [input, hidden]; ``bias`` (4 · width,)."""

    matrix: Array
    bias: Array


@dataclass(frozen=True)
class CouplingNet:
    """The recurrent net of one affine coupling; ``width``: of its layers.

    The first layer's rows are split: ``in_advance`` (n + 1, 4 · width) those of what is known of
    all frames, the bias the last of them; ``layers[0]`` those of what is made frame by frame.
    """

    in_advance: Array
    layers: tuple[LSTMLayer, ...]
    out: Linear
    width: int


@dataclass(frozen=True)
class FlowStep:
    """Activation norm and invertible linear as one affine map, y = x @ ``matrix`` + ``offset``, and
    back, x = y @ ``inverse`` + ``inverse_offset``; then the coupling, which passes the first
    ``half`` values unchanged.
    """

    coupling: CouplingNet
    matrix: Array
    offset: Array
    inverse: Array
    inverse_offset: Array
    log_det: float
    half: int


@dataclass(frozen=True)
class Part:
    """One part of the body: its ``columns`` of a pose and those of the parts made ``before`` it,
    its flow steps from pose to noise, and its environment ``encoders``, two layers each: one for
    all steps, or one for each.
    """

    columns: slice
    before: tuple[slice, ...]
    encoders: tuple[tuple[Linear, Linear], ...]
    steps: tuple[FlowStep, ...]


@dataclass(frozen=True)
class Network:
    """All of one weights file. ``noise``: what takes are made of, the paper's where the file does
    not say how captured takes differ. ``predictor`` is None where the flow is given the past
    itself. ``parts``: in the order of making. ``sphere_radius``: of the sensor, metres.
    """

    sizes: Sizes
    normalisation: Normalisation
    noise: TakeNoise
    predictor: Predictor | None
    parts: tuple[Part, ...]
    sphere_radius: float


def unusable(weights: Weights, why: str) -> WeightsError:
    return WeightsError(f"The weights '{weights.path}' cannot be used: {why}; choose another file.")


def load_network(weights: Weights, system: System, backend: Backend) -> Network:
    """The network of a weights file, as arrays of ``backend``.

    Raises WeightsError where the file does not describe a model of this system, skeleton and frame
    rate, lacks a tensor or has one of the wrong shape, or has a matrix that cannot be inverted.
    """
    sizes = _sizes(weights, system)
    tensors = _Tensors(weights, backend)
    normalisation = _normalisation(tensors, sizes)
    noise = _noise(tensors, system.partition)
    predictor = _predictor(tensors, sizes) if system.predicts else None

    places = list(system.partition.items())
    parts = tuple(
        _part(tensors, sizes, system, name, tuple(columns for _, columns in places[:i]))
        for i, (name, _) in enumerate(places)
    )
    return Network(sizes, normalisation, noise, predictor, parts, weights.sphere_radius)


class _Tensors:
    """A weights file's tensors, whose shapes and numbers are checked as they are asked for."""

    def __init__(self, weights: Weights, backend: Backend) -> None:
        self.weights = weights
        self.backend = backend

    def __contains__(self, name: str) -> bool:
        return name in self.weights.tensors

    def values(self, name: str, *shape: int) -> np.ndarray:
        """In double precision."""
        found = self.weights.require(name, shape).astype(np.float64)
        if found.size and np.abs(found).max() > _MAX_WEIGHT:
            raise unusable(
                self.weights, f"'{name}' holds {np.abs(found).max():.0e}, which no training gives"
            )
        return found

    def linear(self, name: str, inputs: int, outputs: int) -> Linear:
        matrix = self.values(f"{name}.weight", outputs, inputs).T
        bias = self.values(f"{name}.bias", outputs)
        return Linear(self.backend.array(matrix), self.backend.array(bias))


def _sizes(weights: Weights, system: System) -> Sizes:
    """The sizes of a model, checked: of this system, this skeleton and frame rate, none too
    large.
    """
    config: dict[str, Any] = weights.config
    model = config.get("model")
    if not isinstance(model, dict):
        raise unusable(weights, "they do not say how their model is built ('model')")

    name = model.get("system", DAFNET.name)
    if name != system.name:
        raise unusable(
            weights,
            f"they are of the system '{printable(name, 40)}', which only 'dafnet evaluate' runs",
        )

    def read(name: str, accepts: Callable[[Any], bool], wanted: str, default: Any = None) -> Any:
        value = model.get(name, default)
        if not accepts(value):
            raise unusable(
                weights, f"'{name}' of their model is {printable(value, 40)}, not {wanted}"
            )
        return value

    def size(name: str, upper_bound: int) -> int:
        return read(
            name,
            lambda value: type(value) is int and 0 < value <= upper_bound,
            f"a whole number from 1 to {upper_bound}",
        )

    def switch(name: str, default: bool | None = None) -> bool:
        return read(name, lambda value: isinstance(value, bool), "true or false", default)

    found = Sizes(
        **{name: size(name, upper_bound) for name, upper_bound in _MAX_SIZES.items()},
        steps={part: size(f"steps_{part}", _MAX_STEPS) for part in system.partition},
        ahead=read(
            "ahead",
            lambda value: type(value) is int and value in range(0, _AHEAD_SIZE + 1, 3),
            f"a multiple of 3 from 0 to {_AHEAD_SIZE}",
            0,
        ),
        mask=switch("mask"),
        shared_encoder=switch("shared_encoder"),
        ahead_mask=switch("ahead_mask", default=False),
        action_temperature=float(
            read(
                "action_temperature",
                lambda value: type(value) in (int, float) and 1e-3 < value < 1e3,
                "a number from 0.001 to 1000",
            )
        ),
    )

    try:
        offsets = shaped(config.get("offsets"), "offsets", OFFSETS.shape)
    except InputError:
        offsets = np.zeros(OFFSETS.shape)

    for name, fits in (
        ("fps", config.get("fps") == MODEL_FPS),
        ("offsets", np.allclose(offsets, OFFSETS)),
    ):
        if not fits:
            raise unusable(weights, f"they were made for another skeleton or frame rate ('{name}')")

    return found


def _normalisation(tensors: _Tensors, sizes: Sizes) -> Normalisation:
    found = Normalisation(
        pose_mean=tensors.values("pose_mean", POSE_SIZE),
        pose_std=tensors.values("pose_std", POSE_SIZE),
        velocity_mean=tensors.values("velocity_mean", _VELOCITY_SIZE),
        velocity_std=tensors.values("velocity_std", _VELOCITY_SIZE),
        ahead_mean=tensors.values("ahead_mean", sizes.ahead) if sizes.ahead else np.zeros(0),
        ahead_std=tensors.values("ahead_std", sizes.ahead) if sizes.ahead else np.zeros(0),
    )
    for name in ("pose_std", "velocity_std", "ahead_std"):
        if getattr(found, name).min(initial=1.0) < _MIN_DEVIATION:
            raise unusable(tensors.weights, f"'{name}' is not positive")

    return found


def _noise(tensors: _Tensors, partition: Partition) -> TakeNoise:
    """Of the parts' tensors ``spread``, what lasts, and ``passing`` and ``taps``."""
    paper = TakeNoise.standard_normal()
    lasting, passing, taps = paper.lasting, paper.passing, paper.taps
    for name, columns in partition.items():
        size = columns.stop - columns.start
        if f"{name}.spread" in tensors:
            lasting[columns, columns] = tensors.values(f"{name}.spread", size, size)
        if f"{name}.passing" in tensors:
            passing[columns, columns] = tensors.values(f"{name}.passing", size, size)
            taps[columns] = tensors.values(f"{name}.taps", size, TAPS)

    return TakeNoise(lasting, passing, taps)


def _predictor(tensors: _Tensors, sizes: Sizes) -> Predictor:
    width, code = sizes.predictor_width, sizes.predictor_code
    poses = sizes.history * POSE_SIZE
    scene = poses + (sizes.history + 1) * _VELOCITY_SIZE

    environment = tensors.linear("predictor.environment", len(SPHERES), code)
    first = tensors.values("predictor.layers.0.weight", width, scene + code)
    bias = tensors.values("predictor.layers.0.bias", width)
    array = tensors.backend.array
    return Predictor(
        environment=environment,
        past=array(first[:, :poses].T),
        scene=Linear(array(first[:, poses:].T), array(bias)),
        second=tensors.linear("predictor.layers.2", width, width),
        out=tensors.linear("predictor.layers.4", width, sizes.actions),
        temperature=sizes.action_temperature,
    )


def _input_sizes(sizes: Sizes, system: System) -> tuple[int, int]:
    """Numbers that a coupling's net is given frame by frame, and of the root's way in advance:
    actions, velocity and way ahead; or all past poses and velocities.
    """
    if system.predicts:
        return sizes.actions, _VELOCITY_SIZE + sizes.ahead + sizes.ahead_mask
    return sizes.history * POSE_SIZE, (sizes.history + 1) * _VELOCITY_SIZE


def _part(
    tensors: _Tensors, sizes: Sizes, system: System, name: str, before: tuple[slice, ...]
) -> Part:
    columns = system.partition[name]
    encoders = tuple(
        (
            tensors.linear(f"{name}.encoders.{e}.first", len(SPHERES), sizes.code),
            tensors.linear(f"{name}.encoders.{e}.second", sizes.code, sizes.code),
        )
        for e in range(1 if sizes.shared_encoder else sizes.steps[name])
    )
    inputs = _input_sizes(sizes, system)
    steps = tuple(
        _step(tensors, sizes, inputs, f"{name}.{k}", columns.stop - columns.start, before)
        for k in range(sizes.steps[name])
    )
    return Part(columns, before, encoders, steps)


def _step(
    tensors: _Tensors,
    sizes: Sizes,
    inputs: tuple[int, int],
    name: str,
    size: int,
    before: tuple[slice, ...],
) -> FlowStep:
    bias = tensors.values(f"{name}.bias", size)
    log_scale = tensors.values(f"{name}.log_scale", size)
    weight = tensors.values(f"{name}.weight", size, size)
    if np.abs(log_scale).max() > _MAX_LOG_SCALE or not np.linalg.cond(weight) <= _MAX_CONDITION:
        raise unusable(tensors.weights, f"'{name}' cannot be inverted")

    scale = np.exp(log_scale)
    inverse = np.linalg.inv(weight)
    if not np.abs(inverse / scale[:, None]).max() < _MAX_INVERSE:
        raise unusable(tensors.weights, f"'{name}' cannot be inverted")

    array = tensors.backend.array
    return FlowStep(
        coupling=_coupling(tensors, sizes, inputs, name, size, before),
        matrix=array((weight * scale).T),
        offset=array((bias * scale) @ weight.T),
        inverse=array(inverse.T / scale),
        inverse_offset=array(-bias),
        log_det=float(log_scale.sum() + np.linalg.slogdet(weight)[1]),
        half=size // 2,
    )


def _coupling(
    tensors: _Tensors,
    sizes: Sizes,
    inputs: tuple[int, int],
    name: str,
    size: int,
    before: tuple[slice, ...],
) -> CouplingNet:
    array = tensors.backend.array
    half, width = size // 2, sizes.width
    per_frame, root = inputs
    observed = POSE_SIZE + (len(JOINTS) if sizes.mask else 0)
    first_inputs = half + per_frame + root + sizes.code + observed

    layers: list[LSTMLayer] = []
    for i in range(sizes.layers):
        layer_inputs = first_inputs if i == 0 else width
        into = tensors.values(f"{name}.lstm.weight_ih_l{i}", 4 * width, layer_inputs).T
        back = tensors.values(f"{name}.lstm.weight_hh_l{i}", 4 * width, width).T
        bias = tensors.values(f"{name}.lstm.bias_ih_l{i}", 4 * width)
        bias = bias + tensors.values(f"{name}.lstm.bias_hh_l{i}", 4 * width)
        if i == 0:
            # Rows of the input: half a pose, what is made frame by frame, the root's way, the
            # observation (upper part first), its mask, the environment's code. The observation's
            # slots of the parts made before are those parts: known only frame by frame.
            slots = half + per_frame + root + np.arange(POSE_SIZE)
            rows = np.concatenate(
                [np.arange(half + per_frame), *(slots[columns] for columns in before)]
            )
            known = np.setdiff1d(np.arange(first_inputs), rows)
            in_advance = array(np.concatenate([into[known], bias[None]]))
            into = into[rows]

        layers.append(LSTMLayer(array(np.concatenate([into, back])), array(bias)))

    out = tensors.linear(f"{name}.out", width, 2 * (size - half))
    return CouplingNet(in_advance, tuple(layers), out, width)
