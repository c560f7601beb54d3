from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecraft.sim.number_text import number_texts

EDGES = [
    *(0.0, -0.0, 1.0, -1.0, 0.1, 100.0, 1e15, 1e16, 123456789012345680.0, 9007199254740993.0, 9999999999999998.0),
    *(1e-4, 1e-5, 0.00012345, 1.5e-7, 5e-324, -5e-324, 1.7976931348623157e308, 2.2250738585072014e-308),
    *(math.inf, -math.inf, math.nan, 1e22, 1e23, 4.35, 0.3, 2 / 3, 1e100, -1e-100),
]


def test_edges_are_written_as_python_does() -> None:
    assert number_texts(EDGES) == [repr(value) for value in EDGES]
    assert number_texts([]) == []


@given(st.lists(st.floats()))
def test_any_number_is_written_as_python_does(values: list[float]) -> None:
    assert number_texts(values) == [repr(value) for value in values]


def test_any_bits_are_written_as_python_does() -> None:
    bits = np.random.default_rng(1).integers(0, 2**64, 20_000, dtype=np.uint64)
    values = [struct.unpack("<d", struct.pack("<Q", int(number)))[0] for number in bits]
    decimals = np.random.default_rng(2).integers(-(10**9), 10**9, 20_000) / 10.0 ** np.arange(20_000).__mod__(12)
    for numbers in (values, decimals.tolist()):
        assert number_texts(numbers) == [repr(number) for number in numbers]


def test_columns_of_a_table_are_taken() -> None:
    table = np.arange(12.0).reshape(4, 3)
    assert number_texts(table[:, 1]) == ["1.0", "4.0", "7.0", "10.0"]
    with pytest.raises(TypeError):
        number_texts(table)
