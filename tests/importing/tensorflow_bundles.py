"""TensorFlow's checkpoints without TensorFlow: a LevelDB table and the numbers beside it, written byte by byte."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tensorflow_graphs import FLOAT, bytes_field, number, shape_message, varint

BLOCK_BYTES = 1000  # several blocks even of a small model
RESTARTS = 16  # entries between two keys that are written whole
MAGIC = 0xDB4775248B80FB57


def slow_crc32c(data: bytes) -> int:
    """Bit by bit, as the definition says."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def mask(crc: int) -> int:
    return (((crc >> 15) | (crc << 17)) + 0xA282EAD8) % 2**32


def block(entries: list[tuple[bytes, bytes]]) -> bytes:
    out, restarts, before = bytearray(), [], b""
    for place, (key, value) in enumerate(entries):
        shared = 0
        if place % RESTARTS == 0:
            restarts.append(len(out))
        else:
            while shared < min(len(before), len(key)) and before[shared] == key[shared]:
                shared += 1
        out += varint(shared) + varint(len(key) - shared) + varint(len(value)) + key[shared:] + value
        before = key
    return bytes(out) + b"".join(place.to_bytes(4, "little") for place in [*restarts, len(restarts)])


def table(pairs: list[tuple[bytes, bytes]]) -> bytes:
    out = bytearray()

    def add(content: bytes) -> bytes:
        handle = varint(len(out)) + varint(len(content))
        trailed = content + b"\0"
        out.extend(trailed + mask(slow_crc32c(trailed)).to_bytes(4, "little"))
        return handle

    index: list[tuple[bytes, bytes]] = []
    waiting: list[tuple[bytes, bytes]] = []
    for pair in sorted(pairs):
        waiting.append(pair)
        if sum(len(key) + len(value) for key, value in waiting) > BLOCK_BYTES:
            index.append((waiting[-1][0], add(block(waiting))))
            waiting = []
    if waiting:
        index.append((waiting[-1][0] + b"\xff", add(block(waiting))))
    footer = add(block([])) + add(block(index))
    return bytes(out) + footer.ljust(40, b"\0") + MAGIC.to_bytes(8, "little")


def write_checkpoint(
    folder: Path, name: str, tensors: Mapping[str, NDArray[Any]], *, crc: Callable[[bytes], int] = slow_crc32c
) -> Path:
    """``NAME.index`` and ``NAME.data-00000-of-00001``; `crc` is of the tensors, the index has its own."""
    data = bytearray()
    pairs = [(b"", number(1, 1) + bytes_field(3, number(1, 1)))]
    for key in sorted(tensors):
        content = tensors[key].astype("<f4").tobytes()
        checksum = b"\x35" + mask(crc(content)).to_bytes(4, "little")  # field 6, four bytes
        entry = number(1, FLOAT) + bytes_field(2, shape_message(tensors[key].shape))
        entry += (number(4, len(data)) if data else b"") + number(5, len(content)) + checksum
        pairs.append((key.encode(), entry))
        data += content
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.data-00000-of-00001").write_bytes(data)
    (folder / f"{name}.meta").write_bytes(b"a graph that is not read")
    index = folder / f"{name}.index"
    index.write_bytes(table(pairs))
    return index


def few_tensors(layers: int = 30) -> dict[str, NDArray[np.float32]]:
    rng = np.random.default_rng(1)
    shapes = {
        f"main_level/agent/layer_{i}/{part}": (i + 1, 3)[: 2 - (part == "bias")]
        for i in range(layers)
        for part in ("kernel", "bias")
    }
    return {name: rng.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
