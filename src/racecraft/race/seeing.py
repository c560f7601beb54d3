"""The learner of any network: told by perception where the network sees nothing else."""

from __future__ import annotations

from typing import Any

from racecraft.learn import Learner, NetworkSpec, make_learner
from racecraft.learn.networks import PERCEPTION


def learner_of(spec: NetworkSpec, **settings: Any) -> Learner:
    """What `racecraft.learn.make_learner` makes of the same arguments.

    Raises:
        ConfigError: As of it, or a network told by perception looks through two lenses.
        CheckpointError: The weights of perception cannot be read.
    """
    if spec.name != PERCEPTION:
        return make_learner(spec, **settings)
    from racecraft.perception.learner import BeliefLearner  # reads its weights

    return make_learner(spec, native=BeliefLearner, **settings)
