"""Runs the two-part flow frame by frame, over NumPy or torch arrays alike.

Everything that is known in advance (occupancy, velocity, observation) goes through its share of the
first layers for all frames at once; only the recurrent part and the action predictor, which looks
at the poses just made, are left per frame.
"""

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, fields, replace
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from .checks import shaped
from .errors import InputError, WeightsError
from .progress import drained, within
from .root import AHEAD
from .skeleton import LOWER, MODEL_ORDER, OFFSETS, UPPER
from .text import printable
from .threads import one_thread
from .weights import Weights

__all__ = [
    "MOST_ACTIONS",
    "Conditions",
    "Made",
    "Sampler",
    "Unchanged",
    "model_order",
    "smpl_order",
    "velocities_up_to",
]

Array = Any  # numpy.ndarray or torch.Tensor

_UPPER_SIZE, _LOWER_SIZE = 3 * len(UPPER), 3 * len(LOWER)
_POSE_SIZE = _UPPER_SIZE + _LOWER_SIZE
_ORDER = np.array([3 * j + k for j in MODEL_ORDER for k in range(3)])
_INVERSE = np.argsort(_ORDER)
MOST_ACTIONS = 256
"""That a predictor may tell apart; the paper's has 10."""
_SIZES = {
    "actions": MOST_ACTIONS,
    "history": 120,
    "predictor_code": 4096,
    "predictor_width": 4096,
    "width": 4096,
    "layers": 8,
    "code": 4096,
}
"""The sizes of a model, and the largest that is run of each: several times those of the paper."""
_MOST_STEPS = 32
_LARGEST = 1e6  # of the numbers in a tensor; trained ones are under a hundred
_HUGEST = 1e30  # of the numbers in an inverse, so that single precision holds them
_FARTHEST = 100.0  # metres from the root that a joint of a pose may be
_LOG_TURN = float(np.log(2.0 * np.pi))
_PASSING = 10  # frames in which a resumed take's noise becomes its own


def model_order(poses: np.ndarray) -> np.ndarray:
    """Poses (…, 66) in SMPL order, as the model holds them: the upper body first."""
    return poses[..., _ORDER]


def smpl_order(poses: np.ndarray) -> np.ndarray:
    """Inverse of ``model_order``."""
    return poses[..., _INVERSE]


def velocities_up_to(velocity: np.ndarray, history: int) -> np.ndarray:
    """The last ``history`` velocities and the present one (T, 3 history + 3) of each frame; the
    first was so before.
    """
    padded = np.concatenate([np.repeat(velocity[:1], history, axis=0), velocity])
    return np.concatenate([padded[k : k + len(velocity)] for k in range(history + 1)], axis=1)


@dataclass(frozen=True)
class Conditions:
    """What the model is told at each of T frames, 30 a second, in the target root's frame R^τ
    (paper, section 4.1).

    ``velocity`` (T, 3): c_vel, metres and radians per frame. ``ahead`` (T, 18): where the root will
    be (``root.ahead``), for models that are told; NaN where nobody knows. ``occupancy`` (T, 2640):
    c_env. ``observation`` (T, 66): c_ob, positions in metres in the model's order; what is not
    ``given`` (T, 22) is ignored.
    """

    velocity: np.ndarray
    ahead: np.ndarray
    occupancy: np.ndarray
    observation: np.ndarray
    given: np.ndarray

    def __len__(self) -> int:
        return len(self.velocity)

    def between(self, start: int, stop: int) -> "Conditions":
        """Those of the frames from ``start`` to ``stop`` (exclusive), as copies."""
        return Conditions(*(getattr(self, each.name)[start:stop].copy() for each in fields(self)))


class Unchanged(NamedTuple):
    """How a shot's conditions would go on at a few frames from ``start`` on if the mode had not
    changed there: ``observation`` (M, 66) and what of it is ``given`` (M, 22).
    """

    start: int
    observation: np.ndarray
    given: np.ndarray


class Made(NamedTuple):
    """What a run makes of B takes: ``poses`` (T, B, 66) in SMPL order, metres; ``actions`` (T, B,
    K): probabilities; ``log_likelihood`` (T, B): log p of each standardised pose after those before
    it, nats; ``unchanged`` (M, B, 66): the poses of the frames of each ``Unchanged``, one after
    another.
    """

    poses: np.ndarray
    actions: np.ndarray
    log_likelihood: np.ndarray
    unchanged: np.ndarray


def _unusable(weights: Weights, what: str) -> WeightsError:
    return WeightsError(
        f"The weights '{weights.path}' cannot be used: {what}; choose another file."
    )


def _sizes(weights: Weights, systems: tuple[str, ...], parts: Iterable[str]) -> dict[str, int]:
    """The sizes of a model of these parts by name, checked: of these systems, this skeleton and
    frame rate, none too large.
    """
    config: dict[str, Any] = weights.config
    model = config.get("model")
    if not isinstance(model, dict):
        raise _unusable(weights, "they do not say how their model is built ('model')")
    system = model.get("system", "dafnet")
    if system not in systems:
        raise _unusable(
            weights,
            f"they are of the system '{printable(system, 40)}', which only 'dafnet evaluate' runs",
        )

    def said(name: str, accepts: Callable[[Any], bool], wanted: str, default: Any = None) -> Any:
        value = model.get(name, default)
        if not accepts(value):
            raise _unusable(
                weights, f"'{name}' of their model is {printable(value, 40)}, not {wanted}"
            )
        return value

    def size(name: str, most: int) -> int:
        return said(
            name,
            lambda value: type(value) is int and 0 < value <= most,
            f"a whole number from 1 to {most}",
        )

    largest = _SIZES | {f"steps_{part}": _MOST_STEPS for part in parts}
    sizes = {name: size(name, most) for name, most in largest.items()}
    foresight = 3 * len(AHEAD)
    sizes["ahead"] = said(
        "ahead",
        lambda value: type(value) is int and value in (0, foresight),
        f"0 or {foresight}",
        0,
    )
    for name in ("mask", "shared_encoder"):
        said(name, lambda value: isinstance(value, bool), "true or false")
    sizes["ahead_mask"] = said(
        "ahead_mask", lambda value: isinstance(value, bool), "true or false", False
    )
    said(
        "action_temperature",
        lambda value: type(value) in (int, float) and 1e-3 < value < 1e3,
        "a number from 0.001 to 1000",
    )
    try:
        offsets = shaped(config.get("offsets"), "offsets", OFFSETS.shape)
    except InputError:
        offsets = np.zeros(OFFSETS.shape)
    for name, fits in (
        ("fps", config.get("fps") == 30),
        ("offsets", np.allclose(offsets, OFFSETS)),
    ):
        if not fits:
            raise _unusable(
                weights, f"they were made for another skeleton or frame rate ('{name}')"
            )
    return sizes


def _sigmoid(xp: ModuleType, x: Array) -> Array:
    return 0.5 * xp.tanh(0.5 * x) + 0.5


@dataclass
class _Layer:
    """One LSTM layer: ``matrix`` (inputs + width, 4 · width) for [input, hidden]; ``bias`` (4 ·
    width,).
    """

    matrix: Array
    bias: Array


class _Coupling:
    """The recurrent net of one affine coupling, its first layer split into what is known in advance
    and what is not.
    """

    def __init__(
        self,
        xp: ModuleType,
        static: Array,
        layers: list[_Layer],
        out: Array,
        out_bias: Array,
        width: int,
    ) -> None:
        self.xp, self.static, self.layers, self.out, self.out_bias, self.width = (
            xp,
            static,
            layers,
            out,
            out_bias,
            width,
        )
        self.state: list[tuple[Array, Array]] = []
        self.known: Array = None

    def __call__(self, frame: int, fresh: Array) -> tuple[Array, Array]:
        """Shift and scale (B, n) from the frame's known share and its ``fresh`` inputs (B, m);
        advances the state.
        """
        xp, x = self.xp, fresh
        for i, layer in enumerate(self.layers):
            hidden, cell = self.state[i]
            gates = xp.concatenate([x, hidden], axis=-1) @ layer.matrix + (
                self.known[frame] if i == 0 else layer.bias
            )
            w = self.width
            opened = _sigmoid(xp, gates[:, : 2 * w])
            cell = opened[:, w:] * cell + opened[:, :w] * xp.tanh(gates[:, 2 * w : 3 * w])
            x = _sigmoid(xp, gates[:, 3 * w :]) * xp.tanh(cell)
            self.state[i] = (x, cell)
        shift_scale = x @ self.out + self.out_bias
        half = shift_scale.shape[-1] // 2
        return shift_scale[:, :half], _sigmoid(xp, shift_scale[:, half:] + 2.0) + 1e-6


