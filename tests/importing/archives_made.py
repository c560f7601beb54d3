"""Archives as others write them, and whatever a header may say."""

from __future__ import annotations

import io
import tarfile
import zipfile
from pathlib import Path

from racecraft.importing.archive import DEFAULT_LIMITS, read_archive
from racecraft.importing.archive_guard import Limits

FILES = {
    "reward_function.py": b"def reward_function(params):\n    return 1.0\n",
    "model/a.json": b"{}" * 40_000,
    "e": b"",
}


def make_tar(files: dict[str, bytes], *, format: int = tarfile.PAX_FORMAT) -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=format) as tar:
        for name, data in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(data)
            tar.addfile(info, io.BytesIO(data))
    return buffer.getvalue()


def make_zip(files: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name), data, compress_type=method)
    return buffer.getvalue()


def member(name: str, kind: bytes = tarfile.REGTYPE, size: int = 0, data: bytes = b"", **fields: object) -> bytes:
    """A tar of one member, whose header may say anything."""
    info = tarfile.TarInfo(name)
    info.type, info.size = kind, size
    for field, value in fields.items():
        setattr(info, field, value)
    body = data + bytes(-len(data) % 512)
    return info.tobuf(tarfile.GNU_FORMAT) + body + bytes(1024)


def read(data: bytes, tmp_path: Path, *, name: str = "x.tar.gz", limits: Limits = DEFAULT_LIMITS) -> dict[str, bytes]:
    path = tmp_path / name
    path.write_bytes(data)
    found = {}
    for entry in read_archive(path, limits=limits):
        parts = []
        while part := entry.read(1000):
            parts.append(part)
        found[entry.name] = b"".join(parts)
        assert len(found[entry.name]) == entry.size
    return found


def patched(data: bytes, offset: int, value: bytes) -> bytes:
    """A zip of one member with some bytes of its directory replaced."""
    at = data.index(b"PK\x01\x02") + offset
    return data[:at] + value + data[at + len(value) :]
