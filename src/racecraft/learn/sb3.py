"""Settings of Stable-Baselines3's algorithms on our environments; `racecraft.learn.torch_sb3` trains with them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from racecraft.checks import check_number, check_whole

SB3_ALGORITHMS: Final = ("ppo", "a2c", "dqn", "sac", "td3")
DISCRETE_ONLY: Final = ("dqn",)
CONTINUOUS_ONLY: Final = ("sac", "td3")


@dataclass(frozen=True, kw_only=True)
class SB3Config:
    """What is not Stable-Baselines3's default; 0 leaves it as it is there."""

    num_envs: int = 8
    """Cars driven at once."""
    num_steps: int = 64
    """Steps of each car in one iteration."""
    learning_rate: float = 0.0
    """Adam's step size."""
    gamma: float = 0.98
    """Discount per step of 1/15 s."""
    batch_size: int = 0
    """Samples of one gradient step; A2C takes the whole rollout."""
    buffer_size: int = 30_000
    """Steps that DQN, SAC and TD3 remember, of 8 kB each with the default network."""
    learning_starts: int = 1_000
    """Steps before DQN, SAC and TD3 learn."""
    updates_per_step: float = 0.125
    """Gradient steps of DQN, SAC and TD3 for every step of a car."""

    def __post_init__(self) -> None:
        """Refuse what cannot work, naming the field."""
        for name, least in (
            ("num_envs", 1),
            ("num_steps", 1),
            ("batch_size", 0),
            ("buffer_size", 1),
            ("learning_starts", 1),
        ):
            check_whole(name, getattr(self, name), least, is_plain=True)
        for name, high in (("learning_rate", 1.0), ("gamma", 1.0), ("updates_per_step", 64.0)):
            check_number(name, getattr(self, name), 0.0, high, is_plain=True)
