"""What a policy network's outputs mean: a choice, or numbers around a mean; and the gradients that learning needs."""

from __future__ import annotations

from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from racecraft.classic.network import Floats

Actions = NDArray[Any]
LOG_STD: Final = (-3.0, 1.0)
"""Between these the standard deviation of an action in -1 .. 1 is kept, as a logarithm."""


class Distribution(Protocol):
    """Of actions, given outputs (B, outputs) of a network."""

    outputs: int
    """That the network needs."""

    def sample(self, outputs: Floats, rng: np.random.Generator) -> Actions:
        """An action for each row."""
        ...

    def mode(self, outputs: Floats) -> Actions:
        """The likeliest action for each row."""
        ...

    def log_prob(self, outputs: Floats, actions: Actions) -> Floats:
        """Logarithm of how likely the actions are (B,)."""
        ...

    def log_prob_gradient(self, outputs: Floats, actions: Actions) -> Floats:
        """Of `log_prob` by the outputs (B, outputs)."""
        ...

    def entropy(self, outputs: Floats) -> Floats:
        """How undecided the policy is (B,), nats."""
        ...

    def entropy_gradient(self, outputs: Floats) -> Floats:
        """Of `entropy` by the outputs (B, outputs)."""
        ...


class Categorical:
    """One of n actions, with probabilities in the ratio of exp(output)."""

    def __init__(self, n: int) -> None:
        self.outputs = n

    def sample(self, outputs: Floats, rng: np.random.Generator) -> Actions:
        """Actions (B,): the Gumbel-max trick."""
        return np.asarray(np.argmax(outputs + rng.gumbel(size=outputs.shape), axis=1))

    def mode(self, outputs: Floats) -> Actions:
        """Actions (B,)."""
        return np.asarray(np.argmax(outputs, axis=1))

    def log_prob(self, outputs: Floats, actions: Actions) -> Floats:
        """(B,)."""
        return log_softmax(outputs)[np.arange(len(actions)), actions]

    def log_prob_gradient(self, outputs: Floats, actions: Actions) -> Floats:
        """The action's indicator less the probabilities."""
        gradient = -np.exp(log_softmax(outputs))
        gradient[np.arange(len(actions)), actions] += 1.0
        return gradient

    def entropy(self, outputs: Floats) -> Floats:
        """(B,)."""
        logs = log_softmax(outputs)
        return np.asarray(-(np.exp(logs) * logs).sum(axis=1))

    def entropy_gradient(self, outputs: Floats) -> Floats:
        """-p (log p + entropy)."""
        logs = log_softmax(outputs)
        p = np.exp(logs)
        return np.asarray(-p * (logs - (p * logs).sum(axis=1, keepdims=True)))


def log_softmax(outputs: Floats) -> Floats:
    """Logarithms of probabilities (B, n)."""
    shifted = outputs - outputs.max(axis=1, keepdims=True)
    return np.asarray(shifted - np.log(np.exp(shifted).sum(axis=1, keepdims=True)))


class Gaussian:
    """Numbers, each normal and independent: outputs are the means, then the logarithms of the standard deviations."""

    def __init__(self, n: int) -> None:
        self.outputs = 2 * n
        self._n = n

    def _split(self, outputs: Floats) -> tuple[Floats, Floats]:
        return outputs[:, : self._n], np.clip(outputs[:, self._n :], *LOG_STD)

    def sample(self, outputs: Floats, rng: np.random.Generator) -> Actions:
        """Actions (B, n)."""
        mean, log_std = self._split(outputs)
        noise = rng.standard_normal(mean.shape, np.float32)
        return mean + np.exp(log_std) * noise

    def mode(self, outputs: Floats) -> Actions:
        """The means (B, n)."""
        return outputs[:, : self._n]

    def log_prob(self, outputs: Floats, actions: Actions) -> Floats:
        """(B,)."""
        mean, log_std = self._split(outputs)
        z = (actions - mean) * np.exp(-log_std)
        return np.asarray((-0.5 * z * z - log_std - 0.5 * np.log(2.0 * np.pi)).sum(axis=1))

    def log_prob_gradient(self, outputs: Floats, actions: Actions) -> Floats:
        """By the mean z / std; by the logarithm of the standard deviation z² - 1."""
        mean, log_std = self._split(outputs)
        z = (actions - mean) * np.exp(-log_std)
        return np.hstack([z * np.exp(-log_std), (z * z - 1.0) * self._is_free(outputs)])

    def entropy(self, outputs: Floats) -> Floats:
        """(B,)."""
        return np.asarray((self._split(outputs)[1] + 0.5 * np.log(2.0 * np.pi * np.e)).sum(axis=1))

    def entropy_gradient(self, outputs: Floats) -> Floats:
        """1 for every logarithm of a standard deviation."""
        return np.hstack([np.zeros_like(outputs[:, : self._n]), 1.0 * self._is_free(outputs)])

    def _is_free(self, outputs: Floats) -> Floats:
        """Where the standard deviation is not held by its bounds."""
        raw = outputs[:, self._n :]
        return ((raw > LOG_STD[0]) & (raw < LOG_STD[1])).astype(outputs.dtype)
