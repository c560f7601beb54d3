"""What was learned: a table or networks, how it acts when it means it, and its numbers for a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from racecraft.classic.distributions import Categorical, Distribution, Gaussian
from racecraft.classic.network import Floats, Network
from racecraft.classic.worlds import count_actions
from racecraft.errors import ConfigError


class Policy(Protocol):
    """Decides what to do."""

    arrays: Mapping[str, NDArray[Any]]
    """All numbers that were learned, by name; written in place by `restore`."""

    def act(self, observations: NDArray[Any]) -> NDArray[Any]:
        """The best actions known for what is seen in N worlds (N, ...)."""
        ...


def restore(policy: Policy, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Give a policy the numbers of another.

    Raises:
        ConfigError: They are not of its kind.
    """
    shapes = {name: array.shape for name, array in policy.arrays.items()}
    given = {name: np.shape(array) for name, array in arrays.items()}
    if shapes != given:
        raise ConfigError(f"The saved policy holds {given}, and this one {shapes}: they do not fit.")
    if not all(np.isfinite(array).all() for array in arrays.values()):
        raise ConfigError("The saved policy holds numbers that are none.")
    for name, array in policy.arrays.items():
        array[...] = arrays[name]


class Table:
    """A value for each action in each cell.

    Attributes:
        values: (cells, actions).
    """

    def __init__(self, cells: int, actions: int, *, initial: float = 0.0) -> None:
        self.values = np.full((cells, actions), initial)
        self.arrays: Mapping[str, NDArray[Any]] = {"values": self.values}

    def act(self, observations: NDArray[Any]) -> NDArray[Any]:
        """The action of the highest value (N,)."""
        return np.asarray(np.argmax(self.values[observations], axis=1))


class Values:
    """A network that estimates the value of each action."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self.arrays: Mapping[str, NDArray[Any]] = {"network": network.parameters}

    def act(self, observations: NDArray[Any]) -> NDArray[Any]:
        """The action of the highest value (N,)."""
        return np.asarray(np.argmax(self.network(observations), axis=1))


class ActorCritic:
    """A network that decides, and one that estimates the return to come.

    Args:
        inputs: Numbers of an observation.
        space: Of the actions.
        hidden: Units of each hidden layer.
        rng: Draws the first weights.
    """

    def __init__(
        self, inputs: int, space: spaces.Space[Any], hidden: tuple[int, ...], rng: np.random.Generator
    ) -> None:
        self.distribution = distribution_of(space)
        self.actor = Network((inputs, *hidden, self.distribution.outputs), rng, gain=0.01)
        self.critic = Network((inputs, *hidden, 1), rng)
        self.arrays: Mapping[str, NDArray[Any]] = {"actor": self.actor.parameters, "critic": self.critic.parameters}

    def act(self, observations: NDArray[Any]) -> NDArray[Any]:
        """The likeliest actions (N, ...)."""
        return self.distribution.mode(self.actor(observations))

    def sample(self, observations: NDArray[Any], rng: np.random.Generator) -> NDArray[Any]:
        """Actions as likely as the policy finds them good (N, ...)."""
        return self.distribution.sample(self.actor(observations), rng)

    def value(self, observations: NDArray[Any]) -> Floats:
        """The return to come (...,) for observations (..., inputs)."""
        flat = observations.reshape(-1, observations.shape[-1])
        return self.critic(flat).reshape(observations.shape[:-1])


def distribution_of(space: spaces.Space[Any]) -> Distribution:
    """Of actions in a space."""
    n = count_actions(space)
    return Categorical(n) if isinstance(space, spaces.Discrete) else Gaussian(n)
