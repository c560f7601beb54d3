"""A frozen TensorFlow graph (``model.pb``): its nodes by name, and the numbers in its constants.

The file is mapped, not read: a constant is a view of it until somebody copies it. Field numbers are those of
``graph.proto``, ``node_def.proto``, ``attr_value.proto``, ``tensor.proto`` and ``tensor_shape.proto`` of TensorFlow.
"""

from __future__ import annotations

import mmap
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import SourceError
from racecraft.importing.protobuf import Wire, signed

MAX_BYTES: Final = 1 << 29
"""Of a file; AWS's largest network takes 230 MB."""
MAX_NODES: Final = 20_000
MAX_DIMS: Final = 8
MAX_ELEMENTS: Final = 1 << 27
DT_FLOAT: Final = 1
"""``types.proto``'s number of float32, the only type that weights have."""


@dataclass(frozen=True)
class Node:
    """An operation of the graph."""

    operation: str
    """Such as ``MatMul``."""
    inputs: tuple[str, ...]
    """Names of the nodes that it takes."""


@dataclass(frozen=True)
class FrozenGraph:
    """What a graph says: `racecraft.importing.policy_weights.Tensors`, and its nodes."""

    name: str
    """What messages call it."""
    nodes: Mapping[str, Node]
    constants: Mapping[str, NDArray[np.float32]]
    """Of type float32, by their node's name; read-only views of the file."""

    @property
    def shapes(self) -> Mapping[str, tuple[int, ...]]:
        """Of every constant."""
        return {name: constant.shape for name, constant in self.constants.items()}

    def read(self, name: str) -> NDArray[np.float32]:
        """A constant."""
        return self.constants[name]


@contextmanager
def open_frozen_graph(path: Path, *, name: str = "") -> Iterator[FrozenGraph]:
    """Read a graph; its constants are good inside the block.

    Args:
        path: The file.
        name: What messages call it; the file's own name where none is given.

    Raises:
        SourceError: Not readable, not a graph, damaged, or larger than a model is.
    """
    name = name or path.name
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            if not 0 < size <= MAX_BYTES:
                raise SourceError(f"{name} has {size:,} bytes; a frozen graph has 1 to {MAX_BYTES:,}.")
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except (OSError, ValueError) as error:
        if isinstance(error, SourceError):
            raise
        raise SourceError(f"{name} cannot be read: {getattr(error, 'strerror', None) or error}.") from error
    yield _read(memoryview(mapped), Wire(name))  # unmapped with its last view


def _read(data: memoryview, wire: Wire) -> FrozenGraph:
    nodes: dict[str, Node] = {}
    constants: dict[str, NDArray[np.float32]] = {}
    for field in wire.fields(data):
        if field.number != 1:  # GraphDef.node; others are versions and a library of functions
            continue
        name, node, tensor = _node(field.data, wire)
        if not name or name in nodes or len(nodes) == MAX_NODES:
            wire.refuse("is not a frozen graph: its nodes have no names, or not one each")
        nodes[name] = node
        if node.operation == "Const" and tensor is not None:
            constant = _tensor(tensor, wire, name)
            if constant is not None:
                constants[name] = constant
    if not nodes:
        wire.refuse("is not a frozen graph of TensorFlow: it has no nodes")
    return FrozenGraph(wire.name, nodes, constants)


def _node(data: memoryview, wire: Wire) -> tuple[str, Node, memoryview | None]:
    """Name, operation and inputs, and the ``value`` of a constant."""
    name = operation = ""
    inputs: list[str] = []
    tensor = None
    for field in wire.fields(data):
        if field.number == 1:
            name = wire.text(field.data)
        elif field.number == 2:
            operation = wire.text(field.data)
        elif field.number == 3:
            inputs.append(wire.text(field.data))
        elif field.number == 5:  # an entry of the map of attributes
            entry = {part.number: part.data for part in wire.fields(field.data)}
            if bytes(entry.get(1, b"")[:6]) == b"value":
                for part in wire.fields(entry.get(2, memoryview(b""))):
                    tensor = part.data if part.number == 8 else tensor  # AttrValue.tensor
    return name, Node(operation, tuple(inputs)), tensor


def _tensor(data: memoryview, wire: Wire, name: str) -> NDArray[np.float32] | None:
    """A float32 constant; None where it has another type."""
    dtype, dims = 0, list[int]()
    content, floats = memoryview(b""), list[memoryview]()
    for field in wire.fields(data):
        if field.number == 1:
            dtype = field.value
        elif field.number == 2:
            dims = shape_dims(field.data, wire)
        elif field.number == 4:
            content = field.data
        elif field.number == 5:
            floats.append(field.data)  # float_val: packed, or one by one
    if dtype != DT_FLOAT:
        return None
    count = prod(dims)
    given = content or (floats[0] if len(floats) == 1 else memoryview(b"".join(floats)))
    if len(given) == 4:  # a single number stands for all
        return np.broadcast_to(np.frombuffer(given, "<f4")[0], dims)
    if len(given) != 4 * count:
        wire.refuse(f"is damaged: {name[-80:]!a} holds {len(given):,} bytes instead of {4 * count:,}")
    return np.frombuffer(given, "<f4").reshape(dims)


def shape_dims(data: memoryview, wire: Wire) -> list[int]:
    """Sizes of a ``TensorShapeProto``.

    Raises:
        SourceError: It has more dimensions or elements than a weight has, or unknown ones.
    """
    dims = []
    for field in wire.fields(data):
        if field.number == 3 and field.value:
            wire.refuse("is damaged: a constant has no shape")
        if field.number == 2:
            sizes = [signed(part.value) for part in wire.fields(field.data) if part.number == 1]
            dims.append(sizes[-1] if sizes else 0)
    if len(dims) > MAX_DIMS or any(not 0 <= size <= MAX_ELEMENTS for size in dims) or prod(dims) > MAX_ELEMENTS:
        wire.refuse(f"is damaged: a constant has the shape {str(dims)[:80]}")
    return dims
