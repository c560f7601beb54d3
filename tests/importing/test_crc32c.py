"""The checksum of TensorFlow's files."""

from __future__ import annotations

import numpy as np
import pytest
from tensorflow_bundles import mask, slow_crc32c

from racecraft.importing.crc32c import crc32c, masked

RFC_3720 = {
    "zeros": (bytes(32), 0x8A9136AA),
    "ones": (b"\xff" * 32, 0x62A8AB43),
    "up": (bytes(range(32)), 0x46DD794E),
    "down": (bytes(range(31, -1, -1)), 0x113FDB5C),
    "digits": (b"123456789", 0xE3069283),
}


@pytest.mark.parametrize(("data", "checksum"), RFC_3720.values(), ids=RFC_3720)
def test_known_checksums(data: bytes, checksum: int) -> None:
    assert crc32c(data) == slow_crc32c(data) == checksum
    assert masked(checksum) == mask(checksum)


@pytest.mark.parametrize("size", [0, 1, 3, 4, 1023, 65_535, 65_536, 65_537, 65_539, 69_632, 100_001])
def test_it_is_the_definitions_for_every_way_it_is_cut(size: int) -> None:
    data = np.random.default_rng(size).bytes(size)
    assert crc32c(data) == slow_crc32c(data)
    assert crc32c(memoryview(data)) == crc32c(data)
