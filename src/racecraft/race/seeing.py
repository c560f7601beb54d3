"""Any network's learner, and what it looks at: told by perception where the network sees nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from racecraft.learn import Learner, NetworkSpec, make_learner
from racecraft.learn.networks import PERCEPTION

if TYPE_CHECKING:
    from racecraft.learn.saliency import Saliency


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


def explain(learner: Learner, frame: NDArray[np.uint8], *, target: int | None = None) -> Saliency:
    """Explain one output of a policy for one camera image by Grad-CAM.

    Args:
        learner: Holds the policy.
        frame: Camera image  (H, W).
        target: Which output; by default the largest one, of a continuous policy the steering.

    Raises:
        ConfigError: The policy sees through other sensors, too.
        ShapeError: The frame is not of the network's size.
    """
    from racecraft.learn.saliency import grad_cam

    if learner.spec.name != PERCEPTION:
        return grad_cam(learner.spec, learner.weights(), frame, target=target)
    from racecraft.perception.learner import BeliefLearner
    from racecraft.perception.saliency import grad_cam_of_beliefs

    assert isinstance(learner, BeliefLearner)
    return grad_cam_of_beliefs(learner, frame, target=target)
