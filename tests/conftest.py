"""Property tests run without a clock: a busy machine is slow, not wrong. No test leaves other arithmetic behind."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("unhurried")


@pytest.fixture(autouse=True)
def _arithmetic_stays_as_it_was() -> Iterator[None]:
    yield
    assert np.float64(5e-324) * np.float64(1.0) != 0.0, "something left this thread without subnormal numbers"
