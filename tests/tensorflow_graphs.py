"""TensorFlow's graphs without TensorFlow or any code of ours: written byte by byte, parsed, and run node by node."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

FLOAT, INT32 = 1, 3
_TYPES = {FLOAT: np.dtype("<f4"), INT32: np.dtype("<i4")}


# ---- write


def varint(value: int) -> bytes:
    value &= 2**64 - 1
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])


def number(field: int, value: int) -> bytes:
    return varint(field << 3) + varint(value)


def bytes_field(field: int, data: bytes | str) -> bytes:
    data = data.encode() if isinstance(data, str) else data
    return varint(field << 3 | 2) + varint(len(data)) + data


def shape_message(shape: Sequence[int]) -> bytes:
    return b"".join(bytes_field(2, number(1, size)) for size in shape)


def tensor_message(array: NDArray[Any]) -> bytes:
    """A TensorProto: scalars in the fields of their type, as TensorFlow writes them, all else as content."""
    dtype = FLOAT if array.dtype.kind == "f" else INT32
    head = number(1, dtype) + bytes_field(2, shape_message(array.shape))
    if array.size > 1:
        return head + bytes_field(4, array.astype(_TYPES[dtype]).tobytes())
    if dtype == FLOAT:
        return head + bytes_field(5, array.astype("<f4").tobytes())
    return head + bytes_field(7, b"".join(varint(int(value)) for value in array.ravel()))


def attribute(name: str, value: bytes) -> bytes:
    return bytes_field(5, bytes_field(1, name) + bytes_field(2, value))


VERSIONS = bytes_field(4, number(1, 134))
"""What a graph ends in."""


class GraphWriter:
    """A GraphDef, node by node."""

    def __init__(self) -> None:
        self.nodes: list[bytes] = []

    def node(self, name: str, operation: str, *inputs: str, **attributes: bytes) -> str:
        body = bytes_field(1, name) + bytes_field(2, operation)
        body += b"".join(bytes_field(3, source) for source in inputs) + bytes_field(4, "/device:GPU:0")
        self.nodes.append(body + b"".join(attribute(key, value) for key, value in attributes.items()))
        return name

    def constant(self, name: str, value: object) -> str:
        array = np.asarray(value)
        dtype = number(6, FLOAT if array.dtype.kind == "f" else INT32)
        return self.node(name, "Const", value=bytes_field(8, tensor_message(array)), dtype=dtype)

    def placeholder(self, name: str, shape: Sequence[int]) -> str:
        return self.node(name, "Placeholder", shape=bytes_field(7, shape_message(shape)), dtype=number(6, FLOAT))

    def bytes(self) -> bytes:
        return b"".join(bytes_field(1, node) for node in self.nodes) + VERSIONS


# ---- parse


def fields(data: bytes) -> Iterator[tuple[int, Any]]:
    place = 0

    def read() -> int:
        nonlocal place
        value = shift = 0
        while True:
            byte = data[place]
            place += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    while place < len(data):
        key = read()
        if key & 7 == 0:
            yield key >> 3, read()
        else:
            size = read() if key & 7 == 2 else {1: 8, 5: 4}[key & 7]
            yield key >> 3, data[place : place + size]
            place += size


@dataclass(frozen=True)
class ParsedNode:
    operation: str
    inputs: list[str]
    attributes: dict[str, dict[int, Any]]


def parse_graph(data: bytes) -> dict[str, ParsedNode]:
    nodes = {}
    for field, body in fields(data):
        if field == 1:
            parts = list(fields(body))
            attributes = {}
            for entry in (value for part, value in parts if part == 5):
                pair = dict(fields(entry))
                attributes[pair[1].decode()] = dict(fields(pair[2]))
            text = {part: value.decode() for part, value in parts if part in (1, 2)}
            nodes[text[1]] = ParsedNode(text[2], [value.decode() for part, value in parts if part == 3], attributes)
    return nodes


def _tensor(data: bytes) -> NDArray[Any]:
    parts = dict(fields(data))
    shape = [dict(fields(size)).get(1, 0) for _, size in fields(parts[2])]
    dtype = _TYPES[parts[1]]
    if 4 in parts:
        values = np.frombuffer(parts[4], dtype)
    elif parts[1] == FLOAT:
        values = np.frombuffer(parts[5], dtype)
    else:
        packed = parts[7] + b"\x00"
        values = np.array([next(fields(b"\x08" + packed))[1]], np.uint64).astype(np.int32)
    return values.reshape(shape)


def _signed_list(data: bytes) -> list[int]:
    return [byte for field, packed in fields(data) if field == 3 for byte in packed]


# ---- run


def run_graph(data: bytes, output: str, feeds: Mapping[str, NDArray[np.float32]]) -> NDArray[Any]:
    """The value of a node, by what every node on the way says it does."""
    nodes = parse_graph(data)
    values: dict[str, Any] = {}
    waiting = [output]
    while waiting:
        name = waiting[-1]
        node = nodes[name]
        missing = [source for source in node.inputs if source not in values]
        if name in values or missing:
            waiting = waiting[:-1] if name in values else [*waiting, *missing]
            continue
        values[name] = feeds[name] if name in feeds else _run(node, [values[source] for source in node.inputs])
    result: NDArray[Any] = values[output]
    return result


def _run(node: ParsedNode, inputs: list[Any]) -> Any:
    kind = node.operation
    if kind == "Const":
        return _tensor(node.attributes["value"][8])
    if kind in ("Identity", "StopGradient"):
        return inputs[0]
    if kind in ("Add", "AddV2", "BiasAdd"):
        return inputs[0] + inputs[1]
    if kind == "Sub":
        return inputs[0] - inputs[1]
    if kind == "Mul":
        return inputs[0] * inputs[1]
    if kind == "RealDiv":
        return inputs[0] / inputs[1]
    if kind == "Relu":
        return np.maximum(inputs[0], 0)
    if kind == "Tanh":
        return np.tanh(inputs[0])
    if kind == "Softmax":
        powers = np.exp(inputs[0] - inputs[0].max(-1, keepdims=True))
        return powers / powers.sum(-1, keepdims=True)
    if kind == "MatMul":
        return inputs[0] @ inputs[1]
    if kind == "Conv2D":
        assert node.attributes["padding"][2] == b"VALID"
        stride = _signed_list(node.attributes["strides"][1])[1]
        side = inputs[1].shape[0]
        windows = sliding_window_view(inputs[0], (side, side), axis=(1, 2))[:, ::stride, ::stride]
        return np.einsum("nhwcij,ijcf->nhwf", windows, inputs[1], optimize=True)
    if kind == "Shape":
        return np.array(inputs[0].shape, np.int32)
    if kind == "Pack":
        return np.stack(inputs)
    if kind == "Reshape":
        assert inputs[1].min() >= -1, "numpy takes any size below 0 for one that is open, TensorFlow -1 alone"
        return inputs[0].reshape([int(size) for size in inputs[1]])
    if kind == "ConcatV2":
        return np.concatenate(inputs[:-1], axis=int(inputs[-1]))
    if kind == "StridedSlice":
        masks = {name: value[3] for name, value in node.attributes.items() if name.endswith("_mask")}
        if masks["shrink_axis_mask"] == 1:  # value[begin], as the trainer uses it
            return inputs[0][int(inputs[1][0])]
        assert masks["shrink_axis_mask"] == masks["ellipsis_mask"] == masks["new_axis_mask"] == 0
        begins, ends, steps = (part.tolist() for part in inputs[1:])
        return inputs[0][
            tuple(
                slice(
                    None if masks["begin_mask"] >> i & 1 else begins[i],
                    None if masks["end_mask"] >> i & 1 else ends[i],
                    step,
                )
                for i, step in enumerate(steps)
            )
        ]
    if kind == "AvgPool":
        assert node.attributes["padding"][2] == b"VALID"
        _, rows, columns, _ = _signed_list(node.attributes["ksize"][1])
        assert _signed_list(node.attributes["strides"][1]) == [1, rows, columns, 1]
        count, height, width, channels = inputs[0].shape
        squares = inputs[0].reshape(count, height // rows, rows, width // columns, columns, channels)
        return squares.mean(axis=(2, 4), dtype=np.float32)
    plain = {"Floor": np.floor, "Sqrt": np.sqrt, "Sign": np.sign, "Maximum": np.maximum, "Minimum": np.minimum}
    if kind in plain:
        return plain[kind](*inputs)
    raise AssertionError(f"the graph has a node {kind}")
