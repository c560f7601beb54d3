"""The members of a zip archive, from its central directory; stored and deflated ones, nothing exotic.

Format: PKWARE, APPNOTE.TXT 6.3.9. Every size and sum is checked, and members may not share bytes, which bombs do.
"""

from __future__ import annotations

import stat
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO, Final

from racecraft.importing.archive_guard import CHUNK, Guard, Member, shown

END: Final = struct.Struct("<4s4H2LH")
ENTRY: Final = struct.Struct("<4s6H3L5H2L")
LOCAL: Final = struct.Struct("<4s5H3L2H")
MAX_COMMENT: Final = 1 << 16
MAX_DIRECTORY: Final = 1 << 24  # bytes
STORED, DEFLATED = 0, 8
_ENCRYPTED: Final = 1 << 0 | 1 << 6 | 1 << 13
_UTF8: Final = 1 << 11
_WINDOWS: Final = (0, 10)  # FAT, NTFS


@dataclass(frozen=True)
class _Entry:
    """A line of the central directory."""

    name: bytes
    flags: int
    method: int
    crc: int
    packed: int
    size: int
    host: int
    mode: int
    offset: int


def read_zip(file: BinaryIO, guard: Guard) -> Iterator[Member]:
    """The regular files of a zip archive, in the order of their bytes."""
    entries, directory = _directory(file, guard)
    packed = 0
    ends = [*(entry.offset for entry in entries), directory][1:]
    for entry, end in zip(entries, ends, strict=True):
        name = _name(entry, guard)
        is_folder = name.endswith("/")
        _refuse_kinds(entry, name, guard)
        clean = guard.enter(name, entry.size, is_folder=is_folder)
        begin = _data_offset(file, entry, guard)
        if begin + entry.packed > end:
            guard.refuse(f"has members that share bytes, {shown(clean)} among them")
        if is_folder and entry.size:
            guard.refuse(f"has a folder with a content, {shown(clean)}")
        guard.check_ratio(entry.size, entry.packed)
        file.seek(begin)
        member = _ZipMember(clean, entry, file, guard, packed_before=packed)
        packed += LOCAL.size + entry.packed
        if not is_folder:
            yield member
        while member.read(CHUNK):
            pass


class _ZipMember:
    """A file of the archive; checks its length and sum at its end."""

    def __init__(self, name: str, entry: _Entry, file: BinaryIO, guard: Guard, *, packed_before: int) -> None:
        self.name = name
        self.size = entry.size
        self._entry = entry
        self._file = file
        self._guard = guard
        self._packed_before = packed_before
        self._packed_left = entry.packed
        self._done = 0
        self._crc = 0
        self._inflate = zlib.decompressobj(-zlib.MAX_WBITS) if entry.method == DEFLATED else None

    def read(self, count: int) -> bytes:
        """The next bytes, at most ``count``; none at the end."""
        if count <= 0:
            return b""
        data = self._packed(count) if self._inflate is None else self._deflated(min(count, CHUNK))
        self._done += len(data)
        self._crc = zlib.crc32(data, self._crc)
        self._guard.count(len(data), packed_so_far=self._packed_before + self._entry.packed - self._packed_left)
        if self._done > self.size or (not data and not self._is_whole()):
            self._guard.refuse(f"is damaged: {shown(self.name)} has another length than it says")
        if self._done == self.size and self._crc != self._entry.crc:
            self._guard.refuse(f"is damaged: the checksum of {shown(self.name)} is wrong")
        return data

    def _packed(self, count: int) -> bytes:
        data = self._file.read(min(count, self._packed_left, CHUNK))
        self._packed_left -= len(data)
        return data

    def _is_whole(self) -> bool:
        """Whether all that was packed came out, and nothing is left."""
        is_ended = self._inflate is None or (self._inflate.eof and not self._inflate.unused_data)
        return is_ended and self._packed_left == 0 and self._done == self.size

    def _deflated(self, count: int) -> bytes:
        assert self._inflate is not None
        data = b""
        try:
            while not data and not self._inflate.eof:
                packed = self._inflate.unconsumed_tail or self._packed(CHUNK)
                data = self._inflate.decompress(packed, count)
                if not packed and not data:
                    break
        except zlib.error as error:
            self._guard.refuse(f"is damaged: {shown(self.name)} cannot be unpacked ({error})")
        return data


