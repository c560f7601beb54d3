"""The bytes of a replay file: a strict JSON header and columns of numbers, compressed, with every size bounded.

    RACECRAFTREPLAY and a zero    16 bytes
    version                       u32, little-endian as all numbers
    size of the body              u64
    SHA-256 of the body           32 bytes
    the body, zlib                to the end of the file

    body: size of the header u32, header (UTF-8 JSON), columns one after the other

A column is stored in the smallest type that holds every value exactly. Its values are combined by exclusive or with the
one before, and their bytes sorted by significance, so that what changes slowly compresses well. Nothing is lost.
"""

from __future__ import annotations

import hashlib
import json
import struct
import zlib
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ConfigError, ReplayError
from racecraft.json_file import parse_json_object

MAGIC: Final = b"RACECRAFTREPLAY\0"
VERSION: Final = 2
"""Of what is written; version 1, which knows no race, is read as well."""
MAX_FILE_BYTES: Final = 256 << 20
MAX_BODY_BYTES: Final = 256 << 20
MAX_HEADER_BYTES: Final = 16 << 20
DENSE_BYTES: Final = 16 << 20
MAX_DENSITY: Final = 16
"""A body may have `DENSE_BYTES` and, for each byte of its file, `MAX_DENSITY` more; races have 2 to 4."""
TYPES: Final = {"u1": 1, "i2": 2, "i4": 4, "f4": 4, "f8": 8}
"""Column types, smallest first, and their bytes."""

_PREFIX: Final = struct.Struct("<16sIQ32s")


def pack_column(values: NDArray[Any]) -> tuple[str, bytes]:
    """Type and bytes of a column of finite numbers (T,), exactly.

    Raises:
        ReplayError: A number is NaN or infinite.
    """
    values = np.asarray(values, dtype=np.float64)
    if not np.isfinite(values).all():
        raise ReplayError("A replay holds finite numbers only; one is NaN or infinite.")
    for kind in TYPES:
        with np.errstate(invalid="ignore", over="ignore"):
            narrow = values.astype(f"<{kind}")
        if (narrow.astype(np.float64).view(np.uint64) == values.view(np.uint64)).all():
            break
    bits = narrow.view(f"<u{TYPES[kind]}")
    bits = bits ^ np.concatenate((np.zeros(1, bits.dtype), bits[:-1]))[: len(bits)]
    return kind, bits.view(np.uint8).reshape(-1, TYPES[kind]).T.tobytes()


def unpack_column(kind: str, data: bytes | memoryview) -> NDArray[Any]:
    """A column from its bytes, in the type that it is stored in (T,).

    Raises:
        ReplayError: A number is NaN or infinite.
    """
    width = TYPES[kind]
    sorted_bytes = np.frombuffer(data, dtype=np.uint8).reshape(width, -1)
    bits = np.ascontiguousarray(sorted_bytes.T).view(f"<u{width}").reshape(-1)
    values = np.bitwise_xor.accumulate(bits).view(f"<{kind}")
    if not np.isfinite(values).all():
        raise ReplayError(f"A replay's number is {values[~np.isfinite(values)][0]}; allowed are finite ones.")
    return values


def pack(header: dict[str, Any], columns: list[bytes]) -> bytes:
    """The whole file's bytes; equal content gives equal bytes."""
    text = json.dumps(header, separators=(",", ":"), allow_nan=False).encode()
    body = b"".join([struct.pack("<I", len(text)), text, *columns])
    if len(text) > MAX_HEADER_BYTES or len(body) > MAX_BODY_BYTES:
        raise ReplayError(f"A replay of {len(body):,} bytes is too long; allowed are {MAX_BODY_BYTES:,}.")
    prefix = _PREFIX.pack(MAGIC, VERSION, len(body), hashlib.sha256(body).digest())
    packed = zlib.compress(body, 9)
    if len(body) > most_in(len(packed)):  # a car stood for hours; without repetitions a byte takes a bit or more
        deflater = zlib.compressobj(9, strategy=zlib.Z_HUFFMAN_ONLY)
        packed = deflater.compress(body) + deflater.flush()
    return prefix + packed


def most_in(file_bytes: int) -> int:
    """Bytes that the body of a file of so many bytes may have."""
    return min(MAX_BODY_BYTES, DENSE_BYTES + MAX_DENSITY * file_bytes)


def unpack(data: bytes, *, name: str, max_bytes: int = MAX_BODY_BYTES) -> tuple[dict[str, Any], memoryview]:
    """Header and the bytes of all columns.

    Args:
        data: Of the file, whole.
        name: What messages call it.
        max_bytes: That its body may have.

    Raises:
        ReplayError: Says what is wrong with the file.
    """
    if len(data) < _PREFIX.size or not data.startswith(MAGIC):
        raise ReplayError(f"{name} is no replay of Racecraft: it does not begin like one.")
    _, version, size, digest = _PREFIX.unpack_from(data)
    if not 1 <= version <= VERSION:
        raise ReplayError(
            f"{name} is a replay of version {version}; this Racecraft reads up to {VERSION}.",
            hint="Update Racecraft." if version > VERSION else "",
        )
    if not 4 <= size <= (most := min(max_bytes, most_in(len(data)))):
        raise ReplayError(f"{name} says it holds {size:,} bytes; allowed are 4 to {most:,} in a file of its size.")
    inflater = zlib.decompressobj()
    try:
        body = inflater.decompress(memoryview(data)[_PREFIX.size :], size + 1)
    except zlib.error as error:
        raise ReplayError(f"{name} is damaged: its content cannot be unpacked.") from error
    if len(body) != size or not inflater.eof or inflater.unused_data:
        raise ReplayError(f"{name} is damaged: it holds another number of bytes than the {size:,} it says.")
    if hashlib.sha256(body).digest() != digest:
        raise ReplayError(f"{name} is damaged: its checksum does not fit its content.")
    (length,) = struct.unpack_from("<I", body)
    if length > min(MAX_HEADER_BYTES, size - 4):
        raise ReplayError(f"{name} says its header has {length:,} bytes, which it does not hold.")
    try:
        header = parse_json_object(body[4 : 4 + length], name=f"The header of {name}")
    except ConfigError as error:
        raise ReplayError(str(error)) from error
    return header, memoryview(body)[4 + length :]
