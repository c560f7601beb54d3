"""The members of a tar or tar.gz stream, from their 512-byte headers; formats ustar, GNU and pax.

Format: POSIX.1-2017, pax, "ustar Interchange Format" and "pax Header Block"; GNU tar manual, "Basic Tar Format".
"""

from __future__ import annotations

import gzip
import re
import zlib
from collections.abc import Iterator
from typing import BinaryIO, Final, NoReturn

from racecraft.importing.archive_guard import CHUNK, Guard, Member, shown

BLOCK: Final = 512
MAX_HEADER: Final = 1 << 16  # bytes of a pax header or a long name
_REGULAR: Final = (b"0", b"\0", b"7")
_KINDS: Final = {
    b"1": "a link",
    b"2": "a link",
    b"3": "a device",
    b"4": "a device",
    b"6": "a pipe",
    b"S": "a sparse file",
    b"K": "a link",
}
_PAX: Final = re.compile(rb"(\d{1,7}) ([^=]+)=")


def read_tar(file: BinaryIO, guard: Guard, *, is_gzip: bool) -> Iterator[Member]:
    """The regular files of a tar stream, in order."""
    stream = _Stream(file, guard, is_gzip=is_gzip)
    long_name: str | None = None
    pax: dict[str, str] = {}
    while (header := stream.header()) is not None:
        if not any(header):
            stream.finish()
            return
        if not _is_sound(header):
            stream.refuse_header(header)
        stream.is_begun = True
        kind, size = header[156:157], _number(header[124:136], guard)
        if kind in (b"L", b"x", b"g"):
            if size > MAX_HEADER:
                guard.refuse(f"has a header of {size:,} bytes, more than {MAX_HEADER:,}")
            guard.enter(".", 0, is_folder=True)  # counted: headers without end are a bomb as well
            data = stream.take(size)
            stream.take(-size % BLOCK)
            if kind == b"L":
                long_name = _text(data.split(b"\0", 1)[0], guard)
            else:
                read = _pax(data, guard)
                if kind == b"x":
                    pax = read
                elif read.keys() & {"path", "size", "linkpath"}:
                    guard.refuse("names all its members in one header")
            continue
        if kind in _KINDS or (kind not in _REGULAR and kind != b"5"):
            guard.refuse(f"holds {_KINDS.get(kind, f'a member of kind {kind!r}')}, {shown(_name(header, guard))}")
        name = pax.get("path") or long_name or _name(header, guard)
        if "size" in pax:
            size = _decimal(pax["size"], guard)
        is_folder = kind == b"5" or (kind != b"7" and name.endswith("/"))
        clean = guard.enter(name, size, is_folder=is_folder)
        long_name, pax = None, {}
        member = _TarMember(clean, size, stream)
        if not is_folder:
            yield member
        while member.read(CHUNK):
            pass
        stream.take(-size % BLOCK)
    guard.refuse("is cut off: its end is missing" if stream.is_begun else "is empty")


class _TarMember:
    """A file of the stream; reads no further than its own end."""

    def __init__(self, name: str, size: int, stream: _Stream) -> None:
        self.name = name
        self.size = size
        self._left = size
        self._stream = stream

    def read(self, count: int) -> bytes:
        """The next bytes, at most ``count``; none at the end."""
        data = self._stream.take(min(count, self._left, CHUNK))
        self._left -= len(data)
        return data


class _Stream:
    """The unpacked bytes, counted."""

    def __init__(self, file: BinaryIO, guard: Guard, *, is_gzip: bool) -> None:
        self._file = file
        self._guard = guard
        self._unpacked = gzip.GzipFile(fileobj=file, mode="rb") if is_gzip else None
        self.is_begun = False

    def header(self) -> bytes | None:
        """The next block, or None at the end of the file."""
        block = self._read(BLOCK)
        if block and len(block) < BLOCK:
            self._guard.refuse("is cut off") if self.is_begun else self.refuse_header(block)
        return block or None

    def refuse_header(self, header: bytes) -> NoReturn:
        """Say why a block is no header."""
        if self.is_begun:
            self._guard.refuse("is damaged: the checksum of a header is wrong")
        if header.startswith(b"\x1f\x8b"):
            self._guard.refuse("is compressed twice")
        self._guard.refuse("is no archive: neither tar, tar.gz nor zip")

    def take(self, count: int) -> bytes:
        """Exactly so many bytes."""
        data = self._read(count)
        if len(data) < count:
            self._guard.refuse("is cut off")
        return data

    def finish(self) -> None:
        """Nothing but zeros may follow; a gzip stream checks its sum and length when its end is read."""
        while data := self._read(CHUNK):
            if any(data):
                self._guard.refuse("has something behind its end")

    def _read(self, count: int) -> bytes:
        if count == 0:
            return b""
        if self._unpacked is None:
            data = self._file.read(count)
        else:
            try:
                data = self._unpacked.read(count)
            except EOFError:
                self._guard.refuse("is cut off")
            except (gzip.BadGzipFile, zlib.error) as error:
                self._guard.refuse(f"is damaged: {str(error)[:100]}")
        self._guard.count(len(data), packed_so_far=self._file.tell())
        return data


def _is_sound(header: bytes) -> bool:
    """Whether the checksum, the sum of the header's bytes with its own field as blanks, is right."""
    try:
        stored = int(header[148:156].strip(b" \0") or b"0", 8)
    except ValueError:
        return False
    blanked = header[:148] + b" " * 8 + header[156:]
    signed = sum(byte - 256 if byte > 127 else byte for byte in blanked)  # as some old tars had it
    return stored in (sum(blanked), signed)


def _number(data: bytes, guard: Guard) -> int:
    """Octal digits, or the big-endian number that GNU writes for large ones."""
    if data[0] & 0x80:
        value = int.from_bytes(data, "big", signed=True) + (1 << 95)
        if not 0 <= value < 1 << 63:
            guard.refuse("is damaged: a size is not a number")
        return value
    text = data.strip(b" \0")
    if not re.fullmatch(rb"[0-7]*", text):
        guard.refuse("is damaged: a size is not a number")
    return int(text or b"0", 8)


def _decimal(text: str, guard: Guard) -> int:
    if not re.fullmatch(r"[0-9]{1,18}", text):
        guard.refuse("is damaged: a size is not a number")
    return int(text)


def _name(header: bytes, guard: Guard) -> str:
    name, prefix = header[:100].split(b"\0", 1)[0], b""
    if header[257:263] == b"ustar\0":  # GNU, "ustar ", keeps other things in the place of the prefix
        prefix = header[345:500].split(b"\0", 1)[0]
    return _text(prefix + b"/" + name if prefix else name, guard)


def _text(data: bytes, guard: Guard) -> str:
    try:
        return data.decode()
    except UnicodeDecodeError:
        guard.refuse(f"has a name that is not UTF-8, {data[:60]!a}")


def _pax(data: bytes, guard: Guard) -> dict[str, str]:
    """The records ``length key=value`` of a pax header, each ended by a line break."""
    found = {}
    while data:
        record = _PAX.match(data)
        length = int(record[1]) if record else 0
        if record is None or not record.end() < length <= len(data) or data[length - 1 : length] != b"\n":
            guard.refuse("is damaged: a pax header is not a list of records")
        key = record[2].decode("utf-8", "replace")
        if key.startswith("GNU.sparse"):
            guard.refuse("holds a sparse file")
        if key in ("path", "size", "linkpath"):
            found[key] = _text(data[record.end() : length - 1], guard)
        data = data[length:]
    return found
