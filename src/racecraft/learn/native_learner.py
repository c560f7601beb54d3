"""The learner on the native core: the default on a CPU, and all that training needs.

Results are the same bits for any number of threads and on any machine with fused multiply-add.

    NetworkSpec ──networks──▶ _native.Learner: parameters, forward passes, gradient, Adam (native/src/learner.hpp)

Parameters cross the border as one flat vector as ``racecraft.learn.flat_weights`` joins them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft import _native
from racecraft.errors import CheckpointError, ConfigError, ShapeError
from racecraft.learn import networks
from racecraft.learn.flat_weights import join_weights, split_weights
from racecraft.learn.learner import Minibatch, NetworkSpec, Objective, UpdateStats, Weights, below

_NO_INDICES = np.zeros(0, np.int64)
_NO_ACTIONS = np.zeros((0, 0), np.float32)
_NO_STATES = np.zeros((0, 0), np.float32)


class NativeLearner:
    """A ``racecraft.learn.learner.Learner``.

    Args:
        spec: The network, any of ``racecraft.learn.networks``.
        seed: Decides the initial weights; None leaves them zero, for others to be loaded.
        num_threads: Threads for forward and backward passes; 0 takes every core the process may use.

    Raises:
        ConfigError: There is no such network, or it does not fit the camera's image.
    """

    def __init__(self, spec: NetworkSpec, *, seed: int | None = 0, num_threads: int = 0) -> None:
        self.spec = spec
        self.sight_shape: tuple[int, ...] = networks.sight_shape(spec)
        self.observation_shape: tuple[int, ...] = networks.observation_shape(spec)
        try:
            self._native = self._make(spec, num_threads)
        except ValueError as error:
            raise ConfigError(str(error)) from None
        if seed is not None:
            self.load_weights(networks.initial_weights(spec, seed=seed, orthonormalize=_native.orthonormalize))

    @property
    def core(self) -> _native.Learner | None:
        """What the core's loop trains by itself; None where it has to ask here, as frames are encoded outside of it."""
        return self._native

    def _make(self, spec: NetworkSpec, num_threads: int) -> _native.Learner:
        arch = networks.architecture_of(spec)
        height, width = networks.picture_shape(spec)
        return _native.Learner(
            height=height,
            width=width,
            top=networks.sky_rows(spec),
            pool=arch.pool,
            block=networks.block_size(spec),
            convs=[(conv.filters, conv.kernel, conv.stride) for conv in arch.convs],
            dense=list(arch.dense),
            num_actions=spec.num_actions,
            is_discrete=spec.is_discrete,
            state_size=spec.state_size,
            critic_units=list(networks.CRITIC_UNITS),
            lenses=spec.lenses,
            lidar_size=spec.lidar_size,
            lidar_units=list(arch.lidar),
            policy_units=[],
            num_threads=num_threads,
        )

    def encode(self, frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Pool and lay out what the sensors tell (N, *sight_shape) as (N, *observation_shape)."""
        networks.check_sight(self.spec, frames)
        sight = _flat(np.ascontiguousarray(frames))
        return self._native.encode(sight).reshape(len(frames), *self.observation_shape)

    def policy(self, observations: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Logits, or means and log standard deviations  (N, P)."""
        outputs: NDArray[np.float32] = self._native.policy(self._observations(observations), _NO_STATES)
        return outputs

    def values(self, observations: NDArray[np.uint8], states: NDArray[np.float32]) -> NDArray[np.float32]:
        """The critic's estimates  (N,)."""
        return self._native.values(
            self._observations(observations), self._column("states", states, (len(observations), self.spec.state_size))
        )

    def update(self, minibatch: Minibatch, objective: Objective) -> UpdateStats:
        """Take one gradient step; leave everything as it is when loss or gradient is not finite."""
        spec, size = self.spec, len(minibatch.advantages)
        rows = np.arange(size) if minibatch.rows is None else minibatch.rows
        rows = self._column("rows", rows, (len(rows),), np.int64)
        if len(rows) and not 0 <= rows.min() <= rows.max() < size:
            raise ShapeError(f"rows are from {rows.min()} to {rows.max()}, expected 0 to {size - 1}.")
        indices, actions = _NO_INDICES, _NO_ACTIONS
        if spec.is_discrete:
            indices = self._column("actions", minibatch.actions, (size,), np.int64)
            taken = indices[rows]
            if len(taken) and not 0 <= taken.min() <= taken.max() < spec.num_actions:
                raise ShapeError(
                    f"actions are indices from {taken.min()} to {taken.max()}, expected 0 to {spec.num_actions - 1}."
                )
        else:
            actions = self._column("actions", minibatch.actions, (size, spec.num_actions))
        terms = self._native.update(
            *self._sensed(minibatch, size),
            indices,
            actions,
            self._column("log_probs", minibatch.log_probs, (size,)),
            self._column("advantages", minibatch.advantages, (size,)),
            self._column("returns", minibatch.returns, (size,)),
            rows,
            native_objective(objective),
        )
        return UpdateStats.of(terms)

    def weights(self) -> Weights:
        """Copy of the parameters."""
        return self._read("weights")

    def load_weights(self, weights: Weights) -> None:
        """Replace the parameters; CheckpointError if names or shapes differ."""
        self._native.write("weights", join_weights(weights, self.spec))

    def optimizer_state(self) -> Weights:
        """Copy of Adam's moments, ``moment1/<weight>`` and ``moment2/<weight>``, and ``step`` (1,)."""
        state = {"step": np.array([self._native.num_updates], np.float32)}
        for moment in ("moment1", "moment2"):
            state |= {f"{moment}/{name}": array for name, array in self._read(moment).items()}
        return state

    def load_optimizer_state(self, state: Weights) -> None:
        """Replace what ``optimizer_state`` gives; CheckpointError if names or shapes differ."""
        flat = {moment: join_weights(below(f"{moment}/", state), self.spec) for moment in ("moment1", "moment2")}
        if "step" not in state:
            raise CheckpointError("The optimiser's state has no 'step'.")
        for moment, values in flat.items():
            self._native.write(moment, values)
        self._native.num_updates = int(state["step"][0])

    def _read(self, part: str) -> Weights:
        return split_weights(self._native.read(part), self.spec)

    def _sensed(self, minibatch: Minibatch, size: int) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """What the core is to see of a minibatch: bytes and states."""
        states = self._column("states", minibatch.states, (size, self.spec.state_size))
        return self._observations(minibatch.observations, size), states

    def _observations(self, observations: NDArray[np.uint8], size: int | None = None) -> NDArray[np.uint8]:
        shape = (len(observations) if size is None else size, *self.observation_shape)
        return _flat(self._column("observations", observations, shape, np.uint8))

    @staticmethod
    def _column(name: str, array: NDArray[Any], shape: tuple[int, ...], dtype: type = np.float32) -> NDArray[Any]:
        if array.shape != shape:
            raise ShapeError(f"{name} has shape {array.shape}, expected {shape}.")
        return np.ascontiguousarray(array, dtype)


def _flat(array: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Every row as plain bytes."""
    return array.reshape(len(array), int(np.prod(array.shape[1:])))


def native_objective(objective: Objective) -> _native.Objective:
    """The same for the core."""
    return _native.Objective(
        learning_rate=objective.learning_rate,
        clip_coef=objective.clip_coef,
        ent_coef=objective.ent_coef,
        vf_coef=objective.vf_coef,
        is_huber=objective.value_loss == "huber",
        max_grad_norm=objective.max_grad_norm,
        adam_eps=objective.adam_eps,
        is_eps_hat=objective.is_eps_hat,
    )
