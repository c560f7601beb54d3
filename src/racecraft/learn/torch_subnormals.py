"""Arithmetic without subnormal numbers, and only where it is asked for.

Adam's moments of dead units decay into subnormal numbers, which cost ten to a hundred times as much. The switch
belongs to the whole thread, so whoever throws it and leaves it changes the results of the simulator, NumPy and the
user's own code.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import torch


@contextmanager
def subnormals_flushed() -> Iterator[None]:
    """Count subnormal numbers as zero in this thread, until the block (or the decorated function) ends."""
    before = bool(np.float64(5e-324) * np.float64(1.0) == 0.0)  # torch tells nobody how the switch stands
    torch.set_flush_denormal(True)
    try:
        yield
    finally:
        torch.set_flush_denormal(before)
