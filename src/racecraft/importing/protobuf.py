"""Protocol Buffers' wire format without a schema: the fields of a message, one after the other, read and written.

https://protobuf.dev/programming-guides/encoding/. Reading copies nothing and does not recurse: a field that holds bytes
is a view of the file, and whoever knows it to be a message asks for its fields in turn. Groups, which nothing of
TensorFlow writes, are refused. Writing joins bytes: a message is the fields of it, one behind the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple, NoReturn

from racecraft.errors import SourceError

MAX_FIELDS: Final = 200_000
"""Fields of one file, counted over all its messages; a graph of AWS's has some 2,000."""
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5  # wire types
_MAX_VARINT: Final = 10  # bytes
_EMPTY: Final = memoryview(b"")


class Field(NamedTuple):
    """One field of a message."""

    number: int
    """What the schema calls it."""
    value: int
    """A number as it is written, unsigned; 0 where the field holds bytes."""
    data: memoryview
    """Bytes: a text, packed numbers, a message; of a fixed number its 4 or 8 bytes; empty otherwise."""


class Wire:
    """A file of messages, and how many of their fields may still be read.

    Args:
        name: What messages to the user call the file.
        max_fields: More are refused.
    """

    def __init__(self, name: str, *, max_fields: int = MAX_FIELDS) -> None:
        self.name = name
        self._left = max_fields

    def fields(self, message: memoryview) -> Iterator[Field]:
        """The fields of a message in their order.

        Raises:
            SourceError: It ends too early, or is not a message.
        """
        place, end = 0, len(message)
        while place < end:
            self._left -= 1
            if self._left < 0:
                self.refuse("has more fields than a model has")
            key, place = self.varint(message, place)
            number, wire_type = key >> 3, key & 7
            if number == 0:
                self.refuse("is damaged: a field has the number 0")
            if wire_type == _VARINT:
                value, place = self.varint(message, place)
                yield Field(number, value, _EMPTY)
                continue
            if wire_type == _BYTES:
                size, place = self.varint(message, place)
            elif wire_type in (_FIXED32, _FIXED64):
                size = 4 if wire_type == _FIXED32 else 8
            else:
                self.refuse(f"is damaged: a field has the wire type {wire_type}")
            if size > end - place:
                self.refuse(f"ends in the middle of a field: {size:,} bytes are announced, {end - place:,} are there")
            yield Field(number, 0, message[place : place + size])
            place += size

    def text(self, data: memoryview, *, max_bytes: int = 1000) -> str:
        """A field as text.

        Raises:
            SourceError: Too long, or not UTF-8.
        """
        if len(data) > max_bytes:
            self.refuse(f"is damaged: a name has {len(data):,} bytes")
        try:
            return bytes(data).decode()
        except UnicodeDecodeError:
            self.refuse("is damaged: a name is not UTF-8")

    def refuse(self, what: str) -> NoReturn:
        """Raise; ``what`` continues the file's name to a sentence."""
        raise SourceError(f"{self.name} {what}.")

    def varint(self, data: memoryview, place: int) -> tuple[int, int]:
        """A number, 64 bits at most, and where what follows begins."""
        value = 0
        for i, byte in enumerate(data[place : place + _MAX_VARINT]):
            value |= (byte & 127) << (7 * i)
            if byte < 128:
                return value & 0xFFFFFFFFFFFFFFFF, place + i + 1
        self.refuse("is damaged: a number does not end")


def signed(value: int) -> int:
    """An ``int64`` field's number."""
    return value - (1 << 64) if value >> 63 else value


def varint(value: int) -> bytes:
    """A number as it is written; a negative one as an ``int64`` is."""
    value &= 0xFFFFFFFFFFFFFFFF
    written = bytearray()
    while value > 127:
        written.append(value & 127 | 128)
        value >>= 7
    return bytes([*written, value])


def number_field(number: int, value: int) -> bytes:
    """A field that holds a number."""
    return varint(number << 3 | _VARINT) + varint(value)


def bytes_field(number: int, data: bytes | str) -> bytes:
    """A field that holds bytes: a text, packed numbers, a message."""
    data = data.encode() if isinstance(data, str) else data
    return b"".join([varint(number << 3 | _BYTES), varint(len(data)), data])
