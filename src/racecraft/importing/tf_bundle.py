"""A TensorFlow checkpoint: ``NAME.ckpt.index``, a table of names, and ``NAME.ckpt.data-00000-of-00001``, their numbers.

The index is a LevelDB table without compression (https://github.com/google/leveldb/blob/main/doc/table_format.md):
sorted keys that share their beginnings, in blocks with checksums. Its values are ``BundleHeaderProto`` under the empty
key and a ``BundleEntryProto`` for each tensor (``tensor_bundle.proto``): type, shape, offset, size and checksum.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import SourceError
from racecraft.importing.crc32c import crc32c, masked
from racecraft.importing.frozen_graph import DT_FLOAT, shape_dims
from racecraft.importing.protobuf import Wire

MAX_INDEX_BYTES: Final = 1 << 20
"""Of an index; AWS's take 2 kB."""
MAX_TENSORS: Final = 10_000
MAX_TENSOR_BYTES: Final = 1 << 28
_FOOTER: Final = 48  # bytes: two handles, padding, the magic number
_MAGIC: Final = (0xDB4775248B80FB57).to_bytes(8, "little")
_TRAILER: Final = 5  # bytes behind a block: kind of compression, checksum


@dataclass(frozen=True)
class _Entry:
    """Where a tensor lies."""

    shape: tuple[int, ...]
    offset: int
    size: int
    checksum: int


class TensorBundle:
    """The float32 tensors of a checkpoint: `racecraft.importing.policy_weights.Tensors`.

    Args:
        index: Path of the index.
        data: Path of the numbers.
        name: What messages call the checkpoint.

    Raises:
        SourceError: Not readable, not a checkpoint, or damaged.
    """

    def __init__(self, index: Path, data: Path, *, name: str) -> None:
        self.name = name
        self._data = data
        table = _contents(index, name=f"{name}.index")
        self._entries = _entries(memoryview(table), Wire(f"{name}.index"))

    @property
    def shapes(self) -> Mapping[str, tuple[int, ...]]:
        """Of every tensor."""
        return {name: entry.shape for name, entry in self._entries.items()}

    def read(self, name: str) -> NDArray[np.float32]:
        """One of them.

        Raises:
            SourceError: It is not whole.
        """
        entry = self._entries[name]
        layer = name[-80:]
        if entry.size != 4 * prod(entry.shape) or entry.size > MAX_TENSOR_BYTES:
            raise SourceError(f"{self.name} is damaged: {layer!a} of shape {entry.shape} takes {entry.size:,} bytes.")
        try:
            with self._data.open("rb") as file:
                if entry.offset + entry.size > file.seek(0, 2):
                    raise SourceError(f"{self.name} is damaged: its data end before {layer!a}.")
                file.seek(entry.offset)
                read = file.read(entry.size)
        except OSError as error:
            raise SourceError(f"{self.name} cannot be read: {error.strerror or error}.") from error
        if masked(crc32c(read)) != entry.checksum:
            raise SourceError(f"{self.name} is damaged: the checksum of {layer!a} is wrong.")
        return np.frombuffer(read, "<f4").reshape(entry.shape)


def _contents(path: Path, *, name: str) -> bytes:
    try:
        with path.open("rb") as file:
            data = file.read(MAX_INDEX_BYTES + 1)
    except OSError as error:
        raise SourceError(f"{name} cannot be read: {error.strerror or error}.") from error
    if len(data) > MAX_INDEX_BYTES:
        raise SourceError(f"{name} is larger than {MAX_INDEX_BYTES:,} bytes, too large for a file of its kind.")
    return data


def _entries(table: memoryview, wire: Wire) -> dict[str, _Entry]:
    """Every tensor of float32 that is in one piece."""
    if len(table) < _FOOTER or table[-8:] != _MAGIC:
        wire.refuse("is not a checkpoint's index, or its end is missing")
    footer = table[-_FOOTER:-8]
    _, _, place = _handle(footer, 0, wire)  # of the index of filters, which a checkpoint has not
    offset, size, _ = _handle(footer, place, wire)
    found: dict[str, _Entry] = {}
    end = 0  # of the block before
    for _, value in _pairs(_block(table, offset, size, wire), wire):
        offset, size, _ = _handle(value, 0, wire)
        if offset < end:  # a large one that is listed ten thousand times would take minutes
            wire.refuse("is damaged: its blocks do not lie one behind the other")
        end = offset + size + _TRAILER
        for key, message in _pairs(_block(table, offset, size, wire), wire):
            if not key:
                _check_header(message, wire)
                continue
            if len(found) == MAX_TENSORS:
                wire.refuse(f"lists more than {MAX_TENSORS:,} tensors")
            entry = _entry(message, wire)
            if entry is not None:
                found[wire.text(memoryview(key))] = entry
    return found


def _check_header(message: memoryview, wire: Wire) -> None:
    fields = {field.number: field.value for field in wire.fields(message)}
    if fields.get(1) != 1 or fields.get(2, 0) != 0:  # num_shards, endianness
        wire.refuse("is of a checkpoint in several pieces or of a big-endian machine, which is not read")


def _entry(message: memoryview, wire: Wire) -> _Entry | None:
    dtype = offset = size = checksum = 0
    shape: tuple[int, ...] = ()
    for field in wire.fields(message):
        if field.number == 1:
            dtype = field.value
        elif field.number == 2:
            shape = tuple(shape_dims(field.data, wire))
        elif field.number == 4:
            offset = field.value
        elif field.number == 5:
            size = field.value
        elif field.number == 6:
            checksum = int.from_bytes(field.data, "little")
        elif field.number in (3, 7):  # of another shard, or in slices
            return None
    return _Entry(shape, offset, size, checksum) if dtype == DT_FLOAT else None


def _block(table: memoryview, offset: int, size: int, wire: Wire) -> memoryview:
    """A block's content, when its checksum is right."""
    end = offset + size
    if end + _TRAILER > len(table):
        wire.refuse("is damaged: a block lies beyond its end")
    if table[end] != 0:
        wire.refuse("is compressed, which no checkpoint of TensorFlow is, or damaged")
    if masked(crc32c(table[offset : end + 1])) != int.from_bytes(table[end + 1 : end + _TRAILER], "little"):
        wire.refuse("is damaged: a checksum is wrong")
    return table[offset:end]


def _pairs(block: memoryview, wire: Wire) -> Iterator[tuple[bytes, memoryview]]:
    """Keys and values: each key is the beginning of the one before, and what differs."""
    restarts = int.from_bytes(block[-4:], "little")
    end = len(block) - 4 * (restarts + 1)
    if len(block) < 4 or end < 0:
        wire.refuse("is damaged: a block is shorter than its index")
    key, place = b"", 0
    while place < end:
        shared, place = wire.varint(block, place)
        more, place = wire.varint(block, place)
        size, place = wire.varint(block, place)
        if shared > len(key) or more > 1000 or place + more + size > end:
            wire.refuse("is damaged: an entry of a block is longer than the block")
        key = key[:shared] + bytes(block[place : place + more])
        if len(key) > 1000:
            wire.refuse("is damaged: a name is too long")
        place += more + size
        yield key, block[place - size : place]


def _handle(data: memoryview, place: int, wire: Wire) -> tuple[int, int, int]:
    """Offset and size of a block, and what follows."""
    offset, place = wire.varint(data, place)
    size, place = wire.varint(data, place)
    return offset, size, place
