"""Runs a model frame by frame, over NumPy or torch arrays alike.

Everything that is known in advance (occupancy, velocity, observation) goes through its share of the
first layers for all frames at once; only the recurrent part and the action predictor, which looks
at the poses just made, are left per frame.
"""

from collections.abc import Callable, Generator, Sequence
from copy import copy
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from .backend import Array, Backend
from .errors import InputError
from .inputs import inputs_of, velocities_up_to
from .network import DAFNET, CouplingNet, Part, System, load_network, unusable
from .progress import run_to_end, within
from .sensor import narrowed
from .series import smoothstep
from .skeleton import POSE_SIZE, model_order, smpl_order
from .threads import one_thread
from .weights import Weights

__all__ = ["Conditions", "Frame", "Run", "Sampler", "Samples", "Unchanged"]

_FARTHEST = 100.0  # metres from the root that a joint of a pose may be
_LOG_TURN = float(np.log(2.0 * np.pi))
_PASSING = 10  # frames in which a resumed take's noise becomes its own

LSTMState = tuple[tuple[Array, Array], ...]
"""Hidden values and cells (B, width) of each layer."""


@dataclass(frozen=True)
class Conditions:
    """What the model is given at each of T frames, 30 a second, in the target root's frame R^τ
    (paper, section 4.1).

    ``velocity`` (T, 3): c_vel, metres and radians per frame. ``ahead`` (T, 24): where the root will
    be (``root.ahead``), for models that are given it; NaN where nobody knows. ``occupancy`` (T,
    2640): c_env. ``observation`` (T, 66): c_ob, positions in metres in the model's order; what is
    not ``given`` (T, 22) is ignored.
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


class Samples(NamedTuple):
    """B takes of a run: ``poses`` (T, B, 66) in SMPL order, metres; ``actions`` (T, B, K):
    probabilities; ``log_likelihood`` (T, B): log p of each standardised pose after those before it,
    nats; ``unchanged`` (M, B, 66): the poses of the frames of each ``Unchanged``, one after
    another.
    """

    poses: np.ndarray
    actions: np.ndarray
    log_likelihood: np.ndarray
    unchanged: np.ndarray


class Frame(NamedTuple):
    """One frame of B takes, standardised: the ``pose`` and the ``noise`` (B, 66) that it is made
    of, the ``inputs`` (B, K) that the nets were given at it, action probabilities; ``log_det``
    (B,): of the way from pose to noise.
    """

    pose: Array
    noise: Array
    inputs: Array
    log_det: Array


class Run(NamedTuple):
    """One of several shots that are made side by side: its ``conditions``, the noise ``z`` of its
    takes, as ``Sampler.run`` is given them, and the stretches ``unchanged``.
    """

    conditions: Conditions
    z: np.ndarray
    unchanged: Sequence[Unchanged] = ()


@dataclass(frozen=True)
class _InAdvance:
    """What is known of all frames of P shots: the ``scene`` (T, P, m) of the inputs, and the share
    (T, P, 4 · width) that each flow step's first layer has of it, by part and step. ``of``: the
    shot of each take, where there are several.
    """

    scene: Array
    shares: list[list[Array]]
    of: tuple[int, ...] = ()

    def by_take(self, values: Array, takes: int) -> Array:
        """Values (P, n) of the shots for the first ``takes`` of all (B, n); one shot's as they
        are.
        """
        if len(values) == 1:
            return values
        if len(values) == len(self.of):
            return values[:takes]
        return values[list(self.of[:takes])]


@dataclass
class _Memory:
    """The ``past`` poses (B, 66 · history), standardised, and the ``states`` of the couplings' nets
    by part and step.
    """

    past: Array
    states: list[list[LSTMState]]

    def rows(self, which: slice) -> "_Memory":
        """Of some of the takes only."""
        return _Memory(
            self.past[which],
            [
                [tuple((hidden[which], cell[which]) for hidden, cell in step) for step in steps]
                for steps in self.states
            ],
        )


class _Stretch(NamedTuple):
    """A stretch ``Unchanged`` of one run that is still to be made: what is known in advance from
    its first frame on, the memory there, the ``noise`` (M, B, 66), and whose it is.
    """

    known: _InAdvance
    memory: _Memory
    noise: Array
    run: int


class Sampler:
    """The model of one weights file, ready to run on one array library.

    ``device`` is None for NumPy, else a torch device ('cpu', 'cuda', …). ``dtype``: 'float32' or
    'float64'. ``system``: the kind of model that the file has to be of. Raises WeightsError where
    the file does not describe a model of this system, skeleton and frame rate, lacks a tensor or
    has one of the wrong shape, or has a matrix that cannot be inverted.
    """

    def __init__(
        self,
        weights: Weights,
        device: str | None = None,
        dtype: str = "float32",
        system: System = DAFNET,
    ) -> None:
        self.weights = weights
        self.backend = Backend(device, dtype)
        self.network = load_network(weights, system, self.backend)
        self.inputs = inputs_of(self.network, self.backend)
        self.actions = self.network.sizes.actions if system.predicts else 0

        # Which part, counted in the order of making, stands where in a pose.
        starts = [part.columns.start for part in self.network.parts]
        self._as_pose = sorted(range(len(starts)), key=lambda i: starts[i])

    def noise(
        self,
        frames: int,
        seed: int,
        lower_seed: int | None = None,
        temperature: float = 1.0,
        lower_temperature: float | None = None,
        held: bool = False,
    ) -> np.ndarray:
        """One take's noise (T, 1, 66), as ``TakeNoise.draw`` gives it."""
        drawn = self.network.noise.draw(
            frames, seed, lower_seed, temperature, lower_temperature, held
        )
        return drawn[:, None]

    def standardised(self, poses: np.ndarray) -> np.ndarray:
        """Poses (…, 66) in SMPL order, metres, as the model holds them."""
        known = self.network.normalisation
        return (model_order(poses) - known.pose_mean) / known.pose_std

    def start(self, conditions: Conditions, takes: int = 1) -> None:
        """``start_steps``, run to its end."""
        run_to_end(self.start_steps(conditions, takes))

    def start_steps(self, conditions: Conditions, takes: int = 1) -> Generator[float, None, None]:
        """Bring in the conditions of a whole shot and forget all memory; the past is the mean pose.
        Yields progress.
        """
        self._shot = yield from self._in_advance(conditions)
        self._memory = self._mean_past(takes)

    def forget(self, takes: int = 1) -> None:
        """Forget all memory, for ``step`` to begin with: the past of the takes is the mean pose."""
        self._memory = self._mean_past(takes)

    def step(self, conditions: Conditions, z: np.ndarray) -> Samples:
        """The next frame of B takes alone, for who learns what is asked only as time goes; the
        memory goes on.

        ``conditions``: of this frame, their last one, and of those before it, whose velocities the
        action predictor is told. ``z`` (B, 66): the noise, upper part first. After ``forget``, step
        by step, the poses are those of ``run``, but for rounding. Raises WeightsError where they
        are not a body's, InputError as ``run`` does.
        """
        before = self.network.sizes.history + 1
        seen = conditions.between(max(0, len(conditions) - before), len(conditions))
        with one_thread(), np.errstate(over="ignore", invalid="ignore"):
            self._shot = run_to_end(self._in_advance(seen, len(seen) - 1))
            frame = self.decode(0, self.backend.array(z))
            density = _log_density(frame)
        return Samples(
            poses=self._checked(self._stacked([frame.pose])),
            actions=self._stacked([frame.inputs[:, : self.actions]]),
            log_likelihood=self._stacked([density]),
            unchanged=np.zeros((0, len(z), POSE_SIZE)),
        )

    def _mean_past(self, takes: int) -> _Memory:
        sizes, array = self.network.sizes, self.backend.array
        empty = array(np.zeros((takes, sizes.width)))
        state = ((empty, empty),) * sizes.layers
        return _Memory(
            past=array(np.zeros((takes, sizes.history * POSE_SIZE))),
            states=[[state] * len(part.steps) for part in self.network.parts],
        )

    def _in_advance(
        self, conditions: Conditions, since: int = 0
    ) -> Generator[float, None, _InAdvance]:
        """What is known of one shot's frames from ``since`` on."""
        xp, array = self.backend.xp, self.backend.array
        sizes, known = self.network.sizes, self.network.normalisation

        velocity = (conditions.velocity - known.velocity_mean) / known.velocity_std
        up_to = velocities_up_to(velocity, sizes.history)[since:]
        if since:
            conditions, velocity = conditions.between(since, len(conditions)), velocity[since:]
        occupancy = array(narrowed(conditions.occupancy, self.network.sphere_radius))
        root, scene = self.inputs.in_advance(
            up_to,
            np.concatenate([velocity, self._way_ahead(conditions)], axis=1),
            occupancy,
        )
        yield 0.0

        given = np.repeat(conditions.given, 3, axis=-1)
        observation = np.where(
            given > 0, (conditions.observation - known.pose_mean) / known.pose_std, 0.0
        )
        one = array(np.ones((len(conditions), 1)))
        shares: list[list[Array]] = []
        for part in self.network.parts:
            seen = array(self._observed(part, observation, conditions.given))
            codes = []
            for first, second in part.encoders:
                hidden = first(occupancy)
                codes.append(second(hidden * (hidden > 0)))
                yield 0.5

            shares.append([])
            for k, step in enumerate(part.steps):
                inputs = xp.concatenate([root, seen, codes[k % len(codes)], one], axis=-1)
                shares[-1].append((inputs @ step.coupling.in_advance)[:, None])
                yield 1.0

        return _InAdvance(scene[:, None], shares)

    def _together(self, known: Sequence[_InAdvance], takes: Sequence[int]) -> _InAdvance:
        """What is known of several shots, the longest first, with so many takes each."""
        if len(known) == 1:
            return known[0]

        def stacked(arrays: Sequence[Array]) -> Array:
            out = self.backend.array(np.zeros((len(arrays[0]), len(arrays), arrays[0].shape[-1])))
            for k, each in enumerate(arrays):
                out[: len(each), k] = each[:, 0]
            return out

        return _InAdvance(
            scene=stacked([each.scene for each in known]),
            shares=[
                [
                    stacked([each.shares[i][k] for each in known])
                    for k in range(len(known[0].shares[i]))
                ]
                for i in range(len(known[0].shares))
            ],
            of=tuple(k for k, count in enumerate(takes) for _ in range(count)),
        )

    def _observed(self, part: Part, observation: np.ndarray, given: np.ndarray) -> np.ndarray:
        """What a part's nets are given in advance of the observation (T, 66) and of what in it is
        ``given`` (T, 22): all but the parts made before it, which count as given.
        """
        made = np.zeros(POSE_SIZE, bool)
        for columns in part.before:
            made[columns] = True
        mask = [np.where(made[::3], 1.0, given)] if self.network.sizes.mask else []
        return np.concatenate([observation[:, ~made], *mask], axis=1)

    def _way_ahead(self, conditions: Conditions) -> np.ndarray:
        """What the nets are given of the way ahead (T, 0), (T, 24), or (T, 25) with whether it is
        known.

        Raises InputError where it is not known to a model that was always given it.
        """
        sizes, normalisation = self.network.sizes, self.network.normalisation
        way = conditions.ahead[:, : sizes.ahead]
        way = (way - normalisation.ahead_mean) / normalisation.ahead_std
        known = np.isfinite(way).all(axis=1, keepdims=True)
        if sizes.ahead_mask:
            return np.concatenate([np.where(known, way, 0.0), known], axis=1)

        if not known.all():
            raise InputError(
                f"The weights '{self.weights.path}' have to know where the root goes during the "
                "next seconds; give its whole path, or choose weights for a live root."
            )

        return way

    def decode(self, index: int, noise: Array) -> Frame:
        """The next frame, made of ``noise`` (B, 66) part after part."""
        xp = self.backend.xp
        inputs = self._inputs_at(index)
        made: list[Array] = []
        log_det = 0.0 * noise.sum(-1)
        for i, part in enumerate(self.network.parts):
            z = noise[:, part.columns]
            for k, step in reversed(list(enumerate(part.steps))):
                passed = z[:, : step.half]
                known = xp.concatenate([passed, inputs, *made], axis=-1)
                shift, scale = self._shift_and_scale(index, i, k, known)
                changed = z[:, step.half :] / scale - shift
                z = xp.concatenate([passed, changed], axis=-1) @ step.inverse + step.inverse_offset
                log_det = log_det + xp.log(scale).sum(-1) + step.log_det
            made.append(z)

        pose = xp.concatenate([made[i] for i in self._as_pose], axis=-1)
        self._remember(pose)
        return Frame(pose, noise, inputs, log_det)

    def encode(self, index: int, pose: Array, inputs: Array | None = None) -> Frame:
        """The next frame, a standardised ``pose`` (B, 66) that is kept, with the noise that it is
        made of; the memory goes on from it.

        ``inputs``: to be given to the nets in place of the predictor's probabilities.
        """
        xp = self.backend.xp
        if inputs is None:
            inputs = self._inputs_at(index)

        made: list[Array] = []
        log_det = 0.0 * pose.sum(-1)
        for i, part in enumerate(self.network.parts):
            x, before = pose[:, part.columns], [pose[:, columns] for columns in part.before]
            for k, step in enumerate(part.steps):
                x = x @ step.matrix + step.offset
                passed = x[:, : step.half]
                known = xp.concatenate([passed, inputs, *before], axis=-1)
                shift, scale = self._shift_and_scale(index, i, k, known)
                x = xp.concatenate([passed, (x[:, step.half :] + shift) * scale], axis=-1)
                log_det = log_det + xp.log(scale).sum(-1) + step.log_det
            made.append(x)

        self._remember(pose)
        noise = xp.concatenate([made[i] for i in self._as_pose], axis=-1)
        return Frame(pose, noise, inputs, log_det)

    def noise_of(
        self, conditions: Conditions, poses: np.ndarray
    ) -> Generator[float, None, np.ndarray]:
        """The noise (T, B, 66) that poses (T, B, 66) in SMPL order, metres, are made of; yields
        progress in [0, 1].
        """
        yield from within(self.start_steps(conditions, poses.shape[1]), 0.0, 0.0)
        known = self.backend.array(self.standardised(poses))
        found: list[Array] = []
        for t in range(len(poses)):
            with one_thread(), np.errstate(over="ignore", invalid="ignore"):
                found.append(self.encode(t, known[t]).noise)
            yield (t + 1) / len(poses)
        return self._stacked(found)

    def _inputs_at(self, index: int) -> Array:
        past = self._memory.past
        return self.inputs.at(self._shot.by_take(self._shot.scene[index], len(past)), past)

    def _remember(self, pose: Array) -> None:
        past = self._memory.past[:, POSE_SIZE:]
        self._memory.past = self.backend.xp.concatenate([past, pose], axis=-1)

    def _shift_and_scale(self, frame: int, part: int, step: int, x: Array) -> tuple[Array, Array]:
        """Of one step's coupling, by its share of what is known in advance and its inputs ``x``
        (B, m) of this frame; its memory goes on.
        """
        net = self.network.parts[part].steps[step].coupling
        states = self._memory.states[part]
        share = self._shot.by_take(self._shot.shares[part][step][frame], len(x))
        shift, scale, states[step] = self._run_net(net, share, x, states[step])
        return shift, scale

    def _run_net(
        self, net: CouplingNet, share: Array, x: Array, state: LSTMState
    ) -> tuple[Array, Array, LSTMState]:
        """Shift and scale (B, n) of a coupling, and the state after this frame."""
        xp, sigmoid = self.backend.xp, self.backend.sigmoid
        width = net.width
        after: list[tuple[Array, Array]] = []
        for i, (layer, (hidden, cell)) in enumerate(zip(net.layers, state, strict=True)):
            gates = xp.concatenate([x, hidden], axis=-1) @ layer.matrix + (
                share if i == 0 else layer.bias
            )
            opened = sigmoid(gates[:, : 2 * width])
            candidate = xp.tanh(gates[:, 2 * width : 3 * width])
            cell = opened[:, width:] * cell + opened[:, :width] * candidate
            x = sigmoid(gates[:, 3 * width :]) * xp.tanh(cell)
            after.append((x, cell))

        shift_scale = net.out(x)
        half = shift_scale.shape[-1] // 2
        scale = sigmoid(shift_scale[:, half:] + 2.0) + 1e-6
        return shift_scale[:, :half], scale, tuple(after)

    def run(
        self,
        conditions: Conditions,
        z: np.ndarray,
        kept: np.ndarray | None = None,
        watch: Callable[[int, np.ndarray], None] | None = None,
        unchanged: Sequence[Unchanged] = (),
    ) -> Generator[float, None, Samples]:
        """Make every frame of B takes; yields progress in [0, 1].

        ``z`` (T, B, 66): the noise of each take and frame, upper part first; or (B, 66), one vector
        a take, held constant. ``kept`` (N, B, 66), SMPL order, metres: those of the first N frames
        that are to stay, NaN for the others; the model goes on from them, and what the noise that
        the last kept pose is made of has over ``z`` dies away over ten frames, so that nothing
        jumps. ``watch`` is shown each
        frame of the first take as it is made: its index and pose (66,) as above. ``unchanged``:
        stretches to be made besides, as the run would go on. Raises WeightsError where the poses
        are not a body's.
        """
        job = self.run_several([Run(conditions, z, unchanged)], kept, watch)
        return (yield from job)[0]

    def run_several(
        self,
        runs: Sequence[Run],
        kept: np.ndarray | None = None,
        watch: Callable[[int, np.ndarray], None] | None = None,
    ) -> Generator[float, None, list[Samples]]:
        """``run`` several shots side by side, each of its own length; their takes go through the
        network together. ``kept`` and ``watch`` are for one shot alone.
        """
        array, numpy = self.backend.array, self.backend.numpy
        order = sorted(range(len(runs)), key=lambda i: -len(runs[i].conditions))
        lengths = [len(runs[i].conditions) for i in order]
        takes = [runs[i].z.shape[-2] for i in order]
        stops = np.cumsum(takes)
        rows = [
            slice(int(stop) - count, int(stop)) for stop, count in zip(stops, takes, strict=True)
        ]

        drawn = np.zeros((lengths[0], int(stops[-1]), POSE_SIZE))
        for i, length, own in zip(order, lengths, rows, strict=True):
            drawn[:length, own] = np.broadcast_to(runs[i].z, (length, own.stop - own.start, 66))
        own_noise = array(drawn)
        advance = []
        for i in order:
            advance.append((yield from within(self._in_advance(runs[i].conditions), 0.0, 0.0)))
        self._shot = self._together(advance, takes)
        self._memory = self._mean_past(int(stops[-1]))
        nothing = np.zeros((0, int(stops[-1]), POSE_SIZE))
        stays = np.isfinite(nothing if kept is None else kept).all(axis=(1, 2))
        known = array(np.nan_to_num(self.standardised(nothing if kept is None else kept)))

        last, last_kept = 0, own_noise[0]
        frames: list[Frame] = []
        aside: list[_Stretch] = []
        for t in range(lengths[0]):
            active = int(stops[sum(length > t for length in lengths) - 1])
            if active < len(self._memory.past):
                self._memory = self._memory.rows(slice(0, active))
            keep = t < len(stays) and bool(stays[t])
            if keep:
                noise = last_kept
            elif len(known):
                share = float(smoothstep(np.array((t - last) / _PASSING)))
                noise = own_noise[t] + (last_kept - own_noise[last]) * (1.0 - share)
            else:
                noise = own_noise[t, :active]

            for k, i in enumerate(order):
                for stretch in runs[i].unchanged:
                    if stretch.start == t:
                        own = rows[k]
                        later = own_noise[t : t + len(stretch.given), own]
                        going_on = later - own_noise[t, own] + noise[own]
                        job = self._as_before(runs[i].conditions, stretch, going_on, own, i)
                        aside.append((yield from within(job, t / lengths[0], t / lengths[0])))

            # Frame by frame: whoever runs this generator has the threads back in between. Poses are
            # checked below.
            with one_thread(), np.errstate(over="ignore", invalid="ignore"):
                if keep:
                    frame = self.encode(t, known[t])
                    last, last_kept = t, frame.noise
                else:
                    frame = self.decode(t, noise)

            frames.append(frame)
            if watch is not None:
                watch(t, self._checked(numpy(frame.pose[:1]))[0])

            yield (t + 1) / lengths[0]

        unchanged = yield from within(self._made_aside(aside, len(runs)), 1.0, 1.0)
        with np.errstate(over="ignore", invalid="ignore"):
            densities = [_log_density(frame) for frame in frames]

        found = {}
        for i, length, own in zip(order, lengths, rows, strict=True):
            poses = [frame.pose[own] for frame in frames[:length]]
            actions = [frame.inputs[own, : self.actions] for frame in frames[:length]]
            found[i] = Samples(
                poses=self._checked(self._stacked(poses)),
                actions=self._stacked(actions),
                log_likelihood=self._stacked([each[own] for each in densities[:length]]),
                unchanged=self._checked(
                    self._stacked(unchanged[i]) if unchanged[i] else nothing[:, own]
                ),
            )
        return [found[i] for i in range(len(runs))]

    def _as_before(
        self, conditions: Conditions, stretch: Unchanged, noise: Array, takes: slice, run: int
    ) -> Generator[float, None, _Stretch]:
        """A stretch as it is to be made of its own ``noise`` (M, B, 66), from the memory of these
        ``takes`` as it is now, which stays as it is.
        """
        begin = max(0, stretch.start - self.network.sizes.history)
        there = conditions.between(begin, stretch.start + len(stretch.given))
        there.observation[stretch.start - begin :] = stretch.observation
        there.given[stretch.start - begin :] = stretch.given
        known = yield from self._in_advance(there)
        later = slice(stretch.start - begin, None)
        return _Stretch(
            _InAdvance(
                known.scene[later], [[each[later] for each in part] for part in known.shares]
            ),
            self._memory.rows(takes),
            noise,
            run,
        )

    def _made_aside(
        self, stretches: Sequence[_Stretch], runs: int
    ) -> Generator[float, None, list[list[Array]]]:
        """Standardised poses (B, 66) of the frames of all stretches, one after another, by run; all
        are made side by side.
        """
        made: dict[int, list[Array]] = {}
        order = sorted(range(len(stretches)), key=lambda j: -len(stretches[j].noise))
        if order:
            ordered = [stretches[j] for j in order]
            takes = [each.noise.shape[1] for each in ordered]
            stops = np.cumsum(takes)
            other = copy(self)
            other._shot = self._together([each.known for each in ordered], takes)
            other._memory = self._joined([each.memory for each in ordered])
            for t in range(len(ordered[0].noise)):
                count = sum(len(each.noise) > t for each in ordered)
                active = int(stops[count - 1])
                other._memory = other._memory.rows(slice(0, active))
                noise = self.backend.xp.concatenate([each.noise[t] for each in ordered[:count]])
                with one_thread(), np.errstate(over="ignore", invalid="ignore"):
                    pose = other.decode(t, noise).pose
                for j, stop, own in zip(order[:count], stops, takes, strict=False):
                    made.setdefault(j, []).append(pose[int(stop) - own : int(stop)])
                yield t / len(ordered[0].noise)

        return [
            [pose for j, stretch in enumerate(stretches) if stretch.run == run for pose in made[j]]
            for run in range(runs)
        ]

    def _joined(self, memories: Sequence[_Memory]) -> _Memory:
        """The memory of the takes of all, one after another."""
        joined = self.backend.xp.concatenate
        return _Memory(
            joined([each.past for each in memories]),
            [
                [
                    tuple(
                        (
                            joined([each.states[i][k][layer][0] for each in memories]),
                            joined([each.states[i][k][layer][1] for each in memories]),
                        )
                        for layer in range(len(memories[0].states[i][k]))
                    )
                    for k in range(len(memories[0].states[i]))
                ]
                for i in range(len(memories[0].states))
            ],
        )

    def _stacked(self, arrays: Sequence[Array]) -> np.ndarray:
        """Arrays of each frame as one of all, in double precision."""
        return self.backend.numpy(self.backend.xp.stack(arrays)).astype(np.float64)

    def _checked(self, poses: np.ndarray) -> np.ndarray:
        """Standardised poses in SMPL order, metres. Raises WeightsError where they are not a
        body's.
        """
        known = self.network.normalisation
        poses = smpl_order(poses * known.pose_std + known.pose_mean)
        if not (np.abs(poses) < _FARTHEST).all():
            raise unusable(
                self.weights,
                "the poses they give are not numbers, or farther than 100 metres from the root",
            )
        return poses


def _log_density(frame: Frame) -> Array:
    """Log p (B,) of a standardised pose after those before it."""
    noise = frame.noise
    return frame.log_det - 0.5 * (noise * noise).sum(-1) - 0.5 * POSE_SIZE * _LOG_TURN
