"""A multilayer perceptron with its gradient by hand, and Adam.

    hidden = f(x W + b),   output = hidden W + b

All weights lie in one flat vector of which every layer's are views, so that an optimiser's step, a copy to a target
network or to another process is one operation on one array: for networks this small, calls cost more than arithmetic.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[Any]  # floating, of one type in a network

HIDDEN_GAIN: Final = {"tanh": 5.0 / 3.0, "relu": np.sqrt(2.0)}
"""Keeps the size of signals from layer to layer (He et al. 2015; 5/3 as torch.nn.init.calculate_gain has it)."""


class Network:
    """Layers of weights, the last one linear.

    Args:
        sizes: Inputs, hidden units of each layer, outputs.
        rng: Draws the first weights.
        activation: Of the hidden layers.
        gain: Of the last layer's first weights; 0.01 lets a policy begin undecided.
        dtype: Of all numbers.
    """

    def __init__(
        self,
        sizes: Sequence[int],
        rng: np.random.Generator,
        *,
        activation: Literal["tanh", "relu"] = "tanh",
        gain: float = 1.0,
        dtype: type[np.floating[Any]] = np.float32,
    ) -> None:
        self.activation = activation
        pairs = list(pairwise(sizes))
        self.parameters: Floats = np.zeros(sum(n * m + m for n, m in pairs), dtype)
        """All weights and biases, flat."""
        self.layers = split(self.parameters, pairs)
        """Weights (inputs, outputs) and bias (outputs,) of every layer: views of the parameters."""
        for number, (weights, _) in enumerate(self.layers):
            is_last = number == len(self.layers) - 1
            weights[:] = orthogonal(rng, weights.shape) * (gain if is_last else HIDDEN_GAIN[activation])
        self._gradient = np.zeros_like(self.parameters)
        self._gradients = split(self._gradient, pairs)
        self._inputs: list[Floats] = []

    def __call__(self, x: Floats) -> Floats:
        """Outputs (B, outputs) for inputs (B, inputs), remembered for `gradient`."""
        self._inputs = [x]
        for weights, bias in self.layers[:-1]:
            x = x @ weights
            x += bias
            x = np.tanh(x, out=x) if self.activation == "tanh" else np.maximum(x, 0.0, out=x)
            self._inputs.append(x)
        weights, bias = self.layers[-1]
        return x @ weights + bias

    def gradient(self, of_outputs: Floats) -> Floats:
        """Back-propagation through the last call.

        Args:
            of_outputs: Of the loss by the outputs (B, outputs).

        Returns:
            Of the loss by the parameters, flat; the next call overwrites it.
        """
        self._backward(of_outputs, with_inputs=False)
        return self._gradient

    def input_gradient(self, of_outputs: Floats) -> Floats:
        """The same by the inputs (B, inputs)."""
        return self._backward(of_outputs, with_inputs=True)

    def _backward(self, upstream: Floats, *, with_inputs: bool) -> Floats:
        for number in reversed(range(len(self.layers))):
            x = self._inputs[number]
            of_weights, of_bias = self._gradients[number]
            if not with_inputs:
                np.matmul(x.T, upstream, out=of_weights)
                np.add.reduce(upstream, axis=0, out=of_bias)
                if number == 0:
                    break
            upstream = upstream @ self.layers[number][0].T
            if number > 0:  # x is what the activation gave: tanh' = 1 - tanh², relu' = relu > 0
                upstream *= 1.0 - x * x if self.activation == "tanh" else x > 0.0
        return upstream


def split(flat: Floats, pairs: Sequence[tuple[int, int]]) -> list[tuple[Floats, Floats]]:
    """Views of a flat vector as weights and bias of every layer."""
    layers, place = [], 0
    for n, m in pairs:
        layers.append((flat[place : place + n * m].reshape(n, m), flat[place + n * m : place + n * m + m]))
        place += n * m + m
    return layers


def orthogonal(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """A random matrix whose rows or columns are orthonormal (Saxe et al. 2014)."""
    n, m = shape
    q, r = np.linalg.qr(rng.standard_normal((max(n, m), min(n, m))))
    q *= np.sign(np.diag(r))
    return q if n >= m else q.T


class Adam:
    """Kingma and Ba 2015: steps of a size that the gradient's recent mean and spread agree on.

    Args:
        parameters: Changed in place.
        learning_rate: Of a step.
        max_norm: The gradient is scaled down to this length; 0 leaves it as it is.
    """

    def __init__(self, parameters: Floats, learning_rate: float, *, max_norm: float = 0.0) -> None:
        self.parameters, self.learning_rate, self.max_norm = parameters, learning_rate, max_norm
        self._mean = np.zeros_like(parameters)
        self._square = np.zeros_like(parameters)
        self._steps = 0

    def step(self, gradient: Floats) -> None:
        """Go against the gradient (flat)."""
        if self.max_norm:
            length = float(np.sqrt(gradient @ gradient))
            if length > self.max_norm:
                gradient = gradient * (self.max_norm / length)
        self._steps += 1
        self._mean += 0.1 * (gradient - self._mean)
        self._square += 0.001 * (gradient * gradient - self._square)
        unbiased = np.sqrt(1.0 - 0.999**self._steps) / (1.0 - 0.9**self._steps)
        self.parameters -= self.learning_rate * unbiased * self._mean / (np.sqrt(self._square) + 1e-8)
