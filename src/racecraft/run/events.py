"""TensorBoard event files, scalars only, written without TensorBoard.

A file is a sequence of records: length (uint64), its checksum, a protobuf ``Event``, its checksum, all
little-endian. TensorBoard's own writer takes 0.3 s to import, and this is all it would encode:

    Event    1: wall_time (double)  2: step (varint)  3: file_version (string)  5: summary (Summary)
             7: session_log (SessionLog; one that starts makes a reader drop what it has of this step and later)
    Summary  1: value (Value, repeated)
    Value    1: tag (string)  2: simple_value (float)
"""

from __future__ import annotations

import os
import socket
import struct
import time
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from racecraft.errors import RunError
from racecraft.run.closing import Closing

_SESSION_START = b"\x08\x01"  # SessionLog  1: status (varint) = START
FLUSH_SECONDS = 2.0  # how late TensorBoard may see a number


class EventWriter(Closing):
    """Appends scalars to a new event file in a folder; a context manager.

    Args:
        folder: Made when missing. A resumed run adds a file, and TensorBoard joins them.
        after_step: The step a resumed run goes on from: TensorBoard forgets what older files say of later ones.
    """

    def __init__(self, folder: str | Path, *, after_step: int = -1) -> None:
        now = time.time()
        name = f"events.out.tfevents.{int(now)}.{socket.gethostname()}.{os.getpid()}.{time.monotonic_ns()}"
        self.path = Path(folder) / name
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("wb")
        except OSError as error:
            raise RunError(f"{self.path} cannot be written: {error.strerror or error}.") from error
        self._flushed = now
        self._write(_double(1, now) + _bytes(3, b"brain.Event:2"))
        if after_step >= 0:
            self._write(_double(1, now) + _varint(2 << 3) + _varint(after_step + 1) + _bytes(7, _SESSION_START))
        self.flush()

    def add_scalars(self, scalars: Mapping[str, float], *, step: int) -> None:
        """Write numbers by tag, such as ``train/reward``, at a training step."""
        now = time.time()
        values = b"".join(_bytes(1, _bytes(1, tag.encode()) + _float(2, value)) for tag, value in scalars.items())
        self._write(_double(1, now) + _varint(2 << 3) + _varint(step) + _bytes(5, values))
        if now - self._flushed >= FLUSH_SECONDS:
            self.flush()

    def flush(self) -> None:
        """Hand everything to the system."""
        self._flushed = time.time()
        try:
            self._file.flush()
        except OSError as error:
            raise RunError(f"{self.path} cannot be written: {error.strerror or error}.") from error

    def close(self) -> None:
        """Flush and close; a second call does nothing."""
        if not self._file.closed:
            try:
                self.flush()
            finally:
                self._file.close()

    def _write(self, event: bytes) -> None:
        length = struct.pack("<Q", len(event))
        record = length + _masked_checksum(length) + event + _masked_checksum(event)
        try:
            self._file.write(record)
        except OSError as error:
            raise RunError(f"{self.path} cannot be written: {error.strerror or error}.") from error


def _varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)


def _double(field: int, value: float) -> bytes:
    return _varint(field << 3 | 1) + struct.pack("<d", value)


def _float(field: int, value: float) -> bytes:
    try:
        return _varint(field << 3 | 5) + struct.pack("<f", value)
    except OverflowError:
        return _varint(field << 3 | 5) + struct.pack("<f", float("inf") if value > 0 else float("-inf"))


def _bytes(field: int, value: bytes) -> bytes:
    return _varint(field << 3 | 2) + _varint(len(value)) + value


def _masked_checksum(data: bytes) -> bytes:
    """CRC-32C, rotated and shifted as the record format wants it."""
    table, crc = _crc_table(), 0xFFFFFFFF
    for byte in data:
        crc = table[(crc ^ byte) & 0xFF] ^ crc >> 8
    crc ^= 0xFFFFFFFF
    return struct.pack("<I", ((crc >> 15 | crc << 17) + 0xA282EAD8) & 0xFFFFFFFF)


@cache
def _crc_table() -> tuple[int, ...]:
    """CRC-32C of every byte; polynomial 0x1EDC6F41, reflected."""
    table = []
    for crc in range(256):
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
        table.append(crc)
    return tuple(table)
