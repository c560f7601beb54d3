"""Property tests run without a clock: a busy machine is slow, not wrong. No test leaves other arithmetic behind.

Several tests run side by side (`make test`), so libraries that would take every core for a small product take one:
threads that wait for each other on cores they do not have cost many times what they save. Our own threads are as many
as a test asks for.
"""

import gc
import os
from collections.abc import Generator, Iterator

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before NumPy and torch; child processes inherit it
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("unhurried")


@pytest.fixture(autouse=True)
def _arithmetic_stays_as_it_was() -> Iterator[None]:
    yield
    assert np.float64(5e-324) * np.float64(1.0) != 0.0, "something left this thread without subnormal numbers"


@pytest.fixture(autouse=True, scope="session")
def _stable_baselines_logs_with_the_tests(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Not in a new folder of the system's temporary ones for every learner."""
    os.environ["SB3_LOGDIR"] = str(tmp_path_factory.mktemp("sb3"))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What is imported to collect tests lives as long as they do: looking through it for garbage costs seconds."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_make_parametrize_id(val: object) -> str | None:
    """No case is named by its bytes: what a compressor wrote holds the time, and two sides would differ."""
    return f"{len(val)}-bytes" if isinstance(val, bytes) and len(val) > 16 else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Side by side, files that take long come first, so that no side is left with one of them at the end."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        long = {item.path for item in items if item.get_closest_marker("slow")}
        items.sort(key=lambda item: (item.path.name != "test_cpp.py", item.path not in long))