def _directory(file: BinaryIO, guard: Guard) -> tuple[list[_Entry], int]:
    """The entries in the order of their bytes, and where the directory begins."""
    end, size = _end(file, guard)
    _, disk, first_disk, here, count, length, offset, _ = END.unpack(end)
    if 0xFFFF in (disk, count) or 0xFFFFFFFF in (length, offset):
        guard.refuse("is a zip64 archive, for more than a model needs")
    if disk or first_disk or here != count:
        guard.refuse("is one part of several")
    if count > guard.limits.members:
        guard.refuse(f"has more than {guard.limits.members:,} members")
    if length > MAX_DIRECTORY or offset + length != size:
        guard.refuse("is damaged or cut off: its list of members is not where it should be")
    file.seek(offset)
    data = file.read(length)
    entries = []
    position = 0
    for _ in range(count):
        if len(data) < position + ENTRY.size:
            guard.refuse("is damaged: its list of members is cut off")
        fields = ENTRY.unpack_from(data, position)
        magic, made_by, _, flags, method, _, _, crc, packed, unpacked, name, extra, comment, _, _, attributes, at = (
            fields
        )
        if magic != b"PK\x01\x02":
            guard.refuse("is damaged: its list of members has something else in it")
        if 0xFFFFFFFF in (packed, unpacked, at):
            guard.refuse("is a zip64 archive, for more than a model needs")
        begin = position + ENTRY.size
        position = begin + name + extra + comment
        host = made_by >> 8
        mode = attributes >> 16 if host in (3, 19) else 0  # Unix, macOS
        entries.append(_Entry(data[begin : begin + name], flags, method, crc, packed, unpacked, host, mode, at))
    if position != length:
        guard.refuse("is damaged: its list of members has another length than it says")
    return sorted(entries, key=lambda entry: entry.offset), offset


def _end(file: BinaryIO, guard: Guard) -> tuple[bytes, int]:
    """The record that ends the archive, and where it begins; of several the one that really ends the file."""
    size = file.seek(0, 2)
    begin = max(0, size - MAX_COMMENT - END.size)
    file.seek(begin)
    tail = file.read(size - begin)
    place = tail.rfind(b"PK\x05\x06")
    while place >= 0:
        record = tail[place : place + END.size]
        if len(record) == END.size and place + END.size + END.unpack(record)[-1] == len(tail):
            return record, begin + place
        place = tail.rfind(b"PK\x05\x06", 0, place)
    guard.refuse("is cut off: its list of members is missing")


def _refuse_kinds(entry: _Entry, name: str, guard: Guard) -> None:
    if entry.flags & _ENCRYPTED:
        guard.refuse(f"is encrypted, {shown(name)} at least")
    if entry.method not in (STORED, DEFLATED):
        guard.refuse(f"packs {shown(name)} with method {entry.method}; stored and deflated members are read")
    kind = stat.S_IFMT(entry.mode)
    if kind == stat.S_IFLNK:
        guard.refuse(f"holds a link, {shown(name)}")
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        guard.refuse(f"holds a device or a pipe, {shown(name)}")


def _data_offset(file: BinaryIO, entry: _Entry, guard: Guard) -> int:
    """Where a member's bytes begin: behind its own header, which has to say the same as the directory."""
    file.seek(entry.offset)
    header = file.read(LOCAL.size)
    if len(header) < LOCAL.size:
        guard.refuse("is cut off")
    magic, _, flags, method, _, _, _, _, _, name, extra = LOCAL.unpack(header)
    if magic != b"PK\x03\x04" or method != entry.method or flags & _ENCRYPTED or file.read(name) != entry.name:
        guard.refuse(f"is damaged: {ascii(entry.name)[1:60]} is listed as something else than it is")
    return entry.offset + LOCAL.size + int(name) + int(extra)


def _name(entry: _Entry, guard: Guard) -> str:
    try:
        name = entry.name.decode() if entry.flags & _UTF8 else entry.name.decode("cp437")
    except UnicodeDecodeError:
        guard.refuse(f"has a name that is not UTF-8, {entry.name[:60]!a}")
    # Compress-Archive of Windows PowerShell parts folders as Windows does, where no name has a backslash in it
    return name.replace("\\", "/") if entry.host in _WINDOWS else name
