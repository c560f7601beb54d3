"""Parameters as one flat vector, as every backend keeps them: all arrays, in the order of `networks.weight_shapes`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import CheckpointError
from racecraft.learn import networks
from racecraft.learn.learner import NetworkSpec, Weights


def join_weights(weights: Weights, spec: NetworkSpec) -> NDArray[np.float32]:
    """The arrays one after the other, new  (P,).

    Raises:
        CheckpointError: Names or shapes differ from the network's, or numbers are not float32.
    """
    expected = networks.weight_shapes(spec)
    given = {name: tuple(array.shape) for name, array in weights.items()}
    if given != expected:
        different = sorted(name for name, _ in set(given.items()) ^ set(expected.items()))
        raise CheckpointError(
            f"The weights do not fit the network {spec.name}: {', '.join(dict.fromkeys(different))} "
            "are missing, superfluous or of another shape."
        )
    for name, array in weights.items():
        if array.dtype != np.float32:
            raise CheckpointError(f"The weights {name} are {array.dtype}; allowed is float32.")
    return np.concatenate([weights[name].ravel() for name in expected])


def split_weights(flat: NDArray[np.float32], spec: NetworkSpec) -> Weights:
    """Views of what `join_weights` gave  (P,), by name."""
    shapes = networks.weight_shapes(spec)
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes.values()])
    parts = np.split(flat, ends[:-1])
    return {name: part.reshape(shape) for (name, shape), part in zip(shapes.items(), parts, strict=True)}
