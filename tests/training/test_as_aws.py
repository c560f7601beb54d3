"""A training with AWS's hyperparameters and AWS's critic begins as one of AWS's does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft import train
from racecraft.agent import Hyperparameters
from racecraft.learn.networks import glorot_weights, initial_weights
from racecraft.race.policy import NetworkPolicy
from racecraft.training import SilentReporter


class Begun(Exception):
    pass


class First(SilentReporter):
    """Stops before the first step, with the policy."""

    def begin(self, simulation: Any, policy: NetworkPolicy) -> None:
        raise Begun(policy)


@pytest.mark.parametrize(("critic", "kind"), [("camera", glorot_weights), ("privileged", initial_weights)])
def test_the_network_begins_with_awss_weights(critic: str, kind: Any, tmp_path: Path) -> None:
    Hyperparameters(num_episodes_between_training=2).save(tmp_path / "h.json")
    with pytest.raises(Begun) as begun:
        train(
            "oval",
            hyperparameters=tmp_path / "h.json",
            critic=critic,
            network="RACECRAFT_SMALL",
            seed=5,
            num_threads=1,
            reporter=First(),
            root=tmp_path,
        )
    learner = begun.value.args[0].learner
    name = "policy.conv1.weight"
    np.testing.assert_allclose(learner.weights()[name], kind(learner.spec, seed=5)[name], rtol=1e-5)
