"""A toy world: a bright stripe in the camera image is to be steered to the middle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class StripeWorld:
    """Cars that see a stripe at their offset. Actions: left, stay, right (or a velocity in [-1, 1]).

    The reward is 1 in the middle and falls to 0 at the border; beyond it the episode is terminated, and after
    `time_limit` steps it is truncated.
    """

    def __init__(self, num_envs: int, *, seed: int = 0, time_limit: int = 40) -> None:
        self.num_envs = num_envs
        self.time_limit = time_limit
        self.resets = 0
        self._rng = np.random.default_rng(seed)
        self._offset = np.zeros(num_envs)
        self._age = np.zeros(num_envs, int)
        self.reset(np.ones(num_envs, bool))

    def observe(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        columns = np.rint(80 + 70 * self._offset.clip(-1, 1)).astype(int)[:, None, None]
        frames = np.where(abs(np.arange(160) - columns) < 8, 220, 30).astype(np.uint8)
        frames = np.broadcast_to(frames, (self.num_envs, 120, 160))
        return frames, np.stack([self._offset, abs(self._offset)], 1).astype(np.float32)

    def step(self, actions):
        velocity = actions[:, 0] if actions.ndim == 2 else actions - 1.0
        rewards = 1 - abs(self._offset)
        self._offset = self._offset + 0.15 * velocity + self._rng.normal(0, 0.02, self.num_envs)
        self._age += 1
        return rewards, abs(self._offset) > 1, self._age >= self.time_limit

    def reset(self, mask) -> None:
        assert mask.any()
        self.resets += int(mask.sum())
        self._offset = np.where(mask, self._rng.uniform(-0.9, 0.9, self.num_envs), self._offset)
        self._age = np.where(mask, 0, self._age)
