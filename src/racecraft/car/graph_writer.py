"""Frozen TensorFlow graphs written without TensorFlow: nodes, their attributes, and the numbers of constants.

Field numbers are those of ``graph.proto``, ``node_def.proto``, ``attr_value.proto``, ``tensor.proto`` and
``tensor_shape.proto`` of TensorFlow; `racecraft.importing.frozen_graph` reads the same. Every attribute of an operation
is written, also where TensorFlow has a default for it, as other readers have none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.importing.protobuf import bytes_field, number_field, varint

DT_FLOAT: Final = 1
DT_INT32: Final = 3
_KINDS: Final = {"f": (DT_FLOAT, "<f4"), "i": (DT_INT32, "<i4")}
PRODUCER: Final = 38
"""Version of the graphs' form that TensorFlow 1.12 to 1.15 write and every later one reads."""
_FLOATS: Final = number_field(6, DT_FLOAT)  # AttrValue.type
_INTS: Final = number_field(6, DT_INT32)
_NO: Final = number_field(5, 0)  # AttrValue.b


class GraphWriter:
    """A graph that grows node by node; each method returns the name of the node that it adds."""

    def __init__(self) -> None:
        self._nodes: list[bytes] = []

    def finish(self) -> bytes:
        """The graph as the content of a ``.pb`` file."""
        return b"".join([*(bytes_field(1, node) for node in self._nodes), bytes_field(4, number_field(1, PRODUCER))])

    def placeholder(self, name: str, shape: Sequence[int]) -> str:
        """An input of float32; a size of -1 is any."""
        return self._node(name, "Placeholder", dtype=_FLOATS, shape=bytes_field(7, _shape(shape)))

    def constant(self, name: str, values: ArrayLike) -> str:
        """Numbers: float32 or int32, as they are given."""
        array = np.asarray(values)
        kind, form = _KINDS[array.dtype.kind]
        content = bytes_field(4, array.astype(form, copy=False).tobytes())
        tensor = b"".join([number_field(1, kind), bytes_field(2, _shape(array.shape)), content])
        return self._node(name, "Const", dtype=number_field(6, kind), value=bytes_field(8, tensor))

    def variable(self, name: str, values: NDArray[np.float32]) -> str:
        """A weight as freezing leaves it: a constant, and what reads it."""
        return self.apply(f"{name}/read", "Identity", self.constant(name, values))

    def apply(self, name: str, operation: str, *inputs: str) -> str:
        """An operation on floats that has no settings, such as Add, Floor, Maximum, Relu, Sign, Softmax or Tanh."""
        return self._node(name, operation, *inputs, T=_FLOATS)

    def convolution(self, name: str, image: str, kernel: str, *, stride: int) -> str:
        """A convolution without padding: image (N, H, W, C), kernel (rows, columns, C, filters)."""
        settings = {"strides": _list(1, stride, stride, 1), "dilations": _list(1, 1, 1, 1), "padding": _text("VALID")}
        settings |= {"data_format": _text("NHWC"), "explicit_paddings": _list(), "use_cudnn_on_gpu": number_field(5, 1)}
        return self._node(name, "Conv2D", image, kernel, T=_FLOATS, **settings)

    def pool(self, name: str, image: str, *, side: int) -> str:
        """The mean of each square of an image (N, H, W, C)."""
        settings = {"ksize": _list(1, side, side, 1), "strides": _list(1, side, side, 1), "padding": _text("VALID")}
        return self._node(name, "AvgPool", image, T=_FLOATS, data_format=_text("NHWC"), **settings)

    def below(self, name: str, image: str, *, row: int) -> str:
        """An image (N, H, W, C) without its rows above this one."""
        begin, end, step = (
            self.constant(f"{name}/{part}", np.array(values, np.int32))
            for part, values in (("begin", [0, row, 0, 0]), ("end", [0, 0, 0, 0]), ("strides", [1, 1, 1, 1]))
        )
        masks = {
            "begin_mask": 0b1101,
            "end_mask": 0b1111,
            "ellipsis_mask": 0,
            "new_axis_mask": 0,
            "shrink_axis_mask": 0,
        }
        numbers = {mask: number_field(3, value) for mask, value in masks.items()}
        return self._node(name, "StridedSlice", image, begin, end, step, T=_FLOATS, Index=_INTS, **numbers)

    def product(self, name: str, rows: str, kernel: str) -> str:
        """A matrix product: rows (N, inputs), kernel (inputs, units)."""
        return self._node(name, "MatMul", rows, kernel, T=_FLOATS, transpose_a=_NO, transpose_b=_NO)

    def bias(self, name: str, values: str, bias: str) -> str:
        """A bias added along the last axis."""
        return self._node(name, "BiasAdd", values, bias, T=_FLOATS, data_format=_text("NHWC"))

    def reshape(self, name: str, values: str, shape: Sequence[int]) -> str:
        """The same numbers in another shape; a size of -1 is what is left."""
        sizes = self.constant(f"{name}/shape", np.array(shape, np.int32))
        return self._node(name, "Reshape", values, sizes, T=_FLOATS, Tshape=_INTS)

    def join(self, name: str, *parts: str) -> str:
        """Rows (N, ...) side by side."""
        axis = self.constant(f"{name}/axis", np.int32(1))
        return self._node(name, "ConcatV2", *parts, axis, T=_FLOATS, Tidx=_INTS, N=number_field(3, len(parts)))

    def _node(self, name: str, operation: str, *inputs: str, **attributes: bytes) -> str:
        parts = [bytes_field(1, name), bytes_field(2, operation), *(bytes_field(3, source) for source in inputs)]
        for key, value in sorted(attributes.items()):
            parts.append(bytes_field(5, bytes_field(1, key) + bytes_field(2, value)))
        self._nodes.append(b"".join(parts))
        return name


def _shape(sizes: Sequence[int]) -> bytes:
    """A ``TensorShapeProto``."""
    return b"".join(bytes_field(2, number_field(1, size)) for size in sizes)


def _text(value: str) -> bytes:
    return bytes_field(2, value)  # AttrValue.s


def _list(*values: Any) -> bytes:
    return bytes_field(1, bytes_field(3, b"".join(map(varint, values))) if values else b"")  # AttrValue.list.i
