"""What a policy that is told by perception hangs on in a picture: Grad-CAM through both of them.

slope of an action ──policy──▶ of each number told ──bytes──▶ of perception's outputs ──its convolutions──▶ picture
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from racecraft.learn.networks import TOLD_SIDE
from racecraft.learn.saliency import (
    Saliency,
    cells_of,
    check_explained,
    forward,
    on_the_frame,
    pooled,
    slope_at,
    target_of,
)
from racecraft.perception.answers import NUM_OUTPUTS
from racecraft.perception.learner import BeliefLearner, byte_slopes, bytes_of
from racecraft.perception.mirror import mirrored_answers
from racecraft.perception.network import of_one_brightness


def grad_cam_of_beliefs(learner: BeliefLearner, frame: NDArray[np.uint8], *, target: int | None = None) -> Saliency:
    """Explain one output of a policy for one camera image, as `racecraft.learn.saliency.grad_cam` does.

    Args:
        learner: Holds the policy.
        frame: Camera image  (H, W).
        target: Which output; by default the largest one, of a continuous policy the steering.

    Raises:
        ConfigError: The policy sees through other sensors, too.
        ShapeError: The frame is not of the network's size.
    """
    spec, weights, looks = learner.spec, learner.weights(), learner.perceiver.network
    check_explained(spec, frame)
    sees, looking = looks.spec, looks.weights()
    pixels = of_one_brightness(pooled(sees, frame).astype(np.uint8)[None]).astype(np.float32) / np.float32(255.0)
    straight, turned = forward(sees, looking, pixels), forward(sees, looking, pixels[:, :, ::-1])
    outputs = np.float32(0.5) * (straight.outputs + mirrored_answers(turned.outputs[None])[0])[None]

    square = np.zeros(TOLD_SIDE**2, np.float32)
    square[:NUM_OUTPUTS] = bytes_of(outputs)[0] / np.float32(255.0)
    thought = forward(spec, weights, square.reshape(1, TOLD_SIDE, TOLD_SIDE))
    chosen = target_of(spec, thought.outputs) if target is None else target
    at_bytes = slope_at(spec, weights, thought, np.eye(len(thought.outputs), dtype=np.float32)[chosen], 0)
    slopes = at_bytes.ravel()[:NUM_OUTPUTS] / np.float32(255.0) * byte_slopes(outputs)[0]

    here = cells_of(straight, slope_at(sees, looking, straight, slopes, straight.shown))
    there = cells_of(turned, slope_at(sees, looking, turned, mirrored_answers(slopes[None])[0], turned.shown))
    cells = np.float32(0.5) * (here + there[:, ::-1])
    return Saliency(
        picture=on_the_frame(sees, cells, straight.shown),
        cells=cells,
        layer=f"conv{straight.shown}",
        outputs=thought.outputs,
        target=chosen,
    )
