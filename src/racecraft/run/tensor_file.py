"""Safetensors files piece by piece: what is saved is not copied together first, as memory may be short for it.

    length of the header (u64) | header: JSON, padded with spaces | values of all arrays, wide types first

The format is https://huggingface.co/docs/safetensors; they are read by the library of that name.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

_TYPES: Final = {
    **{np.dtype(f"<f{size}"): f"F{8 * size}" for size in (2, 4, 8)},
    **{np.dtype(f"<i{size}"): f"I{8 * size}" for size in (1, 2, 4, 8)},
    **{np.dtype(f"<u{size}"): f"U{8 * size}" for size in (1, 2, 4, 8)},
    np.dtype(np.bool_): "BOOL",
}


def is_storable(array: NDArray[Any]) -> bool:
    """Whether the format has a name for the array's type: booleans, integers, floats up to 64 bits."""
    return array.dtype.newbyteorder("<") in _TYPES


def tensor_file(arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, str]) -> Iterator[memoryview]:
    """The bytes of a file that holds storable arrays and a few texts, in pieces that follow each other.

    Arrays that are contiguous and in the format's byte order are not copied.
    """
    order = sorted(arrays, key=lambda name: (-arrays[name].itemsize, name))  # so every array begins aligned
    header: dict[str, Any] = {"__metadata__": dict(metadata)}
    end = 0
    for name in order:
        array = arrays[name]
        begin, end = end, end + array.nbytes
        type_name = _TYPES[array.dtype.newbyteorder("<")]
        header[name] = {"dtype": type_name, "shape": list(array.shape), "data_offsets": [begin, end]}
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    yield memoryview(len(text).to_bytes(8, "little") + text)
    for name in order:
        array = np.asarray(arrays[name], dtype=arrays[name].dtype.newbyteorder("<"), order="C")
        if array.nbytes > 0:
            yield array.reshape(-1).view(np.uint8).data
