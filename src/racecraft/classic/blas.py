"""One thread for NumPy's products of matrices.

They are small here: threads that wait for each other cost more than they save, on a busy machine many times the whole.
And a product's last bits depend on how many threads share it, so a run would repeat only where as many are free.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np  # noqa: F401  loaded first, as its library is looked for among those that are
from threadpoolctl import threadpool_limits


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """So within, in every library that is loaded by then; afterwards as before."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield
