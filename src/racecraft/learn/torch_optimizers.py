"""What torch's optimisers remember, as plain arrays for a checkpoint, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from racecraft.learn.learner import below

Optimizers = Mapping[str, torch.optim.Optimizer]


def optimizer_arrays(optimizers: Optimizers) -> dict[str, NDArray[Any]]:
    """Copies, as ``<optimiser>/<parameter's number>/<what>``."""
    return {
        f"{name}/{i}/{key}": np.array(value.detach().cpu().numpy())
        for name, optimizer in optimizers.items()
        for i, moments in optimizer.state_dict()["state"].items()
        for key, value in moments.items()
    }


def load_optimizers(optimizers: Optimizers, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Replace what `optimizer_arrays` gives; ValueError where it does not fit."""
    for name, optimizer in optimizers.items():
        found: dict[int, dict[str, torch.Tensor]] = {}
        for place, array in below(f"{name}/", arrays).items():
            i, key = place.split("/")
            found.setdefault(int(i), {})[key] = torch.from_numpy(np.array(array))
        optimizer.load_state_dict({**optimizer.state_dict(), "state": found})
