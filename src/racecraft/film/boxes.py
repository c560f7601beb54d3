"""The boxes that an MP4 file consists of (ISO/IEC 14496-12), as far as a film of one track needs them.

An AVIF file of several pictures is of the same boxes, so the encoder of pictures that everybody has makes films, too.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

UNITY: Final = struct.pack(">9I", 0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000)
"""The matrix of a track that is shown as it is."""
CLOCK: Final = 1000
"""Ticks a second of a whole film."""


@dataclass(frozen=True)
class Samples:
    """Encoded pictures in order, and what a decoder is told before the first of them."""

    description: bytes
    """The ``stsd`` box."""
    data: tuple[bytes, ...]
    keys: frozenset[int]
    """Numbers, from 0 on, of those that need no other."""


def box(kind: bytes, *parts: bytes) -> bytes:
    """A box of this kind around its parts."""
    return struct.pack(">I4s", 8 + sum(map(len, parts)), kind) + b"".join(parts)


def boxes(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Kind and content of every box, one after the other.

    Raises:
        ValueError: A box is longer than what holds it.
    """
    at = 0
    while at + 8 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if size < 8 or at + size > len(data):
            raise ValueError(f"box {kind!r} of {size} bytes does not fit")
        yield kind, data[at + 8 : at + size]
        at += size


def inside(data: bytes, *path: bytes) -> bytes:
    """Content of the first box under this path.

    Raises:
        ValueError: There is none.
    """
    for wanted in path:
        found = next((content for kind, content in boxes(data) if kind == wanted), None)
        if found is None:
            raise ValueError(f"there is no box {wanted!r}")
        data = found
    return data


def read_samples(file: bytes) -> Samples:
    """What the first track of a file holds, of which all samples lie in one piece of the file, as libavif writes them.

    Raises:
        ValueError: There is no track, or not such a one.
    """
    table = inside(file, b"moov", b"trak", b"mdia", b"minf", b"stbl")
    parts = dict(boxes(table))
    common, count = struct.unpack_from(">II", parts[b"stsz"], 4)
    sizes = [common] * count if common else list(struct.unpack_from(f">{count}I", parts[b"stsz"], 12))
    pieces, at = struct.unpack_from(">II", parts[b"stco"], 4)
    if pieces != 1:
        raise ValueError(f"its samples lie in {pieces} pieces")
    data = []
    for size in sizes:
        data.append(file[at : at + size])
        at += size
    keys = list(range(count))
    if b"stss" in parts:
        (number,) = struct.unpack_from(">I", parts[b"stss"], 4)
        keys = [key - 1 for key in struct.unpack_from(f">{number}I", parts[b"stss"], 8)]
    return Samples(box(b"stsd", parts[b"stsd"]), tuple(data), frozenset(keys))


def movie(
    description: bytes, sizes: Sequence[int], keys: Sequence[int], *, width: int, height: int, rate: int
) -> bytes:
    """Everything of a film but its samples, which follow in order behind what is returned.

    Args:
        description: The ``stsd`` box.
        sizes: Bytes of each sample.
        keys: Numbers, from 0 on, of the samples that need no other.
        width: Pixels.
        height: Pixels.
        rate: Samples a second.
    """
    begin = box(b"ftyp", b"isom", bytes(4), b"isom", b"iso6", b"av01", b"mp41")
    offset = len(begin) + len(_moov(description, sizes, keys, width, height, rate, 0)) + 8
    moov = _moov(description, sizes, keys, width, height, rate, offset)
    return begin + moov + struct.pack(">I4s", 8 + sum(sizes), b"mdat")


def _full(kind: bytes, *parts: bytes, flags: int = 0) -> bytes:
    """A box that begins with its version, 0, and flags."""
    return box(kind, struct.pack(">I", flags), *parts)


def _moov(
    description: bytes, sizes: Sequence[int], keys: Sequence[int], width: int, height: int, rate: int, offset: int
) -> bytes:
    count = len(sizes)
    ticks = round(CLOCK * count / rate)
    table = box(
        b"stbl",
        description,
        _full(b"stts", struct.pack(">III", 1, count, 1)),
        _full(b"stss", struct.pack(f">{1 + len(keys)}I", len(keys), *(key + 1 for key in keys))),
        _full(b"stsc", struct.pack(">IIII", 1, 1, count, 1)),
        _full(b"stsz", struct.pack(f">{2 + count}I", 0, count, *sizes)),
        _full(b"stco", struct.pack(">II", 1, offset)),
    )
    media = box(
        b"mdia",
        _full(b"mdhd", struct.pack(">IIIIHH", 0, 0, rate, count, 0x55C4, 0)),  # of no language
        _full(b"hdlr", struct.pack(">I4s12x", 0, b"vide"), b"film\0"),
        box(
            b"minf",
            _full(b"vmhd", bytes(8), flags=1),
            box(b"dinf", _full(b"dref", struct.pack(">I", 1), _full(b"url ", flags=1))),  # in this file
            table,
        ),
    )
    size = struct.pack(">II", width << 16, height << 16)
    header = _full(b"tkhd", struct.pack(">IIIII16x", 0, 0, 1, 0, ticks), UNITY, size, flags=3)
    return box(
        b"moov",
        _full(
            b"mvhd",
            struct.pack(">IIIIIH10x", 0, 0, CLOCK, ticks, 0x10000, 0x100),
            UNITY,
            bytes(24),
            bytes([0, 0, 0, 2]),
        ),
        box(b"trak", header, media),
    )
