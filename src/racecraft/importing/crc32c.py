"""CRC-32C (Castagnoli), the checksum of TensorFlow's files, over megabytes in milliseconds: many pieces side by side.

RFC 3720, appendix B.4. A CRC is linear over GF(2): of bytes that begin with zeros it is that of what follows, and what
a CRC becomes when zeros follow is a matrix times it. So pieces as long as each other are joined two by two.
"""

from __future__ import annotations

from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

POLYNOMIAL: Final = 0x82F63B78  # reversed
_PIECES: Final = 1 << 10
_FEW: Final = 1 << 16  # bytes that are not worth the pieces
_ONES: Final = np.uint32(0xFFFFFFFF)

Words = NDArray[np.uint32]


def crc32c(data: bytes | memoryview) -> int:
    """The checksum of bytes."""
    if len(data) < _FEW:
        return _byte_by_byte(data)
    length = -(-len(data) // (4 * _PIECES))  # of a piece, words
    padded = np.zeros(4 * _PIECES * length, np.uint8)
    begin = len(padded) - len(data)
    padded[begin:] = np.frombuffer(data, np.uint8)
    padded[begin : begin + 4] ^= 0xFF  # a CRC begins with ones
    low, high = _halves()
    state = np.zeros(_PIECES, np.uint32)
    for words in np.ascontiguousarray(padded.view("<u4").reshape(_PIECES, length).T):
        state ^= words
        state = low[state & 0xFFFF] ^ high[state >> np.uint32(16)]
    following = _zeros(4 * length)
    while len(state) > 1:
        state = _times(following, state[0::2]) ^ state[1::2]
        following = _times(following, following)
    return int(state[0] ^ _ONES)


def masked(crc: int) -> int:
    """As TensorFlow stores it, so that nobody computes the CRC of bytes that hold CRCs."""
    return (((crc >> 15) | (crc << 17)) + 0xA282EAD8) & 0xFFFFFFFF


def _byte_by_byte(data: bytes | memoryview) -> int:
    table, state = _byte(), 0xFFFFFFFF
    for byte in data:
        state = table[(state ^ byte) & 0xFF] ^ (state >> 8)
    return state ^ 0xFFFFFFFF


@cache
def _byte() -> list[int]:
    """What the lower 8 bits of a register become when a byte follows  (256,)."""
    table = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        table = (table >> np.uint32(1)) ^ np.where(table & 1, np.uint32(POLYNOMIAL), np.uint32(0))
    return [int(entry) for entry in table]


@cache
def _halves() -> tuple[Words, Words]:
    """What the lower and the upper half of a register become when four bytes follow  (65536,) each."""
    low = np.arange(1 << 16, dtype=np.uint32)
    high = low << np.uint32(16)
    for _ in range(4):
        low, high = _followed(low), _followed(high)
    return low, high


def _followed(state: Words) -> Words:
    """Registers when a byte of zeros follows."""
    return np.asarray(np.array(_byte(), np.uint32)[state & 0xFF] ^ (state >> np.uint32(8)))


def _zeros(count: int) -> Words:
    """The matrix for so many bytes of zeros that follow: what becomes of each bit  (32,)."""
    found = np.uint32(1) << np.arange(32, dtype=np.uint32)
    power = _followed(found)
    while count:
        found = _times(power, found) if count & 1 else found
        power = _times(power, power)
        count >>= 1
    return found


def _times(matrix: Words, state: Words) -> Words:
    """The matrix times every register."""
    found = np.zeros_like(state)
    for bit in range(32):
        found ^= np.where((state >> np.uint32(bit)) & np.uint32(1), matrix[bit], np.uint32(0))
    return found
