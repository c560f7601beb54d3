"""Several small files in one request, as a question to a server costs more than they do.

A line of JSON holds the key and the bytes of each, ``[["runs/NAME/SHA256", 549], ["runs/NAME.json", 3120]]``; then
comes their content, one after the other.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Final

from racecraft.errors import RunError

MAX_PARCEL: Final = 1 << 20
"""Bytes of one, all in all; what is larger travels alone."""
HEAD: Final = 200
"""Bytes of the first line that a piece takes at most: the longest key that a server takes has 146."""
MAX_PIECES: Final = MAX_PARCEL // HEAD


def pack(pieces: Sequence[tuple[str, bytes]]) -> bytes:
    """Keys and contents as one."""
    head = json.dumps([(key, len(content)) for key, content in pieces]).encode()
    return b"\n".join((head, b"".join(content for _, content in pieces)))


def unpack(data: bytes) -> list[tuple[str, bytes]]:
    """Keys and contents again; what they are has not been looked at.

    Raises:
        RunError: It is none.
    """
    head, _, rest = data.partition(b"\n")
    try:
        told = json.loads(head)
        pieces = [(key, size) for key, size in told]
    except (ValueError, TypeError, RecursionError) as error:
        raise RunError("What came is no parcel of files.") from error
    is_plain = len(pieces) <= MAX_PIECES and all(
        type(key) is str and type(size) is int and 0 <= size <= len(rest) for key, size in pieces
    )
    if not is_plain or sum(size for _, size in pieces) != len(rest):
        raise RunError("What came is no parcel of files.")
    found, begin = [], 0
    for key, size in pieces:
        found.append((key, rest[begin : begin + size]))
        begin += size
    return found
