"""Several small files in one request: what was packed comes out again, and nothing else is taken for a parcel."""

from __future__ import annotations

import json

import pytest

from racecraft.errors import RunError
from racecraft.serve.jobs.parcel import HEAD, MAX_PIECES, pack, unpack

LONGEST = f"{'s' * 16}/{'n' * 64}/{'0' * 64}"


@pytest.mark.parametrize(
    "pieces",
    [
        [],
        [("runs/a.json", b"{}")],
        [("runs/a/0", b"\n\n"), ("runs/a/1", b""), ("runs/a/0", bytes(range(256)))],
        [(LONGEST, b"x" * 1000)] * MAX_PIECES,
    ],
)
def test_what_was_packed_comes_out_again(pieces: list[tuple[str, bytes]]) -> None:
    packed = pack(pieces)
    assert unpack(packed) == pieces
    assert len(packed) <= sum(HEAD + len(content) for _, content in pieces) + 3


@pytest.mark.parametrize(
    "told",
    [
        b"",
        b"[",
        b"[" * 100_000,
        b"\xff\n",
        b"{}x\n",
        b'"ab"\n',
        b"null\nx",
        b'[["a", 1]]\n',
        b'[["a", 1]]\nxy',
        b'[["a", -1], ["b", 2]]\nx',
        b'[["a", true]]\nx',
        b'[["a", 1.0]]\nx',
        b'[["a", NaN]]\nx',
        b"[[1, 1]]\nx",
        b'[["a", 1, 2]]\nx',
        b"[1]\nx",
        json.dumps([["", 0]] * (MAX_PIECES + 1)).encode(),
    ],
)
def test_what_is_none_is_refused(told: bytes) -> None:
    with pytest.raises(RunError, match="no parcel of files"):
        unpack(told)
