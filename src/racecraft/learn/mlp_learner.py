"""A learner without a camera: two small perceptrons over the simulator's state, in NumPy, for teachers.

Everything a `racecraft.learn.learner.Learner` does, so PPO trains it as it trains the others; its observations are the
states themselves. With 64 units a matrix library is as fast here as anything else would be.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import CheckpointError
from racecraft.learn.distributions import LOG_STD_MAX, LOG_STD_MIN
from racecraft.learn.learner import Minibatch, NetworkSpec, Objective, UpdateStats, Weights
from racecraft.learn.native_distributions import normals

UNITS = (64, 64)
"""Hidden layers (tanh) of both towers."""
BEGINNERS_LOG_STD = -1.0
_BETA1, _BETA2 = 0.9, 0.999


class MlpLearner:
    """A `racecraft.learn.learner.Learner` whose observations are float states (N, S).

    Args:
        spec: Number and kind of actions, and ``state_size``; its camera network means nothing here.
        seed: Decides the initial weights.
    """

    observation_dtype = np.float32

    def __init__(self, spec: NetworkSpec, *, seed: int = 0) -> None:
        self.spec = spec
        self.observation_shape: tuple[int, ...] = (spec.state_size,)
        rng = np.random.default_rng([seed, 0x6D6C70])
        self._weights: Weights = {}
        for tower, outputs, gain in (("policy", spec.num_actions, 0.01), ("critic", 1, 1.0)):
            sizes = (spec.state_size, *UNITS, outputs)
            for i, (inputs, units) in enumerate(pairwise(sizes), 1):
                scale = (gain if i == len(sizes) - 1 else 1.0) / inputs**0.5
                drawn = normals(rng, 2 * (-(-units * inputs // 2)))[: units * inputs].reshape(inputs, units)
                self._weights[f"{tower}.{i}.weight"] = (scale * drawn).astype(np.float32)
                self._weights[f"{tower}.{i}.bias"] = np.zeros(units, np.float32)
        if not spec.is_discrete:
            self._weights["policy.log_std"] = np.full(spec.num_actions, BEGINNERS_LOG_STD, np.float32)
        self._moments = {name: (np.zeros_like(a), np.zeros_like(a)) for name, a in self._weights.items()}
        self._num_updates = 0

    def encode(self, frames: NDArray[Any]) -> NDArray[Any]:
        """The states as they are, a copy."""
        return np.array(frames, np.float32)

    def policy(self, observations: NDArray[Any]) -> NDArray[np.float32]:
        """Logits, or means and log standard deviations  (N, P)."""
        outputs = self._forward("policy", observations)[-1]
        if self.spec.is_discrete:
            return outputs
        return np.concatenate([outputs, np.broadcast_to(self._weights["policy.log_std"], outputs.shape)], axis=1)

    def values(self, observations: NDArray[Any], states: NDArray[np.float32]) -> NDArray[np.float32]:
        """The critic's estimates  (N,)."""
        return self._forward("critic", observations)[-1][:, 0]

    def update(self, minibatch: Minibatch, objective: Objective) -> UpdateStats:
        """Take one gradient step; leave everything as it is when loss or gradient is not finite."""
        stats, gradient = self.gradient(minibatch, objective)
        if not stats.is_finite:
            return stats
        clip = objective.max_grad_norm
        scale = clip / stats.grad_norm if 0 < clip < stats.grad_norm else 1.0
        self._num_updates += 1
        correction1, correction2 = 1 - _BETA1**self._num_updates, 1 - _BETA2**self._num_updates
        for name, slope in gradient.items():
            first, second = self._moments[name]
            first += (1 - _BETA1) * (scale * slope - first)
            second += (1 - _BETA2) * (np.square(scale * slope) - second)
            step = first / (np.sqrt(second / correction2) + objective.adam_eps)
            self._weights[name] -= np.asarray(objective.learning_rate / correction1 * step, np.float32)
        return stats

    def gradient(self, minibatch: Minibatch, objective: Objective) -> tuple[UpdateStats, Weights]:
        """The clipped PPO loss and its gradient, by name."""
        rows = np.arange(len(minibatch.advantages)) if minibatch.rows is None else minibatch.rows
        size = len(rows)
        observations: NDArray[Any] = minibatch.observations[rows]
        advantages, returns = minibatch.advantages[rows].astype(float), minibatch.returns[rows].astype(float)
        actions = minibatch.actions[rows]
        hidden = self._forward("policy", observations)
        log_probs, entropy, by_log_prob, by_entropy = self._distribution(hidden[-1].astype(float), actions)
        log_ratio = log_probs - minibatch.log_probs[rows]
        with np.errstate(over="ignore", invalid="ignore"):
            ratio = np.exp(log_ratio)
            free = -advantages * ratio
            clipped = -advantages * ratio.clip(1 - objective.clip_coef, 1 + objective.clip_coef)
        slope = np.where(free < clipped, 0.0, free) / size  # d ratio / d log_prob = ratio
        by_outputs = slope[:, None] * by_log_prob - objective.ent_coef / size * by_entropy
        judged = self._forward("critic", observations)
        error = judged[-1][:, 0] - returns
        is_linear = (np.abs(error) > 1) & (objective.value_loss == "huber")
        value_loss = np.where(is_linear, np.abs(error) - 0.5, 0.5 * error**2)
        by_value = objective.vf_coef / size * np.where(is_linear, np.sign(error), error)
        gradient = self._backward("policy", observations, hidden, by_outputs[:, : self.spec.num_actions])
        gradient |= self._backward("critic", observations, judged, by_value[:, None])
        if not self.spec.is_discrete:
            gradient["policy.log_std"] = by_outputs[:, self.spec.num_actions :].sum(0).astype(np.float32)
        norm = float(np.sqrt(sum(float(np.square(slope, dtype=float).sum()) for slope in gradient.values())))
        stats = UpdateStats(
            policy_loss=float(np.maximum(free, clipped).mean()),
            value_loss=float(value_loss.mean()),
            entropy=float(entropy.mean()),
            approx_kl=float(((ratio - 1) - log_ratio).mean()),
            clip_fraction=float((np.abs(ratio - 1) > objective.clip_coef).mean()),
            grad_norm=norm,
        )
        return stats, gradient

    def weights(self) -> Weights:
        """Copy of the parameters."""
        return {name: array.copy() for name, array in self._weights.items()}

    def load_weights(self, weights: Weights) -> None:
        """Replace the parameters; CheckpointError if names or shapes differ."""
        self._check(weights)
        self._weights = {name: np.array(weights[name], np.float32) for name in self._weights}

    def optimizer_state(self) -> Weights:
        """Copy of Adam's moments, ``moment1/<weight>`` and ``moment2/<weight>``, and ``step`` (1,)."""
        state = {"step": np.array([self._num_updates], np.float32)}
        for i, moment in enumerate(("moment1", "moment2")):
            state |= {f"{moment}/{name}": pair[i].copy() for name, pair in self._moments.items()}
        return state

    def load_optimizer_state(self, state: Weights) -> None:
        """Replace what ``optimizer_state`` gives; CheckpointError if names or shapes differ."""
        parts = []
        for moment in ("moment1", "moment2"):
            prefix = f"{moment}/"
            parts.append({name.removeprefix(prefix): a for name, a in state.items() if name.startswith(prefix)})
            self._check(parts[-1])
        if "step" not in state:
            raise CheckpointError("The optimiser's state has no 'step'.")
        self._moments = {name: (parts[0][name].copy(), parts[1][name].copy()) for name in self._weights}
        self._num_updates = int(state["step"][0])

    def _check(self, weights: Weights) -> None:
        expected, given = ({n: a.shape for n, a in arrays.items()} for arrays in (self._weights, weights))
        if expected != given:
            raise CheckpointError("The weights are not of this teacher's network.")

    def _forward(self, tower: str, observations: NDArray[Any]) -> list[NDArray[np.float32]]:
        """The outputs of every layer, the head's last."""
        outputs = []
        x: NDArray[np.float32] = observations
        for i in range(1, len(UNITS) + 2):
            x = x @ self._weights[f"{tower}.{i}.weight"] + self._weights[f"{tower}.{i}.bias"]
            if i <= len(UNITS):
                x = np.tanh(x)
            outputs.append(x)
        return outputs

    def _backward(
        self, tower: str, observations: NDArray[Any], outputs: list[NDArray[np.float32]], slope: NDArray[Any]
    ) -> Weights:
        gradient: Weights = {}
        slope = slope.astype(np.float32)
        for i in range(len(UNITS) + 1, 0, -1):
            inputs = observations if i == 1 else outputs[i - 2]
            gradient[f"{tower}.{i}.weight"] = np.asarray(inputs.T @ slope, dtype=np.float32)
            gradient[f"{tower}.{i}.bias"] = slope.sum(0)
            if i > 1:
                slope = (slope @ self._weights[f"{tower}.{i}.weight"].T) * (1 - inputs**2)
        return gradient

    def _distribution(
        self, outputs: NDArray[np.float64], actions: NDArray[Any]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Log-probabilities and entropies (B,), and their slopes by logits, or by means and log deviations (B, P)."""
        if self.spec.is_discrete:
            logs = outputs - outputs.max(1, keepdims=True)
            logs -= np.log(np.exp(logs).sum(1, keepdims=True))
            probs = np.exp(logs)
            entropy = -(probs * logs).sum(1)
            chosen = np.eye(self.spec.num_actions)[actions]
            return (chosen * logs).sum(1), entropy, chosen - probs, -probs * (logs + entropy[:, None])
        raw = np.broadcast_to(self._weights["policy.log_std"].astype(float), outputs.shape)
        log_std = raw.clip(LOG_STD_MIN, LOG_STD_MAX)
        z = (actions - outputs) * np.exp(-log_std)
        log_probs = (-0.5 * z**2 - log_std - 0.9189385332046727).sum(1)
        is_free = (raw == log_std).astype(float)
        by_log_prob = np.concatenate([z * np.exp(-log_std), (z**2 - 1) * is_free], axis=1)
        by_entropy = np.concatenate([np.zeros_like(z), is_free], axis=1)
        return log_probs, (log_std + 1.4189385332046727).sum(1), by_log_prob, by_entropy