@dataclass
class _Step:
    """A flow step; its activation norm and invertible linear are one affine map: y = x · matrix +
    offset.
    """

    coupling: _Coupling
    matrix: Array
    offset: Array
    inverse: Array
    inverse_offset: Array
    log_det: float
    half: int


@dataclass
class _Part:
    """One part's place in a pose and those of the parts made before it, its flow steps, and its
    environment encoders: one for all steps, or one each.
    """

    columns: slice
    before: list[slice]
    encoders: list[tuple[tuple[Array, Array], tuple[Array, Array]]]
    steps: list[_Step]


class Sampler:
    """The model of one weights file, ready to run on one array library.

    ``device`` is None for NumPy, else a torch device ('cpu', 'cuda', …). ``dtype``: 'float32' or
    'float64'. Raises WeightsError where the file does not describe a model of this skeleton and
    frame rate, lacks a tensor or has one of the wrong shape, or has a matrix that cannot be
    inverted.
    """

    systems: tuple[str, ...] = ("dafnet",)
    parts = {"upper": slice(0, _UPPER_SIZE), "lower": slice(_UPPER_SIZE, _POSE_SIZE)}
    """The parts in the order of sampling, and their places in a pose."""

    def __init__(self, weights: Weights, device: str | None = None, dtype: str = "float32") -> None:
        self.weights, self.config = weights, weights.config.get("model", {})
        self.device, self.dtype = device, dtype
        if device is None:
            self.xp: ModuleType = np
        else:
            import torch

            self.xp = torch
        c = _sizes(weights, self.systems, self.parts)
        self.mask, shared = bool(self.config["mask"]), bool(self.config["shared_encoder"])
        self.action_temperature = float(self.config["action_temperature"])
        self.actions, self.history, self.width = c["actions"], c["history"], c["width"]

        def array(name: str, *shape: int) -> np.ndarray:
            found = weights.require(name, shape).astype(np.float64)
            if found.size and np.abs(found).max() > _LARGEST:
                raise _unusable(
                    weights, f"'{name}' holds {np.abs(found).max():.0e}, which no training gives"
                )
            return found

        self.pose_mean, self.pose_std = (
            array("pose_mean", _POSE_SIZE),
            array("pose_std", _POSE_SIZE),
        )
        self.velocity_mean, self.velocity_std = array("velocity_mean", 3), array("velocity_std", 3)
        self.ahead, self.ahead_mask = c["ahead"], c["ahead_mask"] == 1
        told = ("ahead_mean", "ahead_std")
        self.ahead_mean, self.ahead_std = (
            array(name, self.ahead) if self.ahead else np.zeros(0) for name in told
        )
        for name in ("pose_std", "velocity_std", "ahead_std"):
            if getattr(self, name).min(initial=1.0) < 1e-6:
                raise _unusable(weights, f"'{name}' is not positive")

        self._spread = np.eye(_POSE_SIZE)
        for name, columns in self.parts.items():
            if f"{name}.spread" in weights.tensors:
                size = columns.stop - columns.start
                self._spread[columns, columns] = array(f"{name}.spread", size, size)
        self._read_told(array, c)
        places = list(self.parts.values())
        self._parts = [
            self._part(array, name, places[: i + 1], shared, c) for i, name in enumerate(self.parts)
        ]
        self._as_pose = sorted(range(len(places)), key=lambda i: places[i].start)
        """Which part, counted in the order of sampling, stands where in a pose."""

    def _read_told(self, array: Any, c: dict[str, int]) -> None:
        """What turns the scene feature s into what each coupling's net is told of it: here, the
        action predictor.
        """
        poses = self.history * _POSE_SIZE
        scene = poses + 3 * (self.history + 1)
        width, code = c["predictor_width"], c["predictor_code"]
        self._predictor_environment = self._linear(array, "predictor.environment", 2640, code)
        first = array("predictor.layers.0.weight", width, scene + code)
        self._predictor_past = self._to(first[:, :poses].T)
        self._predictor_known = (
            self._to(first[:, poses:].T),
            self._to(array("predictor.layers.0.bias", width)),
        )
        self._predictor_second = self._linear(array, "predictor.layers.2", width, width)
        self._predictor_out = self._linear(array, "predictor.layers.4", width, self.actions)
        self.fresh, self.moving = self.actions, 3 + self.ahead + self.ahead_mask
        """Numbers that the nets are told at each frame anew, and that they are told of the root's
        way.
        """

    def _to(self, a: np.ndarray) -> Array:
        if self.device is None:
            return np.ascontiguousarray(a, dtype=self.dtype)
        return self.xp.as_tensor(np.ascontiguousarray(a, dtype=self.dtype), device=self.device)

    def _from(self, a: Array) -> np.ndarray:
        return a if self.device is None else a.cpu().numpy()

    def _linear(self, array: Any, name: str, inputs: int, outputs: int) -> tuple[Array, Array]:
        return self._to(array(f"{name}.weight", outputs, inputs).T), self._to(
            array(f"{name}.bias", outputs)
        )

    def _part(
        self, array: Any, part: str, places: list[slice], shared: bool, c: dict[str, int]
    ) -> _Part:
        *before, columns = places
        steps = c[f"steps_{part}"]
        encoders = [
            (
                self._linear(array, f"{part}.encoders.{e}.first", 2640, c["code"]),
                self._linear(array, f"{part}.encoders.{e}.second", c["code"], c["code"]),
            )
            for e in range(1 if shared else steps)
        ]
        made = [self._step(array, f"{part}.{k}", columns, before, c) for k in range(steps)]
        return _Part(columns, before, encoders, made)

    def _step(
        self, array: Any, name: str, columns: slice, before: list[slice], c: dict[str, int]
    ) -> _Step:
        size = columns.stop - columns.start
        half, width = size // 2, c["width"]
        observed = _POSE_SIZE + (22 if self.mask else 0)
        condition = self.fresh + self.moving + c["code"] + observed
        bias, log_scale = array(f"{name}.bias", size), array(f"{name}.log_scale", size)
        weight = array(f"{name}.weight", size, size)
        if np.abs(log_scale).max() > 30 or not np.linalg.cond(weight) <= 1e8:
            raise _unusable(self.weights, f"'{name}' cannot be inverted")
        exponent = np.exp(log_scale)
        inverse = np.linalg.inv(weight)
        if not np.abs(inverse / exponent[:, None]).max() < _HUGEST:
            raise _unusable(self.weights, f"'{name}' cannot be inverted")
        layers = []
        for i in range(c["layers"]):
            inputs = half + condition if i == 0 else width
            into = array(f"{name}.lstm.weight_ih_l{i}", 4 * width, inputs).T
            back = array(f"{name}.lstm.weight_hh_l{i}", 4 * width, width).T
            total = array(f"{name}.lstm.bias_ih_l{i}", 4 * width) + array(
                f"{name}.lstm.bias_hh_l{i}", 4 * width
            )
            if i == 0:
                # Rows of the input: half a pose, actions, velocity and way ahead, observation
                # (upper part first), mask, code.
                slots = half + self.fresh + self.moving + np.arange(_POSE_SIZE)
                # The observation's slots of the parts made before are those parts: known only now.
                rows = np.concatenate(
                    [np.arange(half + self.fresh), *(slots[made] for made in before)]
                )
                known = np.setdiff1d(np.arange(inputs), rows)
                static = self._to(np.concatenate([into[known], total[None]]))
                into = into[rows]
            layers.append(_Layer(self._to(np.concatenate([into, back])), self._to(total)))
        out = self._to(array(f"{name}.out.weight", 2 * (size - half), width).T)
        coupling = _Coupling(
            self.xp,
            static,
            layers,
            out,
            self._to(array(f"{name}.out.bias", 2 * (size - half))),
            width,
        )
        return _Step(
            coupling,
            self._to((weight * exponent).T),
            self._to((bias * exponent) @ weight.T),
            self._to(inverse.T / exponent),
            self._to(-bias),
            float(log_scale.sum() + np.linalg.slogdet(weight)[1]),
            half,
        )

    def noise(
        self,
        seed: int,
        lower_seed: int | None = None,
        temperature: float = 1.0,
        lower_temperature: float | None = None,
    ) -> np.ndarray:
        """A take's noise vector (1, 66), upper part first, held constant; each part has a seed (0
        or more) and, if wished, a temperature of its own, so legs vary under one trunk. At
        temperature 1 takes differ as captured ones do, where the weights say how far those do.
        """
        seeds = (seed, 0, _UPPER_SIZE), (seed if lower_seed is None else lower_seed, 1, _LOWER_SIZE)
        drawn = [np.random.default_rng([s, part]).standard_normal(size) for s, part, size in seeds]
        heat = np.full(_POSE_SIZE, temperature)
        heat[_UPPER_SIZE:] = temperature if lower_temperature is None else lower_temperature
        return heat * (self._spread @ np.concatenate(drawn))[None]

    def standardised(self, poses: np.ndarray) -> np.ndarray:
        """Poses (…, 66) in SMPL order, metres, as the model holds them."""
        return (model_order(poses) - self.pose_mean) / self.pose_std

    def start(self, conditions: Conditions, takes: int = 1) -> None:
        """``start_steps`` drained."""
        drained(self.start_steps(conditions, takes))

    def start_steps(self, conditions: Conditions, takes: int = 1) -> Generator[float, None, None]:
        """Bring in the conditions of a whole shot and forget all memory; the past is the mean pose.
        Yields progress.
        """
        xp, frames = self.xp, len(conditions)
        velocity = (conditions.velocity - self.velocity_mean) / self.velocity_std
        window = velocities_up_to(velocity, self.history)
        occupancy = self._to(conditions.occupancy)
        way = self._way_ahead(conditions)
        moving = self._told_ahead(window, np.concatenate([velocity, way], axis=1), occupancy)
        yield 0.0

        given = np.repeat(conditions.given, 3, axis=-1)
        observation = np.where(
            given > 0, (conditions.observation - self.pose_mean) / self.pose_std, 0.0
        )
        one = self._to(np.ones((frames, 1)))
        empty = self._to(np.zeros((takes, self.width)))
        for part in self._parts:
            # of the pose, by the parts before: given, and told at each frame
            made = np.zeros(_POSE_SIZE, bool)
            for columns in part.before:
                made[columns] = True
            mask = [np.where(made[::3], 1.0, conditions.given)] if self.mask else []
            seen = self._to(np.concatenate([observation[:, ~made], *mask], axis=1))
            codes = []
            for first, second in part.encoders:
                hidden = occupancy @ first[0] + first[1]
                codes.append((hidden * (hidden > 0)) @ second[0] + second[1])
                yield 0.5
            for k, step in enumerate(part.steps):
                known = xp.concatenate([moving, seen, codes[k % len(codes)], one], axis=-1)
                step.coupling.known = known @ step.coupling.static
                step.coupling.state = [(empty, empty) for _ in step.coupling.layers]
                yield 1.0
        self._past = self._to(np.zeros((takes, self.history * _POSE_SIZE)))

    def _way_ahead(self, conditions: Conditions) -> np.ndarray:
        """What the nets are told of the way ahead (T, 0), (T, 18), or (T, 19) with whether it is
        known.

        Raises InputError where it is not known to a model that was always told.
        """
        way = (conditions.ahead[:, : self.ahead] - self.ahead_mean) / self.ahead_std
        known = np.isfinite(way).all(axis=1, keepdims=True)
        if self.ahead_mask:
            return np.concatenate([np.where(known, way, 0.0), known], axis=1)

        if not known.all():
            raise InputError(
                f"The weights '{self.weights.path}' have to know where the root goes during the "
                "next second; give its whole path, or choose weights for a live root."
            )
        return way

    def _told_ahead(self, window: np.ndarray, moving: np.ndarray, occupancy: Array) -> Array:
        """What the nets are told of the root's way (T, n), all frames at once; brings in what
        ``_told`` needs.

        ``window`` (T, 33): velocities up to now; ``moving`` (T, 3 [+ 18 [+ 1]]): the last of them,
        the way ahead, and whether it is known.
        """
        matrix, bias = self._predictor_environment
        known, known_bias = self._predictor_known
        seen = self.xp.concatenate([self._to(window), occupancy @ matrix + bias], axis=-1)
        self._predictor_ahead = seen @ known + known_bias
        return self._to(moving)

    def _told(self, frame: int) -> Array:
        """Action probabilities π (B, K) of a frame from the poses just made (paper, section
        4.2).
        """
        xp = self.xp
        x = self._past @ self._predictor_past + self._predictor_ahead[frame]
        x = (x * (x > 0)) @ self._predictor_second[0] + self._predictor_second[1]
        x = (
            (x * (x > 0)) @ self._predictor_out[0] + self._predictor_out[1]
        ) / self.action_temperature
        x = xp.exp(x - xp.amax(x, -1)[:, None])
        return x / x.sum(-1)[:, None]

    def _remember(self, pose: Array) -> None:
        self._past = self.xp.concatenate([self._past[:, _POSE_SIZE:], pose], axis=-1)

    def frame(self, index: int, noise: Array) -> tuple[Array, Array, Array]:
        """Standardised pose (B, 66) of the next frame, part after part, from ``noise`` (B, 66);
        what the nets were told, action probabilities (B, K); and the log-determinant (B,) of the
        way from pose to noise.
        """
        xp = self.xp
        told = self._told(index)
        made: list[Array] = []
        log_det = 0.0 * noise.sum(-1)
        for part in self._parts:
            z = noise[:, part.columns]
            for step in reversed(part.steps):
                passed = z[:, : step.half]
                shift, scale = step.coupling(index, xp.concatenate([passed, told, *made], axis=-1))
                changed = z[:, step.half :] / scale - shift
                z = xp.concatenate([passed, changed], axis=-1) @ step.inverse + step.inverse_offset
                log_det = log_det + xp.log(scale).sum(-1) + step.log_det
            made.append(z)
        pose = xp.concatenate([made[i] for i in self._as_pose], axis=-1)
        self._remember(pose)
        return pose, told, log_det

    def absorb(
        self, index: int, pose: Array, told: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """Noise (B, 66), action probabilities (B, K) and log-determinant (B,) of a kept frame: pose
        to noise.

        This rebuilds the memory to go on from. ``told`` stand in for the predictor's probabilities.
        """
        xp = self.xp
        told = self._told(index) if told is None else told
        noise, log_det = [], 0.0 * pose.sum(-1)
        for part in self._parts:
            x, before = pose[:, part.columns], [pose[:, columns] for columns in part.before]
            for step in part.steps:
                x = x @ step.matrix + step.offset
                passed = x[:, : step.half]
                shift, scale = step.coupling(
                    index, xp.concatenate([passed, told, *before], axis=-1)
                )
                x = xp.concatenate([passed, (x[:, step.half :] + shift) * scale], axis=-1)
                log_det = log_det + xp.log(scale).sum(-1) + step.log_det
            noise.append(x)
        self._remember(pose)
        return xp.concatenate([noise[i] for i in self._as_pose], axis=-1), told, log_det

    def run(
        self,
        conditions: Conditions,
        z: np.ndarray,
        kept: np.ndarray | None = None,
        watch: Callable[[int, np.ndarray], None] | None = None,
        unchanged: Sequence[Unchanged] = (),
    ) -> Generator[float, None, Made]:
        """Make every frame of B takes; yields progress in [0, 1].

        ``z`` (B, 66): one noise vector a take, upper part first, held constant. ``kept`` (N, B,
        66), SMPL order, metres: the first N frames as they are to stay; the model goes on from
        them, its noise passing over ten frames from the one that the last kept pose is made of to
        ``z``, so that nothing jumps. ``watch`` is shown each frame of the first take as it is made:
        its index and pose (66,) as above. ``unchanged``: stretches to be made besides, as the run
        would go on. Raises WeightsError where the poses are no body's.
        """
        noise = self._to(z)
        yield from within(self.start_steps(conditions, takes=len(z)), 0.0, 0.0)
        known = self._to(np.zeros((0, *z.shape)) if kept is None else self.standardised(kept))
        first, last = len(known), noise
        poses, actions, densities, aside = [], [], [], []
        for t in range(len(conditions)):
            share = min(1.0, max(0, t - first + 1) / _PASSING)
            now = last + (noise - last) * (share * share * (3.0 - 2.0 * share))
            for stretch in unchanged:
                if stretch.start == t:
                    for pose in self._aside(conditions, stretch, now):
                        aside.append(pose)
                        yield t / len(conditions)
            # Frame by frame: whoever drains this generator has the threads back in between. Poses
            # are judged below.
            with one_thread(), np.errstate(over="ignore", invalid="ignore"):
                if t < first:
                    pose = known[t]
                    now, told, log_det = self.absorb(t, pose)
                    last = now
                else:
                    pose, told, log_det = self.frame(t, now)
                densities.append(log_det - 0.5 * (now * now).sum(-1) - 0.5 * _POSE_SIZE * _LOG_TURN)
            poses.append(pose)
            actions.append(told[:, : self.actions])
            if watch is not None:
                watch(t, self._judged(self._metres(self._from(pose[:1])))[0])
            yield (t + 1) / len(conditions)
        stacked, told, density = (
            self._from(self.xp.stack(each)).astype(np.float64)
            for each in (poses, actions, densities)
        )
        others = (
            self._from(self.xp.stack(aside)).astype(np.float64)
            if aside
            else np.zeros((0, *z.shape))
        )
        return Made(
            self._judged(self._metres(stacked)), told, density, self._judged(self._metres(others))
        )

    def _aside(self, conditions: Conditions, stretch: Unchanged, noise: Array) -> Iterator[Array]:
        """Standardised poses (B, 66) of the stretch, from the memory as it is now, which stays
        so.
        """
        other = copy(self)
        other._parts = [
            replace(
                part, steps=[replace(step, coupling=copy(step.coupling)) for step in part.steps]
            )
            for part in self._parts
        ]
        begin, stop = max(0, stretch.start - self.history), stretch.start + len(stretch.given)
        there = conditions.between(begin, stop)
        there.observation[stretch.start - begin :], there.given[stretch.start - begin :] = (
            stretch.observation,
            stretch.given,
        )
        other.start(there, takes=len(noise))
        other._past = self._past
        for part, own in zip(self._parts, other._parts, strict=True):
            for step, mine in zip(part.steps, own.steps, strict=True):
                mine.coupling.state = list(step.coupling.state)
        for t in range(stretch.start, stop):
            with one_thread(), np.errstate(over="ignore", invalid="ignore"):
                pose = other.frame(t - begin, noise)[0]
            yield pose

    def _judged(self, poses: np.ndarray) -> np.ndarray:
        """Poses in metres. Raises WeightsError where they are no body's."""
        if not (np.abs(poses) < _FARTHEST).all():
            raise _unusable(
                self.weights, "their poses are no numbers, or farther than 100 metres from the root"
            )
        return poses

    def _metres(self, poses: np.ndarray) -> np.ndarray:
        """Inverse of ``standardised``."""
        return smpl_order(poses * self.pose_std + self.pose_mean)
