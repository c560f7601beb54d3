"""What it costs to answer wrongly, and how that slopes at each answer."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.answers import (
    ERRORS,
    IN_SIGHT,
    LOG_LIMITS,
    MIDDLES,
    NUM_CONTINUOUS,
    NUM_TARGETS,
    PLACES,
    POSE,
)

Floats = NDArray[np.float32]

ROUND_OFF: Final = 0.02
"""In units of the network: errors below it count by their square, those above it as they are."""
ERROR_RATE: Final = 0.1
"""Weight of learning how far off answers are, beside the answers themselves."""
YES_OR_NO: Final = 0.15
"""Weight of each answer that is yes or no."""
WEIGHTS: Final = np.ones(NUM_CONTINUOUS, np.float32)
"""Of the continuous answers: how the lens stands on the road matters most."""
WEIGHTS[POSE] = 3.0
WEIGHTS[PLACES["closeness"]] = 2.0


def slopes_of(outputs: Floats, targets: Floats) -> tuple[Floats, float]:
    """The loss's derivative at each output (B, NUM_OUTPUTS), and the mean of what wrong answers cost.

    Continuous answers have a rounded absolute error; what is expected of it has the likelihood of Laplace's
    distribution around the answer, which does not move the answer itself. Columns out of the picture do not count.
    """
    slopes = np.zeros_like(outputs)
    told, wanted = outputs[:, :NUM_CONTINUOUS], targets[:, :NUM_CONTINUOUS]
    weights = np.broadcast_to(WEIGHTS, told.shape).copy()
    weights[:, MIDDLES] *= targets[:, IN_SIGHT]
    error = told - wanted
    rounded = np.sqrt(error * error + np.float32(ROUND_OFF**2))
    slopes[:, :NUM_CONTINUOUS] = weights * error / rounded
    loss = float((weights * (rounded - np.float32(ROUND_OFF))).sum(axis=1).mean())

    logs = outputs[:, ERRORS]
    sizes = np.abs(error) * np.exp(-logs.clip(*LOG_LIMITS))
    counts = np.float32(ERROR_RATE) * (weights > 0.0)
    # beyond the limits only the way back
    slope = counts * (1.0 - sizes)
    slope[(logs < LOG_LIMITS[0]) & (slope > 0.0) | (logs > LOG_LIMITS[1]) & (slope < 0.0)] = 0.0
    slopes[:, ERRORS] = slope.clip(-1.0, 1.0)

    logits, is_so = outputs[:, NUM_CONTINUOUS:NUM_TARGETS], targets[:, NUM_CONTINUOUS:]
    yes = 1.0 / (1.0 + np.exp(-logits.clip(-30.0, 30.0)))
    slopes[:, NUM_CONTINUOUS:NUM_TARGETS] = YES_OR_NO * (yes - is_so)
    loss += YES_OR_NO * float(np.logaddexp(0.0, np.where(is_so > 0.5, -logits, logits)).sum(axis=1).mean())
    return slopes, loss
