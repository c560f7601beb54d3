"""ONNX models written without a library: the same nodes that `racecraft.car.graph_writer` writes for TensorFlow.

Field numbers are those of ``onnx.proto``. ONNX keeps an image's channels before its rows, TensorFlow behind
its columns; inputs and weights stay as TensorFlow has them, and each convolution turns what it takes and what it gives.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.importing.protobuf import bytes_field, number_field, varint

IR_VERSION: Final = 8
OPSET: Final = 13
_FLOAT, _INT64 = 1, 7  # TensorProto.DataType
_CALLED: Final = {"RealDiv": "Div", "Maximum": "Max", "Minimum": "Min"}
_CHANNELS_FIRST, _CHANNELS_LAST = (0, 3, 1, 2), (0, 2, 3, 1)


class OnnxWriter:
    """A model that grows node by node; each method returns the name of what its node gives."""

    def __init__(self) -> None:
        self._nodes: list[bytes] = []
        self._numbers: list[bytes] = []
        self._inputs: list[bytes] = []

    def finish(self, output: str, size: int) -> bytes:
        """The model as the content of a ``.onnx`` file.

        Args:
            output: What it gives.
            size: Numbers of it for each row.
        """
        graph = [*(bytes_field(1, node) for node in self._nodes), bytes_field(2, "policy")]
        graph += [bytes_field(5, tensor) for tensor in self._numbers]
        graph += [bytes_field(11, one) for one in self._inputs]
        graph.append(bytes_field(12, _value(output, [-1, size])))
        parts = [number_field(1, IR_VERSION), bytes_field(2, "racecraft"), bytes_field(7, b"".join(graph))]
        return b"".join([*parts, bytes_field(8, number_field(2, OPSET))])

    def placeholder(self, name: str, shape: Sequence[int]) -> str:
        """An input of float32; a size of -1 is any."""
        self._inputs.append(_value(name, shape))
        return name

    def constant(self, name: str, values: ArrayLike) -> str:
        """Numbers: float32, or whole ones as int64."""
        array = np.asarray(values)
        is_float = array.dtype.kind == "f"
        content = array.astype("<f4" if is_float else "<i8", copy=False).tobytes()
        sizes = [number_field(1, size) for size in array.shape]
        kind = number_field(2, _FLOAT if is_float else _INT64)
        self._numbers.append(b"".join([*sizes, kind, bytes_field(8, name), bytes_field(9, content)]))
        return name

    def variable(self, name: str, values: NDArray[np.float32]) -> str:
        """A weight."""
        return self.constant(name, values)

    def apply(self, name: str, operation: str, *inputs: str) -> str:
        """An operation on floats that has no settings, by TensorFlow's name."""
        settings = {"axis": _whole(-1)} if operation == "Softmax" else {}
        return self._node(name, _CALLED.get(operation, operation), *inputs, **settings)

    def convolution(self, name: str, image: str, kernel: str, *, stride: int) -> str:
        """A convolution without padding: image (N, H, W, C), kernel (rows, columns, C, filters)."""
        image = self._turned(f"{name}/image", image, _CHANNELS_FIRST)
        kernel = self._turned(f"{name}/kernel", kernel, (3, 2, 0, 1))
        product = self._node(f"{name}/product", "Conv", image, kernel, strides=_wholes(stride, stride))
        return self._turned(name, product, _CHANNELS_LAST)

    def pool(self, name: str, image: str, *, side: int) -> str:
        """The mean of each square of an image (N, H, W, C)."""
        image = self._turned(f"{name}/image", image, _CHANNELS_FIRST)
        sizes = _wholes(side, side)
        return self._turned(
            name, self._node(f"{name}/mean", "AveragePool", image, kernel_shape=sizes, strides=sizes), _CHANNELS_LAST
        )

    def below(self, name: str, image: str, *, row: int) -> str:
        """An image (N, H, W, C) without its rows above this one."""
        parts = (("starts", row), ("ends", np.iinfo(np.int64).max), ("axes", 1))
        limits = [self.constant(f"{name}/{part}", np.array([value], np.int64)) for part, value in parts]
        return self._node(name, "Slice", image, *limits)

    def product(self, name: str, rows: str, kernel: str) -> str:
        """A matrix product: rows (N, inputs), kernel (inputs, units)."""
        return self._node(name, "MatMul", rows, kernel)

    def bias(self, name: str, values: str, bias: str) -> str:
        """A bias added along the last axis."""
        return self._node(name, "Add", values, bias)

    def reshape(self, name: str, values: str, shape: Sequence[int]) -> str:
        """The same numbers in another shape; a size of -1 is what is left."""
        return self._node(name, "Reshape", values, self.constant(f"{name}/shape", np.array(shape, np.int64)))

    def join(self, name: str, *parts: str) -> str:
        """Rows (N, ...) side by side."""
        return self._node(name, "Concat", *parts, axis=_whole(1))

    def _turned(self, name: str, values: str, order: tuple[int, ...]) -> str:
        return self._node(name, "Transpose", values, perm=_wholes(*order))

    def _node(self, name: str, operation: str, *inputs: str, **settings: bytes) -> str:
        parts = [*(bytes_field(1, source) for source in inputs), bytes_field(2, name), bytes_field(3, name)]
        parts.append(bytes_field(4, operation))
        parts += [bytes_field(5, bytes_field(1, key) + value) for key, value in sorted(settings.items())]
        self._nodes.append(b"".join(parts))
        return name


def _whole(value: int) -> bytes:
    """A setting that is a whole number."""
    return number_field(3, value) + number_field(20, 2)


def _wholes(*values: int) -> bytes:
    """A setting that is a list of them."""
    return bytes_field(8, b"".join(map(varint, values))) + number_field(20, 7)


def _value(name: str, shape: Sequence[int]) -> bytes:
    """A ``ValueInfoProto`` of float32; a size of -1 is called N."""
    sizes = [bytes_field(1, number_field(1, size) if size >= 0 else bytes_field(2, "N")) for size in shape]
    tensor = number_field(1, _FLOAT) + bytes_field(2, b"".join(sizes))
    return bytes_field(1, name) + bytes_field(2, bytes_field(1, tensor))
