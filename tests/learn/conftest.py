from __future__ import annotations

import pytest
from late_torch import TorchLearner

from racecraft.learn import Learner, NetworkSpec, PPOConfig


@pytest.fixture
def config() -> PPOConfig:
    return PPOConfig(num_envs=16, num_steps=8, minibatch_size=64, update_epochs=2)


@pytest.fixture
def learner() -> Learner:
    return TorchLearner(NetworkSpec(num_actions=3, state_size=2), seed=1, num_threads=2)
