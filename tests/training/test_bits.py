"""The same seed trains the same weights to the bit, however many threads and whatever the instruction set."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from tiny_runs import Train, weights

from racecraft import _native

RUNS = [(isa, 1) for isa in _native.available_isas()] + [(_native.available_isas()[-1], threads) for threads in (2, 5)]


@pytest.fixture
def restored_isa() -> Iterator[None]:
    before = _native.isa()
    yield
    _native.set_isa(before)


@pytest.mark.costly
@pytest.mark.usefixtures("restored_isa")
@pytest.mark.parametrize("actions", ["default", "continuous"])
def test_a_training_ends_in_the_same_bits(tiny: Train, actions: str) -> None:
    ends = []
    for isa, num_threads in RUNS:
        _native.set_isa(isa)
        result = tiny(
            actions=actions, until="256 steps", evaluate_every=128, num_threads=num_threads, name=f"{isa}-{num_threads}"
        )
        ends.append({name: array for name, array in weights(result.run).items() if not name.startswith("trace/")})
    for (isa, num_threads), end in zip(RUNS, ends, strict=True):
        for name, array in end.items():
            np.testing.assert_array_equal(array, ends[0][name], err_msg=f"{name}, {isa}, {num_threads} threads")
    assert len(ends[0]["weights/policy.head.weight"]) == (10 if actions == "default" else 2)
