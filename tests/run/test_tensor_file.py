"""Files of arrays: what the library of the format reads back, and that nothing large is copied."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from safetensors import SafetensorError
from safetensors.numpy import load

from racecraft.run.tensor_file import is_storable, tensor_file

TYPES = ["?", "i1", "u1", "<i2", "<u2", "<f2", "<i4", "<u4", "<f4", "<i8", "<u8", "<f8"]


@given(
    st.dictionaries(
        st.text(max_size=8).filter(lambda name: name != "__metadata__"),
        st.sampled_from(TYPES).flatmap(lambda t: arrays(t, array_shapes(min_dims=0, max_dims=3, min_side=0))),
        max_size=5,
    )
)
@pytest.mark.costly
def test_the_library_reads_back_what_was_written(saved):
    read = load(b"".join(tensor_file(saved, {"about": "näive"})))
    assert set(read) == set(saved)
    for name, array in saved.items():
        assert (read[name].dtype, read[name].shape) == (array.dtype, array.shape)
        assert read[name].tobytes() == array.tobytes()


def test_arrays_of_another_order_of_bytes_or_with_gaps_are_stored_as_the_same_numbers():
    grid = np.arange(12, dtype=np.float32).reshape(3, 4)
    read = load(b"".join(tensor_file({"big": grid.astype(">f4"), "turned": grid.T, "every second": grid[:, ::2]}, {})))
    np.testing.assert_array_equal(read["big"], grid)
    np.testing.assert_array_equal(read["turned"], grid.T)
    np.testing.assert_array_equal(read["every second"], grid[:, ::2])


def test_every_array_begins_where_its_type_may():
    pieces = list(
        tensor_file({"a": np.zeros(3, np.uint8), "b": np.zeros(3, np.float64), "c": np.zeros(1, np.int16)}, {})
    )
    assert [piece.nbytes for piece in pieces[1:]] == [24, 2, 3]
    assert pieces[0].nbytes % 8 == 0


def test_large_arrays_are_not_copied():
    large = {f"weights {i}": np.ones(1 << 20, np.float32) for i in range(4)}
    tracemalloc.start()
    try:
        size = sum(piece.nbytes for piece in tensor_file(large, {"step": "1"}))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert size > 4 * large["weights 0"].nbytes
    assert peak < 100_000


@pytest.mark.parametrize(
    "array", [np.zeros(2, complex), np.array(["text"]), np.array([object()]), np.zeros(2, "M8[s]")]
)
def test_other_types_are_not_storable(array):
    assert not is_storable(array)


def test_a_file_that_ends_early_is_refused():
    data = b"".join(tensor_file({"a": np.zeros(8)}, {}))
    with pytest.raises(SafetensorError):
        load(data[:-1])
