"""A network of the native core that learns anything: whoever trains it says how the loss slopes at its outputs.

frames ──encode──▶ observations ──policy──▶ outputs ──(a loss)──▶ slopes ──descend──▶ new weights
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ShapeError
from racecraft.learn.learner import NetworkSpec, Objective
from racecraft.learn.native_learner import NativeLearner, native_objective


class NativeRegressor(NativeLearner):
    """A ``NativeLearner`` whose policy's outputs are any numbers; its critic, the smallest there is, learns nothing.

    Args:
        name: The network, one of ``racecraft.learn.networks``.
        num_outputs: Numbers told of a frame, P.
        seed: Decides the initial weights; None leaves them zero, for others to be loaded.
        num_threads: 0 takes every core the process may use. Results are the same for any number.
    """

    def __init__(self, name: str, num_outputs: int, *, seed: int | None = 0, num_threads: int = 0) -> None:
        spec = NetworkSpec(name=name, num_actions=num_outputs, state_size=1)
        super().__init__(spec, seed=seed, num_threads=num_threads)

    def descend(
        self,
        observations: NDArray[np.uint8],
        slopes: NDArray[np.float32],
        *,
        learning_rate: float,
        max_grad_norm: float = 0.0,
    ) -> float:
        """One step of Adam on the mean of the samples' losses.

        Args:
            observations: As `encode` gives them  (B, *observation_shape).
            slopes: Derivatives of each sample's loss at the outputs that `policy` gives now  (B, P).
            learning_rate: Adam's step size.
            max_grad_norm: Norm above which the gradient is scaled down; 0 leaves it alone.

        Returns:
            The gradient's norm; where it is not finite, nothing has changed.

        Raises:
            ShapeError: An array has another shape.
        """
        if slopes.shape != (len(observations), self.spec.num_actions):
            expected = (len(observations), self.spec.num_actions)
            raise ShapeError(f"slopes have shape {slopes.shape}, expected {expected}.")
        objective = Objective(
            learning_rate=learning_rate,
            clip_coef=0.0,
            ent_coef=0.0,
            vf_coef=0.0,
            value_loss="mse",
            max_grad_norm=max_grad_norm,
        )
        flat = self._observations(observations)
        return float(self._native.descend(flat, np.ascontiguousarray(slopes, np.float32), native_objective(objective)))
